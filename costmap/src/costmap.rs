//! A leg against the fleet: free, priced or forbidden, and by which drones. Close drones are judged
//! one by one, the others by what they add up to.

use std::ops::Range;

use rayon::prelude::*;

use crate::leg::{DroneId, Leg, Tick};
use crate::reservations::background::{FarWakeLoads, FarWakes, far_wake_loads};
use crate::reservations::ground::{Footprint, Ground};
use crate::reservations::over_time::part_ticks;
use crate::reservations::timeline::{Item, Timeline};
use crate::reservations::zones::{Wakes, ZoneBox, Zones};
use crate::verdict::{
    Blocker, IncomingLoad, Verdict, Why, block_largest, peak, price, record_max_load,
};
use crate::wake::fleet::{BUDGET, Fleet, WHOLE};
use crate::wake::surfaces::BlockingSurfaces;

/// Legs on the move that last longer are judged and kept in parts: chosen here, a second holds a
/// typical one.
const PART_TICKS: u32 = 200;

/// Share of a budget that drones planned first leave to drones that come later: chosen here, most
/// drones that conflict by a sum would add less than a twentieth to it. Without it a hall of 1 000
/// is not planned one after another.
const SPARE: f64 = 0.05;

/// The legs of a fleet, and what another leg would mean to them.
#[derive(Clone, Debug)]
pub struct Costmap {
    fleet: Fleet,
    surfaces: BlockingSurfaces,
    zones: Zones,
    timeline: Timeline,
    far_wakes: FarWakes,
    /// Per drone, what was inserted.
    legs: Vec<Vec<Leg>>,
    /// What the loads on one drone or zone may add up to, in millionths of its limit.
    budget: u32,
}

/// A drone's legs, ready to be reserved.
#[derive(Clone, Debug)]
pub struct Reservation {
    legs: Vec<Leg>,
    far_wake_loads: Vec<FarWakeLoads>,
}

impl Reservation {
    /// The drone of the legs; `None` if there are none.
    pub fn drone(&self) -> Option<DroneId> {
        self.legs.first().map(|leg| leg.drone)
    }
}

/// An item that is close to a part, what it brings the part, and the other way round.
type PairLoads = (u32, IncomingLoad, IncomingLoad);

impl Costmap {
    /// An empty costmap for a fleet of this many drones.
    pub fn new(
        fleet: Fleet,
        surfaces: BlockingSurfaces,
        zones: Vec<ZoneBox>,
        ground: Ground,
        drones: usize,
    ) -> Costmap {
        Costmap {
            fleet,
            surfaces,
            zones: Zones::new(zones),
            timeline: Timeline::new(ground, drones),
            far_wakes: FarWakes::new(&ground),
            legs: vec![Vec::new(); drones],
            budget: BUDGET,
        }
    }

    /// The same fleet, were every drone's air limit and every zone's so many times higher. Columns
    /// stay as they are; bodies keep their gaps between legs, as if these were what is flown.
    #[must_use]
    pub fn with_limits_raised(&self, drones: f64, zones: f64) -> Costmap {
        let raised = |times: f64| {
            let budget = f64::from(self.fleet.load(times)) * f64::from(BUDGET) / WHOLE;
            budget.min(f64::from(u32::MAX / 2)) as u32
        };
        let mut costmap = self.clone();
        costmap.budget = raised(drones);
        costmap.zones.budget = raised(zones);
        if costmap.has_limits_raised() {
            costmap.fleet.keep_bodies_by_legs();
        }
        costmap
    }

    /// Whether it says yes where the limits themselves might not.
    pub fn has_limits_raised(&self) -> bool {
        self.budget > BUDGET || self.zones.budget > BUDGET
    }

    /// What flies.
    pub fn fleet(&self) -> &Fleet {
        &self.fleet
    }

    /// Whether there are zones whose air is limited.
    pub fn has_air_limits_of_zones(&self) -> bool {
        self.zones.limit_air()
    }

    /// Whether there is anything above the floor that stops a wake.
    pub fn has_blocking_surfaces(&self) -> bool {
        self.surfaces.has_tops()
    }

