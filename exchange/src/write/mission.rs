//! Missions of QGroundControl: waypoints on the Earth, without times. A `.plan` (JSON) and a
//! `.waypoints` (text) a drone.
//!
//! Layouts: <https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html>, and
//! the plain-text format of <https://mavlink.io/en/file_formats/>. Commands and frames are
//! MAVLink's `MAV_CMD` and `MAV_FRAME`.

use std::fmt::Write as _;

use nalgebra::Point3;
use serde_json::{Value, json};

use super::decimal;
use crate::course::Course;
use crate::deviation::distance_m;
use crate::frame::Georeference;

/// MAVLink counts a mission's items in 16 bits (`MISSION_COUNT.count`).
pub const MOST_ITEMS: usize = 65_535;
/// Places within this of the line between two waypoints are no waypoints (m): chosen here, less
/// than a vehicle's acceptance radius, so that curves stay curves and straight flight stays whole.
const LINE_M: f64 = 0.02;
/// Longest part of a curve that is looked at (s): chosen here, 0.2 m at 2 m/s.
const STEP_S: f64 = 0.1;
/// Places nearer than this are one (m): what the formats' last digit says.
const SAME_M: f64 = 1e-3;
/// `MAV_CMD_NAV_WAYPOINT`.
const WAYPOINT: u16 = 16;
/// `MAV_CMD_NAV_LAND`.
const LAND: u16 = 21;
/// `MAV_CMD_NAV_TAKEOFF`.
const TAKEOFF: u16 = 22;
/// `MAV_FRAME_GLOBAL_RELATIVE_ALT`: heights above home.
const ABOVE_HOME: u8 = 3;
/// `MAV_AUTOPILOT_PX4`, `MAV_TYPE_QUADROTOR`.
const FIRMWARE_AND_VEHICLE: (u8, u8) = (12, 2);

#[derive(Clone, Copy)]
struct Item {
    command: u16,
    hold_s: f64,
    at_m: Point3<f64>,
}

/// The mission of one drone.
pub struct Mission {
    items: Vec<Item>,
    /// Below its first place, on the floor or what it stands on (m).
    home_m: Point3<f64>,
    /// Along its course (m/s).
    fastest_mps: f64,
    /// It waits on the ground before it takes off, which no item holds.
    waits_landed: bool,
}

impl Mission {
    /// Waypoints of a course, and how long it stays at them; the floor is at a height (m).
    #[must_use]
    pub fn of(course: &Course, floor_m: f64) -> Mission {
        let start_m = course.start_m();
        // Where it goes, and where it stays: a line between two stays each.
        let mut lines: Vec<(f64, Vec<Point3<f64>>)> = vec![(0.0, vec![start_m])];
        let mut fastest_mps: f64 = 0.1;
        for piece in &course.pieces {
            let is_still = piece
                .points_m
                .iter()
                .all(|it| (it - piece.points_m[0]).norm() < SAME_M);
            if is_still {
                match lines.last_mut() {
                    Some((held_s, line)) if line.len() == 1 => *held_s += piece.duration_s(),
                    _ => lines.push((piece.duration_s(), vec![piece.points_m[3]])),
                }
                continue;
            }
            let parts = match piece.is_straight {
                true => vec![*piece],
                false => piece.parts(STEP_S),
            };
            for part in parts {
                let across_m = (part.points_m[3] - part.points_m[0]).norm();
                fastest_mps = fastest_mps.max(across_m / part.duration_s());
                if let Some((_, line)) = lines.last_mut() {
                    line.push(part.points_m[3]);
                }
            }
        }
        if course.starts_landed {
            climbs_first(&mut lines, start_m);
        }
        let mut items: Vec<Item> = Vec::new();
        for (hold_s, line) in &lines {
            let mut kept = corners(line).into_iter();
            if let Some(at_m) = kept.next() {
                // A stay; else the end of the line before, which is a waypoint already.
                match items.last_mut() {
                    Some(Item { hold_s: held_s, .. }) if *hold_s > 0.0 => *held_s = *hold_s,
                    Some(_) => {}
                    None => items.push(Item {
                        command: WAYPOINT,
                        hold_s: *hold_s,
                        at_m,
                    }),
                }
            }
            let waypoint = |at_m| Item {
                command: WAYPOINT,
                hold_s: 0.0,
                at_m,
            };
            items.extend(kept.map(waypoint));
        }
        let home_z_m = match course.starts_landed {
            true => start_m.z,
            false => floor_m,
        };
        let home_m = Point3::new(start_m.x, start_m.y, home_z_m);
        // It begins where it leaves its home to, upwards where the drone climbs first.
        let is_away = |it: &Item| (it.at_m - home_m).norm() > LINE_M;
        let first = items.iter().position(is_away).unwrap_or(items.len());
        let waits_landed = items.drain(..first).any(|it| it.hold_s > 0.0);
        // Waypoints alone hold: the first parameter of a take-off is a pitch, that of a landing the
        // height at which it is broken off.
        if let Some(first) = items.first_mut() {
            let (at_m, hold_s) = (first.at_m, first.hold_s);
            (first.command, first.hold_s) = (TAKEOFF, 0.0);
            if hold_s > 0.0 {
                let stay = Item {
                    command: WAYPOINT,
                    hold_s,
                    at_m,
                };
                items.insert(1, stay);
            }
        }
        // From pad to pad of one height: one place to take off to, and to land on.
        if let (true, [only]) = (course.lands, &items[..]) {
            items.push(*only);
        }
        if let Some(last) = items.last_mut().filter(|_| course.lands) {
            (last.command, last.hold_s) = (LAND, 0.0);
        }
        Mission {
            items,
            home_m,
            fastest_mps,
            waits_landed,
        }
    }

