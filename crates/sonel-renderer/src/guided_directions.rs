//! Directions of visibility rays: half of them uniform over the sphere, half where the receiver sees sonels.
//!
//! A quadtree over the unit square that [`warp::uniform_sphere`] takes to the sphere holds what a sample of sonels sends to the receiver
//! [MullerGrossNovak2017]. A cell is divided while it holds more than a few of them, so that a window seen from afar gets cells of its
//! size; a part of each division goes beside it. Uniform numbers are stretched from cell to cell, which keeps the strata of a sequence. The estimate is unbiased whatever the
//! tree holds, and no ray weighs more than twice a uniform one.
//!
//! References: docs/references.md.

use glam::Vec3;
use sonel_sampling::warp;

/// Share of the rays that is uniform: no ray weighs more than twice a uniform one (defensive sampling).
const UNIFORM: f64 = 0.5;
/// Effective number (Σe)² / Σe² of sonels in a cell below which it is not divided: its share is known to 25 %. Chosen, not measured.
const FEW: f64 = 16.0;
/// Share of a divided cell that its quarters get in equal parts [1]: one without a sonel beside lit ones is not dark. Chosen, not measured; at
/// 1 rays follow no sonels.
const ALIKE: f64 = 0.1;
/// Divisions of a cell's side: solid angles down to 7e-7 sr, a window of one metre at a kilometre.
const DEEPEST: u32 = 12;

/// A density over the sphere to draw directions from; uniform by default.
#[derive(Debug, Clone, Default)]
pub(crate) struct GuidedDirections {
    /// The root first. Empty: uniform.
    cells: Vec<DirectionCell>,
}

#[derive(Debug, Clone, Copy)]
struct DirectionCell {
    /// Probability of its directions.
    probability: f64,
    /// Index of the first of its four quarters, low u before high, low v before high; 0 in one that is not divided.
    quarters: u32,
}

/// A direction in the unit square, and its share of what is seen.
struct Seen {
    at: [f32; 2],
    share: f64,
}

impl Seen {
    fn quarter(&self, middle: [f64; 2]) -> usize {
        usize::from(f64::from(self.at[0]) >= middle[0]) + 2 * usize::from(f64::from(self.at[1]) >= middle[1])
    }
}

impl GuidedDirections {
    /// The density for what comes from unit directions, with the energy of each.
    #[must_use]
    pub(crate) fn new(seen: &[(Vec3, f64)]) -> Self {
        let total: f64 = seen.iter().map(|(_, energy)| energy).sum();
        if total <= 0.0 {
            return Self::default();
        }
        let seen = seen.iter().map(|&(towards, energy)| Seen {
            at: warp::uniform_sphere_inverse(towards),
            share: energy / total,
        });
        let mut directions = Self { cells: vec![DirectionCell { probability: 1.0, quarters: 0 }] };
        directions.divide(0, 1.0, &mut seen.collect::<Vec<_>>(), [0.0; 2], 0);
        directions
    }

    /// Divides a cell with its lower `corner`, made by so many `divisions`, that holds `seen` and has a `share` of the directions that are
    /// not uniform.
    fn divide(&mut self, cell: usize, share: f64, seen: &mut [Seen], corner: [f64; 2], divisions: u32) {
        let (sum, squares) = seen
            .iter()
            .fold((0.0, 0.0), |(sum, squares), seen| (sum + seen.share, squares + seen.share * seen.share));
        if sum * sum <= FEW * squares || divisions == DEEPEST {
            return;
        }
        let side = 0.5 / f64::from(1_u32 << divisions);
        let middle = corner.map(|from| from + side);
        seen.sort_by_key(|seen| seen.quarter(middle));
        let first = self.cells.len();
        self.cells[cell].quarters = first as u32;
        let mut parts = Vec::with_capacity(4);
        let mut rest = seen;
        for quarter in 0..4 {
            let (part, others) =
                rest.split_at_mut(rest.partition_point(|seen| seen.quarter(middle) == quarter));
            let own = part.iter().map(|seen| seen.share).sum::<f64>() / sum;
            let share = share * ((1.0 - ALIKE) * own + 0.25 * ALIKE);
            let probability = UNIFORM * side * side + (1.0 - UNIFORM) * share;
            self.cells.push(DirectionCell { probability, quarters: 0 });
            parts.push((share, part));
            rest = others;
        }
        for (quarter, (share, part)) in parts.into_iter().enumerate() {
            let corner = [corner[0] + side * (quarter % 2) as f64, corner[1] + side * (quarter / 2) as f64];
            self.divide(first + quarter, share, part, corner, divisions + 1);
        }
    }

