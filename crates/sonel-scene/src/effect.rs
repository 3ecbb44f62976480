//! Effects that a scene may call for, and scenes without them.
//!
//! Reference: docs/effects.md.

use sonel_acoustics::Directivity;

use crate::scene::{Scene, attenuation_per_band};

/// An effect that a scene may call for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Edge diffraction of deterministic paths.
    Diffraction,
    /// Energy of low frequencies at walls, which the interior lacks.
    Boundary,
    /// Sound through partitions.
    Transmission,
    /// Sound between regions of different air.
    Refraction,
    /// Attenuation by air.
    Air,
    /// Directivity of sources.
    Directivity,
}

impl Effect {
    /// All effects in the order of the interface.
    pub const ALL: [Self; 6] = [
        Self::Diffraction,
        Self::Boundary,
        Self::Transmission,
        Self::Refraction,
        Self::Air,
        Self::Directivity,
    ];

    /// Name in `--effects` and in maps.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Diffraction => "diffraction",
            Self::Boundary => "boundary",
            Self::Transmission => "transmission",
            Self::Refraction => "refraction",
            Self::Air => "air",
            Self::Directivity => "directivity",
        }
    }

    /// The effect with this [name](Self::name).
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|effect| effect.name() == name)
    }
}

impl Scene {
    /// Leaves `effect` out in all bands: partitions absorb what they transmitted; regions, the faces that bound them and the gradient are
    /// removed; air does not attenuate; sources are omnidirectional. A scene states nothing of edges but its faces, which stay.
    pub fn leave_out(&mut self, effect: Effect) {
        match effect {
            Effect::Diffraction | Effect::Boundary => {}
            Effect::Transmission => {
                for material in self.materials.iter_mut().chain(self.variants.iter_mut().flatten()) {
                    material.transmission.fill(0.0);
                }
            }
            Effect::Refraction => {
                self.sound_speed_gradient = 0.0;
                if let Some(media) = self.media.take() {
                    self.mesh.triangles.retain(|triangle| !media.is_interface(triangle.material));
                }
            }
            Effect::Air => {
                let regions = self.media.iter_mut().flat_map(|media| &mut media.regions);
                let all =
                    regions.map(|region| &mut region.air_attenuation).chain([&mut self.air_attenuation]);
                all.for_each(|attenuation| attenuation.fill(0.0));
            }
            Effect::Directivity => {
                for source in &mut self.sources {
                    source.directivity = Directivity::OMNI;
                }
            }
        }
    }

    /// Gives every air the attenuation of its state.
    pub fn attenuate_by_air(&mut self) {
        self.air_attenuation = attenuation_per_band(&self.air, &self.bands);
        for region in self.media.iter_mut().flat_map(|media| &mut media.regions) {
            region.air_attenuation = attenuation_per_band(&region.air, &self.bands);
        }
    }
}
