//! Other planners on the same instances: LaCAM3 (K. Okumura, "Engineering LaCAM*: towards
//! real-time, large-scale, and near-optimal multi-agent pathfinding", AAMAS 2024) and MAPF-LNS2
//! (J. Li et al., "MAPF-LNS2: fast repairing for multi-agent path finding via large neighborhood
//! search", AAAI 2022), where their programs are found.
//!
//! Both know the floor alone, in unit steps to four neighbours. Each drone is taken along their
//! path at its highest speed, and climbs evenly from its start's height to its goal's on the way;
//! the verifier judges that plan, in quasi-static air and without margins, which they do not keep.

use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use diagnosis::statistics::quantile::quantile;
use planner::plan::file;
use planner::{World, read_world, verify};
use serde::Serialize;
use serde_json::json;

use super::instance::Instance;
use super::row::Row;
use super::suite::Suite;
use crate::instances::{Grid, movingai};
use crate::table::{Table, cell, joined};

/// Time for one instance where none is named, chosen here: their papers allow 30 s and a minute.
const TIME_LIMIT: Duration = Duration::from_secs(60);

/// A planner that is not this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Peer {
    /// Its first solution, not refined (`--no-star`).
    #[serde(rename = "LaCAM3")]
    LaCam3,
    /// Its first solution, not improved (`--maxIterations=0`).
    #[serde(rename = "MAPF-LNS2")]
    Lns2,
}

/// One cell of the floor.
type Cell = [usize; 2];

impl Peer {
    const ALL: [Peer; 2] = [Peer::LaCam3, Peer::Lns2];

    fn name(self) -> &'static str {
        match self {
            Peer::LaCam3 => "LaCAM3",
            Peer::Lns2 => "MAPF-LNS2",
        }
    }

    /// What its program is called in the folder: `main` of LaCAM3 under that planner's name.
    fn program(self) -> &'static str {
        match self {
            Peer::LaCam3 => "lacam3",
            Peer::Lns2 => "lns",
        }
    }

    /// Told to solve `floor.map` and `floor.scen` in its working folder, and to write `paths.txt`
    /// there.
    fn words(self, one: &Instance, limit: Duration) -> Vec<String> {
        let agents = one.drones.to_string();
        let seconds = limit.as_secs_f64().ceil().to_string();
        let words: &[&str] = match self {
            Peer::LaCam3 => &[
                "-m",
                "floor.map",
                "-i",
                "floor.scen",
                "-N",
                &agents,
                "-t",
                &seconds,
                "-o",
                "paths.txt",
                "--no-star",
            ],
            Peer::Lns2 => &[
                "-m",
                "floor.map",
                "-a",
                "floor.scen",
                "-k",
                &agents,
                "-t",
                &seconds,
                "--maxIterations=0",
                "--outputPaths=paths.txt",
            ],
        };
        words.iter().map(|word| (*word).to_owned()).collect()
    }

    /// The path of each agent, a cell a step, from what it wrote.
    fn paths(self, text: &str) -> Result<Vec<Vec<Cell>>, String> {
        let mut paths: Vec<Vec<Cell>> = Vec::new();
        match self {
            // After `solution=`, a line a step: `3:(x,y),(x,y),`, a pair an agent.
            Peer::LaCam3 => {
                let lines = text.lines().skip_while(|line| *line != "solution=").skip(1);
                for (step, line) in lines.filter(|line| !line.is_empty()).enumerate() {
                    let cells = pairs(line.split_once(':').map_or("", |it| it.1))?;
                    paths.resize(cells.len().max(paths.len()), Vec::new());
                    if cells.len() != paths.len() {
                        return Err(format!("step {step} has {} cells", cells.len()));
                    }
                    for (path, cell) in paths.iter_mut().zip(cells) {
                        path.push(cell);
                    }
                }
            }
            // A line an agent: `Agent 3:(row,column)->(row,column)->`.
            Peer::Lns2 => {
                for line in text.lines().filter(|line| line.starts_with("Agent ")) {
                    let cells = pairs(line.split_once(':').map_or("", |it| it.1))?;
                    paths.push(
                        cells
                            .into_iter()
                            .map(|[row, column]| [column, row])
                            .collect(),
                    );
                }
            }
        }
        Ok(paths)
    }

    /// Solves an instance by its program in `folder`, in an empty folder of its own, `scratch`.
    fn solve(self, folder: &Path, scratch: &Path, one: &Instance) -> Result<PeerFigures, String> {
        let program = folder.join(self.program());
        let program = fs::canonicalize(program).map_err(|_| "not found".to_owned())?;
        let told = |error: &dyn std::fmt::Display| format!("not run: {error}");
        let grid = one
            .place
            .grid(one.drones, one.seed)
            .map_err(|it| told(&it))?;
        for (name, text) in &movingai(&grid)[..2] {
            let ending = name.rsplit('.').next().unwrap_or_default();
            let path = scratch.join(format!("floor.{ending}"));
            fs::write(path, text).map_err(|it| told(&it))?;
        }
        let limit = one.time_limit.unwrap_or(TIME_LIMIT);
        let begun = Instant::now();
        let status = Command::new(program)
            .args(self.words(one, limit))
            .current_dir(scratch)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .map_err(|it| told(&it))?;
        let time_s = begun.elapsed().as_secs_f64();
        let text = fs::read_to_string(scratch.join("paths.txt")).unwrap_or_default();
        let paths = self.paths(&text)?;
        if paths.len() != one.drones || paths.iter().any(Vec::is_empty) {
            return Err(format!("no plan after {time_s:.1} s ({status})"));
        }
        PeerFigures::of(&grid, one, &paths, time_s)
    }
}

