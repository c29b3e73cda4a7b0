//! One file a check: each names what breaks its rule as violations.
//!
//! | file | rules | asks |
//! | --- | --- | --- |
//! | `contents` | malformed | the data of the plan alone |
//! | `limits` | jump, speed, bounds | one flight, piece by piece |
//! | `obstacle` | obstacle | one flight and [`obstacles`](super::bounds::obstacles) |
//! | `collision` | collision | pairs from [`encounters`](super::time::encounters) |
//! | `column` | column | [`windows`](super::time::window) of one receiver |
//! | `air` | air; exposure and energy | the same windows |
//! | `zone` | zone | all wakes, over box and time |
//!
//! A new check is a file here, a kind in the plan, a line in the table of [`verify`](super), and a
//! plan that breaks it in `tests/promises/verifier/`.

pub(crate) mod air;
pub(super) mod collision;
mod column;
pub(super) mod contents;
pub(super) mod limits;
pub(crate) mod obstacle;
pub(crate) mod zone;
