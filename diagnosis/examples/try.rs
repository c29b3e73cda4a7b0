//! Development only.
use diagnosis::{candidates, fit, noise, observed::Observed, read};
use std::collections::BTreeMap;
fn main() {
    let root = std::env::args().nth(1).unwrap();
    let only = std::env::args().nth(2);
    let mut dirs: Vec<_> = std::fs::read_dir(&root)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.join("meta.json").exists())
        .collect();
    dirs.sort();
    for dir in dirs {
        let id = dir.file_name().unwrap().to_str().unwrap().to_owned();
        if only.as_ref().is_some_and(|o| !id.contains(o.as_str())) {
            continue;
        }
        let truth: serde_json::Value = serde_json::from_str(
            &std::fs::read_to_string(format!("{root}/truth/{id}.json")).unwrap(),
        )
        .unwrap();
        let files: BTreeMap<String, Vec<u8>> = std::fs::read_dir(&dir)
            .unwrap()
            .map(|e| {
                let p = e.unwrap().path();
                (
                    p.file_name().unwrap().to_str().unwrap().to_owned(),
                    std::fs::read(&p).unwrap(),
                )
            })
            .collect();
        let recording = read::read_folder(&id, &files).unwrap();
        let started = std::time::Instant::now();
        let observed = Observed::new(&recording).unwrap();
        let simulated = observed.simulated();
        // baseline check against truth
        let base: Vec<f64> = truth["baseline_clean"]
            .as_array()
            .map(|a| a.iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect())
            .unwrap_or_default();
        let worst = observed
            .samples
            .iter()
            .map(|s| (s.simulated - base.get(s.row).copied().unwrap_or(f64::NAN)).abs())
            .fold(0.0, f64::max);
        let noise = noise::noise(&observed, &simulated);
        let mut sds = noise.sd.clone();
        sds.sort_by(f64::total_cmp);
        let rho = noise.with_before.iter().copied().fold(0.0, f64::max);
        println!(
            "== {id} {} {} n {} blocks {} worst baseline difference {worst:.3} sd {:.3}..{:.3} rho {rho:.2}",
            truth["family"],
            truth["effects"],
            observed.samples.len(),
            noise.blocks,
            sds[0],
            sds[sds.len() - 1]
        );
        let setting = fit::Setting::new(&observed, &noise, Default::default());
        let null = setting.nothing();
        let null_elpd: f64 = fit::held_out(&setting, &[], &null, 6).iter().sum();
        println!(
            "   null cost/n {:.3} tol {:?}",
            null.cost / observed.samples.len() as f64,
            null.tolerance
        );
        let mut rows = Vec::new();
        for c in candidates::applicable(&observed) {
            let t = std::time::Instant::now();
            let f = setting.fit(&[&c], &c.starts).unwrap();
            let gain: f64 = fit::held_out(&setting, &[&c], &f, 6).iter().sum::<f64>() - null_elpd;
            rows.push((
                gain,
                format!(
                    "{:22} gain {:9.1} cost/n {:.3} {:?} tol [{:.3} {:.3}] size {:.1} {:.0} ms",
                    c.name,
                    gain,
                    f.cost / observed.samples.len() as f64,
                    f.values
                        .iter()
                        .map(|v| (v * 1e3).round() / 1e3)
                        .collect::<Vec<_>>(),
                    f.tolerance[0],
                    f.tolerance[1],
                    c.size(&f.values),
                    t.elapsed().as_secs_f64() * 1e3
                ),
            ));
        }
        rows.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, r) in rows.iter().take(6) {
            println!("   {r}");
        }
        println!("   total {:.2} s", started.elapsed().as_secs_f64());
    }
}
