//! Flights of two drones beside one another, with what is put into their forces.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use super::super::forces::LOW_PASS;
use super::*;
use crate::campaign::apply_campaign;
use crate::infer::finding::Verdict;
use crate::infer::intervals::NINETY_FIVE;
use crate::record::read::{Campaign, read_log};
use crate::statistics::draws::Draws;

const FLIGHTS: u64 = 8;
const CAMPAIGN: &str = r#"(
    name: "made", floor_z_m: 0, air: (temperature_c: 20), acceleration: SpecificForceInBody, clock: Shared,
    types: { "d": (mass_kg: Stated(0.034), propeller_diameter_m: Stated(0.046), motor_distance_m: Stated(0.092), rotor_offset_m: Stated((0, 0, 0)), touch_z_m: 0.05) },
    vehicles: { "a": "d", "b": "d" },
)"#;

/// Vertical forces (N) by flight, x and y (m), and 3 mN of scatter.
fn flights(force_n: impl Fn(u64, [f64; 2]) -> f64) -> Vec<Recording> {
    let campaign = Campaign::parse("campaign.ron", CAMPAIGN).expect("in order");
    let flight = |flight: u64| {
        let random = &mut Draws::new(7 + flight);
        let mut text = "t_s,vehicle,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,fx_n,fy_n,fz_n\n".to_owned();
        let swings = [0; 6].map(|_| (random.between(0.03, 0.1), random.between(0.0, TAU)));
        for t_s in (0..1200).map(|step| f64::from(step) * 0.05) {
            for (vehicle, from) in [("a", 0), ("b", 3)] {
                let swing = |at: usize, size_m: f64| {
                    let (hz, phase) = swings[from + at];
                    let angle = TAU * hz * t_s + phase;
                    (size_m * angle.sin(), size_m * TAU * hz * angle.cos())
                };
                let [x, y, z] = [swing(0, 0.2), swing(1, 0.2), swing(2, 0.1)];
                let beside_m = from as f64;
                let mut scatter_n = || 0.003 * random.normal();
                let [fx_n, fy_n] = [scatter_n(), scatter_n()];
                let fz_n = force_n(flight, [x.0 + beside_m, y.0]) + scatter_n();
                writeln!(
                    text,
                    "{t_s:.3},{vehicle},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{fx_n:.5},{fy_n:.5},{fz_n:.5}",
                    x.0 + beside_m, y.0, 1.0 + z.0, x.1, y.1, z.1
                )
                .expect("memory takes it");
            }
        }
        let name = format!("f{flight}");
        read_log(&name, &format!("{name}.csv"), text.as_bytes(), &campaign).expect("in order")
    };
    (0..FLIGHTS).map(flight).collect()
}

fn found(force_n: impl Fn(u64, [f64; 2]) -> f64) -> CampaignFinding {
    diagnose_campaign(&flights(force_n), &CampaignOptions::default()).expect("it can be judged")
}

#[test]
fn an_offset_that_all_flights_share_is_told_with_an_interval_that_its_tolerance_allows() {
    let all = found(|_, _| 0.01).finding;
    let names: Vec<&str> = all.effects.iter().map(|of| of.name.as_str()).collect();
    assert_eq!(names, ["sensor_offset"]);
    let offset = &all.effects[0].parameters["b"];
    // What may be off without a fault, and 5 % of a normal law.
    let most_n = NINETY_FIVE * 2.0 * TOLERANCE_N;
    assert!((offset.value - 0.01).abs() < TOLERANCE_N, "{offset:?}");
    assert!(offset.high - offset.low < 2.0 * most_n, "{offset:?}");
    assert!(all.held_out.rms_after < 0.5 * all.held_out.rms_before);
    // Each flight's own is a thrust map's.
    let own = found(|flight, _| 0.004 * Draws::new(flight).normal());
    assert_eq!(own.finding.verdict, Verdict::None);
}

#[test]
fn nothing_is_named_with_which_held_out_flights_are_surely_predicted_worse() {
    let one_of_two = found(|_, [x_m, _]| if x_m > 1.5 { 0.03 } else { 0.0 });
    for taken in &one_of_two.taken {
        let high = taken.r2_gained.map_or(0.0, |[_, _, high]| high);
        assert!(high >= 0.0, "{taken:?}");
    }
    let effects = one_of_two.finding.effects.iter();
    let mut parameters = effects.flat_map(|of| of.parameters.values());
    assert!(parameters.all(|of| !of.at_bound));
}

#[test]
fn what_stands_in_its_place_in_the_room_is_found_there() {
    let found = found(
        |_, [x_m, y_m]| match (0.05..1.0).contains(&x_m) && y_m > 0.0 {
            true => 0.012,
            false => 0.0,
        },
    );
    let CampaignFinding {
        finding, located, ..
    } = found;
    assert_eq!(finding.verdict, Verdict::OutsideLibrary);
    let shape = finding.shape.expect("it has a shape");
    assert!(
        ["x m", "y m"].contains(&shape.depends_on[0].0.as_str()),
        "{:?}",
        shape.depends_on
    );
    assert!(finding.held_out.rms_after < 0.5 * finding.held_out.rms_before);
    assert!(located.is_some_and(|of| of.mean_error_n > 0.006));
}

