//! What a log without any metadata needs, as the fewest lines of a campaign file that would do,
//! ready to paste: each `?` is to be filled in.

use std::fmt::Write as _;

use super::columns::{self, Role};
use super::crazyflie;
use super::found::Found;
use super::log::is_table;
use super::mcap::{self, MAGIC};
use super::table::Table;

/// Most vehicles that are listed. Chosen here: more are written by hand or by a script.
const MOST_VEHICLES: usize = 30;

/// A campaign file for one log, of which `name` is what a vehicle is called that the log does not
/// name.
///
/// ```
/// let log = b"timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z\n0,0,0,1\n";
/// let asked = diagnosis::record::read::needed("cf7", "cf7.csv", log);
/// assert!(!asked.contains("columns"), "the Crazyflie's names are known");
/// assert!(asked.contains(r#"vehicles: { "cf7": "drone" }"#));
/// ```
#[must_use]
pub fn needed(name: &str, file: &str, bytes: &[u8]) -> String {
    let mut found = Found::default();
    let table = is_table(file, bytes).then(|| Table::open(file, bytes, &mut found));
    let table = table.flatten();
    let header = table.as_ref().map_or(&[][..], Table::header).to_vec();
    let mut text = String::from("(\n    name: \"my flights\",\n");
    let means = |role: Role| {
        let mut names = header.iter().map(String::as_str);
        let ours = |name: &str| columns::meaning(name).is_some_and(|(known, _)| known == role);
        names.any(ours) || crazyflie::says(role, &header)
    };
    let acceleration = Role::Acceleration(0);
    if means(acceleration) && !crazyflie::says(acceleration, &header) {
        text += "    acceleration: ?, // SpecificForceInBody or SpecificForceInWorld where az reads +9.8 m/s2 at hover, GravityRemovedInBody or GravityRemovedInWorld where it reads 0\n";
    }
    let mut pairs = Vec::new();
    let required = [("t_s", Role::Time)];
    let places = ["x_m", "y_m", "z_m"].into_iter().enumerate();
    let places = places.map(|(axis, name)| (name, Role::Position(axis)));
    for (name, role) in required.into_iter().chain(places) {
        if !header.is_empty() && !means(role) {
            pairs.push(format!("\"{name}\": ?"));
        }
    }
    if !pairs.is_empty() {
        let _ = writeln!(text, "    columns: {{ {} }},", pairs.join(", "));
    }
    text += "    types: { \"drone\": (mass_kg: Stated(?), propeller_diameter_m: Stated(?), motor_distance_m: Stated(?)) }, // opposite motors\n";
    let names = table.and_then(|table| {
        let columns = ["vehicle", "vehicle_id"];
        let column = columns.into_iter().find_map(|name| table.column(name))?;
        Some(table.read(&[], Some(column), &mut found).names)
    });
    let in_bag = bytes.starts_with(MAGIC).then(|| mcap::vehicles(bytes));
    let names = names.or(in_bag.filter(|names| !names.is_empty()));
    let mut names = names.unwrap_or_else(|| vec![name.to_owned()]);
    names.sort();
    names.truncate(MOST_VEHICLES);
    let vehicles: Vec<String> = names
        .iter()
        .map(|id| format!("{id:?}: \"drone\""))
        .collect();
    let _ = writeln!(text, "    vehicles: {{ {} }},\n)", vehicles.join(", "));
    text
}

#[cfg(test)]
mod tests {
    use super::super::Campaign;
    use super::*;

    #[test]
    fn what_is_asked_for_does_once_it_is_filled_in() {
        let log = "timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z,acc.x,acc.y,acc.z,pm.vbat\n0,0,0,1,0,0,1,3.9\n20,0,0,1,0,0,1,3.9\n";
        let asked = needed("cf7", "cf7.csv", log.as_bytes());
        let filled = asked.replace('?', "0.1");
        let campaign = Campaign::parse("c.ron", &filled).expect("in order");
        let read = super::super::read_log("cf7", "cf7.csv", log.as_bytes(), &campaign);
        let track = &read.expect("reads").vehicles[0].track;
        assert_eq!(track.t_s, [0.0, 0.02]);
        let up = track.specific_force_mps2.as_ref().expect("logged")[0].z;
        assert!((up - 9.81).abs() < 1e-9);
    }

    #[test]
    fn vehicles_are_listed_and_unknown_columns_asked_for() {
        let log =
            "t_s,vehicle,px,y_m,z_m,ax_mps2,ay_mps2,az_mps2\n0,b,0,0,1,0,0,0\n0,a,0,0,1,0,0,0\n";
        let asked = needed("f", "f.csv", log.as_bytes());
        assert!(
            asked.contains("vehicles: { \"a\": \"drone\", \"b\": \"drone\" }"),
            "{asked}"
        );
        assert!(asked.contains("columns: { \"x_m\": ? }"), "{asked}");
        assert!(asked.contains("acceleration: ?"), "{asked}");
        let of_px4 = needed("log_7", "log_7.ulg", b"");
        assert!(
            of_px4.contains("vehicles: { \"log_7\": \"drone\" }") && !of_px4.contains("columns")
        );
    }
}
