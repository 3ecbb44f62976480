//! Bands with equal coefficients: their energies are equal on every path and are computed once. Likewise leads with equal probabilities.

use sonel_acoustics::Material;
use sonel_scene::Source;

use crate::spectral::Spectral;

/// Bands grouped into classes of equal columns, in the order of their first bands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BandClasses {
    of_band: Vec<u32>,
    first_band: Vec<u32>,
}

impl BandClasses {
    /// Every band on its own.
    #[must_use]
    pub fn separate(bands: usize) -> Self {
        let of_band: Vec<u32> = (0..bands as u32).collect();
        Self { first_band: of_band.clone(), of_band }
    }

    /// Bands with the same coefficients in all `materials` and the same `attenuation` are one class. Bands whose paths are
    /// their own never share one, nor do bands where a source has a measured directivity.
    #[must_use]
    pub fn alike(
        materials: &[Material],
        sources: &[Source],
        attenuation: &[f64],
        spectral: Spectral,
    ) -> Self {
        if spectral == Spectral::PerBand || sources.iter().any(|source| source.directivity.is_measured()) {
            return Self::separate(attenuation.len());
        }
        let column = |band: usize| -> Vec<u64> {
            let coefficients = materials.iter().flat_map(|material| {
                [material.absorption[band], material.scattering[band], material.transmission[band]]
            });
            coefficients.chain([attenuation[band]]).map(f64::to_bits).collect()
        };
        Self::equal((0..attenuation.len()).map(column))
    }

    /// Equal columns are one class.
    #[must_use]
    pub fn equal(all: impl Iterator<Item = Vec<u64>>) -> Self {
        let mut columns: Vec<Vec<u64>> = Vec::new();
        let (mut of_band, mut first_band) = (Vec::new(), Vec::new());
        for (band, column) in all.enumerate() {
            let class = columns.iter().position(|known| *known == column).unwrap_or_else(|| {
                columns.push(column);
                first_band.push(band as u32);
                columns.len() - 1
            });
            of_band.push(class as u32);
        }
        Self { of_band, first_band }
    }

    /// Number of classes.
    #[must_use]
    pub fn count(&self) -> usize {
        self.first_band.len()
    }

    /// Number of bands.
    #[must_use]
    pub fn bands(&self) -> usize {
        self.of_band.len()
    }

    /// The class of `band`.
    #[must_use]
    pub fn of(&self, band: usize) -> usize {
        self.of_band[band] as usize
    }

    /// One band of each class.
    pub fn representatives(&self) -> impl Iterator<Item = usize> + '_ {
        self.first_band.iter().map(|&band| band as usize)
    }

    /// Values of the bands, from those of the classes.
    pub fn spread<T: Clone>(&self, of_class: &[T]) -> Vec<T> {
        self.of_band.iter().map(|&class| of_class[class as usize].clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_columns_are_one_class() {
        let wall =
            Material { absorption: vec![0.1, 0.2, 0.1, 0.1], ..Material::uniform("wall", 0.0, 0.5, 4) };
        let still = BandClasses::alike(std::slice::from_ref(&wall), &[], &[0.0; 4], Spectral::Shared);
        assert_eq!((still.count(), still.spread(&['a', 'b'])), (2, vec!['a', 'b', 'a', 'a']));
        let air =
            BandClasses::alike(std::slice::from_ref(&wall), &[], &[0.0, 0.0, 0.0, 0.1], Spectral::Shared);
        assert_eq!(air.count(), 3);
        assert_eq!(BandClasses::alike(&[wall], &[], &[0.0; 4], Spectral::PerBand), BandClasses::separate(4));
    }
}
