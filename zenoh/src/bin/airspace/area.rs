//! One area's planner in a process of its own.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use clap::Args;
use leeward_zenoh::{Link, Zenoh};
use planner::Control;
use planner::plan::DronePlan;
use serde::{Deserialize, Serialize};
use service::airspace::traffic::Traffic;
use service::airspace::{Area, Neighbours as _, Record};

use super::{Broken, Place};

/// How often messages are looked for (s).
const STEP: Duration = Duration::from_millis(5);
/// How often another free port is looked for.
const MOST_TRIES: usize = 20;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    place: Place,
    /// Which area, as `a0-1`
    #[arg(long)]
    area: String,
    /// Where others reach it, as tcp/127.0.0.1:7447 [default: a free port of 127.0.0.1]
    #[arg(long)]
    listen: Option<String>,
    /// Where it reaches others
    #[arg(long)]
    connect: Vec<String>,
    /// When the site's clock is at 0 (s, Unix time)
    #[arg(long)]
    begins: f64,
    /// Until when it plans (s of the site's clock)
    #[arg(long)]
    until: f64,
    /// What it must keep; replayed at the start
    #[arg(long)]
    journal: PathBuf,
    /// What it flies, from when on
    #[arg(long)]
    flown: PathBuf,
}

/// What an area has come to fly.
#[derive(Serialize, Deserialize)]
pub(super) struct Flown {
    /// When (s).
    pub(super) at_s: f64,
    /// All that are its own now.
    pub(super) own: Vec<String>,
    /// Of these, what flies something else than was said before.
    pub(super) changed: Vec<DronePlan>,
}

/// What an area has counted.
#[derive(Serialize, Deserialize)]
pub(super) struct Counted {
    pub(super) alone: u64,
    pub(super) proposed: u64,
    pub(super) flown: u64,
    pub(super) taken: u64,
    pub(super) votes: [u64; 2],
    pub(super) gave_way: u64,
    pub(super) agreed_in_s: Vec<f64>,
    pub(super) contradictions: Vec<(String, String)>,
    pub(super) refused: BTreeMap<String, u64>,
    pub(super) messages: [u64; 2],
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Broken> {
    let grid = arguments.place.grid();
    let site = grid.site(arguments.place.lead);
    let name = &arguments.area;
    if !site.areas.contains_key(name) {
        return Err(format!("no area is called `{name}`").into());
    }
    let world = planner::read_world(&grid.scenario(name)?).map_err(|it| it.to_string())?;
    let outcome = planner::plan_world(&world, &Control::QUIET)?;
    let plan = outcome.into_planned().ok_or("no plan is safe")?.plan;
    let mut area = Area::new(site, name, world, plan)?;
    let mut journal = replayed(&arguments.journal, &mut area)?;
    let mut flown = File::create(&arguments.flown)?;
    let (mut link, endpoint) = open(arguments)?;
    println!("{endpoint}");
    let mut traffic = Traffic::new(grid, name, arguments.place.crossing);
    let mut said: BTreeMap<String, DronePlan> = BTreeMap::new();
    let mut given: u64 = 0;
    loop {
        let now_s = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs_f64() - arguments.begins;
        if now_s > arguments.until {
            break;
        }
        for message in link.received() {
            area.receive(now_s, &message);
        }
        if now_s >= 0.0 {
            area.tick(now_s);
            if given as f64 <= now_s * arguments.place.rate {
                traffic.step(&mut area, now_s);
                given = (now_s * arguments.place.rate) as u64 + 1;
            }
        }
        let records = area.take_records();
        for record in &records {
            writeln!(journal, "{}", serde_json::to_string(record)?)?;
        }
        if !records.is_empty() || said.is_empty() {
            tell(&mut flown, &area, now_s, &mut said)?;
        }
        // Nothing is said that is not kept.
        for message in area.take_messages() {
            link.send(&message);
        }
        thread::sleep(STEP);
    }
    let counts = area.counts();
    let refused = traffic
        .refused()
        .iter()
        .map(|(why, count)| ((*why).to_owned(), *count));
    let counted = Counted {
        alone: counts.alone,
        proposed: counts.proposed,
        flown: counts.flown,
        taken: counts.taken,
        votes: counts.votes,
        gave_way: counts.gave_way,
        agreed_in_s: counts.agreed_in_s.iter().copied().collect(),
        contradictions: counts.contradictions.iter().cloned().collect(),
        refused: refused.collect(),
        messages: link.sent(),
    };
    println!("{}", serde_json::to_string(&counted)?);
    Ok(())
}

/// The link, and where others reach it.
fn open(arguments: &Arguments) -> Result<(Zenoh, String), Broken> {
    let at = |endpoint: &str| {
        Zenoh::open(Link {
            site: "soak".to_owned(),
            area: arguments.area.clone(),
            listen: vec![endpoint.to_owned()],
            connect: arguments.connect.clone(),
        })
    };
    if let Some(endpoint) = &arguments.listen {
        return Ok((at(endpoint)?, endpoint.clone()));
    }
    // Zenoh does not tell which port it was given: one that is free a moment before may be taken
    // by then.
    let mut tries = 0;
    loop {
        let free = TcpListener::bind("127.0.0.1:0")?.local_addr()?;
        let endpoint = format!("tcp/{free}");
        match at(&endpoint) {
            Ok(link) => return Ok((link, endpoint)),
            Err(it) if tries == MOST_TRIES => return Err(it.into()),
            Err(_) => tries += 1,
        }
    }
}

/// The journal, to be added to; what it holds is done again. A last line that is torn was not acted
/// on.
fn replayed(path: &Path, area: &mut Area) -> Result<File, Broken> {
    if let Ok(file) = File::open(path) {
        let mut whole = 0;
        let mut lines = BufReader::new(file);
        let mut line = String::new();
        while lines.read_line(&mut line)? > 0 && line.ends_with('\n') {
            let record: Record = serde_json::from_str(&line)?;
            area.replay(record)?;
            whole += line.len() as u64;
            line.clear();
        }
        OpenOptions::new().write(true).open(path)?.set_len(whole)?;
    } else if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    Ok(OpenOptions::new().append(true).create(true).open(path)?)
}

fn tell(
    file: &mut File,
    area: &Area,
    at_s: f64,
    said: &mut BTreeMap<String, DronePlan>,
) -> Result<(), Broken> {
    let own: Vec<String> = area.own().map(|it| it.name.clone()).collect();
    let is_new = |it: &&DronePlan| {
        said.get(&it.name)
            .is_none_or(|known| known.trajectory != it.trajectory)
    };
    let changed: Vec<DronePlan> = area.own().filter(is_new).cloned().collect();
    said.retain(|name, _| own.contains(name));
    said.extend(changed.iter().map(|it| (it.name.clone(), it.clone())));
    let line = serde_json::to_string(&Flown { at_s, own, changed })?;
    writeln!(file, "{line}")?;
    Ok(())
}
