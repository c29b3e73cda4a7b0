//! One file a check: each names what breaks its rule as violations.
//!
//! | file | rules | asks |
//! | --- | --- | --- |
//! | `contents` | malformed | the data of the plan alone |
//! | `limits` | jump, speed, bounds, climb, descent, sideways, touchdown | one flight, piece by piece |
//! | `smooth` | velocity jump, acceleration jump, acceleration, jerk | one flight that claims to be smooth |
//! | `obstacle` | obstacle, with tracking margin; keep-out | one flight and [`obstacles`](super::bounds::obstacles) |
//! | `collision` | collision | pairs from [`encounters`](super::time::encounters) |
//! | `column` | column | [`windows`](super::time::window) of one receiver |
//! | `air` | air; exposure and energy | the same windows |
//! | `zone` | zone, also with drones early or late | all wakes, over box and time |
//! | `shifted_pairs` | collision and column with margins | pairs, each drone at a time of its own |
//! | `shifted_air` | air with margins | one receiver, each wake at a time of its own |
//! | `lateness` | no rule: how late each drone may be | the two before |
//!
//! A new check is a file here, a kind in the plan, a line in the table of [`verify`](super), and a
//! plan that breaks it in `tests/promises/verifier/`.

pub(crate) mod air;
pub(super) mod collision;
mod column;
pub(super) mod contents;
pub mod lateness;
pub(super) mod limits;
pub(crate) mod obstacle;
pub(super) mod shifted_air;
pub(super) mod shifted_pairs;
pub(super) mod smooth;
pub(crate) mod zone;
