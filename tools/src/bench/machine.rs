//! What the figures were taken on.

use std::fmt;
use std::num::NonZeroUsize;

use serde::Serialize;

/// Cores, processor, system and build.
#[derive(Debug, Serialize)]
pub struct Machine {
    /// What this process may use; `null` where the system does not tell.
    pub cores: Option<usize>,
    /// The processor's name for itself; only Linux tells.
    pub processor: Option<String>,
    /// Operating system and architecture.
    pub system: String,
    /// Processes that ran or waited to run, mean of the last minute before the first instance:
    /// above a half, other work took its share, and times are too long; only Linux tells.
    pub load_before: Option<f64>,
    /// Threads asked for; `null`: one a core.
    pub threads: Option<usize>,
    /// `release`, or a build with assertions, whose times say little.
    pub build: &'static str,
}

impl Machine {
    /// The machine that this process runs on; `jobs`: threads asked for.
    #[must_use]
    pub fn here(jobs: Option<NonZeroUsize>) -> Machine {
        let cores = std::thread::available_parallelism();
        let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let name = told
            .lines()
            .find_map(|line| line.strip_prefix("model name"));
        let name = name.map(|name| name.trim_start_matches([' ', '\t', ':']).to_owned());
        Machine {
            cores: cores.ok().map(NonZeroUsize::get),
            processor: name,
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            load_before: load(),
            threads: jobs.map(NonZeroUsize::get),
            build: if cfg!(debug_assertions) {
                "with assertions"
            } else {
                "release"
            },
        }
    }
}

/// Chosen here: half a process, about what an idle desktop does.
const BUSY_FROM: f64 = 0.5;

fn load() -> Option<f64> {
    let told = std::fs::read_to_string("/proc/loadavg").ok()?;
    told.split_whitespace().next()?.parse().ok()
}

/// "2 cores, AMD EPYC, linux x86_64, release build"
impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.cores {
            Some(1) => write!(f, "1 core")?,
            Some(cores) => write!(f, "{cores} cores")?,
            None => write!(f, "cores not told")?,
        }
        let name = self.processor.as_deref();
        write!(
            f,
            ", {}, {}",
            name.unwrap_or("processor not told"),
            self.system
        )?;
        if let Some(threads) = self.threads {
            write!(f, ", threads limited to {threads}")?;
        }
        match self.build {
            "release" => write!(f, ", release build")?,
            build => write!(f, ", build {build}: times say little")?,
        }
        match self.load_before {
            Some(load) if load > BUSY_FROM => {
                write!(
                    f,
                    "; not idle before (load {load:.1}): times may be too long"
                )
            }
            _ => Ok(()),
        }
    }
}
