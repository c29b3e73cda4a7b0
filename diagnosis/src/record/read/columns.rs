//! Which column of a table holds what, and in which unit: `x_m`, `ax_g`, `t_us`. The unit ends the
//! name; a column without one is not guessed at.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use super::found::{Found, did_you_mean, listed};
use super::table::{Rows, Table};
use crate::record::problem::Problem;
use crate::record::remark::RemarkKind;

/// What a column may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    Time,
    Position(usize),
    Velocity(usize),
    Acceleration(usize),
    /// x, y, z, w.
    Quaternion(usize),
    /// Roll, pitch, yaw.
    Angle(usize),
    Duty(usize),
    /// rad/s.
    RotorSpeed(usize),
    Battery,
    Throttle,
    Power,
    /// Of all rotors together, along the body's axis (N).
    Thrust,
    /// Beyond thrust and weight, ready made, in the frame of the positions (N).
    Force(usize),
}

impl Role {
    /// Whether nothing is where anything was without it.
    pub(super) fn is_required(self) -> bool {
        matches!(self, Role::Time | Role::Position(_))
    }
}

/// From a column's numbers to ours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unit {
    /// Times so much is SI.
    Times(f64),
    /// In gravities of the recording (m/s²).
    Gravities,
}

/// Ends of names, and what each is in SI; ours first.
type Units = &'static [(&'static str, f64)];

const TIME: Units = &[("_s", 1.0), ("_ms", 1e-3), ("_us", 1e-6), ("_ns", 1e-9)];
const LENGTH: Units = &[("_m", 1.0), ("_cm", 1e-2), ("_mm", 1e-3)];
const SPEED: Units = &[("_mps", 1.0), ("_cmps", 1e-2), ("_mmps", 1e-3)];
const ACCELERATION: Units = &[("_mps2", 1.0), ("_mmps2", 1e-3), (GRAVITIES, 1.0)];
const ANGLE: Units = &[("_rad", 1.0), ("_deg", std::f64::consts::PI / 180.0)];
const NONE: Units = &[("", 1.0)];
/// A share of full: 0 to 1 without a unit; `_u16` is over 65 535.
const SHARE: Units = &[
    ("", 1.0),
    ("_ratio", 1.0),
    ("_percent", 1e-2),
    ("_u16", 1.0 / 65_535.0),
];
const VOLTAGE: Units = &[("_v", 1.0), ("_mv", 1e-3)];
const RATIO: Units = &[("_ratio", 1.0), ("_percent", 1e-2)];
const POWER: Units = &[("_w", 1.0), ("_mw", 1e-3)];
/// Turns a minute without a unit, as the name says it.
const TURNS: Units = &[("", std::f64::consts::TAU / 60.0), ("_radps", 1.0)];
/// A gram's weight is in standard gravity.
const FORCE: Units = &[("_n", 1.0), ("_mn", 1e-3), ("_gf", 9.806_65e-3)];
/// Ends a name in gravities of the recording.
const GRAVITIES: &str = "_g";

/// The role of a column by its place in a group.
pub(super) type RoleOf = fn(usize) -> Role;

/// Every name without its unit, group by group, what it means and its units.
const NAMES: [(&[&str], RoleOf, Units); 14] = [
    (&["t"], |_| Role::Time, TIME),
    (&["x", "y", "z"], Role::Position, LENGTH),
    (&["vx", "vy", "vz"], Role::Velocity, SPEED),
    (&["ax", "ay", "az"], Role::Acceleration, ACCELERATION),
    (&["qx", "qy", "qz", "qw"], Role::Quaternion, NONE),
    (&["roll", "pitch", "yaw"], Role::Angle, ANGLE),
    (&["pwm1", "pwm2", "pwm3", "pwm4"], Role::Duty, SHARE),
    (&["rpm1", "rpm2", "rpm3", "rpm4"], Role::RotorSpeed, TURNS),
    (&["vbat"], |_| Role::Battery, VOLTAGE),
    (&["battery"], |_| Role::Battery, VOLTAGE),
    (&["throttle"], |_| Role::Throttle, RATIO),
    (&["power"], |_| Role::Power, POWER),
    (&["thrust"], |_| Role::Thrust, FORCE),
    (&["fx", "fy", "fz"], Role::Force, FORCE),
];

/// Every name without its unit, what it means and its units.
fn names() -> impl Iterator<Item = (&'static str, Role, Units)> {
    let group = |(stems, role, units): (&'static [&'static str], RoleOf, Units)| {
        let stems = stems.iter().enumerate();
        stems.map(move |(axis, stem)| (*stem, role(axis), units))
    };
    NAMES.into_iter().flat_map(group)
}

