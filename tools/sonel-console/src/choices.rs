//! Options with a few named values that several programs have.

use clap::ValueEnum;
use sonel_map::Mode;
use sonel_renderer::Estimator;

/// `--mode`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModeArgument {
    /// The best estimators known.
    Accurate,
    /// One band a packet, roulette on absorption alone.
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
    /// Each class by its best estimator.
    Auto,
    /// Connections for diffuse arrivals, receiver spheres for what is specular behind a diffuse reflection.
    Connection,
    /// Visibility rays and density estimation for what is specular behind a diffuse reflection.
    Gather,
    /// Receiver spheres for everything but the direct sound.
    Sphere,
    /// What the founding paper writes: visibility rays that gather at the first diffuse reflection, a sphere about the source,
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
