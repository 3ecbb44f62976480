//! Decay curves, ISO 3382 parameters with intervals, differences.
