//! Settings of a rendering, with defaults.

use crate::RenderError;

/// Most bins of an echogram: 17 minutes in milliseconds, 20 seconds in samples of 50 kHz. Neither the option nor the duration
/// that a map states is limited otherwise, and 64 MB a receiver are enough for either.
const MOST_BINS: f64 = (1_u32 << 20) as f64;

/// Packets of a map for each visibility ray of a receiver.
const PACKETS_PER_RAY: u64 = 4;
/// Most rays that are taken unasked: the discs of a batch's fill hundreds of megabytes.
pub const MOST_RAYS: u32 = 1 << 22;
/// Rays of the founding paper's pass.
const PAPER_RAYS: u32 = 1 << 14;

/// Settings of a rendering.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderSettings {
    /// Width of a time bin [s].
    pub bin: f64,
    /// Estimator of each path class.
    pub estimator: Estimator,
    /// Order K of the image-source paths; chosen where none is given.
    pub mirror_order: Option<u32>,
    /// Visibility rays of one receiver over all batches; as [`Self::rays`] has it where none is given.
    pub rays: Option<u32>,
    /// Radius of the discs in which rays gather [m]; chosen where none is given.
    pub gather_radius: Option<f64>,
    /// Seed of the rendering; by default that of the map.
    pub seed: Option<u64>,
    /// Attenuation by air.
    pub air: Air,
    /// Whether energies by direction are added up beside the energy (`directions`).
    pub directions: bool,
    /// Whether edges diffract.
    pub edges: bool,
    /// Whether everything but direct sound has the boundary term ([`crate::boundary`]); exact answers for rays are without.
    pub boundary: bool,
}

/// Estimators of the path classes: the same energy by different means, so that any two can be compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// The most efficient estimator for each path class.
    Auto,
    /// Connections for … D R; spheres for everything specular behind a diffuse reflection.
    Connection,
    /// Estimators of `Auto`, but density estimation behind visibility rays for everything specular behind a diffuse reflection.
    Gather,
    /// Spheres for everything but the direct sound.
    Sphere,
    /// The founding paper's estimator, apart from this table: see docs/paper-mode.md.
    Paper,
}

impl Estimator {
    /// Estimators that agree within their joint interval (docs/physics.md §4): all but `Paper`.
    pub const COMPARABLE: [Self; 4] = [Self::Auto, Self::Connection, Self::Gather, Self::Sphere];

    /// Whether connections own … D R.
    pub(crate) fn connects_diffuse(self) -> bool {
        matches!(self, Self::Auto | Self::Connection | Self::Gather)
    }

    /// Whether it has rays of its own: specular ones from the source, visibility rays from receivers.
    pub(crate) fn has_rays(self) -> bool {
        matches!(self, Self::Auto | Self::Gather)
    }

    /// Name in docs/interface.md.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Connection => "connection",
            Self::Gather => "gather",
            Self::Sphere => "sphere",
            Self::Paper => "paper",
        }
    }
}

/// Air that sound travels through.
#[derive(Debug, Clone, PartialEq)]
pub enum Air {
    /// Air of the scene.
    OfScene,
    /// Another attenuation m per band [1/m]; zeros for none.
    Attenuation(Vec<f64>),
}

impl RenderSettings {
    /// Faults of the settings for a run of `duration` [s].
    pub(crate) fn check(&self, duration: f64) -> Result<(), RenderError> {
        let fault = |fault: String| Err(RenderError::Settings(fault));
        let is_length = |length: f64| length.is_finite() && length > 0.0;
        if !is_length(self.bin) {
            return fault(format!("the bin width is {} s: give a width above 0 s", self.bin));
        }
        if self.gather_radius.is_some_and(|radius| !is_length(radius)) {
            return fault("the radius of gathering discs must be above 0 m".to_owned());
        }
        if self.estimator == Estimator::Paper && self.mirror_order.is_some() {
            return fault(
                "the paper's estimator has no image sources: leave `order` out, or choose another `estimator`".to_owned()
            );
        }
        if duration / self.bin > MOST_BINS {
            return fault(format!(
                "a duration of {duration} s has more than {MOST_BINS} bins of {} s: give wider bins (`bin`), or trace again with a \
                 shorter `duration`",
                self.bin
            ));
        }
        Ok(())
    }

    /// Visibility rays of one receiver for a map of so many emissions per source. Unless a number is given they are a quarter as many: in the
    /// hall and an office half and twice as many take nearly the same time for an accuracy (docs/planning.md).
    #[must_use]
    pub fn rays(&self, emissions: u64) -> u32 {
        let default = match self.estimator {
            Estimator::Paper => PAPER_RAYS,
            _ => emissions.div_ceil(PACKETS_PER_RAY).min(MOST_RAYS.into()) as u32,
        };
        self.rays.unwrap_or(default)
    }

    /// Default settings of `estimator`.
    #[must_use]
    pub fn of(estimator: Estimator) -> Self {
        Self {
            bin: 0.001,
            estimator,
            mirror_order: None,
            rays: None,
            gather_radius: None,
            seed: None,
            air: Air::OfScene,
            directions: false,
            edges: true,
            boundary: false,
        }
    }
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self::of(Estimator::Auto)
    }
}
