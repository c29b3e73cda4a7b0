//! One wake with what bounds it: how far it reaches, and how fast it is over ranges of places.
//!
//! Far field: the centreline falls and the half-width grows with depth, the profile falls outwards,
//! so
//!
//! ```text
//! U <= U_C(s_lo) f(r_lo / r_half(s_hi))
//! ```
//!
//! and that is one value of the field times a ratio of centreline speeds. Near field (and the join,
//! which is smooth) and wakes that effects have moved or reshaped: from [`tables`](super::tables).
//! All of it closes in on the field as the ranges shrink. Offsets are from the drone, in the
//! world's axes; a box of them is its lowest and highest corner. Round wakes are asked by the
//! distance from their axis, which is nearer to the truth than the box; moved wakes by the box.

use std::collections::VecDeque;
use std::ops::RangeInclusive;
use std::sync::{Arc, Mutex, PoisonError};

use airflow::Flown;
use airflow::{Airframe, CrossSection, DiscPoints, Jet, Wake};
use nalgebra::{Vector2, Vector3};

use super::tables::{MovedTable, NearTable};
use crate::verify::extents::{FAINTEST_WAKE_MPS, Places};

/// Depth below the end of the near field from which the far-field bound is taken, as a factor on
/// it: rounding must not ask for a centreline above its range.
const JUST_BELOW: f64 = 1.0 + 1e-9;
/// Depth of one step of the table of reaches, in near-field depths: chosen here.
const REACH_STEP: f64 = 0.5;
/// Steps of that table, chosen here; below the last the greatest reach of all is taken.
const REACH_STEPS: usize = 128;

/// A wake with its bounds.
#[derive(Clone, Debug)]
pub(crate) struct BoundedWake {
    /// The air that it bounds.
    pub(crate) wake: Wake,
    bounds: WakeBounds,
}

#[derive(Clone, Debug)]
enum WakeBounds {
    Round {
        near: Arc<NearTable>,
        /// Radius beyond which it is fainter than [`FAINTEST_WAKE_MPS`], at any depth up to each
        /// step (m).
        reach_m: Arc<[f64]>,
    },
    Moved {
        table: Arc<MovedTable>,
        deepest_m: f64,
    },
}

impl BoundedWake {
    /// Bounds down to a depth (m); only those of moved wakes end there.
    ///
    /// Tabulates the near field, or every layer of a moved wake: milliseconds, so [`WakeCache`]
    /// keeps them.
    pub(crate) fn new(wake: Wake, deepest_m: f64) -> BoundedWake {
        let bounds = if wake.is_shaped() {
            WakeBounds::Moved {
                table: Arc::new(MovedTable::new(&wake, deepest_m)),
                deepest_m,
            }
        } else {
            WakeBounds::Round {
                near: Arc::new(NearTable::new(&wake)),
                reach_m: reaches(&wake),
            }
        };
        BoundedWake { wake, bounds }
    }

    /// The same airframe at another mass (kg).
    fn with_mass(&self, mass_kg: f64) -> BoundedWake {
        let wake = self.wake.with_mass(mass_kg);
        match &self.bounds {
            WakeBounds::Round { near, .. } => BoundedWake {
                bounds: WakeBounds::Round {
                    near: Arc::clone(near),
                    reach_m: reaches(&wake),
                },
                wake,
            },
            // How far wind moves a jet depends on how heavy its drone is.
            WakeBounds::Moved { deepest_m, .. } => BoundedWake::new(wake, *deepest_m),
        }
    }

    /// The same drone while it climbs at a speed (m/s, up positive).
    pub(crate) fn climbing(&self, flown: &Flown, climb_mps: f64) -> BoundedWake {
        let bounds = self.bounds.clone();
        let wake = match bounds {
            WakeBounds::Round { .. } => self.wake.clone(),
            WakeBounds::Moved { .. } => flown.climbing(&self.wake, climb_mps),
        };
        BoundedWake { wake, bounds }
    }

    /// Whether it need not be round, nor below its drone.
    pub(crate) fn is_moved(&self) -> bool {
        matches!(self.bounds, WakeBounds::Moved { .. })
    }

    /// What tables are multiplied with (m/s).
    fn unit_mps(&self) -> f64 {
        match self.bounds {
            WakeBounds::Round { .. } => self.wake.induced_velocity_mps(),
            WakeBounds::Moved { .. } => self.wake.gain() * self.wake.induced_velocity_mps(),
        }
    }

