//! What was judged before: nothing changes while one drone is searched for, and the tries of one
//! search ask much the same.

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, KindId, Leg};
use costmap::verdict::{Blocker, Verdict};
use nalgebra::Point3;
use rustc_hash::FxHashMap;

use super::setting::SearchSetting;
use crate::sipp::conflicts::{ReservationTable, StepQuery};

/// Of one drone's legs, those that others tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct LegKey {
    ticks: [u32; 2],
    ends_m: [[u64; 3]; 2],
    kind: KindId,
    flying: bool,
}

impl LegKey {
    fn of(leg: &Leg) -> LegKey {
        let bits = |at_m: Point3<f64>| [at_m.x, at_m.y, at_m.z].map(f64::to_bits);
        LegKey {
            ticks: [leg.start.0, leg.end.0],
            ends_m: [bits(leg.from_m), bits(leg.to_m)],
            kind: leg.kind,
            flying: leg.flying,
        }
    }
}

/// A verdict, its blockers kept elsewhere.
#[derive(Clone, Copy, Debug)]
struct StoredVerdict {
    first: u32,
    count: u32,
    breaks_zone: Option<usize>,
    price_s: f64,
}

/// Verdicts by what was judged, of one drone among the same others.
#[derive(Debug, Default)]
pub(super) struct Memo {
    /// By the tables, and whether they were enough.
    steps: FxHashMap<StepQuery, (StoredVerdict, bool)>,
    /// By the costmap.
    legs: FxHashMap<LegKey, StoredVerdict>,
    /// Against one drone alone.
    against: FxHashMap<(DroneId, LegKey), StoredVerdict>,
    blockers: Vec<Blocker>,
}

impl Memo {
    /// [`ReservationTable::step`].
    pub(super) fn step(
        &mut self,
        reservations: &ReservationTable<'_>,
        costmap: &Costmap,
        query: &StepQuery,
        verdict: &mut Verdict,
    ) -> bool {
        if let Some((kept, is_enough)) = self.steps.get(query) {
            self.add(*kept, verdict);
            return *is_enough;
        }
        let mut own = Verdict::default();
        let is_enough = reservations.step(costmap, query, &mut own);
        let kept = self.keep(&own);
        self.steps.insert(*query, (kept, is_enough));
        self.add(kept, verdict);
        is_enough
    }

    /// Adds what [`SearchSetting::judge`] says.
    pub(super) fn judge(&mut self, setting: &SearchSetting<'_>, leg: &Leg, verdict: &mut Verdict) {
        let key = LegKey::of(leg);
        let kept = self.legs.get(&key).copied().unwrap_or_else(|| {
            let mut own = Verdict::default();
            setting.judge(leg, &mut own);
            let kept = self.keep(&own);
            self.legs.insert(key, kept);
            kept
        });
        self.add(kept, verdict);
    }

    /// [`Costmap::judge_against`].
    pub(super) fn judge_against(
        &mut self,
        costmap: &Costmap,
        drone: DroneId,
        leg: &Leg,
        verdict: &mut Verdict,
    ) {
        let key = (drone, LegKey::of(leg));
        let kept = self.against.get(&key).copied().unwrap_or_else(|| {
            let mut own = Verdict::default();
            costmap.judge_against(drone, leg, &mut own);
            let kept = self.keep(&own);
            self.against.insert(key, kept);
            kept
        });
        self.add(kept, verdict);
    }

    fn keep(&mut self, verdict: &Verdict) -> StoredVerdict {
        let first = self.blockers.len() as u32;
        self.blockers.extend_from_slice(&verdict.blockers);
        StoredVerdict {
            first,
            count: verdict.blockers.len() as u32,
            breaks_zone: verdict.breaks_zone,
            price_s: verdict.price_s,
        }
    }

    fn add(&self, kept: StoredVerdict, verdict: &mut Verdict) {
        let blockers = self.blockers[kept.first as usize..].iter();
        (verdict.blockers).extend(blockers.take(kept.count as usize));
        verdict.breaks_zone = verdict.breaks_zone.or(kept.breaks_zone);
        verdict.price_s += kept.price_s;
    }
}
