//! A generated scenario before it is text, and the generator that draws it.

use std::fmt::Write as _;

use super::InstanceError;

/// Fleet-wide limit of the air over the rotor discs, over the induced velocity: +16 % power.
pub(super) const AIR_LIMIT: f64 = 0.3;

/// What a scenario says, before it is text.
#[derive(Default)]
pub(super) struct Scene {
    pub(super) about: String,
    pub(super) command: String,
    pub(super) name: String,
    pub(super) size_m: [f64; 3],
    pub(super) boxes: Vec<(String, [f64; 3], [f64; 3])>,
    pub(super) flights: Vec<([f64; 3], [f64; 3])>,
}

impl Scene {
    /// Starts in distinct columns, goals in distinct columns, heights free.
    pub(super) fn scatter(
        &mut self,
        name: &'static str,
        columns: Vec<[f64; 2]>,
        drones: usize,
        seed: u64,
    ) -> Result<(), InstanceError> {
        if drones > columns.len() {
            return Err(InstanceError::TooMany {
                name,
                drones,
                room: columns.len(),
            });
        }
        let mut random = SplitMix64(seed);
        let mut places = || -> Vec<[f64; 3]> {
            let mut columns = columns.clone();
            (0..drones)
                .map(|taken| {
                    let chosen = taken + random.below(columns.len() - taken);
                    columns.swap(taken, chosen);
                    let [x, y] = columns[taken];
                    [x, y, random.below(self.size_m[2] as usize) as f64 + 0.5]
                })
                .collect()
        };
        let (starts, goals) = (places(), places());
        self.flights = starts.into_iter().zip(goals).collect();
        Ok(())
    }

    pub(super) fn to_ron(&self) -> String {
        let Scene {
            about,
            command,
            name,
            size_m: [x, y, z],
            ..
        } = self;
        let mut text = format!(
            "// {about}\n// Made by: {command}\nScenario(\n  name: \"{name}\",\n  bounds_m: (min: (0, 0, 0), max: ({x}, {y}, {z})),\n"
        );
        let mut put = |line: std::fmt::Arguments| {
            // Writing to a String cannot fail.
            let _ = text.write_fmt(line);
        };
        if !self.boxes.is_empty() {
            put(format_args!("  obstacles: [\n"));
            for (name, [x0, y0, z0], [x1, y1, z1]) in &self.boxes {
                put(format_args!(
                    "    (name: \"{name}\", min_m: ({x0}, {y0}, {z0}), max_m: ({x1}, {y1}, {z1})),\n"
                ));
            }
            put(format_args!("  ],\n"));
        }
        put(format_args!("  drones: [\n"));
        for (index, ([x0, y0, z0], [x1, y1, z1])) in self.flights.iter().enumerate() {
            put(format_args!(
                "    (name: \"d{}\", airframe: \"offboard-2\", start_m: ({x0}, {y0}, {z0}), tasks: [(to_m: ({x1}, {y1}, {z1}))]),\n",
                index + 1
            ));
        }
        put(format_args!(
            "  ],\n  planning: (cell_m: 1.0, air_limit: {AIR_LIMIT}),\n)\n"
        ));
        text
    }
}

/// SplitMix64: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014,
/// with the mixing constants of S. Vigna's public-domain implementation.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// One of `0..end`, by multiplication; its bias, below `end` / 2⁶⁴, does not matter here.
    fn below(&mut self, end: usize) -> usize {
        ((u128::from(self.next()) * end as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generator_is_splitmix64() {
        // First outputs for seed 1234567, as listed with the public reference implementation [recalled].
        let mut random = SplitMix64(1_234_567);
        assert_eq!(
            [random.next(), random.next()],
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]
        );
    }
}
