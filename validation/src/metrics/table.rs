//! Metrics as text.

use std::fmt::{self, Write as _};

use serde::Serialize;

use super::{Assessed, LONG_SAMPLES, Metrics, Share};

/// Which side of its goal a metric has to be on.
#[derive(Clone, Copy)]
enum Goal {
    AtLeast(f64),
    AtMost(f64),
    Between(f64, f64),
}

impl Goal {
    fn is_met(self, value: f64) -> bool {
        match self {
            Goal::AtLeast(goal) => value >= goal,
            Goal::AtMost(goal) => value <= goal,
            Goal::Between(low, high) => (low..=high).contains(&value),
        }
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Goal::AtLeast(goal) => write!(f, "at least {goal}"),
            Goal::AtMost(goal) => write!(f, "at most {goal}"),
            Goal::Between(low, high) => write!(f, "{low} to {high}"),
        }
    }
}

/// One metric.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metric {
    /// What is measured.
    pub name: &'static str,
    /// What was reached; `None`: there was no case of it.
    pub value: Option<f64>,
    /// Where it is a share: so many of so many.
    pub of: Option<Share>,
    /// What is to be reached, in words.
    pub goal: String,
    /// Whether it is; `None`: there was no case of it.
    pub reached: Option<bool>,
}

impl Metric {
    fn new(name: &'static str, value: Option<f64>, of: Option<Share>, goal: Goal) -> Metric {
        Metric {
            name,
            value,
            of,
            goal: goal.to_string(),
            reached: value.map(|value| goal.is_met(value)),
        }
    }
}

impl Metrics {
    /// Every metric with what is to be reached, in the order of reports; the same for the same
    /// seed. Time is left out: it is never the same.
    #[must_use]
    pub fn metrics(&self) -> Vec<Metric> {
        let share = |name, share: Share, goal: Goal| {
            let value = share.rate();
            Metric::new(name, value, Some(share), goal)
        };
        let plain = |name, value, goal: Goal| Metric::new(name, value, None, goal);
        vec![
            share("null false alarm", self.false_alarms, Goal::AtMost(0.005)),
            share("wrongful accusation", self.accusations, Goal::AtMost(0.01)),
            share("detection, chi2 >= 25", self.detected, Goal::AtLeast(0.95)),
            share(
                "detection, chi2 >= 200",
                self.detected_plain,
                Goal::AtLeast(0.99),
            ),
            share("naming, first place", self.named, Goal::AtLeast(0.9)),
            share("in the printed set", self.in_set, Goal::AtLeast(0.97)),
            share("spurious extra names", self.spurious, Goal::AtMost(0.03)),
            plain("location", self.location, Goal::AtLeast(0.8)),
            plain("skill, median", self.skill_median, Goal::AtLeast(0.97)),
            plain(
                "skill, tenth percentile",
                self.skill_tenth,
                Goal::AtLeast(0.8),
            ),
            share("95 % intervals", self.covered, Goal::Between(0.92, 0.98)),
            share("outside the library", self.outside, Goal::AtLeast(0.9)),
            share("masked pairs", self.masked, Goal::AtLeast(0.8)),
            share("held-out error that rises", self.rises, Goal::AtMost(0.0)),
            share("parameter at its bound", self.at_bound, Goal::AtMost(0.0)),
        ]
    }

    /// Whether every metric of which there are cases is reached.
    #[must_use]
    pub fn are_reached(&self) -> bool {
        self.metrics()
            .iter()
            .all(|metric| metric.reached != Some(false))
    }

    /// All tables, and a line for each case that was missed.
    #[must_use]
    pub fn report(&self, seed: u64) -> String {
        let missed = self.cases.iter().enumerate();
        let missed: Vec<String> = missed
            .filter(|(_, case)| case.is_missed())
            .map(|(index, case)| format!("{index:>4} {}\n", case.line()))
            .collect();
        let heading = match missed.is_empty() {
            true => "",
            false => "\nmissed, by number of the case\n",
        };
        format!(
            "{} synthetic recordings, seed {seed}\n\n{}\nby family\n{}\nwhat was answered how often\n{}{heading}{}",
            self.cases.len(),
            self.table(),
            self.family_table(),
            self.confusion_table(),
            missed.concat()
        )
    }

