//! The sonel map: paths on disk, sonels by sweeping them.
