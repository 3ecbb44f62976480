//! Hard cases of geometry, coefficients and input, one named case each, in their quick form.
//!
//! docs/stability.md lists the promises of the main cases. `cargo xtask accept` runs the same cases in their long form.

mod cases;

/// Which form of the hard cases this binary runs.
const FORM: cases::Form = cases::Form::Quick;
