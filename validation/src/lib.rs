//! Validation: recordings with an injected effect, made in a world that shares no code with
//! `airflow`; answers; metrics.
//!
//! # In reading order
//!
//! `world`: its air, instruments, drones. `flights`: which drone flies where. `injected`: the
//! effects. `families`: which goes with which; `drawn`: families that the seed draws, half of
//! which ([`Half::Unseen`]) are for totals alone. `scene` and `recorded`: what is recorded.
//! [`Truth`], sealed until there is an [`Answer`]. [`metrics`]: how good the answers are.
//! [`hover_grid`]: flights over one probe, for calibrations. [`folder`]: a recording as the texts
//! of its folder.
//!
//! ```
//! use validation::{Answer, Half, prove};
//!
//! // An answer that never names an effect raises no false alarm.
//! let metrics = prove(Half::Shown, 1, 8, |_recording| Answer::nothing());
//! assert_eq!(metrics.false_alarms.hits, 0);
//! assert_eq!(metrics.detected.hits, 0);
//! ```

mod answer;
mod drawn;
mod families;
mod flights;
pub mod folder;
pub mod hover_grid;
mod injected;
pub mod metrics;
mod names;
mod recorded;
mod scene;
mod truth;
mod world;

use rayon::prelude::*;

pub use answer::{Answer, Named, answer, ask};
pub use diagnosis::infer::candidates::is_sensor;
pub use drawn::Half;
pub use names::canonical;
pub use truth::{DETECTABLE_CHI2, Injected, Sealed, Size, Truth};

use diagnosis::record::recording::Recording;
use diagnosis::statistics::draws::Draws;
use families::{Family, NULLS, injecting, injecting_families};
use metrics::{Assessed, Metrics};

/// A recording and what is true of it.
#[derive(Clone, Debug)]
pub struct Case {
    /// What the diagnosis gets: its name tells nothing.
    pub recording: Recording,
    /// What it does not get.
    pub truth: Sealed,
}

/// What each of five cases in turn is. Two in five have no injected effect, so that a few hundred
/// cases have their hundred nulls.
const TURN: [FamilyIndex; 5] = [
    FamilyIndex::Null(0),
    FamilyIndex::Injecting(0),
    FamilyIndex::Null(1),
    FamilyIndex::Injecting(1),
    FamilyIndex::Injecting(2),
];
const NULLS_A_TURN: usize = 2;
const INJECTING_A_TURN: usize = 3;

#[derive(Clone, Copy, Debug)]
enum FamilyIndex {
    Null(usize),
    Injecting(usize),
}

/// Family and size of listed case number `index`.
fn kind(index: usize) -> (&'static Family, Size) {
    let turn = index / TURN.len();
    match TURN[index % TURN.len()] {
        FamilyIndex::Null(at) => (&NULLS[(turn * NULLS_A_TURN + at) % NULLS.len()], Size::Mid),
        FamilyIndex::Injecting(at) => {
            let nth = turn * INJECTING_A_TURN + at;
            let (round, place) = (nth / injecting_families(), nth % injecting_families());
            // A family meets another size every time round.
            (
                injecting(place),
                Size::ALL[(round + place + 1) % Size::ALL.len()],
            )
        }
    }
}

/// Case number `index` of a seed and a half: the same for every count and on every machine.
///
/// Two in five have no injected effect. Of those shown, every second case is of a listed family:
/// these go through all families and, in turn, all sizes; the others are drawn.
#[must_use]
pub fn case(half: Half, seed: u64, index: usize) -> Case {
    let mut random = Draws::new(seed.wrapping_mul(0x2545_F491_4F6C_DD1D) ^ (index as u64) << 20);
    let is_listed = half == Half::Shown && (index / TURN.len()).is_multiple_of(2);
    let (words, scene) = match is_listed {
        true => listed(
            index / (2 * TURN.len()) * TURN.len() + index % TURN.len(),
            &mut random,
        ),
        false => {
            let is_null = matches!(TURN[index % TURN.len()], FamilyIndex::Null(_));
            drawn::drawn(half, is_null, &mut random)
        }
    };
    let name = format!("p{:08x}", random.bits() as u32);
    let (recording, truth) = scene.fly(&name, words, &mut random);
    Case {
        recording,
        truth: Sealed::new(truth),
    }
}

/// A scene of a listed family, and what it is called.
fn listed(index: usize, random: &mut Draws) -> (String, scene::Scene) {
    let (family, size) = kind(index);
    let words = match (family.is_null(), size) {
        (true, _) => family.name.to_owned(),
        (false, Size::Weak) => format!("{}_weak", family.name),
        (false, Size::Mid) => format!("{}_mid", family.name),
        (false, Size::Strong) => format!("{}_strong", family.name),
    };
    (words, family.scene(size, random))
}

/// Makes so many cases, has each diagnosed, and only then unblinds it. Cases run side by side; the
/// metrics are in their order.
pub fn prove(
    half: Half,
    seed: u64,
    count: usize,
    diagnose: impl Fn(&Recording) -> Answer + Sync,
) -> Metrics {
    let of_case = |index: usize| {
        let Case { recording, truth } = case(half, seed, index);
        let answer = diagnose(&recording);
        Assessed::of(&truth.unblind(&answer), &answer)
    };
    let assessed: Vec<Assessed> = (0..count).into_par_iter().map(of_case).collect();
    Metrics::over(assessed)
}

#[cfg(test)]
mod tests;