/// Groups of columns of which some without the others mean nothing, with their sizes. Neither
/// positions, which are required one by one, nor angles, of which a missing one is taken as 0.
pub(super) fn groups() -> impl Iterator<Item = (RoleOf, usize)> {
    let groups = NAMES
        .into_iter()
        .map(|(stems, role, _)| (role, stems.len()));
    let is_apart = |role: Role| matches!(role, Role::Position(_) | Role::Angle(_));
    groups.filter(move |(role, count)| *count > 1 && !is_apart(role(0)))
}

/// Names of the column that says whose row it is.
const VEHICLE: [&str; 2] = ["vehicle", "vehicle_id"];

/// Which column of a table holds what.
#[derive(Debug, Default)]
pub(super) struct Columns {
    /// Column, unit and name by role.
    pub(super) by_role: BTreeMap<Role, Column>,
    /// The column that says whose row it is.
    pub(super) vehicle: Option<usize>,
    /// Names of the columns that nothing reads.
    pub(super) unused: Vec<String>,
}

/// A column that is read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub(super) at: usize,
    pub(super) unit: Unit,
    pub(super) name: String,
}

/// The role and unit that a name such as `x_mm` speaks of.
pub(super) fn meaning(name: &str) -> Option<(Role, Unit)> {
    names().find_map(|(stem, role, units)| {
        let suffix = name.strip_prefix(stem)?;
        let (_, factor) = units.iter().find(|(known, _)| *known == suffix)?;
        let unit = match suffix {
            GRAVITIES => Unit::Gravities,
            _ => Unit::Times(*factor),
        };
        Some((role, unit))
    })
}

/// Names with their first units, for messages: `t_s`, `x_m`, ...
pub(super) fn known_names() -> Vec<String> {
    let ours = |(stem, _, units): (&str, Role, Units)| format!("{stem}{}", units[0].0);
    let vehicle = std::iter::once(VEHICLE[0].to_owned());
    vehicle.chain(names().map(ours)).collect()
}

/// Finds the columns of `header`; `renamed` gives the table's own name for one of ours (`"x_mm":
/// "pos.x"`).
fn find(file: &str, header: &[String], renamed: &[(String, String)], found: &mut Found) -> Columns {
    let mut columns = Columns::default();
    for (at, name) in header.iter().enumerate() {
        let ours = renamed.iter().find(|(_, theirs)| theirs == name);
        let ours = ours.map_or(name.as_str(), |(ours, _)| ours.as_str());
        if VEHICLE.contains(&ours) {
            match columns.vehicle {
                None => columns.vehicle = Some(at),
                Some(first) => twice(file, &header[first], name, found),
            }
            continue;
        }
        let Some((role, unit)) = meaning(ours) else {
            columns.unused.push(name.clone());
            continue;
        };
        let name = name.clone();
        match columns.by_role.entry(role) {
            Entry::Occupied(first) => twice(file, &first.get().name, &name, found),
            Entry::Vacant(place) => drop(place.insert(Column { at, unit, name })),
        }
    }
    for (ours, theirs) in renamed {
        if !header.contains(theirs) {
            found.helped(
                Problem::field(file, theirs).line(1),
                format!("is not in the header, though `columns` takes `{ours}` from it"),
                did_you_mean(theirs, header.iter().map(String::as_str)),
            );
        }
    }
    for (stem, role, units) in names().filter(|(_, role, _)| role.is_required()) {
        if !columns.by_role.contains_key(&role) {
            missing(file, (stem, units), header, found);
        }
    }
    columns
}

/// A long table of vehicles with all the columns that are known; `check` may find more wrong with
/// them.
pub(super) fn read(
    file: &str,
    table: Table<'_>,
    renamed: &[(String, String)],
    found: &mut Found,
    check: impl FnOnce(&Columns, &mut Found),
) -> Option<(Rows, Columns)> {
    let before = found.problems.len();
    let columns = find(file, table.header(), renamed, found);
    check(&columns, found);
    for (role, count) in groups() {
        let is_missing = |role: &Role| !columns.by_role.contains_key(role);
        let (missing, given): (Vec<_>, Vec<_>) = (0..count).map(role).partition(is_missing);
        if !given.is_empty() && !missing.is_empty() {
            let given = given.iter().map(|role| columns.by_role[role].name.as_str());
            let missing = listed(missing.into_iter().map(stem_of));
            let message = format!("has the columns {} but none for {missing}", listed(given));
            found.problem(Problem::file(file).line(1), message);
        }
    }
    if found.problems.len() > before {
        return None;
    }
    if !columns.unused.is_empty() {
        let names = listed(columns.unused.iter().map(String::as_str));
        let message = format!("columns of {file} that are not used: {names}");
        found.remark(RemarkKind::Unused, None, message);
    }
    let wanted: Vec<usize> = columns.by_role.values().map(|column| column.at).collect();
    Some((table.read(&wanted, columns.vehicle, found), columns))
}

