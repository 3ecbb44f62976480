//! Traces sonels through a scene and saves the sonel map.