    /// The direction of a uniform `point` of the unit square, and its density times 4π.
    #[must_use]
    pub(crate) fn sample(&self, point: [f32; 2]) -> (Vec3, f64) {
        let mut within = point.map(f64::from);
        let (mut corner, mut side, mut cell) = ([0.0; 2], 1.0, self.cells.first().copied());
        let mut density = 1.0;
        while let Some(DirectionCell { quarters, probability }) = cell {
            density = probability / (side * side);
            if quarters == 0 {
                break;
            }
            side *= 0.5;
            let quarter = |number: usize| self.cells[quarters as usize + number];
            let of = |number: usize| quarter(number).probability;
            let low = of(0) + of(1);
            let row = 2 * stretch(&mut within[1], low / (low + of(2) + of(3)));
            let column = stretch(&mut within[0], of(row) / (of(row) + of(row + 1)));
            corner = [corner[0] + side * column as f64, corner[1] + side * (row / 2) as f64];
            cell = Some(quarter(row + column));
        }
        let at = [0, 1].map(|axis| ((corner[axis] + side * within[axis]) as f32).min(BELOW_ONE));
        (warp::uniform_sphere(at), density)
    }
}

/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Which of two parts a uniform number falls in, the first of which takes the `first` share; the number is stretched to that part.
fn stretch(uniform: &mut f64, first: f64) -> usize {
    let is_second = *uniform >= first;
    *uniform = if is_second { (*uniform - first) / (1.0 - first) } else { *uniform / first };
    usize::from(is_second)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;
    use sonel_sampling::ScrambledSobol;
    use sonel_testkit::uniform::Uniform;

    /// A window of a tenth of a radian about an axis, seen from a room that sends a little from everywhere.
    fn window(count: u32) -> (Vec3, Vec<(Vec3, f64)>) {
        let axis = Vec3::new(0.6, -0.48, 0.64);
        let mut random = Uniform::new(5);
        let mut seen = Vec::new();
        while seen.len() < count as usize {
            let towards = glam::DVec3::from(random.unit_vector()).as_vec3();
            let is_lit = towards.dot(axis) > 0.995;
            if is_lit || random.between(0.0, 1.0) < 0.002 {
                seen.push((towards, if is_lit { 1.0 } else { 0.01 }));
            }
        }
        (axis, seen)
    }

    fn samples(directions: &GuidedDirections, count: u32) -> Vec<(Vec3, f64)> {
        let sequence = ScrambledSobol::numbered(3, 0, 0);
        (0..count).map(|number| directions.sample(sequence.point(number))).collect()
    }

    #[test]
    fn a_window_of_a_four_hundredth_of_the_sphere_gets_more_than_a_quarter_of_the_rays() {
        let (axis, seen) = window(500);
        let found = samples(&GuidedDirections::new(&seen), 4096);
        let share = found.iter().filter(|(towards, _)| towards.dot(axis) > 0.995).count() as f64 / 4096.0;
        assert!(share > 0.25 && share < 0.55, "{share}");
        let uniform = samples(&GuidedDirections::default(), 4096);
        assert!(uniform.iter().filter(|(towards, _)| towards.dot(axis) > 0.995).count() < 30);
    }

    #[test]
    fn weights_make_up_for_the_choice() {
        let (axis, seen) = window(500);
        let directions = GuidedDirections::new(&seen);
        let found = samples(&directions, 1 << 16);
        assert!(found.iter().all(|(_, density)| *density >= UNIFORM - 1e-9));
        let mean = |of: &dyn Fn(Vec3) -> f64, weigh: &dyn Fn(f64) -> f64| {
            found.iter().map(|&(towards, density)| of(towards) / weigh(density)).sum::<f64>() / 65536.0
        };
        let cap = |towards: Vec3| f64::from(u8::from(towards.dot(axis) > 0.995));
        for (of, expected) in [
            (&cap as &dyn Fn(Vec3) -> f64, 0.0025),
            (&|towards| f64::from(towards.z * towards.z), 1.0 / 3.0),
            (&|towards| f64::from(towards.x).max(0.0), 0.25),
        ] {
            let whole = mean(of, &|density| density);
            assert!((whole / expected - 1.0).abs() < 0.02, "{whole} instead of {expected}");
            assert!((mean(of, &|_| 1.0) / expected - 1.0).abs() > 0.1, "rays without weights are rejected");
        }
        assert!((mean(&|_| 4.0 * PI, &|density| density) / (4.0 * PI) - 1.0).abs() < 0.01);
    }

    #[test]
    fn nothing_seen_means_uniform() {
        let found = samples(&GuidedDirections::new(&[(Vec3::X, 0.0)]), 16);
        assert!(found.iter().all(|(_, density)| (density - 1.0).abs() < 1e-12));
    }
}
