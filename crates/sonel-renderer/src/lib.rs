//! From sonel map to echograms: receivers and one module per path class.