    /// It waits on the ground before it takes off, which no item holds.
    #[must_use]
    pub fn waits_landed(&self) -> bool {
        self.waits_landed
    }

    /// How many items it has.
    #[must_use]
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// It has none: it never leaves its home.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Latitude, longitude (deg), height above home (m), to a hundredth of a millimetre.
    fn on_earth(&self, at_m: &Point3<f64>, at: &Georeference) -> [f64; 3] {
        let [longitude_deg, latitude_deg, _] = at.on_earth(*at_m);
        let rounded = |value: f64, scale: f64| (value * scale).round() / scale + 0.0;
        [
            rounded(latitude_deg, 1e10),
            rounded(longitude_deg, 1e10),
            rounded(at_m.z - self.home_m.z, 1e5),
        ]
    }

    /// Its `.plan`.
    #[must_use]
    pub fn plan(&self, id: &str, at: &Georeference) -> Vec<u8> {
        let item = |(k, item): (usize, &Item)| {
            let [latitude_deg, longitude_deg, above_m] = self.on_earth(&item.at_m, at);
            // No yaw is asked for: the vehicle keeps its own.
            let params = json!([
                ms(item.hold_s),
                0,
                0,
                null,
                latitude_deg,
                longitude_deg,
                above_m
            ]);
            json!({
                "type": "SimpleItem", "command": item.command, "frame": ABOVE_HOME,
                "params": params, "doJumpId": k + 1, "autoContinue": true,
                "Altitude": above_m, "AltitudeMode": 1, "AMSLAltAboveTerrain": null,
            })
        };
        let items: Vec<Value> = self.items.iter().enumerate().map(item).collect();
        let [latitude_deg, longitude_deg, _] = self.on_earth(&self.home_m, at);
        let (firmware, vehicle) = FIRMWARE_AND_VEHICLE;
        let speed_mps = (self.fastest_mps * 100.0).round() / 100.0;
        let file = json!({
            "fileType": "Plan", "version": 1, "groundStation": "QGroundControl", "leeward": id,
            "geoFence": {"circles": [], "polygons": [], "version": 2},
            "rallyPoints": {"points": [], "version": 2},
            "mission": {
                "version": 2, "firmwareType": firmware, "vehicleType": vehicle,
                "cruiseSpeed": speed_mps, "hoverSpeed": speed_mps, "globalPlanAltitudeMode": 1,
                "plannedHomePosition": [latitude_deg, longitude_deg, self.home_amsl_m(at)],
                "items": items,
            },
        });
        file.to_string().into_bytes()
    }

