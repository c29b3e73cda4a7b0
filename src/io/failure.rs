//! Why a question could not be answered: the reader of exit code 2. "No safe plan" is not among
//! these.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use airflow::NoSuchAirframe;
use diagnosis::calibrate::CalibrateError;
use diagnosis::campaign::{CampaignError, lacking};
use diagnosis::infer::diagnose::DiagnoseError;
use diagnosis::infer::finding_file::NoFinding;
use diagnosis::record::recording::Recording;
use loader::recordings::LoadError;
use thiserror::Error;
use tools::instances::InstanceError;
use tools::table::{first_few, joined};

use crate::io::problems::of_recordings;

/// What keeps a command from answering.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    #[error("nothing to do: name a scenario, or see `plan --help`")]
    NothingToDo,
    #[error("there is no file or subcommand `{typed}`; did you mean `{meant}`?")]
    Mistyped { typed: String, meant: String },
    #[error("cannot read {}: {source}", path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    /// Several that keep a command from answering, a line each.
    #[error("{}", joined(.0, "; "))]
    Several(Vec<Failure>),
    #[error("cannot write {}: {source}", path.display())]
    Write {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "{} holds what `{command}` wrote ({file}); name another folder with --out",
        path.display()
    )]
    Foreign {
        path: PathBuf,
        file: &'static str,
        command: &'static str,
    },
    #[error("cannot write to standard output: {0}")]
    Print(std::io::Error),
    /// The problems of scenarios, recordings or campaign files, each at its place, ready to print.
    #[error("{0}")]
    Drawn(String),
    #[error(
        "nothing to compare in {recordings} recordings: no probe readings below a drone, no throttle, no force that a thrust map allows{}",
        told(lacking.as_slice())
    )]
    NothingToCompare {
        recordings: usize,
        /// What vehicles lack that a force needs, in words.
        lacking: Vec<String>,
    },
    /// Options that say nothing of what is asked for, a line each.
    #[error("{}", .0.join("\n"))]
    Inapplicable(Vec<String>),
    #[error("{}: not a plan: {reason}", path.display())]
    NotAPlan { path: PathBuf, reason: String },
    #[error("{}: no drone is called `{name}`; there are {known}", path.display())]
    NoSuchDrone {
        path: PathBuf,
        name: String,
        known: String,
    },
    #[error("{}: cannot be flown: {error}", path.display())]
    NotFlown {
        path: PathBuf,
        error: flight::FlyError,
    },
    #[error("{}: {error}", path.display())]
    NotASetup {
        path: PathBuf,
        error: flight::SetupError,
    },
    #[error(transparent)]
    NoGeoreference(Box<exchange::ExportError>),
    #[error("{0}: name a folder to write to with --out")]
    NoFolder(&'static str),
    #[error("--one takes one place, one size and one seed, which would be 1 instance, not {0}")]
    NotOneInstance(usize),
    #[error(transparent)]
    NoSuchAirframe(#[from] NoSuchAirframe),
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// One error a recording.
    #[error("{}", joined(.0, "; "))]
    Diagnose(Vec<DiagnoseError>),
    /// Each is written to a folder of its name.
    #[error(
        "several recordings are called `{}`, and each is written to a folder of its name: diagnose them apart",
        .0.join("`, and several `")
    )]
    Namesakes(Vec<String>),
    #[error("--judge holds one finding against other recordings, and there are {0}")]
    SeveralToJudge(usize),
    #[error("{}: no finding: {error}", path.display())]
    Finding {
        path: PathBuf,
        error: Box<NoFinding>,
    },
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// A campaign that cannot be diagnosed with what is left of it.
    #[error("{error}{}", told(.left_out))]
    LeftOfCampaign {
        error: CampaignError,
        /// Logs that are left out, and why.
        left_out: Vec<String>,
    },
    #[error(
        "no flight logs: {others}; diagnose these by themselves: logs are judged together, and --alone, --near-floor and --normal are for them"
    )]
    NotOnlyFlightLogs {
        /// Names of some of the recordings that are none, and how many more.
        others: String,
    },
    #[error("no flight can be compared: {0}")]
    NoHardware(String),
    #[error(transparent)]
    Instance(#[from] InstanceError),
    /// One error a fault.
    #[error("{}: {}", path.display(), faults.join("; "))]
    Journal { path: PathBuf, faults: Vec<String> },
    #[error("the fleet cannot live: {0}")]
    NotSoaked(String),
    #[error("{}: {reason}", path.display())]
    Token { path: PathBuf, reason: String },
    #[error("cannot listen at {address}: {source}")]
    Listen {
        address: String,
        source: std::io::Error,
    },
    #[error(
        "{0} can be reached from other machines: name a file with a token that requests must carry \
         (--token-file FILE; `openssl rand -hex 32 > FILE` makes one), or listen at 127.0.0.1"
    )]
    Unguarded(std::net::SocketAddr),
    #[error("nothing can be held out: {0}")]
    HeldOut(String),
    #[error("cannot start {jobs} threads: {source}")]
    Threads {
        jobs: usize,
        source: rayon::ThreadPoolBuildError,
    },
}

