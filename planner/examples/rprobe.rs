use std::time::Instant;
use planner::prepare::*;
use planner::{Control, Outcome};
fn main() {
    let n: usize = std::env::args().nth(1).map_or(500, |s| s.parse().unwrap());
    let kind = std::env::args().nth(2).unwrap_or("hall".into());
    let text = if kind == "hall" { planner::instances::hall(n, 1) } else { planner::instances::warehouse(n, 1) }.unwrap();
    let world = planner::scenario::read_world(&text, &|f| Err(f.to_owned())).unwrap();
    let t = Instant::now(); let job = prepare(&world); println!("prepare {:?}", t.elapsed());
    let t = Instant::now(); let c = empty_costmap(&world, job.roadmap.lattice(), true); println!("empty_costmap {:?}", t.elapsed());
    let mut effort = planner::outcome::Effort::default();
    let t = Instant::now(); let paths = planner::priority::plan_fleet(&job, &c, &[], &world.planning, &Control::QUIET, &mut effort); println!("plan_fleet {:?} {:?} stranded {}", t.elapsed(), effort, paths.stranded.len());
    let t = Instant::now(); let mut d = c.clone(); println!("clone empty {:?}", t.elapsed());
    let t = Instant::now(); for p in paths.paths.iter().flatten() { d.insert(p.legs.clone()); } println!("insert all {:?}", t.elapsed());
    let at = costmap::leg::Tick(1000);
    let mut d = c.clone();
    let t = Instant::now(); for p in paths.paths.iter().flatten() { d.insert(p.legs.iter().filter(|l| l.end > at).copied().collect()); } println!("insert rest {:?}", t.elapsed());
    let t = Instant::now(); let e = d.clone(); println!("clone full {:?} {}", t.elapsed(), e.horizon().0);
    let t = Instant::now(); let plan = planner::assemble::assemble(&world, &job, &paths); println!("assemble {:?}", t.elapsed());
    let t = Instant::now(); let r = planner::verify::verify(&plan); println!("verify {:?} {}", t.elapsed(), r.violations.len());
    let _ = Outcome::Stopped;
}
