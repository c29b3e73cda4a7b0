//! Every figure on made-up readings: well-formed, small, the same twice, and with nothing in it that is not a number.

use airflow::Jet;

use super::expansion::{Expansion, ExpansionSlice, Uncertainty};
use super::near_field::Lobe;
use super::profiles::{Profile, ProfileSeries, Words};
use super::readings::{Reading, radial_slices};
use super::receiver::Trace;
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

fn drones() -> Vec<(String, bool)> {
    vec![
        ("kolibri".into(), false),
        ("offboard-1".into(), false),
        ("matrice-300".into(), false),
        ("mavic-3e".into(), true),
        ("elios-3".into(), true),
    ]
}

fn all() -> Vec<(&'static str, String)> {
    let jet = Jet::default();
    let readings = readings();
    let slices = radial_slices(&readings, 6, 14);
    let profiles: Vec<Profile> = slices
        .iter()
        .map(|slice| Profile {
            heading: format!("s = {:.1} to {:.1} l", slice.s_from, slice.s_to),
            series: vec![ProfileSeries {
                mark: 0,
                hollow: false,
                points: slice
                    .bins
                    .iter()
                    .map(|bin| (bin.r_over_l, bin.recorded))
                    .collect(),
            }],
            curve: slice
                .bins
                .iter()
                .map(|bin| (bin.r_over_l, bin.simulated))
                .collect(),
        })
        .collect();
    let marks = [("<recorded>".to_owned(), false)];
    let words = Words {
        title: "Radial profiles",
        subtitle: "kolibri, U_H = 7.41 m/s",
        x: "r / l",
        y: "speed / U_H",
        marks: &marks,
        curve: "simulated",
    };
    let slices: Vec<ExpansionSlice> = (0..30)
        .map(|i| {
            let s = 2.6 + 0.4 * f64::from(i);
            let half =
                jet.spreading * (s - jet.origin) * (1.0 + 0.1 * (even(i as usize, 0.0) - 0.5));
            let centre = jet.centreline / (s - jet.origin);
            ExpansionSlice {
                drone: i as usize % 5,
                s_over_l: s,
                half_width_over_l: half,
                centreline_over_u_h: centre,
                half_width_interval: Some((half * 0.95, half * 1.05)),
                centreline_interval: None,
            }
        })
        .collect();
    let lobes: Vec<Lobe> = (0..12)
        .map(|i| Lobe {
            drone: i % 5,
            s_over_l: 0.2 * (i + 1) as f64,
            delta_over_l: (0.36 - 0.02 * i as f64).max(0.0),
            interval: Some((0.3 - 0.02 * i as f64, 0.42 - 0.02 * i as f64)),
        })
        .collect();
    let trace = |name: &str, phase: f64| Trace {
        name: name.into(),
        moments: (0..3000)
            .map(|i| {
                let t = f64::from(i) / 50.0;
                let simulated = -0.1 * (0.5 * t + phase).sin().max(0.0);
                (
                    t,
                    simulated * 1.1 + 0.03 * (even(i as usize, 0.4) - 0.5),
                    simulated,
                )
            })
            .collect(),
    };
    vec![
        (
            "field",
            field::draw("Field", "kolibri", &readings, &jet, false).expect("readings"),
        ),
        (
            "residuals",
            residual_map::draw(
                "Residuals",
                "a & b",
                ("U_H", "the accuracy"),
                &readings,
                &jet,
            )
            .expect("readings"),
        ),
        (
            "profiles",
            profiles::draw(&words, &profiles).expect("profiles"),
        ),
        (
            "expansion",
            expansion::draw(&Expansion {
                title: "Expansion",
                subtitle: "five drones",
                drones: &drones(),
                slices: &slices,
                jet: (
                    &Jet {
                        spreading: 0.074,
                        ..jet
                    },
                    "fit",
                ),
                uncertainty: Some(&Uncertainty {
                    deviations: [0.1, 0.001, 0.1],
                    correlations: [0.3, -0.8, 0.2],
                }),
                other: Some((&jet, "the paper")),
            })
            .expect("slices"),
        ),
        (
            "near-field",
            near_field::draw("Near field", "five drones", &drones(), &lobes).expect("lobes"),
        ),
        (
            "receiver",
            receiver::draw(
                "Force",
                "two drones",
                "vertical force (N)",
                &[trace("low", 0.0), trace("lower", 1.0)],
            )
            .expect("traces"),
        ),
    ]
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
        assert_eq!(
            svg.matches("<text").count(),
            svg.matches("</text>").count(),
            "{name}"
        );
        assert!(svg.len() < 130_000, "{name}: {} bytes", svg.len());
    }
}

#[test]
fn what_a_person_wrote_is_escaped() {
    let found = all();
    let of = |wanted: &str| {
        &found
            .iter()
            .find(|(name, _)| *name == wanted)
            .expect("drawn")
            .1
    };
    assert!(of("residuals").contains("<desc>a &amp; b</desc>"));
    assert!(of("profiles").contains("&lt;recorded&gt;"));
}

#[test]
fn without_readings_there_is_no_figure() {
    let jet = Jet::default();
    assert!(field::draw("", "", &[], &jet, false).is_none());
    assert!(residual_map::draw("", "", ("", ""), &[], &jet).is_none());
    assert!(receiver::draw("", "", "", &[]).is_none());
    assert!(near_field::draw("", "", &[], &[]).is_none());
}
