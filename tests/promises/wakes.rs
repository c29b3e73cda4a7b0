//! Several wakes at once, where they end, and what a payload or another frame changes.

use airflow::{Airframe, Jet, Source, Superposition, Wake, axial_speed_mps, mean_over_discs_mps};
use nalgebra::{Point3, Vector3};

use crate::hover::{DENSITY_KG_PER_M3, airframe, wake};

#[test]
fn sums_of_wakes_keep_their_order_and_agree_with_one_wake_alone() {
    let (upper, beside) = (wake("offboard-2"), wake("kolibri"));
    let sources = [
        Source {
            wake: &upper,
            position_m: Point3::new(0.0, 0.0, 8.0),
            ends_at_z_m: 0.0,
        },
        Source {
            wake: &beside,
            position_m: Point3::new(0.4, 0.1, 7.0),
            ends_at_z_m: 0.0,
        },
    ];
    let point_m = Point3::new(0.2, 0.0, 5.0);
    let [momentum, linear, strongest] =
        Superposition::ALL.map(|way| axial_speed_mps(&sources, point_m, way));
    let alone: Vec<f64> = sources
        .iter()
        .map(|s| s.wake.axial_speed_mps(point_m - s.position_m))
        .collect();
    // Rounding of two terms.
    assert!((momentum - alone[0].hypot(alone[1])).abs() < 1e-14);
    assert!((linear - (alone[0] + alone[1])).abs() < 1e-14);
    assert_eq!(strongest, alone[0].max(alone[1]));
    assert!(strongest < momentum && momentum < linear);
    for way in Superposition::ALL {
        assert_eq!(way.as_str().parse(), Ok(way));
    }
    assert!("rss".parse::<Superposition>().is_err());
}

#[test]
fn a_wake_is_felt_at_its_end_and_not_below_and_never_in_or_above_the_rotor_plane() {
    let wake = wake("offboard-2");
    let sources = [Source {
        wake: &wake,
        position_m: Point3::new(0.0, 0.0, 5.0),
        ends_at_z_m: 2.0,
    }];
    let met = |z_m: f64| {
        axial_speed_mps(
            &sources,
            Point3::new(0.0, 0.1, z_m),
            Superposition::Momentum,
        )
    };
    assert!(met(2.0) > 0.0 && met(2.0 - 5e-7) > 0.0 && met(4.9) > 0.0);
    for z_m in [1.999_99, 0.0, 5.0, 5.0 - 5e-7, 5.1] {
        assert_eq!(met(z_m), 0.0, "at {z_m} m");
    }
}

#[test]
fn the_mean_over_discs_is_the_weighted_mean_of_the_summed_air() {
    let (upper, beside) = (wake("offboard-2"), wake("matrice-300"));
    let sources = [
        Source {
            wake: &upper,
            position_m: Point3::new(0.1, 0.0, 8.0),
            ends_at_z_m: 0.0,
        },
        Source {
            wake: &beside,
            position_m: Point3::new(0.9, 0.4, 6.5),
            ends_at_z_m: 0.0,
        },
    ];
    // Eight rotors hold more points than are summed at a time.
    let octocopter = Airframe::new("octo", 9.0, 8, 0.3, 1.0, 1.0).expect("valid");
    for discs in [airframe("kolibri").disc_points(), octocopter.disc_points()] {
        for centre_m in [Point3::new(0.0, 0.0, 5.0), Point3::new(1.0, 0.4, 6.0)] {
            for way in Superposition::ALL {
                let by_hand: f64 = discs
                    .offsets_m
                    .iter()
                    .zip(&discs.weights)
                    .map(|(o, w)| {
                        w * axial_speed_mps(&sources, centre_m + Vector3::new(o[0], o[1], 0.0), way)
                    })
                    .sum();
                let ours = mean_over_discs_mps(&sources, &discs, centre_m, way);
                assert!((ours - by_hand).abs() < 1e-13, "{ours} and {by_hand} m/s"); // rounding of 56 terms
            }
        }
    }
}

#[test]
fn a_payload_changes_the_speeds_and_nothing_else() {
    let airframe = airframe("offboard-1");
    let bare = wake("offboard-1");
    let loaded = Wake::new(
        &airframe,
        4.0 * airframe.mass_kg(),
        DENSITY_KG_PER_M3,
        &Jet::default(),
    );
    let again = bare.with_mass(4.0 * airframe.mass_kg());
    let offsets_m: Vec<Vector3<f64>> = (0..40)
        .map(|i| Vector3::new(0.01 * f64::from(i), -0.05, 0.05 - 0.04 * f64::from(i)))
        .collect();
    for offset_m in &offsets_m {
        let speed_mps = loaded.axial_speed_mps(*offset_m);
        assert_eq!(again.axial_speed_mps(*offset_m), speed_mps);
        // Four times the mass, twice the speed; rounding.
        assert!((speed_mps - 2.0 * bare.axial_speed_mps(*offset_m)).abs() < 1e-13);
    }
}

#[test]
fn frames_without_a_near_field_model_hold_the_far_field_up_to_the_rotor_plane() {
    let hexacopter = Airframe::new("hexa", 3.0, 6, 0.25, 0.6, 1.0).expect("valid");
    assert!(!hexacopter.has_near_field_model() && airframe("kolibri").has_near_field_model());
    let wake = Wake::new(&hexacopter, 3.0, DENSITY_KG_PER_M3, &Jet::default());
    let depth_m = wake.near_field_depth_m();
    let at = |r_m: f64, depth_m: f64| wake.axial_speed_mps(Vector3::new(r_m, 0.0, -depth_m));
    for r_m in [0.0, 0.2, 0.5, 2.0] {
        assert_eq!(at(r_m, 1e-9), at(r_m, depth_m));
        assert_eq!(at(r_m, 0.0), 0.0);
    }
    let held = wake.velocity_mps(Vector3::new(0.3, 0.0, -0.5 * depth_m));
    assert_eq!((held.x, held.y), (0.0, 0.0));
}
