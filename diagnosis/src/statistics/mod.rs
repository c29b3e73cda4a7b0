//! What is signal and what is noise: tests, trees, expressions and intervals on plain numbers.
//!
//! Nothing here knows air or recordings: values come as slices and nalgebra matrices, samples by
//! rows. Samples of one series (one probe, one receiver) depend on one another, so every test, fold
//! and interval works on [`sequence::Blocks`] of them. Every draw comes from a seed.
//!
//! # In reading order
//!
//! [`draws`], [`quantile`], [`robust`] and [`tail`]: random numbers, order statistics, losses that
//! gross errors cannot carry away, and tail probabilities. [`sequence`]: which sample follows
//! which, and blocks of them. [`simultaneous`]: do series err together? [`noise`]: how far values
//! scatter, and whitening. [`mod@column`]: shapes that a residual is tested against.
//! [`mod@lack_of_fit`]: the global lack-of-fit test. [`spectrum`]: does it pulsate?
//! [`change_point`]: does it step? [`mod@scan`]: where is it? [`held_out`]: does a prediction hold
//! where it was not fitted? [`trees`]: the most that any function of the covariates explains.
//! [`expression`]: the shortest formula for it. [`bootstrap`]: how sure an error is.
//!
//! # Example
//!
//! A reading that is 5 % of the flow too low below 1 m, in noise of 0.05 m/s:
//!
//! ```
//! use diagnosis::statistics::column;
//! use diagnosis::statistics::draws::Draws;
//! use diagnosis::statistics::lack_of_fit::{Evidence, lack_of_fit};
//! use diagnosis::statistics::noise::{self, Whitener};
//! use diagnosis::statistics::sequence::{Blocks, Sequence};
//! use nalgebra::DMatrix;
//!
//! let mut random = Draws::new(1);
//! let t_s: Vec<f64> = (0..900).map(f64::from).collect();
//! // A minute at each height.
//! let height_m: Vec<f64> = (0..900).map(|i| f64::from(i / 60) / 7.0).collect();
//! let flow_mps = vec![2.0; 900];
//! let residual_mps: Vec<f64> = height_m
//!     .iter()
//!     .map(|&h| 0.05 * random.normal() - if h < 1.0 { 0.1 } else { 0.0 })
//!     .collect();
//!
//! let sequence = Sequence::new(&t_s, &[0; 900]);
//! let noise = noise::estimate(&sequence, &residual_mps, &flow_mps, 0.0).expect("900 samples");
//! let whitener = Whitener::new(&noise, &sequence, &flow_mps);
//! let answer = lack_of_fit(&Evidence {
//!     residual: &whitener.whiten(&residual_mps),
//!     columns: &column::whitened(&column::bins(&[height_m], &flow_mps), &whitener),
//!     nuisances: &DMatrix::zeros(900, 0),
//!     blocks: &Blocks::new(&sequence, &t_s),
//!     rhythms: &[],
//! });
//! assert!(answer.is_significant);
//! ```

pub mod bootstrap;
pub mod bursts;
pub mod change_point;
pub mod column;
pub mod curve;
pub mod draws;
pub mod expression;
pub mod held_out;
pub mod lack_of_fit;
pub(crate) mod line;
pub mod noise;
pub mod quantile;
pub mod robust;
pub mod scan;
pub mod sequence;
pub mod simultaneous;
pub mod spectrum;
pub mod tail;
pub mod trees;
