//! Decay curves, ISO 3382 parameters with intervals, differences.
//!
//! Computes room-acoustic parameters from a response (energy echograms with batch estimates):
//!
//! - [`decay`]: Schroeder's backward integration, with what follows the record estimated by [`tail`] and steps at [`listed`] arrivals;
//! - [`regression`]: reverberation times with their decay range and non-linearity;
//! - [`modulation`]: modulation transfer and the speech transmission index;
//! - [`parameter`]: the parameters of one echogram; [`receiver`]: those of a whole response;
//! - `lateral`: lateral fractions and the late lateral level, where the response has directions;
//! - `support`: stage support at receivers one metre from a source;
//! - [`open_plan`]: parameters of open-plan offices;
//! - [`modal`]: bands below the Schroeder frequency;
//! - [`average`] and [`single`]: single numbers and means over receivers; [`seats`]: their standard deviations;
//! - [`echo`]: the echo criterion of Dietsch and Kraak;
//! - [`jackknife`] and [`student`]: their intervals over batches; [`outlier`]: when intervals are unreliable;
//! - [`materials`]: their uncertainty by that of the absorption of materials;
//! - [`report`]: tables, CSV and JSON (docs/interface.md); [`cell`] and [`shown`]: names in them.
//!
//! [`comparison`] finds the parameters of two responses that differ beyond noise, [`map_comparison`] the places, times and
//! bands of two maps.
//!
//! And from a map: [`survey`] walks its paths for the energy ledger and what arrived where, [`sonels`] lists its sonels one
//! by one, [`export`] writes them for other programs.
//!
//! A parameter that the echogram cannot support is an [`Unsupported`] with its reason, never a number.

pub mod average;
pub mod batches;
pub mod cell;
pub mod comparison;
pub mod decay;
pub mod derived;
pub mod echo;
pub mod estimate;
pub mod export;
pub mod jackknife;
mod lateral;
pub mod listed;
pub mod map_comparison;
pub mod materials;
mod missing;
pub mod modal;
pub mod modulation;
pub mod octave;
pub mod open_plan;
pub mod outlier;
pub mod parameter;
pub mod reading;
pub mod receiver;
pub mod regression;
pub mod report;
pub mod seats;
pub mod sensitivity;
pub mod shown;
pub mod single;
mod skewness;
pub mod sonels;
pub mod speech;
pub mod student;
mod support;
pub mod survey;
pub mod tail;
pub mod what_if;
pub mod window;

pub use decay::{DecayCurve, Echogram};
pub use estimate::{Estimate, Interval, NoInterval, ParameterValue, Unsupported};
pub use parameter::Parameter;
pub use receiver::{BandParameters, ReceiverParameters, parameters, some_parameters};
