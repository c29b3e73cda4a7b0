//! Rules that a scenario leaves open: advected wakes, given up for quasi-static ones, and smooth
//! motion, given up for straight motion, where a fleet finds no paths by them.
//!
//! Advected wakes are given up first: of a hall of 500 drones that is flown in closed loop
//! (`plan fly`, PX4's controller, air at 0.6 of the centreline's speed), planned by both rules one
//! drone is over its limit for 0.18 s; in smooth motion with quasi-static wakes 141 are, for up to
//! 5 s, and none touches another; in straight motion 97 touch.

use std::f64::consts::PI;

use crate::scenario::limits::STOP_S;
use crate::scenario::world::{PathMotion, World};
use crate::solver::prepare::Job;
use crate::solver::priority::MOST_SMALL;

/// Share of the floor under the wakes of a larger fleet above which advected wakes are not tried.
/// Chosen here: halls of 500 drones (0.15; `plan generate hall --drones 500`, seeds 1 to 3, planned
/// with `--no-contrast --no-page`) take 7 to 11 s of CPU, one of 700 (0.21) with both rules named
/// in it 45.
const MOST_COVERED_ADVECTED: f64 = 0.16;
/// The same of smooth motion with quasi-static wakes. Chosen here: of the same halls those of 600
/// (0.18) and 700 take 4 and 7 s of CPU, one of 1000 (0.30) with both rules named in it 23.
const MOST_COVERED_SMOOTH: f64 = 0.25;
/// Fleets up to this size are tried with advected wakes up to that share, some seconds of work at
/// most, and in smooth motion with quasi-static wakes above any, if only for so many states a
/// drone, two seconds of work. All chosen here: 60 `offboard-1` that trade places at random in a
/// hall (0.38) take a second with both rules; `scenarios/light-show.ron` (0.44) takes a quarter of
/// these states, and with both rules named in it 18 s.
const MOST_MIDDLING: usize = 100;
const MOST_COVERED_MIDDLING: f64 = 0.4;
const STATES_A_DRONE_COVERED: u64 = 2_000;
/// States a drone after which a larger fleet is planned by the next weaker rules: chosen here, more
/// than halls of 500 take.
const STATES_A_DRONE: u64 = 3_000;

/// The worlds by whose rules a fleet is planned where those before find no paths, the last by all
/// that hold. Small fleets are tried in straight motion through advected wakes, too.
pub(crate) fn weaker(world: &World) -> Vec<World> {
    let straight = world.in_straight_motion();
    let neither = (straight.as_ref()).and_then(World::with_quasi_static_wakes);
    // Of air alone nothing changes for a drone that is slow to stop.
    let helps = straight.is_none() || slow_to_stop(world).is_none();
    let quasi_static = world.with_quasi_static_wakes().filter(|_| helps);
    let is_small = world.drones.len() <= MOST_SMALL;
    let straight = straight.filter(|_| is_small || quasi_static.is_none());
    let all = [quasi_static, straight, neither];
    all.into_iter().flatten().collect()
}

/// A drone that takes longer to stop than smooth motion is for, and how long (s).
fn slow_to_stop(world: &World) -> Option<(&str, f64)> {
    let is_smooth = world.planning.motion == PathMotion::Smooth;
    let mut stops = (world.drones.iter()).map(|it| (it.name.as_str(), it.vehicle.stop_s()));
    stops.find(|(_, stop_s)| is_smooth && !STOP_S.contain(*stop_s))
}

/// States of a try that is not the last, where wakes cover this share of the floor if that is
/// known; `None`: by all its rules a small fleet gets as many as it takes.
///
/// # Errors
/// Why nothing is to be tried.
pub(crate) fn most_states(
    world: &World,
    job: &Job,
    is_first: bool,
    covered: Option<f64>,
) -> Result<Option<u64>, Why> {
    if let Some((name, stop_s)) = slow_to_stop(world) {
        return Err(Why::SlowToStop(name.to_owned(), stop_s));
    }
    let drones = world.drones.len();
    if drones <= MOST_SMALL {
        return Ok((!is_first).then(|| STATES_A_DRONE * drones as u64));
    }
    let share = covered.unwrap_or_else(|| covered_share(world, job));
    match Why::of_covered(world, share) {
        Some(why) => Err(why),
        None if share > most_covered(world) => Ok(Some(STATES_A_DRONE_COVERED * drones as u64)),
        None => Ok(Some(STATES_A_DRONE * drones as u64)),
    }
}

