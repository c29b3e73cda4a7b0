//! Orders in which a fleet is planned.

use std::collections::VecDeque;

use costmap::leg::DroneId;

use crate::solver::prepare::Job;

/// Shortest alone first; later orders shuffle neighbours in that order more and more.
pub(super) fn order_of(job: &Job, order: u64, seed: u64) -> VecDeque<DroneId> {
    let mut keyed: Vec<(u64, DroneId)> = job
        .agents
        .iter()
        .map(|agent| {
            let alone = u64::from(agent.alone_ticks);
            let noise = splitmix64(seed ^ (order << 32) ^ u64::from(agent.drone.0)) % 1000;
            // In the first order noise only breaks ties.
            (
                alone * 1000 + order * alone * noise / 2 + noise,
                agent.drone,
            )
        })
        .collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, drone)| drone).collect()
}

/// G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
fn splitmix64(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
