//! A leg against the fleet: free, priced or forbidden, and by whom.

use crate::leg::{DroneId, Leg, Tick};
use crate::reservations::background::{FarWakes, Spread, spreads};
use crate::reservations::ground::{Footprint, Ground};
use crate::reservations::timeline::{BUCKET_TICKS, Item, Timeline};
use crate::reservations::zones::{Wakes, ZoneBox, Zones};
use crate::verdict::Incoming;
use crate::wake::fleet::{BUDGET, Fleet, WHOLE};
use crate::wake::surfaces::BlockingSurfaces;

/// Legs on the move that last longer are judged and kept in parts: chosen here, a second holds a typical one.
const PART_TICKS: u32 = 200;

/// The legs of a fleet, and what another leg would mean to them.
#[derive(Clone, Debug)]
pub struct Costmap {
    pub(crate) fleet: Fleet,
    pub(crate) surfaces: BlockingSurfaces,
    pub(crate) zones: Zones,
    pub(crate) timeline: Timeline,
    pub(crate) far_wakes: FarWakes,
    /// Per drone, what was inserted.
    legs: Vec<Vec<Leg>>,
    /// What the loads on one drone or zone may add up to, in millionths of its limit.
    pub(crate) budget: u32,
}

/// A drone's legs, ready to be reserved.
#[derive(Clone, Debug)]
pub struct Reservation {
    legs: Vec<Leg>,
    spreads: Vec<Spread>,
}