    /// How long the air of a leg may matter after its end, at most, margins of time included
    /// (ticks); 0 where wakes are quasi-static.
    pub fn wake_persistence_ticks(&self) -> u32 {
        match self.fleet.is_advected() {
            true => self.shift() + self.fleet.longest_delay(self.fleet.conditions().deepest_m),
            false => 0,
        }
    }

    /// What others' wakes that are close fill, at most, of the budget of a drone in one of its
    /// parts: those of its legs in turn, see [`part_at`].
    pub fn filled(&self, drone: DroneId, part: u32) -> f64 {
        let item = self.part(drone, part);
        item.map_or(0.0, |item| item.peak as f64 / f64::from(self.budget))
    }

    /// The same between two ticks.
    pub fn filled_between(&self, drone: DroneId, part: u32, [start, end]: [Tick; 2]) -> f64 {
        let filled = |item: &Item| item.filled(start, end) as f64 / f64::from(self.budget);
        self.part(drone, part).map_or(0.0, filled)
    }

    /// Whether it is more than a share between two ticks, in any of the parts that last then.
    pub fn is_filled_during(&self, drone: DroneId, [start, end]: [Tick; 2], share: f64) -> bool {
        let mut lasting = self.timeline.lasting(drone, [start, end]);
        let is_more = |sum: u64| sum as f64 / f64::from(self.budget) > share;
        lasting.any(|item| is_more(item.peak) && is_more(item.filled(start, end)))
    }

    fn part(&self, drone: DroneId, part: u32) -> Option<&Item> {
        let items = self.timeline.of(drone);
        items
            .get(part as usize)
            .map(|&item| self.timeline.item(item))
    }

    /// For how many drones there is room.
    pub fn drone_count(&self) -> usize {
        self.legs.len()
    }

    /// What a drone has reserved; empty if it is not planned.
    pub fn legs(&self, drone: DroneId) -> &[Leg] {
        &self.legs[drone.0 as usize]
    }