    /// Its `.waypoints`; the first is home.
    #[must_use]
    pub fn waypoints(&self, at: &Georeference) -> Vec<u8> {
        let mut text = "QGC WPL 110\n".to_owned();
        let mut line = |k: usize, (frame, command): (u8, u16), hold_s: f64, to: [f64; 3]| {
            let [latitude_deg, longitude_deg, height_m] = to;
            let current = u8::from(k == 0);
            let (hold, height) = (decimal(hold_s, 3), decimal(height_m, 5));
            let _ = writeln!(
                text,
                "{k}\t{current}\t{frame}\t{command}\t{hold}\t0\t0\t0\t{}\t{}\t{height}\t1",
                decimal(latitude_deg, 10),
                decimal(longitude_deg, 10),
            );
        };
        let [latitude_deg, longitude_deg, _] = self.on_earth(&self.home_m, at);
        let home = [latitude_deg, longitude_deg, self.home_amsl_m(at)];
        line(0, (0, WAYPOINT), 0.0, home);
        for (k, item) in self.items.iter().enumerate() {
            let to = self.on_earth(&item.at_m, at);
            line(k + 1, (ABOVE_HOME, item.command), item.hold_s, to);
        }
        text.into_bytes()
    }

    fn home_amsl_m(&self, at: &Georeference) -> f64 {
        ((at.altitude_m + self.home_m.z) * 1e5).round() / 1e5
    }
}

/// One that stands climbs as far as it does straight: there its first line is cut in two.
fn climbs_first(lines: &mut Vec<(f64, Vec<Point3<f64>>)>, start_m: Point3<f64>) {
    let (_, line) = &mut lines[0];
    let is_over = |at_m: &&Point3<f64>| (at_m.xy() - start_m.xy()).norm() < LINE_M;
    let over = line.iter().take_while(is_over).enumerate();
    let Some((top, _)) = over.max_by(|a, b| a.1.z.total_cmp(&b.1.z)) else {
        return;
    };
    let rest = line[top..].to_vec();
    line.truncate(top + 1);
    lines.insert(1, (0.0, rest));
}

fn ms(hold_s: f64) -> f64 {
    (hold_s * 1e3).round() / 1e3
}

