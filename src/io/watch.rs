//! Watching a planner that reads no clock itself: when to stop it, how far it is, how long it took.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, Once};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use planner::plan::outcome::Progress;

use crate::io::failure::tell;

/// A bar before this would only flicker.
const SHOW_PROGRESS_AFTER: Duration = Duration::from_secs(1);
/// Share of a time limit after which a plan that is complete is not made better any more: chosen here, checks take less than
/// planning does.
const IMPROVING_SHARE: f64 = 0.6;
/// Exit code of a process ended by a second interrupt: 128 + SIGINT, as shells have it.
const ENDED: i32 = 130;
/// Whether this process has been interrupted.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Stops, shows and times one run.
pub(crate) struct Watch {
    started: Instant,
    deadline: Option<Instant>,
    bar: ProgressBar,
    bar_shown: Once,
    phases: Mutex<Phases>,
}

/// Time spent so far in each part of a run.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Durations {
    pub(crate) planning: Duration,
    pub(crate) verification: Duration,
    pub(crate) ignoring_downwash: Duration,
}

struct Phases {
    now: Part,
    since: Instant,
    spent: Durations,
}

/// Where the time of a part of a run is added up.
type Part = fn(&mut Durations) -> &mut Duration;

const PLANNING: Part = |spent| &mut spent.planning;
const VERIFICATION: Part = |spent| &mut spent.verification;
const IGNORING_DOWNWASH: Part = |spent| &mut spent.ignoring_downwash;

impl Watch {
    /// Starts the clock. The first interrupt asks the planner to stop, the second ends the process.
    pub(crate) fn start(time_limit: Option<Duration>) -> Watch {
        // A second watch finds the first one's handler; without any, an interrupt just ends the process, and files are still
        // whole or absent.
        let _ = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(ENDED);
            }
            tell("interrupted: finishing with the best plan so far; once more ends at once");
        });
        let started = Instant::now();
        Watch {
            started,
            // A limit beyond the clock's range is no limit.
            deadline: time_limit.and_then(|limit| started.checked_add(limit)),
            bar: ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden()),
            bar_shown: Once::new(),
            phases: Mutex::new(Phases {
                now: PLANNING,
                since: started,
                spent: Durations::default(),
            }),
        }
    }

    /// Whether the planner should come to an end.
    pub(crate) fn stop(&self) -> bool {
        INTERRUPTED.load(Ordering::Relaxed)
            || self.deadline.is_some_and(|end| Instant::now() >= end)
    }

    /// Whether there is a limit, and time to make a plan better before it: the last part of it is for the check, and for the
    /// plan that ignores downwash.
    pub(crate) fn improve(&self) -> bool {
        !INTERRUPTED.load(Ordering::Relaxed)
            && self.deadline.is_some_and(|end| {
                let limit = end - self.started;
                self.started.elapsed() < limit.mul_f64(IMPROVING_SHARE)
            })
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
        self.enter(PLANNING);
        self.phases().spent
    }

    fn enter(&self, next: Part) {
        let mut phases = self.phases();
        let now = Instant::now();
        let passed = now - phases.since;
        *(phases.now)(&mut phases.spent) += passed;
        (phases.now, phases.since) = (next, now);
    }

    fn phases(&self) -> std::sync::MutexGuard<'_, Phases> {
        // Plain sums: a panic elsewhere cannot have left them half-written.
        self.phases
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
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
            Progress::Improving => "improving the plan in the time that is left (LNS)".into(),
            Progress::Verifying => "verifying".into(),
            Progress::IgnoringDownwash => "planning once more, ignoring downwash".into(),
        };
        self.bar.set_message(message);
    }
}

/// CPU time of this process so far, over all its threads (s); only Linux tells.
pub(crate) fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // Behind the name, which stands in brackets: user and system time are the fields 14 and 15 of proc(5), in hundredths of a second.
    let (_, fields) = stat.rsplit_once(')')?;
    let ticks = fields.split_whitespace().skip(11).take(2);
    let ticks: Vec<f64> = ticks.map(str::parse).collect::<Result<_, _>>().ok()?;
    Some(ticks.iter().sum::<f64>() / 100.0)
}

/// Highest resident memory of this process so far (bytes); only Linux tells.
pub(crate) fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}
