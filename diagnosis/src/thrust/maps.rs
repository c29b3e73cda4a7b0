//! Thrust maps of all drones of some recordings, identified in free flight: what forces below other
//! drones are simulated with.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::record::recording::{Recording, Vehicle};
use crate::record::remark::{Remark, RemarkKind};
use crate::record::track::ThrustSource;
use crate::thrust::identify::{Identification, Options, identify};

/// The thrust map of one kind of drone and what it takes.
#[derive(Clone, Debug, Serialize)]
pub struct IdentifiedMap {
    /// Its kind, by name.
    pub airframe: String,
    /// What it takes.
    pub source: ThrustSource,
    /// Whether only an offset was added to a map that the metadata state.
    pub offset_only: bool,
    /// The map itself.
    #[serde(flatten)]
    pub identification: Identification,
}

impl IdentifiedMap {
    /// Whether it gives a vehicle's thrust.
    #[must_use]
    pub fn is_of(&self, vehicle: &Vehicle) -> bool {
        self.airframe == vehicle.airframe.name()
            && Some(self.source) == vehicle.track.thrust_source()
    }
}

/// Identifies a thrust map for every airframe that logs specific force and a thrust source, over
/// all recordings, and gives it to its drones. Where that fails the recordings say so, and keep the
/// map that their metadata state, if any.
pub fn identify_all(recordings: &mut [Recording]) -> Vec<IdentifiedMap> {
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
    let mut maps = Vec::new();
    for ((airframe, source), members) in members_of {
        let is_of_duty = source == ThrustSource::DutyCycle;
        let stated = members.iter().find_map(|&(recording, vehicle)| {
            let of = &recordings[recording].vehicles[vehicle];
            of.thrust_map.clone().filter(|_| is_of_duty)
        });
        let mut options = Options::default();
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
        maps.push(IdentifiedMap {
            airframe,
            source,
            offset_only: stated.is_some(),
            identification,
        });
    }
    maps
}
