//! Watching a planner that reads no clock itself: when to stop it, how far it is, how long it took.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use planner::plan::outcome::{IMPROVING_SHARE, PLANNING_SHARE, Progress};

use crate::io::failure::tell;

/// A bar before this would only flicker.
const SHOW_PROGRESS_AFTER: Duration = Duration::from_secs(1);
/// Exit code of a process ended by a second interrupt: 128 + SIGINT, as shells have it.
const ENDED: i32 = 130;
/// Whether this process has been interrupted.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Stops, shows and times one run.
pub(crate) struct Watch {
    started: Instant,
    limit: Option<Duration>,
    bar: ProgressBar,
    bar_shown: Once,
    /// What the time is added to now, since when, and the sums so far.
    phases: Mutex<(Part, Instant, Durations)>,
}

/// Time spent so far in each part of a run.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Durations {
    pub(crate) planning: Duration,
    pub(crate) verification: Duration,
    pub(crate) ignoring_downwash: Duration,
    /// How late each drone may be.
    pub(crate) lateness: Duration,
}

/// Where the time of a part of a run is added up.
type Part = fn(&mut Durations) -> &mut Duration;

const PLANNING: Part = |spent| &mut spent.planning;
const VERIFICATION: Part = |spent| &mut spent.verification;
const IGNORING_DOWNWASH: Part = |spent| &mut spent.ignoring_downwash;
const LATENESS: Part = |spent| &mut spent.lateness;

impl Watch {
    /// Starts the clock. The first interrupt asks the planner to stop, the second ends the process.
    pub(crate) fn start(time_limit: Option<Duration>) -> Watch {
        // A second watch finds the first one's handler; without any, an interrupt just ends the
        // process, and files are still whole or absent.
        let _ = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(ENDED);
            }
            tell("interrupted: finishing with the best plan so far; once more ends at once");
        });
        let started = Instant::now();
        Watch {
            started,
            limit: time_limit,
            bar: ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden()),
            bar_shown: Once::new(),
            phases: Mutex::new((PLANNING, started, Durations::default())),
        }
    }

    /// Whether the planner should come to an end: the rest of a limit is for the check.
    pub(crate) fn stop(&self) -> bool {
        INTERRUPTED.load(Ordering::Relaxed) || self.is_past(PLANNING_SHARE)
    }

    /// Whether there is a limit, and time to make a plan better before it: the last part of it is
    /// for the check, and for the plan that ignores downwash.
    pub(crate) fn improve(&self) -> bool {
        self.limit.is_some()
            && !INTERRUPTED.load(Ordering::Relaxed)
            && !self.is_past(IMPROVING_SHARE)
    }

    /// Whether the command should come to an end.
    pub(crate) fn is_over(&self) -> bool {
        INTERRUPTED.load(Ordering::Relaxed) || self.is_past(1.0)
    }

    /// From now on it is looked how late drones may be.
    pub(crate) fn tell_lateness(&self) {
        self.enter(LATENESS);
    }

    /// Whether there is a limit, and this share of it is over.
    fn is_past(&self, share: f64) -> bool {
        let elapsed_s = self.started.elapsed().as_secs_f64();
        let limit_s = self.limit.map(|limit| limit.as_secs_f64());
        limit_s.is_some_and(|limit_s| elapsed_s >= share * limit_s)
    }

    /// Takes what the planner tells.
    pub(crate) fn progress(&self, progress: Progress) {
        self.enter(match progress {
            Progress::Verifying => VERIFICATION,
            Progress::IgnoringDownwash => IGNORING_DOWNWASH,
            _ => PLANNING,
        });
        if self.started.elapsed() >= SHOW_PROGRESS_AFTER {
            self.show(progress);
        }
    }

    /// Ends the last phase and takes the bar away.
    pub(crate) fn finish(&self) -> Durations {
        self.bar.finish_and_clear();
        self.enter(PLANNING)
    }

    /// Adds up what has passed since the last call; gives the sums.
    fn enter(&self, next: Part) -> Durations {
        // Plain sums: a panic elsewhere cannot have left them half-written.
        let phases = self.phases.lock();
        let mut phases = phases.unwrap_or_else(PoisonError::into_inner);
        let (now, since, mut spent) = *phases;
        let here = Instant::now();
        *now(&mut spent) += here - since;
        *phases = (next, here, spent);
        spent
    }

    fn show(&self, progress: Progress) {
        self.bar_shown.call_once(|| {
            // Stays hidden where standard error is no terminal.
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{spinner} {msg} {wide_bar} {elapsed}");
            self.bar
                .set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            self.bar.enable_steady_tick(Duration::from_millis(100));
        });
        let message = match progress {
            Progress::Preparing => "preparing the roadmap".into(),
            Progress::Searching {
                planned,
                drones,
                evictions,
            } => {
                self.bar.set_length(drones as u64);
                self.bar.set_position(planned as u64);
                format!("{planned} of {drones} drones have a path, {evictions} taken back")
            }
            Progress::Improving => "improving the plan (LNS)".into(),
            Progress::Verifying => "verifying".into(),
            Progress::IgnoringDownwash => "planning once more, ignoring downwash".into(),
        };
        self.bar.set_message(message);
    }
}

/// CPU time of this process so far, over all its threads (s); only Linux tells.
pub(crate) fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // Behind the name, which stands in brackets: user and system time are the fields 14 and 15 of
    // proc(5), in hundredths of a second.
    let (_, fields) = stat.rsplit_once(')')?;
    let ticks = fields.split_whitespace().skip(11).take(2);
    let ticks: Vec<f64> = ticks.map(str::parse).collect::<Result<_, _>>().ok()?;
    Some(ticks.iter().sum::<f64>() / 100.0)
}

/// Highest resident memory of this process so far (bytes); only Linux tells.
pub(crate) fn peak_memory_bytes() -> Option<u64> {
    memory_bytes("VmHWM:")
}

/// Resident memory of this process now (bytes); only Linux tells.
pub(crate) fn resident_memory_bytes() -> Option<u64> {
    memory_bytes("VmRSS:")
}

fn memory_bytes(field: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(field))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
