//! Echograms with batch statistics, discrete arrivals: types and files.