    /// Radius beyond which it is fainter than [`FAINTEST_WAKE_MPS`] anywhere down to a depth (m).
    pub(crate) fn reach_m(&self, depth_m: f64) -> f64 {
        match &self.bounds {
            WakeBounds::Round { reach_m, .. } => {
                let step = depth_m / (REACH_STEP * self.wake.near_field_depth_m());
                reach_m[(step.max(0.0) as usize).min(REACH_STEPS)]
            }
            WakeBounds::Moved { table, .. } => {
                table.reach_m(FAINTEST_WAKE_MPS / self.unit_mps(), depth_m)
            }
        }
    }

    /// The wake over a range of depths below the rotor plane (m).
    pub(crate) fn passage(&self, depth_m: (f64, f64)) -> Passage<'_> {
        let mut passage = Passage {
            bounded: self,
            is_calm: depth_m.1 <= 0.0,
            starts_below: depth_m.0 > 0.0,
            far: None,
            near: None,
            middle: None,
        };
        if let (false, WakeBounds::Round { near, .. }) = (passage.is_calm, &self.bounds) {
            let near_depth_m = self.wake.near_field_depth_m();
            // Where one field ends and the other begins both count.
            if depth_m.1 >= near_depth_m {
                passage.far = Some(Far::new(&self.wake, depth_m));
            }
            if depth_m.0 <= near_depth_m {
                let layers = near.layers(depth_m.0.max(0.0), depth_m.1.min(near_depth_m));
                passage.near = Some((near, layers));
            }
        }
        passage
    }

    /// Highest axial speed (m/s) over a box of offsets that lie at least so far from the axis (m).
    pub(crate) fn highest_mps(&self, places_m: &Places, off_axis_m: f64) -> f64 {
        let passage = self.passage((-places_m.1.z, -places_m.0.z));
        passage.highest(Vector2::new(off_axis_m, 0.0), places_m).0
    }

    /// The same along a path through the box of which the offset of the middle (m) and half the
    /// length (m) are known.
    pub(crate) fn highest_along_mps(
        &self,
        places_m: &Places,
        off_axis_m: f64,
        middle_m: &Vector3<f64>,
        half_path_m: f64,
    ) -> f64 {
        let mut passage = self.passage((-places_m.1.z, -places_m.0.z));
        let nearest_m = Vector2::new(off_axis_m, 0.0);
        passage.highest_along_mps(nearest_m, places_m, middle_m, half_path_m)
    }

    /// Steepest change of the axial speed with place (1/s) over a box of offsets that lie at least
    /// so far from the axis (m). It holds along paths that stay below the rotor plane.
    pub(crate) fn steepest_per_s(&self, places_m: &Places, off_axis_m: f64) -> f64 {
        let passage = self.passage((-places_m.1.z, -places_m.0.z));
        let nearest_m = Vector2::new(off_axis_m, 0.0);
        let (_, slope_per_s) = passage.highest(nearest_m, places_m);
        let far = passage.far.as_ref().map_or(0.0, |far| {
            let over_speed = self.wake.far_field().steepest_over_speed_per_m(far.top_m);
            far.highest_mps(nearest_m) * over_speed.unwrap_or(f64::INFINITY)
        });
        far.max(slope_per_s)
    }
}

/// One wake over a range of depths, made ready for many points of a receiver.
pub(crate) struct Passage<'a> {
    bounded: &'a BoundedWake,
    /// The whole range lies at or above the rotor plane.
    is_calm: bool,
    /// The whole range lies below the rotor plane, where air begins.
    starts_below: bool,
    far: Option<Far<'a>>,
    near: Option<(&'a NearTable, RangeInclusive<usize>)>,
    /// The level through the middle, made when first asked for.
    middle: Option<CrossSection<'a>>,
}

