//! Options with a few named values that several programs have.

use clap::ValueEnum;
use sonel_map::Mode;
use sonel_renderer::Estimator;

/// `--mode`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModeArgument {
    /// Weighted packets that carry all bands.
    Accurate,
    /// One band per packet, roulette with the absorption coefficient.
    Paper,
}

impl From<ModeArgument> for Mode {
    fn from(mode: ModeArgument) -> Self {
        match mode {
            ModeArgument::Accurate => Self::Accurate,
            ModeArgument::Paper => Self::Paper,
        }
    }
}

/// `--estimator`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EstimatorArgument {
    /// The most efficient estimator for each path class.
    Auto,
    /// Connections for diffuse arrivals, receiver spheres for specular reflections after a diffuse one.
    Connection,
    /// Connections for diffuse arrivals, visibility rays and density estimation for specular reflections after a diffuse one.
    Gather,
    /// Receiver spheres for everything but the direct sound.
    Sphere,
    /// That of the founding paper: visibility rays that gather at the first diffuse reflection, a sphere about the source,
    /// the first Fresnel zone over edges.
    Paper,
}

impl From<EstimatorArgument> for Estimator {
    fn from(argument: EstimatorArgument) -> Self {
        match argument {
            EstimatorArgument::Auto => Self::Auto,
            EstimatorArgument::Connection => Self::Connection,
            EstimatorArgument::Gather => Self::Gather,
            EstimatorArgument::Sphere => Self::Sphere,
            EstimatorArgument::Paper => Self::Paper,
        }
    }
}
