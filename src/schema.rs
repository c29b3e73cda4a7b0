//! `plan schema`: the scenario's fields, units and defaults.

use crate::Answer;
use crate::failure::{Failure, answer};

pub(crate) fn run() -> Result<Answer, Failure> {
    answer("")?;
    Ok(Answer::Yes)
}