impl<'a> Passage<'a> {
    /// The far field's part, where nothing else counts.
    pub(crate) fn far_alone(&self) -> Option<&Far<'a>> {
        self.far.as_ref().filter(|_| self.near.is_none())
    }

    /// Highest axial speed (m/s), and steepest slope (1/s; 0 in the far field), at and beyond a
    /// level offset; a moved wake goes by the box of offsets instead.
    fn highest(&self, nearest_m: Vector2<f64>, places_m: &Places) -> (f64, f64) {
        let far_mps = (self.far.as_ref()).map_or(0.0, |far| far.highest_mps(nearest_m));
        let (speed, slope_per_m) = match (&self.bounded.bounds, &self.near) {
            (WakeBounds::Moved { table, .. }, _) if !self.is_calm => table.highest(places_m),
            (_, Some((near, layers))) => near.highest(layers.clone(), nearest_m.norm()),
            _ => return (far_mps, 0.0),
        };
        let unit_mps = self.bounded.unit_mps();
        (far_mps.max(speed * unit_mps), slope_per_m * unit_mps)
    }

    /// Highest axial speed (m/s) at and beyond a level offset, along a path of which the offset of
    /// the middle and half the length are known (m). All middles of one passage are at one height.
    pub(crate) fn highest_along_mps(
        &mut self,
        nearest_m: Vector2<f64>,
        places_m: &Places,
        middle_m: &Vector3<f64>,
        half_path_m: f64,
    ) -> f64 {
        let (speed_mps, slope_per_s) = self.highest(nearest_m, places_m);
        let change_mps = slope_per_s * half_path_m;
        // The far field's bound is its own. A path so long that the slope tells no more than the
        // table is not looked at; nor one through the rotor plane, where air begins.
        if self.far_alone().is_some()
            || !self.starts_below
            || change_mps.is_nan()
            || change_mps >= speed_mps
        {
            return speed_mps;
        }
        let wake = &self.bounded.wake;
        let middle = (self.middle).get_or_insert_with(|| wake.cross_section(-middle_m.z));
        speed_mps.min(middle.axial_speed_mps(middle_m.x, middle_m.y) + change_mps)
    }
}

/// The far field's part of a range of depths.
pub(crate) struct Far<'a> {
    top_m: f64,
    bottom: CrossSection<'a>,
    /// Centreline speed at the top over that at the bottom.
    ratio: f64,
}