    /// The metrics alone: of families that are never looked at one by one.
    #[must_use]
    pub fn totals(&self, seed: u64) -> String {
        let count = self.cases.len();
        format!(
            "{count} synthetic recordings of unseen families, seed {seed}\n\n{}",
            self.table()
        )
    }

    /// The slowest of the long recordings, by its number; `None`: there was none.
    #[must_use]
    pub fn slowest(&self) -> Option<(usize, &Assessed)> {
        let long = self.cases.iter().enumerate();
        let long = long.filter(|(_, case)| case.samples >= LONG_SAMPLES);
        long.max_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds))
    }

    /// [`Metrics::metrics`] as text.
    #[must_use]
    pub fn table(&self) -> String {
        let mut text = format!("{:<24} {:>7} {:>9}  to reach\n", "metric", "reached", "of");
        for metric in self.metrics() {
            let value = number(metric.value, 3);
            let of = metric
                .of
                .map_or(String::new(), |of| format!("{}/{}", of.hits, of.of));
            let missed = if metric.reached == Some(false) {
                "  missed"
            } else {
                ""
            };
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{:<24} {value:>7} {of:>9}  {}{missed}",
                metric.name, metric.goal
            );
        }
        text
    }

    /// Truth by truth what was answered how often, the most frequent first.
    #[must_use]
    pub fn confusion_table(&self) -> String {
        let mut text = String::from("truth: answers\n");
        for (truth, answers) in &self.confusion {
            let mut answers: Vec<(&String, &usize)> = answers.iter().collect();
            answers.sort_by(|a, b| b.1.cmp(a.1).then(a.0.cmp(b.0)));
            let words: Vec<String> = answers
                .iter()
                .map(|(name, times)| format!("{times} {name}"))
                .collect();
            let _ = writeln!(text, "{truth}: {}", words.join(", "));
        }
        text
    }

    /// Family by family: cases, detected, named, in the set, mean location, worst skill.
    #[must_use]
    fn family_table(&self) -> String {
        let mut names: Vec<&str> = self.cases.iter().map(|case| case.family.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        let mut text = format!(
            "{:<32} {:>5} {:>8} {:>5} {:>6} {:>8} {:>6} {:>9}\n",
            "family", "cases", "detected", "named", "in set", "location", "skill", "chi2"
        );
        for name in names {
            let mine: Vec<&Assessed> = self
                .cases
                .iter()
                .filter(|case| case.family == name)
                .collect();
            let count = |hit: fn(&&&Assessed) -> bool| mine.iter().filter(hit).count();
            let location = mean(mine.iter().filter_map(|case| case.location));
            let skill = mine
                .iter()
                .filter_map(|case| case.skill)
                .min_by(f64::total_cmp);
            let chi2 = mine
                .iter()
                .map(|case| case.oracle_chi2)
                .min_by(f64::total_cmp);
            let _ = writeln!(
                text,
                "{name:<32} {:>5} {:>8} {:>5} {:>6} {:>8} {:>6} {:>9}",
                mine.len(),
                count(|case| case.detected),
                count(|case| case.named),
                count(|case| case.in_set),
                number(location, 2),
                number(skill, 2),
                number(chi2, 0),
            );
        }
        text
    }
}

impl Assessed {
    /// One line: family, what was injected, what was answered, location, skill.
    #[must_use]
    pub fn line(&self) -> String {
        format!(
            "{:<28} {:<36} -> {:<15} {:<36} {} location {:>5} skill {:>6} chi2 {:>9.0}",
            self.family,
            self.truth,
            self.verdict.as_str(),
            self.answered,
            if self.is_null() || self.is_outside {
                "     "
            } else if self.named {
                "named"
            } else if self.in_set {
                "set  "
            } else {
                "wrong"
            },
            number(self.location, 2),
            number(self.skill, 3),
            self.oracle_chi2,
        )
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}
