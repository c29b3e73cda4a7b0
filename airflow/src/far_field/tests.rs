use super::*;

#[test]
fn air_below_offboard_1_takes_half_a_second_over_three_metres() {
    // U_H = 6.66 m/s; 0.51 s by the closed form, against the sum of ds/U_C.
    let jet = FarField::new(6.66, 0.266, 1.0, &Jet::default());
    let closed_s = jet.transport_time_s(3.0, 1.0);
    assert!((closed_s - 0.51).abs() < 0.005, "{closed_s}");
    let extrapolated = jet.extrapolated();
    let speed_mps = |s_m| {
        extrapolated
            .centreline_mps(s_m)
            .expect("evaluated anywhere")
    };
    let summed_s: f64 = (0..3000)
        .map(|i| 0.001 / speed_mps((f64::from(i) + 0.5) * 0.001))
        .sum();
    assert!(
        (closed_s - summed_s).abs() < 1e-6,
        "midpoint rule: {summed_s}"
    );
}

#[test]
fn a_jet_is_carried_down_as_fast_whatever_its_width() {
    let [narrow, wide] = [0.9, 1.15].map(|q| FarField::new(9.66, 0.266, q, &Jet::default()));
    assert_eq!(
        narrow.transport_time_s(3.0, 0.6),
        wide.transport_time_s(3.0, 0.6)
    );
}

#[test]
fn air_has_come_down_by_the_depth_that_takes_it_so_long() {
    let jet = jet();
    for depth_m in [0.0, 1e-6, 0.4, 3.0, 40.0] {
        for convection in [0.6, 1.0] {
            let time_s = jet.transport_time_s(depth_m, convection);
            // The square of the depth and its origin cancels in the time.
            let back_m = jet.transported_m(time_s, convection);
            assert!(
                (back_m - depth_m).abs() < 1e-12 * (1.0 + depth_m),
                "{back_m}"
            );
        }
    }
}

#[test]
fn extrapolated_it_is_the_same_formula_up_to_the_rotor_plane() {
    let (held, extrapolated) = (jet(), jet().extrapolated());
    assert_eq!(
        held.axial_speed_mps(1.0, 0.1),
        extrapolated.axial_speed_mps(1.0, 0.1)
    );
    assert_eq!(held.centreline_mps(0.1), None);
    // U_C/U_H = B/(q (1 - s₀)) one motor distance down
    let expected_mps = 9.66 * 10.11 / (1.15 * 6.817);
    let found_mps = extrapolated
        .centreline_mps(0.266)
        .expect("evaluated anywhere");
    assert!((found_mps - expected_mps).abs() < 1e-9, "{found_mps}");
    assert_eq!(extrapolated.centreline_mps(0.0), None);
}

/// Offboard 2 with propellers canted outwards, so that no formula can forget the width factor.
fn jet() -> FarField {
    FarField::new(9.66, 0.266, 1.15, &Jet::default())
}

const DEPTHS_M: [f64; 3] = [0.7, 2.0, 9.0];
const XIS: [f64; 6] = [0.0, 0.4, 0.695, 1.0, 1.6, 4.0];

fn points() -> impl Iterator<Item = (f64, f64)> {
    let radius_m = |s: f64, xi: f64| xi * jet().half_width_m(s).expect("deep");
    DEPTHS_M
        .into_iter()
        .flat_map(move |s| XIS.into_iter().map(move |xi| (s, radius_m(s, xi))))
}

#[test]
fn the_rational_form_is_the_papers_profile() {
    for (s, r) in points() {
        let centreline_mps = jet().centreline_mps(s).expect("deep");
        let xi = r / jet().half_width_m(s).expect("deep");
        let paper_mps = centreline_mps / (1.0 + PROFILE_A * xi * xi).powi(2);
        // Rounding.
        assert!((jet().axial_speed_mps(s, r).expect("deep") / paper_mps - 1.0).abs() < 1e-14);
    }
}

