//! Decay curves of all batches together and of all but each, in the batches' coarse bins.

use sonel_echogram::Response;

use crate::decay::{DecayCurve, NoDecay};
use crate::jackknife::Weights;

/// Largest relative difference between the energy and the batches' mean: beyond it they are not of the same rendering. Single
/// precision and a different order of additions stay far below.
const SAME_ENERGY: f64 = 1e-3;

/// Batches of a response that have weight.
#[derive(Debug, Clone)]
pub struct BatchSet {
    /// Their weights.
    pub weights: Weights,
    indices: Vec<usize>,
}

/// One band's curves.
#[derive(Debug, Clone)]
pub struct LeaveOneOut {
    /// From all batches.
    pub all: DecayCurve,
    /// Without each batch in turn.
    pub without: Vec<DecayCurve>,
}

impl BatchSet {
    /// The batches of `response`.
    ///
    /// # Errors
    /// Why figures carry no interval: no batches, or fewer than two.
    pub fn of(response: &Response) -> Result<Self, String> {
        let batches =
            response.batches.as_ref().ok_or("the response holds no batches to tell an interval from")?;
        let indices: Vec<usize> = (0..batches.weight.len()).filter(|g| batches.weight[*g] > 0.0).collect();
        let weights = Weights::new(indices.iter().map(|g| batches.weight[*g]).collect())
            .ok_or("an interval needs at least two batches")?;
        Ok(Self { weights, indices })
    }

    /// Curves of a source, receiver and band whose fine record holds `recorded` energy.
    ///
    /// # Errors
    /// Why the band has no interval.
    pub fn curves(
        &self,
        response: &Response,
        [s, r, b]: [usize; 3],
        recorded: f64,
    ) -> Result<LeaveOneOut, String> {
        let broken = "the batches do not fit the echogram";
        let edges = response.batch_edges(s, r).ok_or(broken)?;
        let rows: Option<Vec<&[f32]>> =
            self.indices.iter().map(|g| response.batch_echogram(*g, s, r, b)).collect();
        let rows = rows.ok_or(broken)?;
        let mean: Vec<f64> = (0..edges.len() - 1)
            .map(|bin| self.weights.mean(&rows.iter().map(|row| f64::from(row[bin])).collect::<Vec<f64>>()))
            .collect();
        let sum: f64 = mean.iter().sum();
        if (sum - recorded).abs() > SAME_ENERGY * recorded {
            return Err("the batches' mean is not the echogram's energy".to_owned());
        }
        let direct = response.direct_time(s, r);
        let curve = |energies: &[f64]| DecayCurve::new(edges, energies, direct);
        let without = |j: usize| {
            let row = mean.iter().zip(rows[j]);
            // Where only this batch has energy, rounding may leave less than none of it.
            let rest = row.map(|(mean, own)| self.weights.mean_without(*mean, f64::from(*own), j).max(0.0));
            curve(&rest.collect::<Vec<f64>>())
        };
        let all = curve(&mean).map_err(|error| error.to_string())?;
        let without: Result<Vec<DecayCurve>, NoDecay> = (0..rows.len()).map(without).collect();
        Ok(LeaveOneOut { all, without: without.map_err(|_| "all the energy comes from one batch")? })
    }
}
