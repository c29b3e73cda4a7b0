//! Round after round, until nearly every drone is home.

use super::configuration::{AgentState, Configuration};
use super::round::Round;

/// Drones that may be on their way yet when the rounds end, of all: chosen here, a fiftieth. The
/// last few push one another out of their homes in turn, and are sooner planned one after another.
const LAST_SHARE: usize = 50;
/// Rounds without one in which fewer steps are left than ever before: chosen here, longer than a
/// queue takes to dissolve.
const MOST_IN_VAIN: usize = 60;

/// Where every drone is after each round, up to the one that left the fewest steps; `None` if it
/// was told to stop.
pub(super) fn rounds(
    configuration: &Configuration<'_>,
    starts: Vec<AgentState>,
    seed: u64,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Vec<AgentState>>> {
    let drones = configuration.len();
    let left = |all: &[AgentState]| -> u32 {
        let of = |drone: usize| configuration.steps_left(drone, &all[drone]);
        (0..drones).map(of).sum()
    };
    // How long each has been on its way since it was last at home; at first, those with farther to
    // go are before others.
    let far = |drone: usize| configuration.steps_left(drone, &starts[drone]);
    let farthest = (0..drones).map(far).max().unwrap_or(0);
    let first = |drone: usize| far(drone) as f32 / (farthest + 1) as f32;
    let mut urgency: Vec<f32> = (0..drones).map(first).collect();
    let mut order: Vec<u32> = (0..drones as u32).collect();
    let (mut fewest, mut best) = (left(&starts), 0);
    let mut all = vec![starts];
    while fewest > 0 && all.len() - best <= MOST_IN_VAIN {
        if stop() {
            return None;
        }
        let now = &all[all.len() - 1];
        order.sort_by(|a, b| urgency[*b as usize].total_cmp(&urgency[*a as usize]));
        let random = seed ^ (all.len() as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let ways = Round::new(configuration, now, random).decide_all(&order);
        let after =
            |(drone, way): (usize, &u8)| configuration.after(drone, &now[drone], usize::from(*way));
        let next: Vec<AgentState> = ways.iter().enumerate().map(after).collect();
        for (drone, urgency) in urgency.iter_mut().enumerate() {
            *urgency = if configuration.is_home(drone, &next[drone]) {
                urgency.fract()
            } else {
                *urgency + 1.0
            };
        }
        let now_left = left(&next);
        let away = (0..drones).filter(|&drone| !configuration.is_home(drone, &next[drone]));
        let away = away.count();
        all.push(next);
        if now_left < fewest {
            (fewest, best) = (now_left, all.len() - 1);
            if away * LAST_SHARE <= drones {
                break;
            }
        }
    }
    all.truncate(best + 1);
    Some(all)
}