/// Share of the floor under wakes above which the rules of a larger fleet's world are not tried, or
/// not for long.
fn most_covered(world: &World) -> f64 {
    match world.convection {
        Some(_) if world.drones.len() <= MOST_MIDDLING => MOST_COVERED_MIDDLING,
        Some(_) => MOST_COVERED_ADVECTED,
        None => MOST_COVERED_SMOOTH,
    }
}

/// Why rules that a scenario leaves open are given up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Why {
    /// A drone takes so long to stop (s).
    SlowToStop(String, f64),
    /// This share of the floor is under wakes at once, more than that for which they are.
    Covered(f64, f64),
    /// So many pairs of places exclude one another, starts among them.
    Excluded(usize),
    /// So many drones have no path.
    Unplanned(usize),
    /// So many states were not enough.
    Spent(u64),
}

impl Why {
    /// The rules of a world are not tried where wakes cover this share of the floor.
    pub(crate) fn of_covered(world: &World, share: f64) -> Option<Why> {
        let most = most_covered(world);
        let is_tried = world.convection.is_none() && world.drones.len() <= MOST_MIDDLING;
        (share > most && !is_tried).then_some(Why::Covered(share, most))
    }

    /// As a note on a plan without advected wakes, or else without smooth motion.
    fn note(&self, is_of_wakes: bool) -> String {
        let (planned, without, are, key) = match is_of_wakes {
            true => (
                "with quasi-static wakes",
                "advected wakes",
                "are",
                "air: (convection: (0.6, 1.0))",
            ),
            false => (
                "in straight motion, whose corners no drone flies as planned",
                "smooth motion",
                "is",
                "planning: (motion: Smooth)",
            ),
        };
        let why = match self {
            Why::SlowToStop(name, stop_s) => format!(
                "`{name}` takes {stop_s:.1} s to stop; {without} {are} not tried above {:.0} s",
                STOP_S.high
            ),
            Why::Covered(share, most) => format!(
                "wakes cover {:.0} % of the floor at once; {without} {are} not tried above {:.0} %",
                100.0 * share,
                100.0 * most
            ),
            Why::Excluded(1) => format!("with {without}, one pair of places excludes one another"),
            Why::Excluded(pairs) => {
                format!("with {without}, {pairs} pairs of places exclude one another")
            }
            Why::Unplanned(1) => format!("with {without}, one drone has no path"),
            Why::Unplanned(drones) => format!("with {without}, {drones} drones have no path"),
            Why::Spent(states) => {
                format!("with {without}, no plan was found in {states} search states")
            }
        };
        format!("planned {planned}: {why}; {key} asks for it all the same")
    }
}

/// Notes on the plan of a world: why it lacks rules that other worlds tried had, of each rule by
/// the world that differs in it alone where there is one.
pub(crate) fn notes(tried: &[(&World, Why)], planned: &World) -> Vec<String> {
    let without = |has: &dyn Fn(&World) -> bool, is_alike: &dyn Fn(&World) -> bool| {
        let by = tried
            .iter()
            .filter(|(world, _)| has(world) && !has(planned));
        let mut by: Vec<_> = by.collect();
        by.sort_by_key(|(world, _)| !is_alike(world));
        by.first().map(|(_, why)| why)
    };
    let has_advected = |world: &World| world.convection.is_some();
    let is_smooth = |world: &World| world.planning.motion == PathMotion::Smooth;
    let wakes = without(&has_advected, &|world| {
        is_smooth(world) == is_smooth(planned)
    });
    let motion = without(&is_smooth, &|world| {
        has_advected(world) == has_advected(planned)
    });
    let notes = [(wakes, true), (motion, false)];
    let notes = notes.into_iter();
    notes
        .filter_map(|(why, is_of_wakes)| Some(why?.note(is_of_wakes)))
        .collect()
}