    fn wakes(&self) -> Wakes<'_> {
        Wakes {
            fleet: &self.fleet,
            surfaces: &self.surfaces,
        }
    }

    /// The legs of all drones near a footprint that a span of time touches.
    fn items_near(&self, around: &Footprint, start: Tick, end: Tick) -> Vec<&Item> {
        let mut found = Vec::new();
        self.timeline
            .around(around, start, end, |_, item| found.push(item));
        found.sort_unstable_by_key(|item| (item.leg.drone, item.leg.start));
        found
    }

    /// Reserves a drone's legs, bodies and wakes, in place of what it had reserved.
    pub fn insert(&mut self, legs: Vec<Leg>) {
        self.reserve(self.reservation(legs));
    }

    /// What a drone's legs bring to every place, independent of all others: it can be worked out
    /// for several drones at a time.
    pub fn reservation(&self, legs: Vec<Leg>) -> Reservation {
        let far_wake_loads = self.far_wake_loads(&legs);
        Reservation {
            legs,
            far_wake_loads,
        }
    }

    /// What a drone's legs add to the far-wake background.
    fn far_wake_loads(&self, legs: &[Leg]) -> Vec<FarWakeLoads> {
        match self.fleet.conditions().wakes {
            true => far_wake_loads(
                &self.fleet,
                self.timeline.ground(),
                self.surfaces.floor_z_m(),
                legs,
            ),
            false => Vec::new(),
        }
    }

    /// [`Costmap::insert`] of what is known already.
    pub fn reserve(&mut self, reservation: Reservation) {
        let Reservation {
            legs,
            far_wake_loads,
        } = reservation;
        let Some(first) = legs.first() else { return };
        let drone = first.drone;
        self.remove(drone);
        self.timeline.forget_all_incoming();
        let mut all: Vec<(Leg, [Tick; 2], f64)> = Vec::new();
        for leg in &legs {
            let (whole, end_z_m) = ([leg.start, leg.end], self.wake_end_z_m(leg));
            all.extend(parts(leg).map(|part| (part, whole, end_z_m)));
        }
        let pair_loads: Vec<Vec<PairLoads>> = match self.fleet.conditions().wakes {
            true => all
                .par_iter()
                .map(|(part, _, end)| self.meets(part, *end))
                .collect(),
            false => vec![Vec::new(); all.len()],
        };
        for ((part, whole, end_z_m), pair_loads) in all.into_iter().zip(pair_loads) {
            let index = self.timeline.add(part, whole, end_z_m);
            for (other, on_me, on_them) in pair_loads {
                if on_me.load > 0 {
                    self.timeline.meets(index, on_me);
                }
                if on_them.load > 0 {
                    self.timeline.meets(other, on_them);
                }
            }
        }
        let wakes = Wakes {
            fleet: &self.fleet,
            surfaces: &self.surfaces,
        };
        for leg in &legs {
            self.zones.add(leg, wakes);
        }
        self.far_wakes.add(&far_wake_loads);
        self.legs[drone.0 as usize] = legs;
    }

    /// What a part and those that are close to it bring one another, in a row what one drone
    /// brings; see [`peak`].
    fn meets(&self, part: &Leg, wake_end_z_m: f64) -> Vec<PairLoads> {
        let mut pair_loads = Vec::new();
        self.close_to(part, |other, item| {
            let ends = [wake_end_z_m, item.wake_end_z_m];
            if let Some(meeting) = self.fleet.meet(part, &item.leg, ends) {
                let on_me = self.incoming(part, &item.leg, meeting.load_on_first);
                let on_them = self.incoming(&item.leg, part, meeting.load_on_second);
                pair_loads.push((other, on_me, on_them));
            }
        });
        pair_loads.sort_by_key(|(_, on_me, _)| on_me.from);
        pair_loads
    }

    /// Calls `f` with all legs that are not so far off that [`FarWakes`] accounts for them.
    fn close_to<'a>(&'a self, part: &Leg, mut f: impl FnMut(u32, &'a Item)) {
        let ground = self.timeline.ground();
        let own = Footprint::around(part, 0.0);
        let around = ground.hull(ground.bins(&own), self.fleet.pairwise_within_m());
        let [since, until] = self.window(part);
        self.timeline.around(&around, since, until, |index, item| {
            if item.leg.drone != part.drone {
                f(index, item);
            }
        });
    }

    /// When others may be under way that matter to a leg, or it to them, while they and their air
    /// last.
    fn window(&self, leg: &Leg) -> [Tick; 2] {
        let shift = self.shift();
        [
            leg.start.before(shift + self.others_delay(leg)),
            leg.end.after(shift + self.own_delay(leg)),
        ]
    }

    /// How long the air of a leg outlasts it, at most (ticks).
    fn own_delay(&self, leg: &Leg) -> u32 {
        self.fleet.delay_down_to(leg, self.surfaces.floor_z_m())
    }

    /// How long air that a leg meets may have been under way, at most (ticks).
    fn others_delay(&self, leg: &Leg) -> u32 {
        if !self.fleet.is_advected() {
            return 0;
        }
        let top_z_m = self.surfaces.floor_z_m() + self.fleet.conditions().deepest_m;
        self.fleet
            .longest_delay(top_z_m - leg.from_m.z.min(leg.to_m.z))
    }

    /// Takes back all that a drone has reserved, if it has anything.
    pub fn remove(&mut self, drone: DroneId) -> Option<Reservation> {
        let legs = std::mem::take(&mut self.legs[drone.0 as usize]);
        let (Some(first), Some(last)) = (legs.first(), legs.last()) else {
            return None;
        };
        self.timeline.forget_all_incoming();
        let mut loaded = Vec::new();
        for &index in self.timeline.of(drone) {
            self.close_to(&self.timeline.item(index).leg, |other, item| {
                if item.incoming.iter().any(|incoming| incoming.from == drone) {
                    loaded.push(other);
                }
            });
        }
        loaded.sort_unstable();
        loaded.dedup();
        for other in loaded {
            self.timeline.forget(other, drone);
        }
        self.timeline.remove(drone);
        let far_wake_loads = self.far_wake_loads(&legs);
        self.far_wakes.take_back(&far_wake_loads);
        if self.zones.limit_air() {
            let late = legs.iter().map(|leg| self.own_delay(leg)).max();
            let clear = last.end.after(late.unwrap_or(0) + self.shift());
            let since = first.start.before(self.shift());
            self.zones.remove(drone, since, clear);
        }
        Some(Reservation {
            legs,
            far_wake_loads,
        })
    }

    /// Height at which the wake of a leg ends (m).
    pub fn wake_end_z_m(&self, leg: &Leg) -> f64 {
        if !leg.flying {
            return f64::INFINITY;
        }
        self.surfaces
            .wake_end_z_m(self.fleet.wake(leg.kind), &leg.from_m, &leg.to_m)
    }

    /// All legs that can matter to a leg, or it to them, while they and their air last.
    pub fn near(&self, leg: &Leg) -> Vec<&Item> {
        let around = Footprint::around(leg, self.fleet.reach_m(leg.kind));
        let [since, until] = self.window(leg);
        let mut found = self.items_near(&around, since, until);
        found.retain(|item| item.leg.drone != leg.drone);
        found
    }

    /// Judges a leg against all legs near and the zones.
    pub fn judge(&self, leg: &Leg, verdict: &mut Verdict) {
        self.judge_parts(leg, verdict, |part, verdict| {
            self.judge_fully(part, self.budget, verdict)
        });
    }

    /// The same in a tenth of the time: by bounds for drones that are not close, and without a look
    /// at what the leg's own weak wake adds far off. Ask [`Costmap::are_loads_within_budget`] once
    /// a whole path is known. Where it is asked to, it leaves a part of the budget to drones that
    /// come later.
    pub fn judge_nearby(&self, leg: &Leg, spares: bool, verdict: &mut Verdict) {
        let budget = self.budget_of(leg, spares);
        self.judge_parts(leg, verdict, |part, verdict| {
            let before = (verdict.blockers.len(), verdict.price_s);
            let enough = [false, true].into_iter().any(|exactly| {
                verdict.blockers.truncate(before.0);
                verdict.price_s = before.1;
                self.judge_close(part, (exactly, budget), verdict)
            });
            if !enough {
                verdict.blockers.truncate(before.0);
                verdict.price_s = before.1;
                self.judge_fully(part, budget, verdict);
            }
        });
    }

    /// What a leg may fill of the budgets of others.
    fn budget_of(&self, leg: &Leg, spares: bool) -> u32 {
        let spare = if spares && !leg.stays() { SPARE } else { 0.0 };
        (f64::from(self.budget) * (1.0 - spare)) as u32
    }

    fn judge_parts(&self, leg: &Leg, verdict: &mut Verdict, judge: impl Fn(&Leg, &mut Verdict)) {
        verdict.clear();
        for part in parts(leg) {
            judge(&part, verdict);
        }
        self.judge_zones(leg, verdict);
    }

    /// Adds which zone a leg's wake is too strong for, alone or with others'.
    pub fn judge_zones(&self, leg: &Leg, verdict: &mut Verdict) {
        if leg.flying && self.fleet.conditions().wakes {
            self.zones.judge(leg, self.wakes(), verdict);
        }
    }

    /// Whether the loads of these legs on all drones farther off are within their budgets.
    pub fn are_loads_within_budget(&self, legs: &[Leg]) -> bool {
        let are_loads_within_budget =
            |leg: &Leg| parts(leg).all(|part| self.are_far_loads_within_budget(&part));
        legs.par_iter()
            .all(|leg| !leg.flying || are_loads_within_budget(leg))
    }

    /// Whether all drones that [`Costmap::close_to`] leaves out have a part's wake within their
    /// budgets.
    fn are_far_loads_within_budget(&self, part: &Leg) -> bool {
        let ground = self.timeline.ground();
        let own = Footprint::around(part, 0.0);
        let bins = ground.bins(&own.grown(self.fleet.wake_reach_m(part.kind)));
        let mut own_end_z_m = None;
        for (bin, gap_m) in ground.rows(bins).flatten().zip(ground.gaps_m(&own, bins)) {
            let load = u64::from(self.fleet.far_load_on_any(part.kind, gap_m));
            let filled = self.timeline.fullest(bin) + self.far_wakes.worst_in(bin);
            let is_close = gap_m < self.fleet.pairwise_within_m();
            if is_close || load == 0 || filled + load <= u64::from(self.budget) {
                continue;
            }
            let [since, until] = self.window(part);
            for (_, item) in self.timeline.over(bin, since, until) {
                if item.leg.drone == part.drone || self.is_within_budget_by_bound(part, &own, item)
                {
                    continue;
                }
                let end_z_m = *own_end_z_m.get_or_insert_with(|| self.wake_end_z_m(part));
                let ends = [end_z_m, item.wake_end_z_m];
                let meeting = self.fleet.meet(part, &item.leg, ends);
                let load = meeting.map_or(0, |meeting| meeting.load_on_second);
                let time = self.fleet.exposed_during(&item.leg, part);
                if load > 0 && !self.is_within_budget(item, &time, (load, self.budget)) {
                    return false;
                }
            }
        }
        true
    }

    /// Adds whether one drone blocks a leg, with all that it meets so far, and a part of its budget
    /// left to drones that come later.
    pub fn judge_against(&self, drone: DroneId, leg: &Leg, verdict: &mut Verdict) {
        let (budget, price_s) = (self.budget_of(leg, true), verdict.price_s);
        for part in parts(leg) {
            let own = Footprint::around(&part, 0.0);
            for item in self.timeline.lasting(drone, self.window(&part)) {
                if self.is_in_time(&part, &item.leg)
                    && !self.is_within_budget_by_bound(&part, &own, item)
                {
                    let end_z_m = self.wake_end_z_m(&part);
                    self.judge_one((&part, budget), end_z_m, item, verdict);
                }
            }
        }
        verdict.price_s = price_s;
    }

    /// Whether a part's wake is within a planned leg's budget, to judge by their distance alone.
    fn is_within_budget_by_bound(&self, part: &Leg, own: &Footprint, item: &Item) -> bool {
        let gap_m = own.gap_m(&item.footprint);
        let load = u64::from(self.fleet.far_load(part.kind, item.leg.kind, gap_m));
        let worst = self.far_wakes.worst(self.timeline.ground(), item.bins);
        !item.leg.flying || load == 0 || item.peak + worst + load <= u64::from(self.budget)
    }

    /// Whether this much more is within a planned leg's budget during a time.
    fn is_within_budget(
        &self,
        item: &Item,
        time: &Range<Tick>,
        (load, budget): (u32, u32),
    ) -> bool {
        // What is less than the rest may have it.
        let budget = if load > self.budget - budget {
            budget
        } else {
            self.budget
        };
        let (budget, load) = (u64::from(budget), u64::from(load));
        let far_wakes = &self.far_wakes;
        item.peak + far_wakes.worst(self.timeline.ground(), item.bins) + load <= budget
            || {
                let ground = self.timeline.ground();
                let weak = far_wakes.on(ground, item.bins, time.start, time.end);
                item.filled(time.start, time.end) + weak + load <= budget
            }
            || load <= budget && self.summed(item, time) + load <= budget
    }

    /// The most that all wakes fill of a planned leg's budget at any moment of a time, each looked
    /// at, in millionths.
    fn summed(&self, item: &Item, time: &Range<Tick>) -> u64 {
        let all_incoming = item.all_incoming.get_or_init(|| {
            let near = self.near(&item.leg).into_iter();
            let incoming = near.filter_map(|other| {
                let ends = [item.wake_end_z_m, other.wake_end_z_m];
                let meeting = self.fleet.meet(&item.leg, &other.leg, ends)?;
                let load = meeting.load_on_first;
                (load > 0).then(|| self.incoming(&item.leg, &other.leg, load))
            });
            incoming.collect()
        });
        peak(all_incoming, time.start, time.end)
    }

    /// Judges close drones, and takes bounds for the rest. `false` if bounds will not do: `exactly`
    /// they serve for none that is close.
    fn judge_close(
        &self,
        part: &Leg,
        (exactly, budget): (bool, u32),
        verdict: &mut Verdict,
    ) -> bool {
        let own = Footprint::around(part, 0.0);
        let mut own_end_z_m = None;
        let mut incoming = std::mem::take(&mut verdict.incoming);
        incoming.clear();
        self.close_to(part, |_, item| {
            if !self.is_in_time(part, &item.leg) {
                return;
            }
            let (mine, theirs) = (part.kind, item.leg.kind);
            let gap_m = own.gap_m(&item.footprint);
            let is_exact = exactly || gap_m < self.fleet.exact_within_m(mine, theirs);
            let load = if is_exact || !self.is_within_budget_by_bound(part, &own, item) {
                let end_z_m = *own_end_z_m.get_or_insert_with(|| self.wake_end_z_m(part));
                self.judge_one((part, budget), end_z_m, item, verdict)
            } else if part.flying && item.leg.flying {
                self.fleet.far_load(theirs, mine, gap_m)
            } else {
                0
            };
            if load > 0 {
                incoming.push(self.incoming_and_blocker(part, item, load));
            }
        });
        let emits = part.flying && self.fleet.conditions().wakes;
        let enough = !emits || {
            let ground = self.timeline.ground();
            let weak = self
                .far_wakes
                .on(ground, ground.bins(&own), part.start, part.end);
            let weak = u32::try_from(weak).unwrap_or(u32::MAX);
            let all = incoming
                .iter()
                .map(|(incoming, _)| u64::from(incoming.load));
            all.sum::<u64>() + u64::from(weak) <= u64::from(budget)
                || self.block_sums(part, [weak, budget], false, &incoming, verdict)
        };
        verdict.incoming = incoming;
        enough
    }

    /// Whether the loads fit into the budget at every moment of a part; if they `must`, those that
    /// do not are blocked.
    fn block_sums(
        &self,
        part: &Leg,
        [weak, budget]: [u32; 2],
        must: bool,
        incoming: &[(IncomingLoad, Blocker)],
        verdict: &mut Verdict,
    ) -> bool {
        // A sum only grows where something begins.
        let begins = incoming
            .iter()
            .filter(|(it, _)| part.start < it.start && it.start < it.end);
        let begins = begins.map(|(incoming, _)| incoming.start);
        for moment in std::iter::once(part.start).chain(begins) {
            let lasts = |it: &IncomingLoad| it.start <= moment && moment < it.end;
            let together = || incoming.iter().filter(|(it, _)| lasts(it));
            let sum: u64 = together().map(|(it, _)| u64::from(it.load)).sum();
            if sum + u64::from(weak) <= u64::from(budget) {
                continue;
            }
            let mut loads: Vec<(u32, Blocker)> = Vec::new();
            for (it, blocker) in together() {
                record_max_load(&mut loads, it.load, *blocker);
            }
            let sum: u64 = loads.iter().map(|(load, _)| u64::from(*load)).sum();
            if sum + u64::from(weak) <= u64::from(budget) {
                continue;
            }
            if !must {
                return false;
            }
            block_largest(&mut loads, weak.min(budget), budget, verdict);
        }
        true
    }

    /// Judges against one other; what it brings unless it forbids the leg.
    fn judge_one(
        &self,
        (part, budget): (&Leg, u32),
        own_end_z_m: f64,
        item: &Item,
        verdict: &mut Verdict,
    ) -> u32 {
        let ends = [own_end_z_m, item.wake_end_z_m];
        let Some(meeting) = self.fleet.meet(part, &item.leg, ends) else {
            return 0;
        };
        let is_within_budget = |load: u32| {
            let theirs = self.fleet.exposed_during(&item.leg, part);
            self.is_within_budget(item, &theirs, (load, budget))
        };
        let why = if meeting.bodies {
            Some(Why::Bodies)
        } else if meeting.column {
            Some(Why::Column)
        } else if meeting.load_on_first > self.budget {
            Some(Why::OwnLimit)
        } else if meeting.load_on_second > 0 && !is_within_budget(meeting.load_on_second) {
            Some(Why::TheirLimit)
        } else {
            None
        };
        if let Some(why) = why {
            verdict.blockers.push(self.blocker(part, item, why));
            return 0;
        }
        verdict.price_s += match self.fleet.is_advected() {
            true => self.fleet.price_s(part, &item.leg, ends),
            false => {
                let prices = price(meeting.alpha_first) + price(meeting.alpha_second);
                shared_s(part, item) * prices
            }
        };
        meeting.load_on_first
    }

    /// Looks at all legs near, and sums what lasts together.
    fn judge_fully(&self, part: &Leg, budget: u32, verdict: &mut Verdict) {
        let end_z_m = self.wake_end_z_m(part);
        let mut incoming = Vec::new();
        for item in self.near(part) {
            let load = self.judge_one((part, budget), end_z_m, item, verdict);
            if load > 0 {
                incoming.push(self.incoming_and_blocker(part, item, load));
            }
        }
        self.block_sums(part, [0, budget], true, &incoming, verdict);
    }

    /// How much earlier or later one drone may be, seen from another (ticks).
    fn shift(&self) -> u32 {
        self.fleet.conditions().shift
    }

    /// What a part meets of a leg's wake, and that leg as blocker.
    fn incoming_and_blocker(&self, part: &Leg, item: &Item, load: u32) -> (IncomingLoad, Blocker) {
        let late = self.shift() + self.fleet.delay_between(&item.leg, part);
        let time = part.within(&item.leg, [self.shift(), late]);
        let incoming = IncomingLoad {
            from: item.leg.drone,
            start: time.start,
            end: time.end,
            load,
        };
        (incoming, self.blocker(part, item, Why::OwnLimit))
    }

    /// Whether a part and a leg are under way together, or the air of one is with the other.
    fn is_in_time(&self, part: &Leg, other: &Leg) -> bool {
        let shift = self.shift();
        if part.end.after(shift) <= other.start {
            let late = self.fleet.delay_between(part, other);
            return part.end.after(shift + late) > other.start;
        }
        if other.end.after(shift) <= part.start {
            let late = self.fleet.delay_between(other, part);
            return other.end.after(shift + late) > part.start;
        }
        true
    }

    /// A whole leg as blocker of a part, while it may be.
    fn blocker(&self, part: &Leg, item: &Item, why: Why) -> Blocker {
        let [before, after] = match why {
            Why::OwnLimit => [0, self.fleet.delay_between(&item.leg, part)],
            Why::TheirLimit => [self.fleet.delay_between(part, &item.leg), 0],
            Why::Bodies | Why::Column | Why::Zone => [0; 2],
        };
        Blocker {
            drone: item.leg.drone,
            why,
            began: item.began.before(self.shift() + before),
            clear: item.clear.after(self.shift() + after),
            flown: [item.began, item.clear],
        }
    }

    /// What one leg meets of another's wake.
    fn incoming(&self, on: &Leg, from: &Leg, load: u32) -> IncomingLoad {
        let time = self.fleet.exposed_during(on, from);
        IncomingLoad {
            from: from.drone,
            start: time.start,
            end: time.end,
            load,
        }
    }
}

