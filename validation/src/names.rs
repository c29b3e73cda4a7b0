//! Names of effects that an answer may give.

use diagnosis::infer::candidates::names_of;

/// Names that would be right as well, because the recording cannot tell: one factor on the jets or
/// on the readings, a steady flow against an offset, air drawn in against a probe that reads it.
const ALSO: &[(&str, &[&str])] = &[
    ("payload_mass", &["momentum_scale"]),
    ("air_density", &["momentum_scale"]),
    ("dl_ratio", &["momentum_scale"]),
    ("momentum_scale", &["dl_ratio", "sensor_gain"]),
    ("recirculation", &["ambient_background"]),
    ("magnitude_sensor", &["entrainment_radial"]),
];

/// The canonical one of several names of an effect; an unknown name is its own.
#[must_use]
pub fn canonical(name: &str) -> &str {
    names_of(name).map_or(name, |names| names[0])
}

/// Every name that is right for an effect.
#[must_use]
pub(super) fn accepted(name: &str) -> Vec<String> {
    let also = ALSO.iter().find(|(of, _)| *of == name);
    let also = also.map_or(&[][..], |(_, also)| also);
    let names = names_of(name).unwrap_or_default();
    let all = names.iter().chain(also);
    all.map(|&name| name.to_owned()).collect()
}
