//! Every figure on synthetic readings: well-formed, small, the same twice, and with nothing in it
//! that is not a number.

use airflow::Jet;
use diagnosis::calibrate::{
    Calibration, Correlation, Counts, DroneFit, Estimate, FittedJet, Goodness, Interval, Lobes,
    Profile, Resampling, ResidualTests, SliceFit, Unit, Verdict,
};
use diagnosis::forward::simulate::{Channel, Sample};
use nalgebra::Point3;

use super::agreement::{self, Trace};
use super::expansion::{self, Expansion};
use super::profiles::{self, Words};
use super::readings::Reading;
use super::residual_map::{Above, ResidualMap};
use super::signature::{self, Mismatch};
use super::*;

/// Even draws from 0 to 1 without a generator: multiples of the golden ratio.
fn even(index: usize, salt: f64) -> f64 {
    (index as f64 * 0.618_033_988_749_895 + salt).fract()
}

/// The paper's jet, and a recording of it that is 10 % wider and noisy.
fn readings() -> Vec<Reading> {
    let jet = Jet::default();
    let speed = |s: f64, r: f64, width: f64| {
        let xi = r / (jet.spreading * (s - jet.origin) * width);
        jet.centreline
            / (s - jet.origin)
            / (1.0 + (std::f64::consts::SQRT_2 - 1.0) * xi * xi).powi(2)
    };
    (0..4000)
        .map(|i| {
            let s = 2.5 + 12.0 * even(i, 0.1);
            let across = 3.0 * (2.0 * (i as f64 / 4000.0 + 0.37 * even(i / 7, 0.3)).fract() - 1.0);
            let simulated = speed(s, across.abs(), 1.0);
            Reading {
                s_over_l: s,
                across_over_l: across,
                recorded: speed(s, across.abs(), 1.1) + 0.04 * (even(i * i, 0.7) - 0.5),
                simulated,
                accuracy: 0.01 + 0.05 * simulated,
            }
        })
        .collect()
}

/// So many per cent around a value.
fn estimate(value: f64, percent: f64) -> Estimate {
    let reach = value.abs() * percent / 100.0;
    Estimate {
        value,
        interval: Interval {
            low: value - reach,
            high: value + reach,
        },
    }
}

/// Five drones with six slices and two near-field slices each; two of them beside the fit.
fn calibration() -> Calibration {
    let jet = Jet::default();
    let slice = |drone: usize, i: usize| {
        let s_over_l = 2.6 + 0.4 * (drone + 5 * i) as f64;
        let sigma = s_over_l - jet.origin;
        let off = 1.0 + 0.1 * (even(drone + 5 * i, 0.0) - 0.5);
        Profile {
            s_from: s_over_l - 0.2,
            s_to: s_over_l + 0.2,
            s_over_l,
            bins: Vec::new(),
            fit: Some(SliceFit {
                centreline: estimate(jet.centreline / sigma, 4.0),
                half_width: estimate(jet.spreading * sigma * off, 5.0),
            }),
        }
    };
    let lobe = |i: usize| Lobes {
        s_over_l: 0.4 * (i + 1) as f64,
        delta: estimate(0.36 - 0.05 * i as f64, 15.0),
        width: 0.2,
        peak: 1.5,
        samples: 100,
    };
    let names = [
        "kolibri",
        "offboard-1",
        "matrice-300",
        "mavic-3e",
        "elios-3",
    ];
    let drones = names.iter().enumerate().map(|(drone, name)| DroneFit {
        airframe: (*name).to_owned(),
        in_fit: drone < 3,
        induced_velocity_mps: 7.4,
        motor_distance_m: 0.12,
        flights: 1,
        samples: 1000,
        profiles: (0..6).map(|i| slice(drone, i)).collect(),
        lobes: (0..2).map(lobe).collect(),
        lobes_merge_s_over_l: None,
        departures: Vec::new(),
    });
    let centreline = estimate(jet.centreline, 2.0);
    Calibration {
        jet: FittedJet {
            centreline,
            spreading: estimate(0.074, 3.0),
            origin: estimate(jet.origin, 4.0),
            correlation: Correlation {
                centreline_spreading: 0.3,
                centreline_origin: -0.8,
                spreading_origin: 0.2,
            },
            resampling: Resampling {
                unit: Unit::Flight,
                units: 5,
                block_s: None,
            },
            centreline_if_one_gain: centreline.interval,
            gains: Vec::new(),
        },
        goodness: Goodness {
            verdict: Verdict::Fits,
            p: 0.5,
            rms_over_centreline: 0.01,
            regions: Vec::new(),
            sentence: String::new(),
        },
        drones: drones.collect(),
        residual_tests: ResidualTests {
            through_operator: Vec::new(),
            scalar_subtracted: Vec::new(),
            caveats: Vec::new(),
        },
        counts: Counts::default(),
        recordings: Vec::new(),
        caveats: Vec::new(),
    }
}