/// Most vehicles and recordings that a message lists. Chosen here: a look at them all.
const MOST_LISTED: usize = 5;

/// What follows the statement that there is nothing.
fn told(lacking: &[String]) -> String {
    match lacking {
        [] => String::new(),
        several => format!("; {}", several.join("; ")),
    }
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Failure {
        match error {
            LoadError::Read { path, source } => Failure::Read { path, source },
            LoadError::Problems(problems) => Failure::Drawn(of_recordings(&problems)),
            LoadError::Several(several) => {
                Failure::Several(several.into_iter().map(Failure::from).collect())
            }
        }
    }
}

impl Failure {
    /// Nothing in any of these can be compared; of a few vehicles what they lack.
    pub(crate) fn nothing_to_compare<'r>(
        recordings: impl ExactSizeIterator<Item = &'r Recording>,
    ) -> Failure {
        Failure::NothingToCompare {
            recordings: recordings.len(),
            lacking: recordings.flat_map(lacking).take(MOST_LISTED).collect(),
        }
    }

    /// What is not to be judged by forces: recordings that are no flight logs, or logs that lack
    /// what a force needs.
    pub(crate) fn not_only_forces(recordings: &[Recording]) -> Failure {
        let others = recordings.iter().filter(|one| !one.is_flight_log());
        let names: Vec<&str> = others.map(|one| one.name.as_str()).collect();
        match names.is_empty() {
            true => Failure::Campaign(CampaignError::no_force(recordings)),
            false => Failure::NotOnlyFlightLogs {
                others: first_few(names.iter(), MOST_LISTED, ", "),
            },
        }
    }

    pub(crate) fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Failure {
        let path = path.to_owned();
        move |source| Failure::Write { path, source }
    }

    pub(crate) fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Failure {
        let path = path.to_owned();
        move |source| Failure::Read { path, source }
    }

    pub(crate) fn print(&self) {
        match self {
            // Carries its own "error:" labels.
            Failure::Drawn(rendered) => tell(rendered.trim_end()),
            Failure::Diagnose(errors) => {
                for error in errors {
                    tell_error(&error.to_string(), &[]);
                }
            }
            Failure::Several(failures) => failures.iter().for_each(Failure::print),
            Failure::Journal { path, faults } => {
                for fault in faults {
                    tell_error(&format!("{}: {fault}", path.display()), &[]);
                }
            }
            Failure::Inapplicable(options) => {
                for option in options {
                    tell_error(option, &[]);
                }
            }
            other => tell_error(&other.to_string(), &[]),
        }
    }
}

/// One error on standard error: what is wrong, then indented lines, the last of them what to do.
pub(crate) fn tell_error(what: &str, more: &[String]) {
    let bold_red = anstyle::Style::new()
        .bold()
        .fg_color(Some(anstyle::AnsiColor::Red.into()));
    let mut text = format!("{bold_red}error{bold_red:#}: {what}");
    for line in more {
        text.push_str("\n  ");
        text.push_str(line);
    }
    tell(&text);
}

/// One line on standard error; colours survive only where a terminal shows them.
pub(crate) fn tell(text: &str) {
    // With standard error closed there is no reader left.
    let _ = writeln!(anstream::stderr(), "{text}");
}