fn twice(file: &str, first: &str, second: &str, found: &mut Found) {
    let message = format!("says the same as column `{first}`");
    found.problem(Problem::field(file, second).line(1), message);
}

/// The name of a role without its unit.
fn stem_of(role: Role) -> &'static str {
    let entry = names().find(|(_, known, _)| *known == role);
    entry.map_or("?", |(stem, _, _)| stem)
}

/// A required column is missing, or there without a unit, or with one that is not known.
fn missing(file: &str, (stem, units): (&str, Units), header: &[String], found: &mut Found) {
    let names = units.iter().map(|(unit, _)| format!("{stem}{unit}"));
    let names: Vec<String> = names.collect();
    let has_unit = |name: &&String| {
        let rest = name.strip_prefix(stem);
        rest.is_some_and(|rest| rest.len() > 1 && rest.starts_with('_'))
    };
    let bare = header.iter().find(|name| *name == stem);
    let (name, message) = match (bare, header.iter().find(has_unit)) {
        (Some(name), _) => (name, "has no unit in its name".to_owned()),
        (None, Some(name)) => (name, format!("has a unit that is not known for `{stem}`")),
        (None, None) => (&names[0], "is missing".to_owned()),
    };
    let theirs = header.iter().find(|theirs| *theirs == name);
    let theirs = theirs.map_or("your column", String::as_str);
    let help = format!(
        "name it one of {}, or write `columns: {{ \"{}\": \"{theirs}\" }}` in the metadata, with the unit that it has",
        listed(names.iter().map(String::as_str)),
        names[0]
    );
    found.helped(Problem::field(file, name).line(1), message, Some(help));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problems(header: &[&str], renamed: &[(&str, &str)]) -> Vec<String> {
        let header: Vec<String> = header.iter().map(|name| (*name).to_owned()).collect();
        let renamed: Vec<_> = renamed
            .iter()
            .map(|(ours, theirs)| ((*ours).to_owned(), (*theirs).to_owned()))
            .collect();
        let mut found = Found::default();
        find("f.csv", &header, &renamed, &mut found);
        found.problems.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn units_end_the_names() {
        assert_eq!(
            meaning("x_mm"),
            Some((Role::Position(0), Unit::Times(1e-3)))
        );
        assert_eq!(
            meaning("az_g"),
            Some((Role::Acceleration(2), Unit::Gravities))
        );
        assert_eq!(meaning("pwm3"), Some((Role::Duty(2), Unit::Times(1.0))));
        for unknown in ["x", "x_ft", "xd_m", "motor_cmd1", "t"] {
            assert_eq!(meaning(unknown), None, "{unknown}");
        }
    }

    #[test]
    fn every_name_of_ours_means_something() {
        for name in known_names().iter().skip(1) {
            assert!(meaning(name).is_some(), "{name}");
        }
    }

    #[test]
    fn a_required_column_that_is_missing_unitless_or_in_feet_is_an_error_that_names_it() {
        assert_eq!(
            problems(&["t", "x_ft", "y_m"], &[]),
            [
                "f.csv:1: `t`: has no unit in its name",
                "f.csv:1: `x_ft`: has a unit that is not known for `x`",
                "f.csv:1: `z_m`: is missing",
            ]
        );
    }

    #[test]
    fn columns_of_other_names_are_taken_from_where_the_metadata_say() {
        let renamed = [("t_us", "timestamp"), ("x_m", "px")];
        assert!(problems(&["timestamp", "px", "y_m", "z_m"], &renamed).is_empty());
        assert_eq!(
            problems(&["t_s", "pz", "x_m", "y_m", "z_m"], &[("vx_mps", "px")]),
            ["f.csv:1: `px`: is not in the header, though `columns` takes `vx_mps` from it"]
        );
    }

    #[test]
    fn two_columns_for_one_thing_are_an_error() {
        assert_eq!(
            problems(&["t_s", "x_m", "x_mm", "y_m", "z_m"], &[]),
            ["f.csv:1: `x_mm`: says the same as column `x_m`"]
        );
    }
}