/// What lies under the wakes of a fleet at once over the floor, each as wide as it alone is too
/// strong for another of its kind.
fn covered_share(world: &World, job: &Job) -> f64 {
    let costmap = job.costmap(world, 0);
    let fleet = costmap.fleet();
    let mut known: Vec<((u32, f64), f64)> = Vec::new();
    let mut area_m2 = |index: usize| {
        let kind = job.agents[index].kinds[0];
        let key = (kind.0, world.drones[index].air_limit);
        if let Some((_, area_m2)) = known.iter().find(|(other, _)| *other == key) {
            return *area_m2;
        }
        let conflict_volume = fleet.conflict_volume([(kind, key.1); 2], [1.0; 2]);
        let wake_sections = conflict_volume.wake_sections().iter().map(|it| it.section);
        let radii_m = wake_sections.map(|it| it.from_radius_m.max(it.to_radius_m));
        let radius_m = radii_m.fold(conflict_volume.body_radius(), f64::max);
        known.push((key, PI * radius_m.powi(2)));
        PI * radius_m.powi(2)
    };
    let size_m = world.bounds_m.max - world.bounds_m.min;
    let covered_m2: f64 = (0..world.drones.len()).map(&mut area_m2).sum();
    covered_m2 / (size_m.x * size_m.y)
}

#[cfg(test)]
mod tests {
    use super::Why;
    use crate::plan::outcome::{Control, Planned};
    use crate::scenario::read_world;

    fn planned(text: &str) -> Planned {
        let world = read_world(text).expect("in order");
        let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
        outcome.into_planned().expect("a plan")
    }

