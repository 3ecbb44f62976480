//! The scene file and its mesh: loading, validation, the compiled scene.
