//! Renders echograms at any receivers from a sonel map.
