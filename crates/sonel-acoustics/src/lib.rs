//! Vocabulary of room acoustics: bands, levels, air, materials, directivity, statistical formulas.
