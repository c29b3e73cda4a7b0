//! Thrust maps of drones, identified in free flight: what forces below other drones are simulated
//! with.

use std::collections::BTreeMap;

use diagnosis::record::recording::{Recording, Vehicle};
use diagnosis::record::remark::{Remark, RemarkKind};
use diagnosis::record::track::ThrustSource;
use diagnosis::thrust::identify::{Identification, Options, identify};
use diagnosis::thrust::low_pass::LowPass;
use serde::Serialize;

use crate::io::progress::Progress;

/// Forces are compared below this frequency. Chosen here: motors and frames shake above it, wakes
/// are met more slowly.
pub(super) const LOW_PASS: LowPass = LowPass { cutoff_hz: 5.0 };

/// The thrust map of one kind of drone and what it takes.
#[derive(Serialize)]
pub(crate) struct Map {
    pub(crate) airframe: String,
    /// What it takes.
    pub(crate) source: ThrustSource,
    /// Whether only an offset was added to a map that the metadata state.
    pub(crate) offset_only: bool,
    #[serde(flatten)]
    pub(crate) identification: Identification,
}

impl Map {
    /// Whether it gives a vehicle's thrust.
    pub(super) fn is_of(&self, vehicle: &Vehicle) -> bool {
        self.airframe == vehicle.airframe.name()
            && Some(self.source) == vehicle.track.thrust_source()
    }

    pub(crate) fn sentence(&self) -> String {
        let found = &self.identification;
        let kind = match self.offset_only {
            true => "stated thrust map and an offset",
            false => "thrust map fitted",
        };
        let [low, high] = found.map.duty_range();
        let [least_v, most_v] = found.battery_range_v;
        let outside = format!("({} rows outside)", found.rows_outside);
        let (battery, range) = match self.source {
            ThrustSource::DutyCycle => (
                format!(", {:+.1} % thrust a volt", 100.0 * found.battery_per_v),
                format!(
                    "duty cycles {low:.2} to {high:.2} {outside} and {least_v:.2} to {most_v:.2} V"
                ),
            ),
            ThrustSource::RotorSpeed => (
                String::new(),
                format!("tips of rotors at {low:.2} to {high:.2} of the speed of sound {outside}"),
            ),
            ThrustSource::Thrust | ThrustSource::ReadyForce => {
                (String::new(), format!("thrust as logged {outside}"))
            }
        };
        format!(
            "{}: {kind}, {:+.4} N at rest, lag {:.0} ms{battery}; leaves {:.4} N rms of {} rows in {} flights; for {range}",
            self.airframe,
            found.offset_n,
            1000.0 * found.map.lag_s(),
            found.scatter_n,
            found.rows,
            found.flights,
        )
    }
}

/// Identifies a thrust map for every airframe that logs specific force and what tells its thrust,
/// over all recordings, and gives it to its drones. Where that fails the recordings say so, and
/// keep the map that their metadata state, if any.
pub(super) fn identify_all(recordings: &mut [Recording]) -> Vec<Map> {
    let mut members_of: BTreeMap<(String, ThrustSource), Vec<(usize, usize)>> = BTreeMap::new();
    for (recording, of) in recordings.iter().enumerate() {
        for (vehicle, drone) in of.vehicles.iter().enumerate() {
            let source = drone.track.thrust_source();
            if let Some(source) = source.filter(|source| *source != ThrustSource::ReadyForce)
                && drone.track.specific_force_mps2.is_some()
            {
                let members = members_of.entry((drone.airframe.name().to_owned(), source));
                members.or_default().push((recording, vehicle));
            }
        }
    }
    let progress = Progress::start("identifying thrust maps", members_of.len());
    let mut maps = Vec::new();
    for ((airframe, source), members) in members_of {
        progress.done_one();
        let is_of_duty = source == ThrustSource::DutyCycle;
        let stated = members.iter().find_map(|&(recording, vehicle)| {
            let of = &recordings[recording].vehicles[vehicle];
            of.thrust_map.clone().filter(|_| is_of_duty)
        });
        let mut options = Options {
            low_pass: LOW_PASS,
            ..Options::default()
        };
        if let Some(map) = &stated {
            options = options.on(map);
        }
        let identification = match identify(recordings, &members, &options) {
            Ok(identification) => identification,
            Err(error) => {
                let then = match stated {
                    Some(_) => "forces are simulated with the map that the metadata state",
                    None => "no forces are simulated",
                };
                let message = format!("thrust map of {airframe}: {error}; {then}");
                let remark = Remark::new(RemarkKind::Assumed, Some(&airframe), message);
                recordings[members[0].0].remarks.push(remark);
                continue;
            }
        };
        for (recording, vehicle) in members {
            let drone = &mut recordings[recording].vehicles[vehicle];
            drone.thrust_map = Some(identification.map.clone());
        }
        maps.push(Map {
            airframe,
            source,
            offset_only: stated.is_some(),
            identification,
        });
    }
    progress.finish();
    maps
}
