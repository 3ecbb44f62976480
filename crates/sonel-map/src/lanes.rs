//! Band values in lanes of four, so that the compiler vectorises; lanes after the last band are zero.

/// Four bands side by side.
pub type Lanes = [f64; 4];

/// How many lanes hold `bands` bands.
#[must_use]
pub const fn lanes_of(bands: usize) -> usize {
    bands.div_ceil(4)
}

/// Spreads per-band values over lanes, zeros behind.
#[must_use]
pub fn to_lanes(values: impl IntoIterator<Item = f64>) -> Vec<Lanes> {
    let mut lanes: Vec<Lanes> = Vec::new();
    for (band, value) in values.into_iter().enumerate() {
        if band % 4 == 0 {
            lanes.push([0.0; 4]);
        }
        lanes[band / 4][band % 4] = value;
    }
    lanes
}

/// Multiplies every band.
pub(crate) fn multiply(energy: &mut Lanes, factor: &Lanes) {
    for lane in 0..4 {
        energy[lane] *= factor[lane];
    }
}