/// A leg that stays, whole; others in parts of a second, slow ones of more, if they last for more
/// than two.
fn parts(leg: &Leg) -> impl Iterator<Item = Leg> + '_ {
    let whole = is_whole(leg);
    let step = if whole { u32::MAX } else { part_ticks(leg) };
    let mut next = Some(leg.start);
    std::iter::from_fn(move || {
        let start = next?;
        let end = start.after(step).min(leg.end);
        next = (end < leg.end).then_some(end);
        Some(if whole { *leg } else { leg.between(start, end) })
    })
}

/// Which of the parts in which a leg is kept lasts at a moment.
pub fn part_at(leg: &Leg, at: Tick) -> u32 {
    if is_whole(leg) {
        0
    } else {
        (at.0 - leg.start.0) / part_ticks(leg)
    }
}

fn is_whole(leg: &Leg) -> bool {
    leg.stays() || leg.end.0 - leg.start.0 <= PART_TICKS
}

/// How long a leg that ends shares with another (s).
fn shared_s(leg: &Leg, item: &Item) -> f64 {
    let time = leg.overlap(&item.leg);
    if time.end == Tick::FOREVER || time.is_empty() {
        return 0.0;
    }
    time.end.seconds() - time.start.seconds()
}

#[cfg(test)]
mod tests;
