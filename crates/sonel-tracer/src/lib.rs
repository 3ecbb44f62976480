//! Emission, interaction, propagation, fates and the energy ledger.