/// A minute of one drone below another.
fn samples(phase: f64) -> Vec<Sample> {
    let sample = |row: usize| {
        let t_s = row as f64 / 50.0;
        let simulated = -0.1 * (0.5 * t_s + phase).sin().max(0.0);
        Sample {
            channel: Channel::VerticalForce,
            row,
            t_s,
            subject: 0,
            position_m: Point3::origin(),
            recorded: simulated * 1.1 + 0.03 * (even(row, 0.4) - 0.5),
            simulated,
            air_mps: 1.0,
            place: None,
        }
    };
    (0..3000).map(sample).collect()
}

fn expansion_of(found: &Calibration) -> Option<String> {
    expansion::draw(&Expansion {
        title: ("Expansion", "five drones"),
        found,
        jet: (&found.jet.jet(), "fit"),
        has_band: true,
        other: (&Jet::default(), "the paper"),
    })
}

fn signature_of(readings: &[Reading]) -> Option<String> {
    let of = |value: fn(&Reading) -> f64| -> Vec<f64> { readings.iter().map(value).collect() };
    let before = of(|reading| reading.recorded - reading.simulated);
    let mismatch = Mismatch {
        after: before.clone(),
        before,
        law: of(|reading| 0.1 * reading.simulated),
    };
    let (depths, distances) = (
        of(|reading| reading.s_over_l),
        of(|reading| reading.across_over_l),
    );
    let coordinates = [("depth", &depths[..]), ("distance", &distances[..])];
    let words = ("recorded - simulated (m/s)", Some("law"));
    signature::draw(
        ("Signature", "two coordinates"),
        words,
        &coordinates,
        &mismatch,
    )
}

fn before_and_after(readings: &[Reading]) -> Option<String> {
    let jet = Jet::default();
    let mut map = ResidualMap::of_readings(("Before", "after"), ("U_H", "noise"), readings, &jet);
    let after = map.panels[0].1.iter().map(|residual| 0.1 * residual);
    map.panels.push(("after", after.collect()));
    let inside = readings.iter().map(|reading| reading.s_over_l < 6.0);
    map.above = Above::Region(inside.collect());
    map.draw()
}

fn all() -> Vec<(&'static str, String)> {
    let jet = Jet::default();
    let (readings, found) = (readings(), calibration());
    let (low, lower) = (samples(0.0), samples(1.0));
    let traces = [("low", &low), ("lower", &lower)].map(|(name, samples)| Trace {
        name: name.to_owned(),
        samples: samples.iter().collect(),
    });
    let pairs: Vec<(f64, f64)> = low
        .iter()
        .map(|one| (one.recorded, one.simulated))
        .collect();
    let words = Words {
        title: ("Radial profiles", "kolibri, U_H = 7.41 m/s"),
        x: "r / l",
        y: "speed / U_H",
        marks: &["<recorded>"],
        curve: "simulated",
    };
    let unit = ("U_H", "the accuracy");
    let figures = [
        (
            "field",
            field::draw(("Field", "kolibri"), &readings, &jet, false),
        ),
        (
            "residuals",
            ResidualMap::of_readings(("Residuals", "a & b"), unit, &readings, &jet).draw(),
        ),
        ("before-after", before_and_after(&readings)),
        (
            "profiles",
            profiles::draw(&words, &profiles::of_slices(&readings, 6, 14)),
        ),
        ("expansion", expansion_of(&found)),
        (
            "near-field",
            expansion::near_field(("Near field", "five drones"), &found.drones),
        ),
        ("signature", signature_of(&readings)),
        (
            "agreement",
            agreement::before_and_after(
                ("Force", "both"),
                "force (N)",
                [("a", &pairs), ("b", &pairs[..300])],
            ),
        ),
        (
            "receiver",
            agreement::over_time(("Force", "two drones"), "vertical force (N)", &traces),
        ),
    ];
    figures
        .into_iter()
        .map(|(name, svg)| (name, svg.expect(name)))
        .collect()
}

#[test]
fn every_figure_is_well_formed_small_and_the_same_twice() {
    for ((name, svg), (_, again)) in all().into_iter().zip(all()) {
        assert_eq!(svg, again, "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        assert!(
            svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"),
            "{name}"
        );
        assert!(svg.contains("<title>") && svg.contains("<desc>"), "{name}");
        for tag in ["text", "g"] {
            let opened = svg.matches(&format!("<{tag} ")).count();
            assert_eq!(opened, svg.matches(&format!("</{tag}>")).count(), "{name}");
        }
        assert!(svg.len() < 130_000, "{name}: {} bytes", svg.len());
    }
}

#[test]
fn what_a_person_wrote_is_escaped() {
    let found = all();
    let of = |wanted: &str| {
        let figure = found.iter().find(|(name, _)| *name == wanted);
        &figure.expect("drawn").1
    };
    assert!(of("residuals").contains("<desc>a &amp; b</desc>"));
    assert!(of("profiles").contains("&lt;recorded&gt;"));
}

#[test]
fn without_readings_there_is_no_figure() {
    let jet = Jet::default();
    assert!(field::draw(("", ""), &[], &jet, false).is_none());
    assert!(
        ResidualMap::of_readings(("", ""), ("", ""), &[], &jet)
            .draw()
            .is_none()
    );
    assert!(agreement::over_time(("", ""), "", &[]).is_none());
    assert!(expansion::near_field(("", ""), &[]).is_none());
}
