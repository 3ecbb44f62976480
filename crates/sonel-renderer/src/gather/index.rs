//! Finding the discs that a sonel lies in: a grid of cells per surface and side.
//!
//! A cell lists every disc that touches it, so a sonel looks into a single cell. Cells are as wide as a disc; surfaces have
//! grids of their own, so nothing leaks through thin walls or around corners, and no cell is shared by chance.

use std::collections::HashMap;

use glam::DVec2;

use super::rays::GatherPoint;

/// Discs of one batch.
#[derive(Debug)]
pub struct GatherIndex {
    points: Vec<GatherPoint>,
    cells: HashMap<(u32, i32, i32), Vec<u32>>,
    radius: f64,
}

impl GatherIndex {
    /// Indexes discs of `radius` [m].
    #[must_use]
    pub fn new(points: Vec<GatherPoint>, radius: f64) -> Self {
        let mut index = Self { points, cells: HashMap::new(), radius };
        for number in 0..index.points.len() {
            let (place, centre) = (index.points[number].place, index.points[number].centre);
            let (low, high) = (index.cell(centre - radius), index.cell(centre + radius));
            for x in low.0..=high.0 {
                for y in low.1..=high.1 {
                    index.cells.entry((place, x, y)).or_default().push(number as u32);
                }
            }
        }
        index
    }

    fn cell(&self, at: DVec2) -> (i32, i32) {
        let cell = (at / (2.0 * self.radius)).floor();
        (cell.x as i32, cell.y as i32)
    }

    /// Visits every disc on `place` that `at`, in the plane of its surface, lies in and is seen from, and says how much more
    /// dense the disc of half the size finds it: nothing where it lies beside that.
    #[inline]
    pub fn around(&self, place: u32, at: DVec2, mut found: impl FnMut(&GatherPoint, f64)) {
        let (x, y) = self.cell(at);
        let Some(candidates) = self.cells.get(&(place, x, y)) else { return };
        for &number in candidates {
            let point = &self.points[number as usize];
            let offset = at - point.centre;
            let (squared, limit) = (offset.length_squared(), self.radius * self.radius);
            if squared <= limit && point.view.sees(offset) {
                found(
                    point,
                    if squared <= 0.5 * limit { point.view.area / point.view.inner_area } else { 0.0 },
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::disc::View;
    use super::super::rays::Sonels;
    use super::*;
    use glam::DVec3;
    use sonel_sampling::{Purpose, StreamFamily};

    fn discs(count: usize) -> (Vec<GatherPoint>, Vec<DVec2>) {
        let mut stream = StreamFamily::new(3, Purpose::VisibilityRay, [0; 4]).stream(0);
        let mut random = || DVec2::new(f64::from(stream.uniform()), f64::from(stream.uniform())) * 10.0 - 5.0;
        let points = (0..count)
            .map(|number| GatherPoint {
                receiver: number as u32,
                place: number as u32 % 3,
                centre: random(),
                length: 0.0,
                start: DVec3::ZERO,
                view: View { area: 1.0, inner_area: 0.5, hidden_by: Vec::new() },
                weight: Vec::new(),
                seen_directly: false,
                sonels: Sonels::All,
            })
            .collect();
        (points, (0..2000).map(|_| random()).collect())
    }

    /// Places at which `index` finds other discs than looking at all of them, and how many it finds.
    fn compared(index: &GatherIndex, places: &[DVec2]) -> (usize, usize) {
        let (mut wrong, mut found_any) = (0, 0);
        for &at in places {
            let mut found = Vec::new();
            index.around(1, at, |point, _| found.push(point.receiver));
            found.sort_unstable();
            let expected: Vec<u32> = index
                .points
                .iter()
                .filter(|point| point.place == 1 && point.centre.distance(at) <= index.radius)
                .map(|point| point.receiver)
                .collect();
            found_any += found.len();
            wrong += usize::from(found != expected);
        }
        (wrong, found_any)
    }

    #[test]
    fn the_grid_finds_what_looking_at_every_disc_finds() {
        let (points, places) = discs(300);
        let mut index = GatherIndex::new(points, 0.7);
        let (wrong, found_any) = compared(&index, &places);
        assert!(wrong == 0 && found_any > 1000, "{wrong}, {found_any}");
        index.cells.retain(|&(place, x, y), _| (place, x, y) != (1, 0, 0));
        assert!(compared(&index, &places).0 > 10, "a grid that forgets a cell is noticed");
    }
}
