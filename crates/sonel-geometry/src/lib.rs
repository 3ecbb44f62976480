//! Meshes, planar surfaces, watertight ray casting, edges.
