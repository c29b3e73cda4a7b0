//! Development only.
use diagnosis::prove::{self, marks};
use diagnosis::read;
use std::collections::BTreeMap;
fn main() {
    let root = std::env::args().nth(1).unwrap();
    if root == "case" {
        let seed: u64 = std::env::args().nth(2).unwrap().parse().unwrap();
        let index: usize = std::env::args().nth(3).unwrap().parse().unwrap();
        let c = prove::case(seed, index);
        let f = diagnosis::diagnose::diagnose(&c.recording).unwrap();
        let a = prove::answer(&f);
        let t = c.truth.open(&a);
        println!(
            "{} effects {:?} chi2 {} region {}",
            t.family,
            t.effects,
            t.oracle_chi2,
            t.region.len()
        );
        println!("{:?} {:?}", f.verdict, f.effects);
        for i in (0..t.truth_clean.len()).step_by(t.truth_clean.len() / 25) {
            let y = c
                .recording
                .probes
                .as_ref()
                .map_or(f64::NAN, |p| p.samples[i].speed_mps);
            println!(
                "   {i} recorded {y:.3} truth {:.3} baseline {:.3} noise {:.3} ours {:.3}",
                t.truth_clean[i], t.baseline_clean[i], t.noise[i], f.prediction[i]
            );
        }
        println!("{:?}", diagnosis::actuation::actuation(&c.recording));
        println!(
            "{:?} region {} {}",
            f.held_out, f.region.share, f.region.description
        );
        println!("ADVICE {:?}", f.advice);
        for r in f.candidates.iter().take(8) {
            println!("  {:?}", r);
        }
        return;
    }
    if root == "merging" {
        let seed: u64 = std::env::args().nth(2).unwrap().parse().unwrap();
        let index: usize = std::env::args().nth(3).unwrap().parse().unwrap();
        let c = prove::case(seed, index);
        let t = c.truth.open(&prove::Answer::nothing());
        let o = diagnosis::observed::Observed::new(&c.recording).unwrap();
        println!("{:?} {:?}", t.effects, c.recording.baseline);
        for q in [1.0, 1.2, 1.4, 1.5, 1.6, 1.7, 1.7715, 1.9, 2.0] {
            let mut h = diagnosis::hypothesis::Hypothesis::default();
            h.effects.jet_merging = Some(airflow::effects::JetMerging { exponent: q });
            let p = o.predict(&h);
            let e: f64 = p
                .iter()
                .zip(&o.samples)
                .map(|(f, s)| ((f - t.truth_clean[s.row]) / t.noise[s.row]).powi(2))
                .sum();
            println!("{q} {e}");
        }
        let mut h = diagnosis::hypothesis::Hypothesis::default();
        h.effects.jet_merging = Some(airflow::effects::JetMerging { exponent: 1.7715 });
        let p = o.predict(&h);
        for i in (0..p.len()).step_by(p.len() / 40) {
            let s = &o.samples[i];
            println!(
                "{:.3} truth {:.3} base {:.3} ours0 {:.3} {:?} {:.2}",
                p[i], t.truth_clean[s.row], t.baseline_clean[s.row], s.simulated,
                s.place.map(|p| (p.s_over_l, p.xi)),
                o.covariate("second jet/first").unwrap()[i]
            );
        }
        return;
    }
    if root == "one" {
        let dir = std::env::args().nth(2).unwrap();
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
        let recording = read::read_folder("x", &files).unwrap();
        let f = diagnosis::diagnose::diagnose(&recording).unwrap();
        println!("{:?} {:?} chance {}", f.verdict, f.effects, f.chance);
        println!("{:?}", f.held_out);
        for r in f.candidates.iter().take(12) {
            println!("  {:?}", r);
        }
        return;
    }
    if root == "prove" {
        let seed: u64 = std::env::args().nth(2).unwrap().parse().unwrap();
        let count: usize = std::env::args().nth(3).unwrap().parse().unwrap();
        use rayon::prelude::*;
        let from: usize = std::env::args().nth(4).map_or(0, |x| x.parse().unwrap());
        let all: Vec<_> = (from..from + count)
            .into_par_iter()
            .map(|i| {
                let c = prove::case(seed, i);
                let t = std::time::Instant::now();
                let f = diagnosis::diagnose::diagnose(&c.recording);
                let mut a = f
                    .as_ref()
                    .map_or_else(|_| prove::Answer::nothing(), prove::answer);
                a.seconds = t.elapsed().as_secs_f64();
                let notes = f.map_or(String::new(), |f| {
                    format!("p {:.1e} {}", f.chance, f.advice.join(" "))
                });
                let t = c.truth.open(&a);
                let mut notes = notes;
                for e in &t.effects {
                    for (k, v) in &e.parameters {
                        for n in &a.effects {
                            if n.name == e.name
                                && let Some(i) = n.parameters.get(k)
                                && !(i.low..=i.high).contains(v)
                            {
                                notes += &format!(
                                    " MISS {}.{k} true {v:.4} est {:.4} [{:.4} {:.4}] z {:.1} rel {:.3}",
                                    e.name,
                                    i.value,
                                    i.low,
                                    i.high,
                                    (i.value - v) / (i.high - i.value) * 1.96,
                                    i.value / v
                                );
                            }
                        }
                    }
                }
                (marks::Marked::of(&t, &a), notes)
            })
            .collect();
        let (cases, notes): (Vec<_>, Vec<_>) = all.into_iter().unzip();
        let m = marks::Marks::over(cases);
        println!("{}", m.table());
        for (i, c) in m.cases.iter().enumerate() {
            let _ = &notes[i];
            if true
                || (c.truth == "none" && c.detected)
                || (c.truth != "none" && c.oracle_chi2 > 25.0 && !c.named)
                || c.spurious
                || c.skill.is_some_and(|s| s < 0.8)
                || c.location.is_some_and(|l| l < 0.6)
            {
                println!(
                    "{i:3} {:34} truth {:34} answered {:44} chi2 {:9.0} set {} loc {:.2} skill {:.2} n {} {:.1}s named {} cover {:?} | {}",
                    c.family,
                    c.truth,
                    c.answered,
                    c.oracle_chi2,
                    c.in_set,
                    c.location.unwrap_or(f64::NAN),
                    c.skill.unwrap_or(f64::NAN),
                    c.samples,
                    c.seconds,
                    c.named,
                    c.covered,
                    notes[i]
                );
            }
        }
        return;
    }
    let mut dirs: Vec<_> = std::fs::read_dir(&root)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.join("meta.json").exists())
        .collect();
    dirs.sort();
    let mut all = Vec::new();
    for dir in dirs {
        let id = dir.file_name().unwrap().to_str().unwrap().to_owned();
        let text = std::fs::read_to_string(format!("{root}/truth/{id}.json")).unwrap();
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
        let t = std::time::Instant::now();
        let finding = diagnosis::diagnose::diagnose(&recording).unwrap();
        let mut a = prove::answer(&finding);
        a.seconds = t.elapsed().as_secs_f64();
        let c = marks::Marked::of(
            &marks::practice(&text, recording.probes.is_none()).unwrap(),
            &a,
        );
        println!(
            "{id} {:26} answered {:36} alt {:?} named {} loc {:.2} skill {:.3} cover {:?} {:.1}s | before {:.3} after {:.3} [{:.3} {:.3}] floor {:.3}",
            c.family,
            c.answered,
            a.effects
                .iter()
                .map(|e| e.alternatives.clone())
                .collect::<Vec<_>>(),
            c.named,
            c.location.unwrap_or(f64::NAN),
            c.skill.unwrap_or(f64::NAN),
            c.covered,
            c.seconds,
            finding.held_out.rms_before,
            finding.held_out.rms_after,
            finding.held_out.rms_after_low,
            finding.held_out.rms_after_high,
            finding.held_out.noise_floor
        );
        all.push(c);
    }
    println!("{}", marks::Marks::over(all).table());
}
