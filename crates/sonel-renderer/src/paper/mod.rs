//! The founding paper's own rendering pass, [Kapralos2006] section 3: to reproduce it and to be compared with.
//!
//! | class | means | module |
//! |---|---|---|
//! | L R | shadow ray | [`crate::exact::direct`] |
//! | L S⁺ R | a visibility ray, mirrored at least once, meets a sphere that stands for the source | [`rays`] |
//! | … D S* R | a visibility ray ends by its roulette on a diffuse reflection; the sonels in a disc there are counted | [`rays`] |
//! | L E R | share of the first Fresnel zone that source and receiver both see | [`zone`] |
//!
//! Where the paper is silent or contradicts itself, docs/paper-mode.md says how it is read, and how far off each reading is.

pub(crate) mod rays;
pub(crate) mod zone;

use sonel_geometry::Geometry;
use sonel_map::Mode;

use crate::ball::CLEARANCE;
use crate::disc_size::{disc_radius, free_path};
use crate::path_class::PathClass;
use crate::settings::RenderSettings;
use crate::stochastic::gather::disc::Sheet;
use sonel_diffraction::Wedge;

/// Radius of the source's sphere at [`REFERENCE_RAYS`], relative to the mean free path [1]. Chosen, not measured: that of receiver spheres;
/// doubled, its bias is four times as large and a quarter of the rays suffices.
const SPHERE_PER_FREE_PATH: f64 = 0.12;
/// Radius of a disc, relative to the mean free path [1]. Chosen, not measured: half the sphere's; doubled, its bias is four times as large
/// and it holds four times as many sonels.
const DISC_PER_FREE_PATH: f64 = 0.06;
/// Number of rays M at which the radius is as stated; it goes as M^(−1/6), so that the O(a²) bias vanishes as fast as the noise.
const REFERENCE_RAYS: f64 = 16_384.0;

/// The paper's pass, prepared for one map.
pub(crate) struct Paper {
    /// Surfaces laid out.
    pub sheets: Vec<Sheet>,
    /// Radius of the discs [m].
    pub disc_radius: f64,
    /// Radius of the sphere about each source [m].
    pub source_radius: Vec<f64>,
    /// Visibility rays of one receiver and band in one batch.
    rays: u32,
    /// Edges that diffract; none where diffraction is off.
    pub edges: Vec<Wedge>,
    /// Wavelength at the centre of every band [m]; zero in bands that are not diffracted.
    pub wavelengths: Vec<f64>,
}

impl Paper {
    /// Prepares `geometry` for the map of `header`.
    #[must_use]
    pub(crate) fn new(geometry: &Geometry, header: &sonel_map::MapHeader, settings: &RenderSettings) -> Self {
        let (scene, traced) = (&header.scene, &header.settings);
        let rays = settings.rays(traced.emissions);
        let shrink = libm::pow(f64::from(rays) / REFERENCE_RAYS, -1.0 / 6.0);
        let sphere = SPHERE_PER_FREE_PATH * free_path(geometry) * shrink;
        // Maps of the default mode say nothing of edges.
        let wavelengths = match traced.mode {
            Mode::Paper => header.diffracted_wavelengths(),
            Mode::Accurate => Some(scene.bands.nominal().iter().map(|f| scene.speed_of_sound / f).collect()),
        };
        let wavelengths = wavelengths.filter(|_| settings.edges);
        let clearance = |position| CLEARANCE * geometry.distance_to_nearest_surface(position);
        Self {
            sheets: Sheet::all(geometry),
            disc_radius: disc_radius(DISC_PER_FREE_PATH, free_path(geometry), settings, traced),
            source_radius: scene.sources.iter().map(|s| sphere.min(clearance(s.position))).collect(),
            rays: rays.div_ceil(traced.batches),
            edges: if wavelengths.is_some() { zone::edges(geometry) } else { Vec::new() },
            wavelengths: wavelengths.unwrap_or_default(),
        }
    }

    /// Estimator of `class`.
    #[must_use]
    pub(crate) fn owner(&self, class: PathClass) -> &'static str {
        match class {
            PathClass::Direct => "shadow ray",
            PathClass::Edge => "first Fresnel zone",
            PathClass::ImageSource | PathClass::LateSpecular => "sphere about the source",
            _ => "gather where a visibility ray is reflected diffusely",
        }
    }

    /// Why, and with which radius.
    #[must_use]
    pub(crate) fn reason(&self, class: PathClass) -> String {
        match class {
            PathClass::Direct => "as the paper writes".to_owned(),
            PathClass::Edge if self.edges.is_empty() => "diffraction is off or no edge diffracts".to_owned(),
            PathClass::Edge => {
                "as the paper writes: 3 dB too loud at the shadow boundary, zero beyond Fresnel number 1"
                    .to_owned()
            }
            PathClass::ImageSource | PathClass::LateSpecular => {
                let radii: Vec<String> = self.source_radius.iter().map(|a| format!("{a:.3} m")).collect();
                format!("as the paper writes; radius {}", radii.join(", "))
            }
            _ => {
                format!("as the paper writes, delta applied once; discs of {:.3} m", self.disc_radius)
            }
        }
    }
}