impl<'a> Far<'a> {
    /// The part of a range of depths (m) that lies below the near field.
    fn new(wake: &'a Wake, depth_m: (f64, f64)) -> Far<'a> {
        let top_m = depth_m.0.max(wake.near_field_depth_m() * JUST_BELOW);
        let bottom_m = depth_m.1.max(top_m);
        let ratio = match (wake.centreline_mps(top_m), wake.centreline_mps(bottom_m)) {
            (Some(top), Some(bottom)) if bottom > 0.0 => top / bottom,
            _ => 1.0,
        };
        Far {
            top_m,
            bottom: wake.cross_section(bottom_m),
            ratio,
        }
    }

    /// Highest axial speed (m/s) at and beyond a level offset (m).
    #[inline]
    pub(crate) fn highest_mps(&self, nearest_m: Vector2<f64>) -> f64 {
        self.bottom.axial_speed_mps(nearest_m.x, nearest_m.y) * self.ratio
    }
}

/// Greatest radius of the faintest wake counted, at any depth up to each step (m).
fn reaches(wake: &Wake) -> Arc<[f64]> {
    let near_depth_m = wake.near_field_depth_m();
    let end_m = wake.iso_speed_end_m(FAINTEST_WAKE_MPS).max(near_depth_m);
    let at = |depth_m: f64| {
        let depth_m = depth_m.max(near_depth_m * JUST_BELOW);
        let radius_m = wake.radius_at_speed_m(depth_m, FAINTEST_WAKE_MPS);
        radius_m.unwrap_or(0.0)
    };
    // The near field reaches as far as the far field at its end: 5 motor distances against 2 for a
    // Gaussian.
    let mut greatest_m = at(near_depth_m);
    let mut table = Vec::with_capacity(REACH_STEPS + 1);
    for step in 1..=REACH_STEPS {
        greatest_m = greatest_m.max(at(step as f64 * REACH_STEP * near_depth_m));
        table.push(greatest_m);
    }
    // The iso-speed volume is one arch: 64 samples miss its greatest radius by far less than the 2
    // % added.
    let just_below_m = near_depth_m * JUST_BELOW;
    let over_all = (1..64).map(|k| at(just_below_m + f64::from(k) / 64.0 * (end_m - near_depth_m)));
    table.push(over_all.fold(greatest_m, f64::max));
    table.iter().map(|reach_m| 1.02 * reach_m).collect()
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct PlanAir {
    density_kg_per_m3: f64,
    jet: Jet,
    flown: Flown,
    deepest_m: f64,
}

/// A wake that was bounded, and what it follows from.
struct CachedWake {
    air: PlanAir,
    airframe: Airframe,
    mass_kg: f64,
    wake: Arc<BoundedWake>,
}

/// Wakes bounded in this process, the latest last: a plan is judged by its contents alone, many
/// times while it is made and flown, in the air of the time before. No answer depends on what is
/// in here.
static LATEST: Mutex<VecDeque<CachedWake>> = Mutex::new(VecDeque::new());
/// So many are kept: chosen here, the layers of one that the wind lays down take a megabyte.
const KEPT: usize = 32;

/// Wakes and rotor discs by airframe and mass: each near field is tabulated once for an airframe.
pub(crate) struct WakeCache {
    air: PlanAir,
    known: Vec<CachedWakes>,
}

struct CachedWakes {
    airframe: Airframe,
    discs: Arc<DiscPoints>,
    /// By mass (kg), the airframe's own first.
    wakes: Vec<(f64, Arc<BoundedWake>)>,
}

impl WakeCache {
    /// An empty cache, for air of a density (kg/m³), a jet, what a finding adds to it, and wakes
    /// down to a depth (m).
    pub(crate) fn new(density_kg_per_m3: f64, jet: Jet, flown: Flown, deepest_m: f64) -> WakeCache {
        WakeCache {
            air: PlanAir {
                density_kg_per_m3,
                jet,
                flown,
                deepest_m,
            },
            known: Vec::new(),
        }
    }

    /// Of the air (kg/m³).
    pub(crate) fn density_kg_per_m3(&self) -> f64 {
        self.air.density_kg_per_m3
    }

    /// Why the air cannot be judged below an airframe.
    pub(crate) fn beyond(&self, airframe: &Airframe) -> Option<String> {
        self.air.flown.beyond(airframe, self.air.density_kg_per_m3)
    }

    /// The wake of an airframe that hovers at a mass (kg), and its discs.
    pub(crate) fn get(
        &mut self,
        airframe: &Airframe,
        mass_kg: f64,
    ) -> (Arc<BoundedWake>, Arc<DiscPoints>) {
        let known = self.known.iter().position(|it| it.airframe == *airframe);
        let index = known.unwrap_or_else(|| {
            let PlanAir {
                density_kg_per_m3,
                jet,
                flown,
                deepest_m,
            } = self.air;
            let bare_kg = airframe.mass_kg();
            let bare = self.latest(airframe, bare_kg, || {
                let plain = Wake::new(airframe, bare_kg, density_kg_per_m3, &jet);
                BoundedWake::new(flown.wake(&plain), deepest_m)
            });
            self.known.push(CachedWakes {
                airframe: airframe.clone(),
                discs: Arc::new(airframe.disc_points()),
                wakes: vec![(bare_kg, bare)],
            });
            self.known.len() - 1
        });
        let wakes = &self.known[index].wakes;
        let same = wakes.iter().find(|(known_kg, _)| *known_kg == mass_kg);
        let wake = match same {
            Some((_, wake)) => Arc::clone(wake),
            None => {
                let bare = &wakes[0].1;
                let wake = self.latest(airframe, mass_kg, || bare.with_mass(mass_kg));
                self.known[index].wakes.push((mass_kg, Arc::clone(&wake)));
                wake
            }
        };
        (wake, Arc::clone(&self.known[index].discs))
    }

    /// A wake in this air, made unless it is one of the latest.
    fn latest(
        &self,
        airframe: &Airframe,
        mass_kg: f64,
        make: impl FnOnce() -> BoundedWake,
    ) -> Arc<BoundedWake> {
        let latest = || LATEST.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it = |it: &CachedWake| {
            it.mass_kg == mass_kg && it.airframe == *airframe && it.air == self.air
        };
        let known = (latest().iter())
            .find(|it| is_it(it))
            .map(|it| Arc::clone(&it.wake));
        // Not under the lock: it is made on all threads, which may want one as well.
        let wake = known.unwrap_or_else(|| Arc::new(make()));
        let mut latest = latest();
        latest.retain(|it| !is_it(it));
        if latest.len() == KEPT {
            latest.pop_front();
        }
        latest.push_back(CachedWake {
            air: self.air,
            airframe: airframe.clone(),
            mass_kg,
            wake: Arc::clone(&wake),
        });
        wake
    }
}
