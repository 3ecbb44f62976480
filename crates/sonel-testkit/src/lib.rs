//! Test kit: statistical tests, and rooms with known answers.
//!
//! A dev-dependency only. It depends on no other crate of the workspace, so that every one of them may use it and
//! so that nothing it states is derived from the code under test: rooms are written down from formulas, in `f64`,
//! with points and directions as plain `[f64; 3]`.
//!
//! - [`chi_square`] and [`z_test`] judge samplers and estimators, [`significance`] splits a level over many tests;
//! - [`uniform`] drives them: a tiny generator, constant for ever;
//! - [`analytic`] holds the rooms with exact answers, [`bruteforce`] the one with a slow but obvious answer;
//! - [`row_of_rooms`] is as slow for several rooms and what passes between them;
//! - [`exponential`] and [`decay`] serve the parameter code: ideal decays with closed forms, and a plain regression;
//! - [`waves`] solves the wave equation between walls, slowly;
//! - [`meshes`] writes one room in every mesh format;
//! - [`test_folder`] is a folder in which the tests of programs run them, [`broken_streams`] runs them where nobody reads what they print.
//!
//! None of it is fit for production: speed, portability of the last bit and forgiving errors are not aims here.

pub mod analytic;
pub mod broken_streams;
pub mod bruteforce;
pub mod chi_square;
pub mod decay;
pub mod exponential;
pub mod meshes;
mod quadrature;
pub mod row_of_rooms;
pub mod significance;
pub mod test_folder;
pub mod uniform;
mod vector;
pub mod waves;
pub mod z_test;