#[test]
fn a_finding_is_judged_on_any_number_of_flights_and_of_one_block_without_an_interval() {
    let all = flights(|_, _| 0.01);
    let correction = Hypothesis::default();
    let judged = |recordings: &[Recording]| {
        let options = CampaignOptions::default();
        let applied = apply_campaign(recordings, &options, &correction).expect("nothing is fitted");
        applied.all[0].clone()
    };
    let two = judged(&all[..2]);
    let [low, after, high] = two.rms_after;
    assert_eq!(two.recordings, 2);
    assert!(low < after && after < high, "{two:?}");
    let mut short = all[0].clone();
    short.vehicles.truncate(1);
    let track = &mut short.vehicles[0].track;
    let kept = track.t_s.iter().filter(|t_s| **t_s < 14.0).count();
    track.t_s.truncate(kept);
    track.position_m.truncate(kept);
    track.velocity_mps.truncate(kept);
    track.attitude.truncate(kept);
    track.force_n.iter_mut().for_each(|of| of.truncate(kept));
    let one = judged(&[short]);
    let [low, after, high] = one.rms_after;
    assert!(low.is_nan() && after > 0.0 && high.is_nan(), "{one:?}");
}

#[test]
fn without_flights_near_the_floor_there_are_none_to_be_judged() {
    // A metre above it.
    let low = near_floor(&flights(|_, _| 0.0));
    assert!(matches!(low, Err(CampaignError::NoneLow)), "{low:?}");
}

#[test]
fn what_is_taken_back_leaves_nothing_that_would_have_come_next() {
    let (recordings, options) = (flights(|_, _| 0.01), CampaignOptions::default());
    let forces = Forces::new(&recordings, &options).expect("ready forces");
    let every = forces.at_every_moment(&Hypothesis::default());
    let scatter = scatter(&forces, &every, 1.0 / RATE_HZ);
    let candidates = library(&forces, forces.alone);
    let setting = Setting::within(&forces, &scatter.noise, &candidates, [1e-6, TOLERANCE_N]);
    let none = forward(&setting, singles(&setting), MOST_EFFECTS, |_, _| false);
    assert!(none.turns.is_empty() && none.selection.chosen.which.is_empty());
    let mut chosen = forward(&setting, singles(&setting), MOST_EFFECTS, |_, _| true);
    assert!(!chosen.turns.is_empty() && chosen.next.is_some());
    chosen.withdraw();
    assert!(chosen.turns.is_empty() && chosen.next.is_none());
    assert!(chosen.selection.chosen.which.is_empty());
}

#[test]
fn a_campaign_simulates_fast_passes_as_the_flight_by_itself_is_simulated() {
    let campaign = Campaign::parse("campaign.ron", CAMPAIGN).expect("in order");
    let mut text = "t_s,vehicle,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,fx_n,fy_n,fz_n\n".to_owned();
    for t_s in (0..1200).map(|step| f64::from(step) * 0.02) {
        let angle = TAU * 0.6 * t_s;
        let (x_m, vx_mps) = (0.4 * angle.sin(), 0.4 * TAU * 0.6 * angle.cos());
        let fz_n = 0.01 * angle.cos();
        writeln!(text, "{t_s:.3},a,0,0,1.5,0,0,0,0,0,{fz_n:.5}").expect("memory takes it");
        writeln!(
            text,
            "{t_s:.3},b,{x_m:.4},0,1,{vx_mps:.4},0,0,0,0,{fz_n:.5}"
        )
        .expect("memory takes it");
    }
    let flight = read_log("f", "f.csv", text.as_bytes(), &campaign).expect("in order");
    let flow = crate::forward::flow::Flow::new(&flight);
    let (alone, _) = crate::forward::force::simulate(&flight, &flow, LOW_PASS);
    let of = |subject, t_s: f64| {
        let mut all = alone.iter();
        let same = all.find(|of| of.subject == subject && (of.t_s - t_s).abs() < 1e-6);
        same.expect("every entry is simulated").simulated
    };
    let recordings = [flight.clone()];
    let forces = Forces::new(&recordings, &CampaignOptions::default()).expect("ready forces");
    let together = forces.samples(&forces.predict(&Hypothesis::default()));
    let largest_n = alone
        .iter()
        .map(|of| of.simulated.abs())
        .fold(0.0, f64::max);
    assert!(largest_n > 0.01, "{largest_n}");
    for row in &together {
        let off_n = (row.simulated - of(row.subject, row.t_s)).abs();
        // What lies beyond the reach of a wake.
        assert!(
            off_n < 0.02 * largest_n,
            "{} s: {off_n} of {largest_n} N",
            row.t_s
        );
    }
}
