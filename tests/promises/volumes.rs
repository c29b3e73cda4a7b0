//! Volumes of air hold all the air they stand for, and shapes are what their formulas say.

mod bodies;
mod exposure;
mod moved;
mod spindles;

/// SplitMix64: the same random numbers on every machine.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn point(&mut self, reach: f64) -> nalgebra::Point3<f64> {
        [0; 3].map(|_| self.between(-reach, reach)).into()
    }
}

fn wake_of(preset: &str) -> airflow::Wake {
    let airframe = airflow::Airframe::preset(preset).expect("a preset");
    let density = airflow::Air::default().density_kg_per_m3();
    airflow::Wake::new(
        &airframe,
        airframe.mass_kg(),
        density,
        &airflow::Jet::default(),
    )
}
