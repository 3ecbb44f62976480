//! Random streams and warps: every random number of the simulator comes from here.