/// Of a line its ends and the places without which it would be farther than [`LINE_M`] off (D. H.
/// Douglas, T. K. Peucker, "Algorithms for the reduction of the number of points required to
/// represent a digitized line", Cartographica 10, 1973), or go back along itself by as much.
fn corners(line: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let mut is_kept = vec![false; line.len()];
    let last = line.len() - 1;
    (is_kept[0], is_kept[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((a, b)) = open.pop() {
        let off_m = |k: usize| distance_m(line[k], [line[a], line[b]]);
        let between = (a + 1..b).map(|k| (off_m(k), k));
        let farthest = between.max_by(|x, y| x.0.total_cmp(&y.0));
        let farthest = farthest.filter(|it| it.0 > LINE_M).map(|(_, k)| k);
        if let Some(k) = farthest.or_else(|| turns_back(line, a, b)) {
            is_kept[k] = true;
            open.extend([(a, k), (k, b)]);
        }
    }
    let kept = line.iter().zip(is_kept).filter(|it| it.1);
    kept.map(|it| *it.0).collect()
}

/// Between two places of a line that lies along the way from one to the other, where it turns back
/// on that way by more than [`LINE_M`] first.
fn turns_back(line: &[Point3<f64>], a: usize, b: usize) -> Option<usize> {
    let way = (line[b] - line[a]).try_normalize(0.0)?;
    let along_m = |k: usize| (line[k] - line[a]).dot(&way);
    let mut ahead = a;
    for k in a + 1..b {
        if along_m(k) > along_m(ahead) {
            ahead = k;
        } else if along_m(ahead) - along_m(k) > LINE_M {
            return Some(ahead);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::course::Piece;

    #[test]
    fn a_line_that_goes_to_and_fro_keeps_each_turn() {
        let place = |x_m: f64| Point3::new(x_m, 2.0, 3.0);
        let line = [0.0, 4.0, 9.0, 4.0, 0.0, 4.0, 9.0].map(place);
        assert_eq!(corners(&line), [0.0, 9.0, 0.0, 9.0].map(place));
        let halfway = [0.0, 6.0, 3.0, 9.0].map(place);
        assert_eq!(corners(&halfway), halfway);
    }

    fn course(pieces: Vec<Piece>) -> Course {
        Course {
            name: "a".to_owned(),
            pieces,
            starts_landed: true,
            lands: true,
            enters_s: None,
            leaves: false,
            changes_mass: false,
        }
    }

    #[test]
    fn straight_flight_is_one_waypoint_stays_are_holds_and_what_stands_climbs_first() {
        let place = Point3::new;
        let line = |from_s, until_s, ends_m| Piece::straight(from_s, until_s, ends_m);
        let [ground, up] = [place(1.0, 2.0, 0.1), place(1.0, 2.0, 3.0)];
        let [far, down] = [place(9.0, 2.0, 3.0), place(9.0, 2.0, 0.1)];
        let pieces = vec![
            line(0.0, 2.0, [ground; 2]),
            line(2.0, 4.0, [ground, up]),
            line(4.0, 6.0, [up, place(5.0, 2.0, 3.0)]),
            line(6.0, 8.0, [place(5.0, 2.0, 3.0), far]),
            line(8.0, 13.0, [far; 2]),
            line(13.0, 16.0, [far, down]),
        ];
        let mission = Mission::of(&course(pieces), 0.0);
        let told: Vec<_> = mission
            .items
            .iter()
            .map(|it| (it.command, it.hold_s, it.at_m))
            .collect();
        let expected = [(TAKEOFF, 0.0, up), (WAYPOINT, 5.0, far), (LAND, 0.0, down)];
        assert_eq!(told, expected);
        assert_eq!(mission.home_m, ground);
    }

    #[test]
    fn who_bends_aside_as_it_climbs_takes_off_to_where_it_still_climbs_straight() {
        let place = Point3::new;
        let [ground, up, aside] = [
            place(1.0, 2.0, 0.1),
            place(1.0, 2.0, 1.0),
            place(3.0, 2.0, 2.0),
        ];
        let bend = Piece {
            from_s: 2.0,
            until_s: 5.0,
            points_m: [up, place(1.0, 2.0, 1.5), place(1.0, 2.0, 2.0), aside],
            is_straight: false,
        };
        let climb = Piece::straight(0.0, 2.0, [ground, up]);
        let mission = Mission::of(&course(vec![climb, bend]), 0.0);
        let first = &mission.items[0];
        assert_eq!(first.command, TAKEOFF);
        assert!((first.at_m.xy() - ground.xy()).norm() < LINE_M);
        assert!(first.at_m.z >= up.z, "{}", first.at_m);
    }

    #[test]
    fn who_flies_at_or_below_the_height_of_its_pad_has_a_mission_of_every_place() {
        let place = Point3::new;
        let [roof, off, down, up] = [
            place(2.0, 4.0, 3.2),
            place(10.0, 4.0, 3.2),
            place(10.0, 4.0, 1.5),
            place(14.0, 9.0, 4.0),
        ];
        let line = |from_s, until_s, ends_m| Piece::straight(from_s, until_s, ends_m);
        let mut pieces = vec![line(0.0, 1.0, [roof; 2]), line(1.0, 9.0, [roof, off])];
        let told = |pieces: &[Piece]| -> Vec<_> {
            let mission = Mission::of(&course(pieces.to_vec()), 0.0);
            assert_eq!(mission.home_m, roof);
            mission
                .items
                .iter()
                .map(|it| (it.command, it.at_m))
                .collect()
        };
        assert_eq!(told(&pieces), [(TAKEOFF, off), (LAND, off)]);
        pieces.push(line(9.0, 13.0, [off, down]));
        assert_eq!(told(&pieces), [(TAKEOFF, off), (LAND, down)]);
        pieces.push(line(13.0, 30.0, [down, up]));
        assert_eq!(
            told(&pieces),
            [(TAKEOFF, off), (WAYPOINT, down), (LAND, up)]
        );
    }

    #[test]
    fn who_never_leaves_the_ground_has_no_mission() {
        let stays = Piece::straight(0.0, 2.0, [Point3::new(1.0, 2.0, 0.1); 2]);
        assert!(Mission::of(&course(vec![stays]), 0.0).is_empty());
    }
}