/// Pairs of whole numbers in parentheses, whatever stands between them.
fn pairs(text: &str) -> Result<Vec<Cell>, String> {
    let inside = text.split('(').skip(1);
    let pair = |text: &str| {
        let (one, other) = text.split(')').next()?.split_once(',')?;
        Some([one.trim().parse().ok()?, other.trim().parse().ok()?])
    };
    inside
        .map(|text| pair(text).ok_or_else(|| format!("`({text}` is no cell")))
        .collect()
}

/// What came of an instance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PeerFigures {
    /// The whole process, reading included (s).
    pub time_s: f64,
    /// Steps until each agent rests at its goal, added up.
    pub sum_of_costs: u64,
    /// The same with no other agent there.
    pub sum_alone: u64,
    /// What the verifier finds in the plan that it makes of the drones, by kind.
    pub violations: BTreeMap<String, usize>,
}

impl PeerFigures {
    fn of(
        grid: &Grid,
        one: &Instance,
        paths: &[Vec<Cell>],
        time_s: f64,
    ) -> Result<PeerFigures, String> {
        for (agent, path) in grid.agents().iter().zip(paths) {
            let ends = [agent.start, agent.goal].map(|[x, y, _]| [x, y]);
            if [path[0], path[path.len() - 1]] != ends {
                return Err(format!("`{}` is not where it is to be", agent.name));
            }
        }
        let text = one.place.scenario(one.drones, one.seed);
        let text = text.map_err(|error| error.to_string())?;
        let world = read_world(&text).map_err(|error| error.to_string())?;
        let plan = file::read(&flown(&world, grid, paths).to_string());
        let report = verify(&plan.map_err(|error| error.to_string())?.plan);
        let mut violations = BTreeMap::new();
        for found in &report.violations {
            let kind = serde_json::to_value(found.kind).map_err(|error| error.to_string())?;
            let kind = kind.as_str().unwrap_or_default().to_owned();
            *violations.entry(kind).or_default() += 1;
        }
        let flat = grid.projected();
        let alone = (flat.agents().iter()).map(|it| steps_alone(&flat, it.start, it.goal));
        Ok(PeerFigures {
            time_s,
            sum_of_costs: paths.iter().map(|path| steps_of(path) as u64).sum(),
            sum_alone: alone.map(|steps| steps as u64).sum(),
            violations,
        })
    }

    fn suboptimality(&self) -> f64 {
        self.sum_of_costs as f64 / self.sum_alone.max(1) as f64
    }
}

/// Steps until it rests at its goal.
fn steps_of(path: &[Cell]) -> usize {
    let goal = path.last();
    path.iter()
        .rposition(|cell| Some(cell) != goal)
        .map_or(0, |last| last + 1)
}

/// Steps of the shortest path over a floor; 0 where there is none.
fn steps_alone(flat: &Grid, [x, y, _]: [usize; 3], [to_x, to_y, _]: [usize; 3]) -> usize {
    let mut reached = BTreeMap::from([([x, y], 0)]);
    let mut open = VecDeque::from([[x, y]]);
    while let Some(cell) = open.pop_front() {
        let steps = reached[&cell];
        if cell == [to_x, to_y] {
            return steps;
        }
        let [x, y] = cell;
        for [x, y] in [
            [x + 1, y],
            [x.wrapping_sub(1), y],
            [x, y + 1],
            [x, y.wrapping_sub(1)],
        ] {
            if !flat.is_blocked([x, y, 0]) && !reached.contains_key(&[x, y]) {
                reached.insert([x, y], steps + 1);
                open.push_back([x, y]);
            }
        }
    }
    0
}

