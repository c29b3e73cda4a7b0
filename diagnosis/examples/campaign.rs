//! scratch
use std::io::Read;
use diagnosis::campaign::*;
fn main() {
    let root = std::path::PathBuf::from("/work/shared/recordings/neural_swarm2/flights");
    let text = std::fs::read_to_string("/work/wt/real/recordings/neural_swarm2.ron").unwrap();
    let campaign = diagnosis::read::Campaign::parse("m", &text).unwrap();
    let mut paths: Vec<_> = std::fs::read_dir(&root).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    let t0 = std::time::Instant::now();
    let recordings: Vec<_> = paths.iter().filter_map(|p| {
        let mut bytes = Vec::new();
        flate2::read::GzDecoder::new(std::fs::File::open(p).unwrap()).read_to_end(&mut bytes).unwrap();
        let name = p.file_name().unwrap().to_string_lossy().replace(".csv.gz", "");
        diagnosis::read::read_flight(&name, &name, &bytes, &campaign).map_err(|e| eprintln!("{name}: {e:?}")).ok()
    }).collect();
    eprintln!("read {} in {:?}", recordings.len(), t0.elapsed());
    let which = std::env::args().nth(1).unwrap();
    let rows: usize = std::env::args().nth(2).map_or(6000, |s| s.parse().unwrap());
    let mut options = CampaignOptions { most_rows: rows, ..CampaignOptions::default() };
    match which.as_str() {
        "alone" => options.alone = true,
        "jet" => {}
        "floor" => options.judge = near_floor(&recordings),
        _ => panic!(),
    }
    let t0 = std::time::Instant::now();
    let f = diagnose_campaign(&recordings, &options).unwrap();
    eprintln!("{:?}", t0.elapsed());
    println!("flights {} rows {} scatter {:?} flex {:?} +- {}", f.flights, f.finding.samples, f.scatter, f.flexible_gain, f.flexible_gain_error);
    println!("located {:?}", f.located);
    println!("region {} share {:.3} mean {:.4} N over noise {:.2}", f.finding.region.description, f.finding.region.share, f.finding.region.mean_error, f.finding.region.error_over_noise);
    for r in &f.finding.candidates { println!("  {:22} {:9.1} +- {:7.1} {} {:?}", r.name, r.gain, r.gain_error, r.practical, r.parameters); }
    for t in &f.taken { println!("TAKEN {t:?}"); }
    for e in &f.finding.effects { println!("EFFECT {} alt {:?} {:?}", e.name, e.alternatives, e.parameters); }
    for s in &f.skills { println!("{s:?}"); }
    for c in &f.curves { println!("{}", c.along); for i in 0..c.bins.len() { println!("   {:?} n {} rec {:6.2} before {:6.2} after {:6.2} +- {:.2} g", c.bins[i], c.rows[i], c.recorded_n[i]/0.00981, c.before_n[i]/0.00981, c.after_n[i]/0.00981, c.error_n[i]/0.00981); } }
}
