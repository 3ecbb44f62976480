//! Uncertainty of parameters that comes from the absorption of materials.
//!
//! Law of propagation of uncertainty, first order [GUM]: u²(P) = Σₘ cₘ², where cₘ = ∂P/∂α · uₘ(α) is the change of the parameter by one standard
//! uncertainty of the absorption of material m. Materials are independent of one another. Within a material all bands deviate together: what makes
//! a specimen differ from the wall, such as mounting, thickness or moisture, does so in neighbouring bands alike, and no standard states
//! correlations. The mean over bands is then as uncertain as the bands, which is the cautious choice. For the same reason changes are added with their signs in
//! means over bands and receivers before they are squared.
//!
//! The half-width of the interval is 1.96 u. It does not hold where the parameter is far from linear over that range, as with absorptions near 0.
//!
//! Reference: [GUM] clauses 5.1 and 6 (docs/references.md).

use crate::estimate::ParameterValue;
use crate::receiver::ReceiverParameters;

/// Parameters of a room in which the absorption of one material is changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Varied {
    /// The change in standard uncertainties, above 0 and small.
    pub share: f64,
    /// Parameters with the change, of the same sources, receivers and bands as without.
    pub parameters: Vec<ReceiverParameters>,
}

/// Gives every value of `parameters` the changes by one standard uncertainty of each material, from `before` and `varied`, which share their
/// random numbers. A value gets none where one of the changes is not known.
pub fn attach(parameters: &mut [ReceiverParameters], before: &[ReceiverParameters], varied: &[Varied]) {
    for (at, receiver) in parameters.iter_mut().enumerate() {
        let Some(before) = before.get(at) else { continue };
        let before = before.values();
        let varied: Vec<(f64, Vec<&ParameterValue>)> = varied
            .iter()
            .filter_map(|varied| Some((varied.share, varied.parameters.get(at)?.values())))
            .collect();
        for (index, value) in receiver.values_mut().into_iter().enumerate() {
            let Ok(estimate) = value else { continue };
            let changes: Option<Vec<f64>> = varied
                .iter()
                .map(|(share, varied)| {
                    let (Ok(after), Ok(before)) = (varied.get(index)?, before.get(index)?) else {
                        return None;
                    };
                    Some((after.value - before.value) / share)
                })
                .collect();
            estimate.materials = changes.unwrap_or_default();
        }
    }
}
