//! Reverberation times: the line through a stretch of the decay curve.
//!
//! Least squares over *time*, with integrals of the piecewise linear curve instead of sums over samples: the standards
//! sample densely in time, and so the result does not depend on how wide the bins are or where their edges happen to
//! lie. Exact for an exponential decay.
//!
//! References: [ISO3382-1], [ISO3382-2] annex B for the non-linearity (docs/references.md).

use super::DecayCurve;

/// A stretch of the decay curve, in decibels relative to its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayRange {
    /// Upper end (dB), 0 or below.
    pub from_db: f64,
    /// Lower end (dB), below the upper one.
    pub to_db: f64,
}

impl DecayRange {
    /// Early decay time: 0 … −10 dB.
    pub const EARLY: Self = Self { from_db: 0.0, to_db: -10.0 };
    /// T20: −5 … −25 dB.
    pub const T20: Self = Self { from_db: -5.0, to_db: -25.0 };
    /// T30: −5 … −35 dB.
    pub const T30: Self = Self { from_db: -5.0, to_db: -35.0 };
}

/// A line fitted to a stretch of the decay curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayFit {
    /// Stretch that was used.
    pub range: DecayRange,
    /// Time of a decay by 60 dB along the line [s].
    pub time: f64,
    /// Non-linearity ξ = 1000 (1 − r²), r the correlation coefficient (‰).
    pub nonlinearity_permille: f64,
    /// Bin edges inside the stretch.
    pub inner_edges: usize,
}

/// A linear piece of the curve: centre and extent in time (s) and level (dB).
struct Piece {
    time: f64,
    level: f64,
    duration: f64,
    fall: f64,
}

impl DecayCurve {
    /// The line through `range`; none when the curve does not reach its lower end or falls through it at once.
    #[must_use]
    pub fn fit(&self, range: DecayRange) -> Option<DecayFit> {
        let points: Vec<(f64, f64)> = self.points().collect();
        let (from, to) = (crossing(&points, range.from_db)?, crossing(&points, range.to_db)?);
        let inside: Vec<(f64, f64)> =
            points.iter().copied().filter(|(time, _)| *time > from && *time < to).collect();
        let mut nodes = vec![(from, range.from_db)];
        nodes.extend(&inside);
        nodes.push((to, range.to_db));
        let pieces: Vec<Piece> = nodes
            .windows(2)
            .map(|pair| Piece {
                time: 0.5 * (pair[0].0 + pair[1].0),
                level: 0.5 * (pair[0].1 + pair[1].1),
                duration: pair[1].0 - pair[0].0,
                fall: pair[1].1 - pair[0].1,
            })
            .collect();
        let all = to - from;
        if all <= 0.0 {
            return None;
        }
        let mean =
            |of: fn(&Piece) -> f64| pieces.iter().map(|piece| piece.duration * of(piece)).sum::<f64>() / all;
        let (time, level) = (mean(|piece| piece.time), mean(|piece| piece.level));
        // ∫ x y over a linear piece: the product at its centre plus a twelfth of the extents'.
        let (mut tt, mut tl, mut ll) = (0.0, 0.0, 0.0);
        for piece in &pieces {
            let (t, l) = (piece.time - time, piece.level - level);
            tt += piece.duration * (t * t + piece.duration * piece.duration / 12.0);
            tl += piece.duration * (t * l + piece.duration * piece.fall / 12.0);
            ll += piece.duration * (l * l + piece.fall * piece.fall / 12.0);
        }
        let correlation_squared = (tl * tl / (tt * ll)).min(1.0);
        Some(DecayFit {
            range,
            time: -60.0 * tt / tl,
            nonlinearity_permille: 1000.0 * (1.0 - correlation_squared),
            inner_edges: inside.len(),
        })
    }
}

/// When the curve through `points` first falls to `level_db` [s].
fn crossing(points: &[(f64, f64)], level_db: f64) -> Option<f64> {
    let next = points.iter().position(|(_, level)| *level <= level_db)?;
    let (time, level) = points[next];
    let Some((earlier, higher)) = next.checked_sub(1).map(|before| points[before]) else {
        return Some(time);
    };
    Some(earlier + (time - earlier) * (higher - level_db) / (higher - level))
}
