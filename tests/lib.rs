//! Tests that cross crates: pipeline, physics, stability.