/// The plan of paths over the floor, as a plan.json.
///
/// A step of a metre goes up or down a metre at most, and takes as long as the slowest drone takes
/// for that; a drone with farther to climb goes on above or below its goal.
fn flown(world: &World, grid: &Grid, paths: &[Vec<Cell>]) -> serde_json::Value {
    let speeds = world.drones.iter().map(|drone| drone.vehicle.max_speed_mps);
    let step_s = f64::sqrt(2.0) / speeds.fold(f64::INFINITY, f64::min);
    let drones = grid.agents().iter().zip(paths).zip(&world.drones);
    let drones = drones.map(|((agent, path), drone)| {
        let [from_m, to_m] = [agent.start, agent.goal].map(|it| it[2] as f64 + 0.5);
        let moves = steps_of(path).max(agent.start[2].abs_diff(agent.goal[2]));
        let place = |step: usize| {
            let [x, y] = path[step.min(path.len() - 1)].map(|it| it as f64 + 0.5);
            let share = step as f64 / moves.max(1) as f64;
            [x, y, from_m + share * (to_m - from_m)]
        };
        let t_s: Vec<f64> = (0..=moves).map(|step| step as f64 * step_s).collect();
        json!({
            "name": drone.name,
            "airframe": drone.vehicle.airframe.name(),
            "air_limit": drone.air_limit,
            "trajectory": {
                "t_s": t_s,
                "position_m": (0..=moves).map(place).collect::<Vec<_>>(),
            },
        })
    });
    json!({
        "format": "plan/1",
        "scenario": world.name,
        "air": { "superposition": world.superposition.as_str() },
        "bounds_m": world.bounds_m,
        "obstacles": world.obstacles,
        "margins": { "time_s": 0.0, "tracking_m": 0.0 },
        "drones": drones.collect::<Vec<_>>(),
    })
}

/// What a peer makes of the instances of a row.
#[derive(Debug, Serialize)]
pub struct PeerRow {
    /// The peer.
    pub peer: Peer,
    /// One for each seed, or why there are none.
    pub runs: Vec<Result<PeerFigures, String>>,
}

/// What the peers make of a suite's instances, row by row; `fresh` makes an empty folder for each.
pub fn rows<T: AsRef<Path>>(
    suite: &Suite,
    folder: &Path,
    fresh: impl Fn() -> Result<T, std::io::Error>,
) -> Vec<[PeerRow; 2]> {
    let all = suite.instances();
    let run = |peer: Peer, one: &Instance| {
        let scratch = fresh().map_err(|error| format!("not run: {error}"))?;
        peer.solve(folder, scratch.as_ref(), one)
    };
    let rows = all.chunks(suite.seeds.len().max(1)).map(|row| {
        Peer::ALL.map(|peer| PeerRow {
            peer,
            runs: row.iter().map(|one| run(peer, one)).collect(),
        })
    });
    rows.collect()
}

/// This planner and its peers on the same instances, as Markdown.
#[must_use]
pub fn text(own: &[Row], peers: &[[PeerRow; 2]]) -> String {
    let headings = "place | drones | planner | solved | time (s) | suboptimality | violations";
    let mut cells = Vec::new();
    for (row, peers) in own.iter().zip(peers) {
        let place = [row.place.name().to_owned(), row.drones.to_string()];
        let ratio = row.median(|run| Some(run.sum_of_arrivals_s / run.sum_alone_s));
        let figures = || row.runs.iter().filter_map(|run| run.figures.as_ref());
        let planned = figures()
            .filter(|run| run.has_plan() && run.left_out == 0)
            .count();
        let violations: usize = figures().map(|run| run.violations).sum();
        cells.push(line(
            &place,
            "this one",
            [
                format!("{planned} of {}", row.runs.len()),
                cell(row.planning_time_s(), 2),
                cell(ratio, 3),
                violations.to_string(),
            ],
        ));
        cells.extend(peers.iter().map(|it| it.line(&place)));
    }
    format!(
        "Other planners on the same instances: they solve the floor seen from above, and each drone climbs evenly on the way. \
         Medians; time: of this planner endpoints, roadmap and search, of the others their whole process; suboptimality: each in its own metric; violations: what the verifier finds, of the others' plans in quasi-static air without margins.\n\n{}",
        Table::new("lrlrrrl", headings, cells).markdown()
    )
}

fn line(place: &[String; 2], planner: &str, figures: [String; 4]) -> Vec<String> {
    let names = place.iter().cloned().chain([planner.to_owned()]);
    names.chain(figures).collect()
}

