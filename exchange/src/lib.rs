//! Plans in the formats that other programs fly, and those formats read back. Bytes in, bytes out:
//! no files.
//!
//! [`export()`] turns a plan into files, then reads these files with [`read`], which shares no
//! code with [`mod@write`], and measures how far what they say is from the plan. A file that a
//! vehicle could not hold is not written: every drone that does not fit is a [`Refusal`].
//!
//! In reading order: [`frame`]: which axes a file has; [`course`]: a plan's motions as cubic Bézier
//! pieces, which the writers take; [`mod@write`]: one file a format; [`flown`]: what readers give,
//! polynomials in time; [`kept`]: what a show says
//! beside them; [`read`]: one file a format; [`deviation`]: both, compared; [`untimed`]: a plan
//! whose times a format does not hold; `standing`: a plan whose drones come or leave.
//!
//! World frame: metres, z up; seconds from the plan's beginning.

pub mod course;
pub mod deviation;
pub mod export;
pub mod flown;
pub mod frame;
pub mod import;
pub mod kept;
pub mod lights;
pub mod read;
mod standing;
pub mod untimed;
pub mod write;

pub use export::{
    Export, ExportError, File, Manifest, Options, RATE_DEFAULT_HZ, RATES_HZ, Refusal, Target,
    export,
};
pub use import::{Show, ShowError, read_show};
