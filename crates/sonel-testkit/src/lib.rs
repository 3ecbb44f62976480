//! For tests only: chi-square, z-test, analytic rooms.
