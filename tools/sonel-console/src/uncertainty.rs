//! Options that say how uncertain the absorption of materials is.

use clap::Args;
use sonel::analysis::ReceiverParameters;
use sonel::analysis::receiver::parameters_of;
use sonel::echograms::Echograms;
use sonel::{AbsorptionUncertainty, MaterialVariants};

use crate::follower::Follower;
use crate::heard::HeardArguments;

/// Uncertainty of materials.
#[derive(Debug, Clone, Default, Args)]
pub struct UncertaintyArguments {
    /// Standard uncertainty of absorption; repeatable.
    ///
    /// Gives every parameter a second interval: 0.05 for all materials, NAME=0.1 for one, NAME=0.1,0.05,… by band, NAME=20% of
    /// the coefficient. Needs the map. Materials are independent, bands of one material deviate together.
    #[arg(long, value_name = "U|MATERIAL=U", value_parser = str::parse::<AbsorptionUncertainty>, allow_hyphen_values = true)]
    pub material_uncertainty: Vec<AbsorptionUncertainty>,
}

impl UncertaintyArguments {
    /// Whether a second interval is wanted.
    #[must_use]
    pub fn is_given(&self) -> bool {
        !self.material_uncertainty.is_empty()
    }

    /// Gives every value of `parameters`, which were read off `response` as `heard` says, its changes by the uncertainty of the materials.
    ///
    /// # Errors
    /// When the response was rendered from another map than `map`, or a material does not exist.
    pub fn attach(
        &self,
        parameters: &mut [ReceiverParameters],
        response: &Echograms,
        map: &sonel::Map,
        heard: &HeardArguments,
        follower: &Follower<'_>,
    ) -> anyhow::Result<MaterialVariants> {
        let variants =
            follower.result(map.material_variants(response, &self.material_uncertainty, follower))?;
        variants.attach(parameters, |echograms| {
            Ok::<_, anyhow::Error>(parameters_of(&heard.heard(echograms.clone())?, heard.talk().as_ref()))
        })?;
        Ok(variants)
    }
}