impl PeerRow {
    fn line(&self, place: &[String; 2]) -> Vec<String> {
        let solved: Vec<&PeerFigures> = self.runs.iter().flatten().collect();
        let median = |of: &dyn Fn(&PeerFigures) -> f64| {
            let mut values: Vec<f64> = solved.iter().map(|it| of(it)).collect();
            values.sort_unstable_by(f64::total_cmp);
            quantile(&values, 0.5)
        };
        let mut why: Vec<&str> = self
            .runs
            .iter()
            .filter_map(|it| Some(&it.as_ref().err()?[..]))
            .collect();
        why.dedup();
        let answer = match (solved.len(), &why[..]) {
            (0, ["not found"]) => "not found".to_owned(),
            (solved, []) => format!("{solved} of {}", self.runs.len()),
            (solved, why) => format!("{solved} of {}: {}", self.runs.len(), joined(why, "; ")),
        };
        let mut violations: BTreeMap<&str, usize> = BTreeMap::new();
        for (kind, number) in solved.iter().flat_map(|it| &it.violations) {
            *violations.entry(kind).or_default() += number;
        }
        let violations = match (solved.len(), violations.len()) {
            (0, _) => "-".to_owned(),
            (_, 0) => "0".to_owned(),
            _ => joined(
                violations
                    .iter()
                    .map(|(kind, number)| format!("{number} {kind}")),
                ", ",
            ),
        };
        line(
            place,
            self.peer.name(),
            [
                answer,
                cell(median(&|it| it.time_s), 2),
                cell(median(&PeerFigures::suboptimality), 3),
                violations,
            ],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instances::Floor;

    #[test]
    fn what_each_writes_is_read() {
        let lacam =
            "agents=2\nsolved=1\nstarts=(9,9),(8,8),\nsolution=\n0:(1,2),(3,2),\n1:(1,2),(3,3),\n";
        let lns = "Agent 0:(2,1)->(2,1)->\nAgent 1:(2,3)->(3,3)->\n";
        let expected = vec![vec![[1, 2], [1, 2]], vec![[3, 2], [3, 3]]];
        assert_eq!(Peer::LaCam3.paths(lacam).as_ref(), Ok(&expected));
        assert_eq!(Peer::Lns2.paths(lns), Ok(expected));
        assert!(Peer::LaCam3.paths("solution=\n0:(1,2),(3,b),\n").is_err());
        assert!(
            Peer::LaCam3
                .paths("solution=\n0:(1,2),(3,2),\n1:(1,2),\n")
                .is_err()
        );
    }

    /// Each agent along x, then along y, as if the others were not there.
    fn unaware(grid: &Grid) -> Vec<Vec<Cell>> {
        let path = |agent: &crate::instances::Agent| {
            let ([mut x, mut y, _], [to_x, to_y, _]) = (agent.start, agent.goal);
            let mut path = vec![[x, y]];
            while [x, y] != [to_x, to_y] {
                match x == to_x {
                    true => y = if y < to_y { y + 1 } else { y - 1 },
                    false => x = if x < to_x { x + 1 } else { x - 1 },
                }
                path.push([x, y]);
            }
            path
        };
        grid.agents().iter().map(path).collect()
    }

    #[test]
    fn a_path_over_the_floor_becomes_a_plan_that_the_verifier_judges() {
        let one = Instance {
            place: Floor::Hall,
            drones: 1,
            seed: 1,
            time_limit: None,
            jobs: None,
            contrast: false,
            relaxed: true,
        };
        let grid = one.place.grid(1, 1).expect("it fits");
        let paths = unaware(&grid);
        let figures = PeerFigures::of(&grid, &one, &paths, 0.5).expect("a plan");
        assert_eq!(figures.sum_of_costs, figures.sum_alone);
        assert!(figures.violations.is_empty(), "{figures:?}");

        let many = Instance { drones: 200, ..one };
        let grid = many.place.grid(200, 1).expect("they fit");
        let figures = PeerFigures::of(&grid, &many, &unaware(&grid), 0.5).expect("a plan");
        let kinds: Vec<&str> = figures.violations.keys().map(String::as_str).collect();
        assert!(kinds.contains(&"air"), "{kinds:?}");
        assert!(
            !kinds.contains(&"speed") && !kinds.contains(&"obstacle"),
            "{kinds:?}"
        );

        let elsewhere = vec![vec![[0, 0], [0, 1]]; 200];
        assert!(PeerFigures::of(&grid, &many, &elsewhere, 0.5).is_err());
    }

    #[test]
    fn a_planner_that_is_not_there_is_told() {
        let nowhere = Path::new("no such folder");
        let one = Instance {
            place: Floor::Hall,
            drones: 2,
            seed: 1,
            time_limit: None,
            jobs: None,
            contrast: false,
            relaxed: true,
        };
        let solved = Peer::Lns2.solve(nowhere, nowhere, &one);
        assert_eq!(solved, Err("not found".to_owned()));
        let row = PeerRow {
            peer: Peer::Lns2,
            runs: vec![solved],
        };
        let line = row.line(&["hall".to_owned(), "2".to_owned()]);
        assert_eq!(line[2..], ["MAPF-LNS2", "not found", "-", "-", "-"]);
    }
}
