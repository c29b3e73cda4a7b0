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
        let mut base = diagnosis::hypothesis::Hypothesis::default();
        let act = diagnosis::actuation::actuation(&recording);
        println!("   {act:?}");
        if let Some(f) = act.and_then(|a| a.found) {
            f.set(&mut base);
        }
        let simulated = observed.predict(&base);
        let noise = noise::noise(&observed, &simulated);
        let setting = fit::Setting::new(&observed, &noise, base);
        let cands = candidates::applicable(&observed);
        let sel = diagnosis::select::select(&setting, &cands);
        let n = observed.samples.len() as f64;
        println!(
            "   null cost/n {:.3} {:?}",
            sel.nothing.fit.cost / n,
            sel.nothing.fit.tolerance
        );
        for t in sel.singles.iter().take(4) {
            println!(
                "   {:20} gain {:.1} +- {:.1} cost/n {:.3} {:?}",
                cands[t.which[0]].name,
                t.gain.total,
                t.gain.error,
                t.fit.cost / n,
                t.fit.values
            );
        }
        println!(
            "   CHOSEN {:?} gain {:.1} +- {:.1} cost/n {:.3} {:?} alternatives {:?}",
            sel.chosen
                .which
                .iter()
                .map(|k| cands[*k].name)
                .collect::<Vec<_>>(),
            sel.chosen.gain.total,
            sel.chosen.gain.error,
            sel.chosen.fit.cost / n,
            sel.chosen.fit.values,
            sel.alternatives
                .iter()
                .map(|a| a.iter().map(|k| cands[*k].name).collect::<Vec<_>>())
                .collect::<Vec<_>>()
        );
        println!("   total {:.2} s", started.elapsed().as_secs_f64());
    }
}
