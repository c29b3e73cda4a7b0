//! Names of effects: the first is canonical, the others mean the same.

/// Every effect with its names; `true`: of an instrument or a clock.
const NAMES: &[(&[&str], bool)] = &[
    (&["crossflow", "ambient_wind", "jet_in_crossflow"], false),
    (
        &["wake_transport", "emitter_motion", "transport_delay"],
        false,
    ),
    (&["climb_descent"], false),
    (&["ground_impingement", "ground_effect", "wall_jet"], false),
    (&["ground_effect_thrust"], false),
    (&["ceiling_effect"], false),
    (&["recirculation", "background_flow"], false),
    (&["rotor_cant", "width_scale"], false),
    (&["payload_mass"], false),
    (&["air_density"], false),
    (&["dl_ratio"], false),
    (&["momentum_scale"], false),
    (&["near_field", "rotor_lobes"], false),
    (&["profile_tail", "outer_edge"], false),
    (&["jet_merging", "superposition"], false),
    (&["buoyancy"], false),
    (&["swirl"], false),
    (&["wander", "meander", "unsteadiness"], false),
    (&["entrainment_radial"], false),
    (&["battery_sag", "thrust_map_drift"], false),
    (&["receiver_inflow", "thrust_inflow"], false),
    (&["wake_tilt"], false),
    (&["sensor_gain"], true),
    (&["sensor_offset", "ambient_background"], true),
    (&["sensor_drift"], true),
    (&["sensor_lag"], true),
    (&["sensor_saturation"], true),
    (&["clock_misalignment", "time_offset"], true),
    (&["magnitude_sensor"], true),
];

/// Names that would be right as well, because nobody could tell by what was recorded: one factor on the jets or on the readings, a steady
/// draught against an offset, air drawn in against a probe that reads it.
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
    let known = NAMES.iter().find(|(names, _)| names.contains(&name));
    known.map_or(name, |(names, _)| names[0])
}

/// Whether a name is that of an instrument's or a clock's fault.
#[must_use]
pub fn is_sensor(name: &str) -> bool {
    NAMES
        .iter()
        .any(|(names, sensor)| *sensor && names.contains(&name))
}

/// Every name that is right for an effect.
#[must_use]
pub(super) fn accepted(name: &str) -> Vec<String> {
    let same = NAMES.iter().find(|(names, _)| names.contains(&name));
    let same = same.map_or(&[][..], |(names, _)| names);
    let also = ALSO
        .iter()
        .find(|(of, _)| *of == name)
        .map_or(&[][..], |(_, also)| also);
    same.iter()
        .chain(also)
        .map(|&name| name.to_owned())
        .collect()
}
