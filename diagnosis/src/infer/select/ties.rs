//! What does as well in the place of what was chosen, and who is named first.

use super::{FAINT_GAIN, Tried, gain};
use crate::infer::candidates::{Candidate, Kind};
use crate::infer::fit::Setting;

/// Everything that was tried.
pub(super) struct Pool<'a> {
    pub(super) singles: &'a [Tried],
    pub(super) pairs: &'a [Tried],
}

impl Pool<'_> {
    /// What does as well with another candidate in the place of one of the chosen, best first: within twice the standard error of the
    /// difference, 4 % of what the term in question brings, or 2.
    pub(super) fn ties(
        &self,
        setting: &Setting,
        chosen: &Tried,
        place: usize,
    ) -> Vec<(usize, &Tried)> {
        let kept = |k: &usize| *k != chosen.which[place] && chosen.which.contains(k);
        let pool: &[Tried] = if chosen.which.len() == 1 {
            self.singles
        } else {
            self.pairs
        };
        // What the term in question brings.
        let rest = self
            .singles
            .iter()
            .find(|single| kept(&single.which[0]))
            .map_or(0.0, |single| single.gain.total.max(0.0));
        let own = chosen.gain.total - rest;
        let mut close: Vec<(f64, usize, &Tried)> = Vec::new();
        for tried in pool.iter().filter(|tried| tried.practical) {
            let [rival] = tried
                .which
                .iter()
                .copied()
                .filter(|k| !kept(k))
                .collect::<Vec<_>>()[..]
            else {
                continue;
            };
            if chosen.which.contains(&rival) || close.iter().any(|(_, known, _)| *known == rival) {
                continue;
            }
            let lead = gain(setting, &chosen.log_density, &tried.log_density);
            let tie = (2.0 * lead.error).min(0.5 * own).max(0.04 * own).max(2.0);
            // What was seen once is compared as fitted.
            let (lead, tie) = if chosen.gain.total < FAINT_GAIN {
                (0.5 * (tried.fit.cost - chosen.fit.cost), FAINT_GAIN)
            } else {
                (lead.total, tie)
            };
            if lead < tie {
                close.push((lead, rival, tried));
            }
        }
        close.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        close
            .into_iter()
            .map(|(_, rival, tried)| (rival, tried))
            .collect()
    }

    /// Who is named before one of the chosen that it cannot be told from, within one standard error: an instrument before physics, a
    /// mechanism before a factor.
    pub(super) fn preferred(
        &self,
        setting: &Setting,
        candidates: &[Candidate],
        chosen: &Tried,
        place: usize,
    ) -> Option<Tried> {
        let own = &candidates[chosen.which[place]];
        let comes_first = |rival: &Candidate| match (own.kind, rival.kind) {
            (Kind::Physics, Kind::Sensor) => true,
            (Kind::Physics, Kind::Physics) => own.name == "momentum_scale",
            (Kind::Sensor, _) => false,
        };
        let (rival, tried) =
            self.ties(setting, chosen, place)
                .into_iter()
                .find(|(rival, tried)| {
                    let lead = gain(setting, &chosen.log_density, &tried.log_density);
                    let is_even = if chosen.gain.total < FAINT_GAIN {
                        tried.fit.cost < chosen.fit.cost + 2.0
                    } else {
                        lead.total < lead.error.max(2.0)
                    };
                    comes_first(&candidates[*rival]) && is_even
                })?;
        let mut preferred = tried.clone();
        // The same order of terms, values and columns as in the fit that stands.
        if tried.which.iter().position(|k| *k == rival) != Some(place) {
            preferred = tried.swapped(candidates);
        }
        Some(preferred)
    }
}

impl Tried {
    /// The two terms of a pair in the other order.
    fn swapped(&self, candidates: &[Candidate]) -> Tried {
        let [a, b] = self.which[..] else {
            return self.clone();
        };
        let first = candidates[a].parameters.len();
        let count = self.fit.values.len();
        let order: Vec<usize> = (first..count)
            .chain(0..first)
            .chain(count..count + 2)
            .collect();
        let mut swapped = self.clone();
        swapped.which = vec![b, a];
        swapped.fit.values = order[..count].iter().map(|&j| self.fit.values[j]).collect();
        swapped.fit.jacobian = self.fit.jacobian.select_columns(&order);
        swapped
    }
}