    fn one(airframe: &str, planning: &str) -> String {
        format!(
            r#"(name: "one", bounds_m: (min: (0, 0, 0), max: (9, 9, 5)), airframes: {{"slow": (
            mass_kg: 1, propeller_diameter_m: 0.2, motor_distance_m: 0.4, max_acceleration_mps2: 0.1, max_jerk_mps3: 0.1)}},
            drones: [(name: "k", airframe: "{airframe}", start_m: (1, 1, 1), tasks: [(to_m: (8, 8, 3))])], {planning})"#
        )
    }

    #[test]
    fn a_note_says_why_rules_were_given_up_in_words_of_its_reader() {
        let note = |why: Why| why.note(true);
        assert_eq!(
            note(Why::Spent(6001)),
            "planned with quasi-static wakes: with advected wakes, no plan was found in 6001 search states; \
             air: (convection: (0.6, 1.0)) asks for it all the same"
        );
        let excluded = note(Why::Excluded(2));
        assert!(
            excluded.contains("wakes, 2 pairs of places exclude one another;"),
            "{excluded}"
        );
    }

    #[test]
    fn what_is_not_named_is_smooth_and_advected() {
        let all = planned(&one("kolibri", ""));
        assert!(all.plan.drones[0].trajectory.is_smooth() && !all.plan.quasi_static);
        let planned = planned(&one(
            "kolibri",
            "planning: (motion: Straight), air: (convection: None)",
        ));
        assert!(!planned.plan.drones[0].trajectory.is_smooth() && planned.plan.quasi_static);
        assert!(all.notes.is_empty() && planned.notes.is_empty());
    }

    #[test]
    fn a_drone_that_is_slow_to_stop_flies_straight_unless_smooth_motion_is_named() {
        let planned = planned(&one("slow", "air: (convection: (0.6, 1.0))"));
        let plan = &planned.plan;
        assert!(plan.is_safe() && !plan.drones[0].trajectory.is_smooth() && !plan.quasi_static);
        let [note] = &planned.notes[..] else {
            panic!("{:?}", planned.notes);
        };
        assert!(note.starts_with("planned in straight motion"), "{note}");
        assert!(
            note.contains(": `k` takes 22.0 s to stop; smooth"),
            "{note}"
        );
        assert!(read_world(&one("slow", "planning: (motion: Smooth)")).is_err());
    }

    /// Rows of as many drones that hover 2 m apart in a hall this wide (m), one of which climbs.
    fn crowd(width_m: f64, row: usize) -> String {
        let drone = |k: usize| {
            let [x, y] = [k % row, k / row].map(|it| 1.5 + 2.0 * it as f64);
            let tasks = if k == 0 {
                format!("(to_m: ({x}, {y}, 5.5))")
            } else {
                String::new()
            };
            format!(
                r#"(name: "d{k}", airframe: "offboard-2", start_m: ({x}, {y}, 3.5), tasks: [{tasks}])"#
            )
        };
        let drones: Vec<String> = (0..row * row).map(drone).collect();
        format!(
            r#"(name: "crowd", bounds_m: (min: (0, 0, 0), max: ({width_m}, {width_m}, 8)),
            planning: (cell_m: 1), drones: [{}])"#,
            drones.join(", ")
        )
    }

    #[test]
    fn wakes_that_cover_much_of_the_floor_follow_their_drones_and_then_motion_is_straight_too() {
        let none = planned(&crowd(19.0, 6));
        assert!(none.plan.drones[0].trajectory.is_smooth() && !none.plan.quasi_static);
        assert!(none.notes.is_empty(), "{:?}", none.notes);

        let one = planned(&crowd(28.0, 11));
        assert!(one.plan.is_safe() && one.plan.quasi_static);
        assert!(one.plan.drones[0].trajectory.is_smooth());
        let [note] = &one.notes[..] else {
            panic!("{:?}", one.notes);
        };
        assert!(
            note.starts_with("planned with quasi-static wakes: wakes cover "),
            "{note}"
        );
        assert!(
            note.contains("advected wakes are not tried above 16 %"),
            "{note}"
        );

        // Fewer are tried all the same.
        let few = planned(&crowd(13.0, 6));
        assert!(few.plan.is_safe() && !few.plan.quasi_static);
        assert!(few.plan.drones[0].trajectory.is_smooth());

        let both = planned(&crowd(23.0, 11));
        assert!(both.plan.is_safe() && both.plan.quasi_static);
        assert!(!both.plan.drones[0].trajectory.is_smooth());
        let [_, note] = &both.notes[..] else {
            panic!("{:?}", both.notes);
        };
        assert!(note.starts_with("planned in straight motion"), "{note}");
        assert!(
            note.contains("smooth motion is not tried above 25 %"),
            "{note}"
        );
    }

    #[test]
    fn advected_wakes_are_kept_where_giving_them_up_helps_none() {
        // 7 m at 2 m/s, which leaves no time to speed up and to slow down.
        let hurried = one("kolibri", "").replace("(8, 8, 3)", "(8, 1, 1), during_s: (3.6, 3.6)");
        let planned = planned(&hurried);
        let plan = &planned.plan;
        assert!(plan.is_safe() && !plan.drones[0].trajectory.is_smooth() && !plan.quasi_static);
        let [note] = &planned.notes[..] else {
            panic!("{:?}", planned.notes);
        };
        assert!(
            note.contains(": with smooth motion, one drone has no path"),
            "{note}"
        );
    }

    #[test]
    fn advected_wakes_are_kept_where_giving_them_up_and_finer_cells_help_no_more() {
        let drone = |name: &str, y: f64, during: &str| {
            format!(
                r#"(name: "{name}", airframe: "offboard-1", start_m: (1, {y}, 1.5),
                tasks: [(to_m: (11, {y}, 1.5), during_s: {during})])"#
            )
        };
        // The first has no time to speed up in, nor to fly to places of whole cells; the second
        // has none to get there in at all.
        let drones = [drone("a", 1.25, "(5, 8)"), drone("b", 3.0, "(4, 8)")].join(", ");
        let planned = planned(&format!(
            r#"(name: "late", bounds_m: (min: (0, 0, 0), max: (12, 6, 3)), drones: [{drones}])"#
        ));
        let plan = &planned.plan;
        assert_eq!(planned.failures.len(), 1, "{:?}", planned.failures);
        assert!(!plan.quasi_static && !plan.drones[0].trajectory.is_smooth());
        assert!(
            planned.notes.iter().all(|note| !note.contains("advected")),
            "{:?}",
            planned.notes
        );
    }

    #[test]
    fn a_payload_is_taken_up_where_the_drone_stands() {
        let text = one("kolibri", "").replace(
            "(8, 8, 3))",
            "(8, 8, 3), dwell_s: 2, load_kg: 0.05), (to_m: (1, 8, 3), load_kg: 0)",
        );
        let plan = planned(&text).plan;
        let flown = &plan.drones[0].trajectory;
        let steps = (1..flown.t_s.len()).filter(|&k| flown.mass_kg[k] != flown.mass_kg[k - 1]);
        let places_m: Vec<_> = steps.map(|k| flown.position_m[k]).collect();
        for (at_m, place_m) in places_m.iter().zip([[8.0, 8.0, 3.0], [1.0, 8.0, 3.0]]) {
            assert!(
                (at_m - nalgebra::Point3::from(place_m)).norm() < 1e-6,
                "{at_m}"
            );
        }
        assert_eq!(places_m.len(), 2);
    }
}