impl Reservation {
    /// The legs.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Whose legs they are; `None` if there are none.
    pub fn drone(&self) -> Option<DroneId> {
        self.legs.first().map(|leg| leg.drone)
    }
}

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

    /// The same fleet, were every drone's air limit this many times higher. Bodies, columns and zones stay
    /// as they are.
    #[must_use]
    pub fn with_limits_raised(&self, times: f64) -> Costmap {
        let raised = f64::from(self.fleet.load(times)) * f64::from(BUDGET) / WHOLE;
        Costmap {
            budget: raised.min(f64::from(u32::MAX / 2)) as u32,
            ..self.clone()
        }
    }

    /// What flies.
    pub fn fleet(&self) -> &Fleet {
        &self.fleet
    }

    /// Whether there are zones.
    pub fn has_zones(&self) -> bool {
        !self.zones.is_empty()
    }

    /// Whether there is anything above the floor that stops a wake.
    pub fn has_blocking_surfaces(&self) -> bool {
        self.surfaces.has_tops()
    }

    /// Whether air takes its time to come down.
    pub fn has_advected_wakes(&self) -> bool {
        self.fleet.longest_delay() > 0
    }

    /// What others' wakes that are close fill, at most, of the budget of a drone in one of its parts: those of its legs
    /// in turn, see [`part_at`].
    pub fn filled(&self, drone: DroneId, part: u32) -> f64 {
        let item = self.part(drone, part);
        item.map_or(0.0, |item| item.peak as f64 / f64::from(self.budget))
    }

    /// The same between two ticks.
    pub fn filled_between(&self, drone: DroneId, part: u32, [start, end]: [Tick; 2]) -> f64 {
        let filled = |item: &Item| item.filled(start, end) as f64 / f64::from(self.budget);
        self.part(drone, part).map_or(0.0, filled)
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

    /// From here on nothing changes any more: the end of all legs that end, and of the air that they leave behind.
    pub fn horizon(&self) -> Tick {
        self.timeline.horizon()
    }

    pub(crate) fn wakes(&self) -> Wakes<'_> {
        Wakes {
            fleet: &self.fleet,
            surfaces: &self.surfaces,
        }
    }

    pub(crate) fn budget(&self) -> u32 {
        self.budget
    }

    /// The legs of all drones near a footprint that a span of time touches.
    pub(crate) fn items_near(&self, around: &Footprint, start: Tick, end: Tick) -> Vec<&Item> {
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

    /// What a drone's legs bring to every place, independent of all others: it can be worked out for several drones at a time.
    pub fn reservation(&self, legs: Vec<Leg>) -> Reservation {
        let spreads = if self.sums_ahead() {
            spreads(&self.fleet, self.timeline.ground(), &legs)
        } else {
            Vec::new()
        };
        Reservation { legs, spreads }
    }

    /// [`Costmap::insert`] of what is known already.
    pub fn reserve(&mut self, reservation: Reservation) {
        let Reservation { legs, spreads } = reservation;
        let Some(first) = legs.first() else { return };
        let drone = first.drone;
        self.remove(drone);
        let last = legs
            .iter()
            .map(|leg| {
                if leg.end == Tick::FOREVER {
                    leg.start
                } else {
                    leg.end
                }
            })
            .max();
        let delay = self.fleet.longest_delay();
        self.timeline
            .extend_to(last.unwrap_or_default().after(delay));
        self.zones.extend_to(self.timeline.bucket_count());
        for leg in &legs {
            let end_z_m = self.wake_end_z_m(leg);
            for part in parts(leg) {
                self.insert_part(part, [leg.start, leg.end], end_z_m);
            }
            let wakes = Wakes {
                fleet: &self.fleet,
                surfaces: &self.surfaces,
            };
            self.zones.add(leg, wakes, &self.timeline);
        }
        if self.sums_ahead() {
            self.far_wakes.extend_to(self.timeline.bucket_count());
            self.far_wakes.add(&spreads);
        }
        self.legs[drone.0 as usize] = legs;
    }

    fn insert_part(&mut self, part: Leg, whole: [Tick; 2], wake_end_z_m: f64) {
        let mut met = Vec::new();
        if !self.sums_ahead() {
            self.timeline.add(part, whole, wake_end_z_m);
            return;
        }
        self.close_to(&part, |other, item| {
            let ends = [wake_end_z_m, item.wake_end_z_m];
            if let Some(meeting) = self.fleet.meet(&part, &item.leg, ends) {
                let on_me = incoming(&part, &item.leg, meeting.load_on_first);
                met.push((
                    other,
                    on_me,
                    incoming(&item.leg, &part, meeting.load_on_second),
                ));
            }
        });
        let index = self.timeline.add(part, whole, wake_end_z_m);
        for (other, on_me, on_them) in met {
            if on_me.load > 0 {
                self.timeline.meets(index, on_me);
            }
            if on_them.load > 0 {
                self.timeline.meets(other, on_them);
            }
        }
    }

    /// Calls `f` with all legs that are not so far off that [`FarWakes`] accounts for them.
    pub(crate) fn close_to<'a>(&'a self, part: &Leg, mut f: impl FnMut(u32, &'a Item)) {
        let ground = self.timeline.ground();
        let own = Footprint::around(part, 0.0);
        let around = ground.hull(ground.bins(&own), self.fleet.near_m());
        self.timeline
            .around(&around, part.start, part.end, |index, item| {
                if item.leg.drone != part.drone {
                    f(index, item);
                }
            });
    }

    /// Takes back all that a drone has reserved.
    pub fn remove(&mut self, drone: DroneId) {
        let legs = std::mem::take(&mut self.legs[drone.0 as usize]);
        let (Some(first), Some(last)) = (legs.first(), legs.last()) else {
            return;
        };
        let mut loaded = Vec::new();
        for &index in self.timeline.of(drone) {
            self.close_to(&self.timeline.item(index).leg, |other, item| {
                if item.met.iter().any(|incoming| incoming.from == drone) {
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
        if self.sums_ahead() {
            let spreads = spreads(&self.fleet, self.timeline.ground(), &legs);
            self.far_wakes.take_back(&spreads);
        }
        if !self.zones.is_empty() {
            let clear = last.end.after(self.fleet.longest_delay());
            let buckets = self.timeline.buckets(first.start, clear);
            self.zones.remove(drone, buckets);
        }
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
        let delay = self.fleet.longest_delay();
        let since = Tick(leg.start.0.saturating_sub(delay));
        let mut found = self.items_near(&around, since, leg.end.after(delay));
        found.retain(|item| item.leg.drone != leg.drone);
        found
    }

    /// Whether what wakes add up to is kept with each leg. Advected wakes are added up when they are asked for.
    fn sums_ahead(&self) -> bool {
        self.fleet.conditions().wakes && self.fleet.longest_delay() == 0
    }
}

/// What one leg meets of another's wake.
pub(crate) fn incoming(on: &Leg, from: &Leg, load: u32) -> Incoming {
    let time = on.overlap(from);
    Incoming {
        from: from.drone,
        start: time.start,
        end: time.end,
        load,
    }
}

/// A leg that stays, whole; others in parts of a second, if they last for more than two.
pub(crate) fn parts(leg: &Leg) -> impl Iterator<Item = Leg> + '_ {
    let whole = is_whole(leg);
    let step = if whole { u32::MAX } else { BUCKET_TICKS };
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
        (at.0 - leg.start.0) / BUCKET_TICKS
    }
}

fn is_whole(leg: &Leg) -> bool {
    leg.stays() || leg.end.0 - leg.start.0 <= PART_TICKS
}

#[cfg(test)]
mod tests;