#[test]
fn no_gradient_is_steeper_over_its_speed_than_the_bound() {
    for s in DEPTHS_M {
        let bound_per_m = jet().steepest_over_speed_per_m(s).expect("deep");
        let half_width_m = jet().half_width_m(s).expect("deep");
        for r in (0..1000).map(|i| 0.01 * f64::from(i) * half_width_m) {
            let speed = |s: f64, r: f64| jet().axial_speed_mps(s, r).expect("deep");
            let h = 1e-5; // m
            let across = (speed(s, r + h) - speed(s, r - h)) / (2.0 * h);
            let along = (speed(s + h, r) - speed(s - h, r)) / (2.0 * h);
            // Speeds near 10 m/s: rounding leaves 1e-10, the third derivative (1e4 at most) times
            // h² 1e-6.
            assert!(across.hypot(along) <= bound_per_m * speed(s, r) + 2e-6);
        }
    }
}

#[test]
fn momentum_through_a_plane_is_the_integral_of_the_profile() {
    let s = 2.0;
    let half_width_m = jet().half_width_m(s).expect("deep");
    // Midpoints in t = ξ²/(1 + ξ²) bring the whole plane into 0..1: error of order 1/n².
    let n = 20_000;
    let over = |t: f64| {
        let xi2 = t / (1.0 - t);
        let speed_mps = jet()
            .axial_speed_mps(s, half_width_m * xi2.sqrt())
            .expect("deep");
        speed_mps.powi(2) / ((1.0 - t) * (1.0 - t))
    };
    let sum: f64 = (0..n)
        .map(|i| over((f64::from(i) + 0.5) / f64::from(n)))
        .sum();
    let integral = PI * half_width_m * half_width_m * sum / f64::from(n);
    assert!((integral / jet().momentum_flux_m4_per_s2() - 1.0).abs() < 1e-7);
}

#[test]
fn the_mean_over_a_centred_disc_is_that_of_a_quadrature() {
    for s in DEPTHS_M {
        for disc_m in [0.01, 0.13, 1.0] {
            let n = 4000; // equal areas, midpoints: error of order 1/n²
            let mean: f64 = (0..n)
                .map(|i| disc_m * ((f64::from(i) + 0.5) / f64::from(n)).sqrt())
                .map(|r| jet().axial_speed_mps(s, r).expect("deep"))
                .sum::<f64>()
                / f64::from(n);
            assert!(
                (2.0 * jet().stream_over_radius2_mps(s, disc_m * disc_m) / mean - 1.0).abs() < 1e-6
            );
        }
    }
}

#[test]
fn the_iso_speed_volume_is_where_the_speed_is_met_and_ends_where_the_axis_meets_it() {
    for s in DEPTHS_M {
        for share in [0.999, 0.5, 0.03] {
            let speed_mps = share * jet().centreline_mps(s).expect("deep");
            let radius_m = jet()
                .radius_at_speed_m(s, speed_mps)
                .expect("slower than the axis");
            // The root of √(U_C/U) - 1 loses three digits at 0.999.
            assert!(
                (jet().axial_speed_mps(s, radius_m).expect("deep") / speed_mps - 1.0).abs() < 1e-12
            );
        }
        let axis_mps = jet().centreline_mps(s).expect("deep");
        assert_eq!(jet().radius_at_speed_m(s, 1.001 * axis_mps), None);
        assert!((jet().iso_speed_end_m(axis_mps).expect("reached") - s).abs() < 1e-13 * s.max(1.5));
    }
    assert_eq!(jet().iso_speed_end_m(20.0), None);
    assert_eq!(jet().iso_speed_end_m(0.0), Some(f64::INFINITY));
}

#[test]
fn no_straight_path_is_bent_more_than_the_bound() {
    let h = 1e-4; // m
    for (s, r) in points() {
        let bound_per_m2 = jet().bent_over_speed_per_m2(s).expect("deep");
        for k in 0..16 {
            let (up, level) = (0.1 * f64::from(k)).sin_cos();
            for turn in [0.0, 0.6, 1.2, 1.571] {
                let at_mps = |path_m: f64| {
                    let (x, y) = (
                        r + path_m * level * f64::cos(turn),
                        path_m * level * f64::sin(turn),
                    );
                    jet()
                        .axial_speed_mps(s + path_m * up + 2.0 * h, x.hypot(y))
                        .expect("deep")
                };
                let [before, here, after] = [-h, 0.0, h].map(at_mps);
                let slope = (after - before) / (2.0 * h);
                let bent = (after - 2.0 * here + before) / (h * h);
                // Rounding of 10 m/s over h² leaves 1e-6 / s² or so.
                assert!(slope * slope / here + bent.abs() <= bound_per_m2 * here + 1e-5);
            }
        }
    }
}
