#[cfg(test)]
mod t {
    use super::super::*;
    use crate::made_up::*;
    fn e(n: &str, d: f64) -> f64 {
        std::env::var(n)
            .ok()
            .and_then(|s| s.parse().ok())
            .unwrap_or(d)
    }
    #[test]
    fn coverage_probe() {
        let n = e("REPEATS", 50.0) as u64;
        let per = e("PER", 4.0) as u64;
        let profile = [
            TrueProfile::Paper,
            TrueProfile::GaussianTail,
            TrueProfile::Gaussian,
            TrueProfile::TopHat,
        ][e("PROFILE", 0.0) as usize];
        let truth = [10.11, 0.07668, -5.817];
        let mut hit = [0; 3];
        let mut poor = 0;
        let mut p05 = 0;
        let mut sens = Vec::new();
        let mut tt = [0; 6];
        let mut ts = [0; 6];
        let mut norm = [0; 6];
        let mut tf = 0.0;
        let mut only_p = 0;
        for rep in 0..n {
            let mut recs = Vec::new();
            for (d, name) in ["kolibri", "offboard-1", "offboard-2", "matrice-300"]
                .iter()
                .enumerate()
            {
                let mut g = HoverGrid::over_one_probe(name).unwrap();
                g.jet.profile = profile;
                g.lateral_turbulence = e("LAT", 0.0);
                for f in 0..per {
                    recs.push(g.fly(rep * 1000 + d as u64 * 100 + f));
                }
            }
            let t1 = std::time::Instant::now();
            let c = calibrate(
                &recs,
                &Options {
                    lateral_turbulence: e("OLAT", 0.0),
                    draws: 999,
                    ..Options::default()
                },
            )
            .unwrap();
            tf += t1.elapsed().as_secs_f64();
            for (k, x) in [c.jet.centreline, c.jet.spreading, c.jet.origin]
                .iter()
                .enumerate()
            {
                if x.interval.low <= truth[k] && truth[k] <= x.interval.high {
                    hit[k] += 1;
                }
            }
            if c.goodness.verdict == Verdict::Poor {
                poor += 1;
            }
            if c.goodness.p < 0.05 {
                p05 += 1;
            }
            if c.goodness.p <= 0.01 {
                only_p += 1;
            }
            for (i, r) in c.residual_tests.through_operator.iter().enumerate() {
                if r.above_zero_corrected {
                    tt[i] += 1;
                }
                if r.p_normal.is_some_and(|p| p < 0.05) {
                    norm[i] += 1;
                }
            }
            for (i, r) in c.residual_tests.scalar_subtracted.iter().enumerate() {
                if r.above_zero_corrected {
                    ts[i] += 1;
                }
            }
            if rep < 3 {
                sens.push(c.goodness.sentence.clone());
            }
            if rep == 0 {
                println!("{:#?}", c.jet);
                for r in &c.residual_tests.through_operator {
                    println!("{r:?}");
                }
                for r in &c.residual_tests.scalar_subtracted {
                    println!("{r:?}");
                }
                for r in &c.goodness.regions {
                    println!("{r:?}");
                }
                for d in &c.drones {
                    println!("{} {}", d.airframe, d.profiles.len());
                    for p in &d.profiles {
                        println!(
                            "  {:.2} bins {} fit {:?}",
                            p.s_over_l,
                            p.bins.len(),
                            p.fit.map(|f| (f.centreline, f.half_width))
                        );
                    }
                }
                println!("json {}", serde_json::to_string(&c).unwrap().len());
            }
        }
        println!(
            "hit {:?} poor {poor} p05 {p05} p01 {only_p} of {n}; op {tt:?} scalar {ts:?} nonnormal {norm:?} t {:.2}",
            hit, tf
        );
        for s in sens {
            println!("{s}");
        }
    }
    #[test]
    fn lobes_probe() {
        let recs: Vec<_> = (0..4)
            .map(|i| HoverGrid::near_field("offboard-2").unwrap().fly(i))
            .chain((0..4).map(|i| HoverGrid::over_one_probe("offboard-2").unwrap().fly(i)))
            .collect();
        let c = calibrate(&recs, &Options::default()).unwrap();
        for l in &c.drones[0].lobes {
            println!(
                "{:?} truth {:.3}",
                l,
                0.3536 * (1.0 - l.s_over_l / 2.0).max(0.0)
            );
        }
        println!("{:?}", c.drones[0].lobes_merge_s_over_l);
    }
}
