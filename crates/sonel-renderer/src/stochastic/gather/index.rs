//! Finding the discs that a sonel lies in: a grid of cells per surface and side.
//!
//! A cell lists every disc that touches it, so a sonel looks into a single cell. Surfaces have grids of their own, so nothing leaks
//! through thin walls or around corners, and each grid covers the discs on its surface alone.

use glam::{DVec2, Vec2};

use super::disc::Disc;

/// By how much cells and distances in single precision reach beyond a disc, so that its rim is a matter of double precision alone:
/// it must not depend on where the grid begins, which other discs decide.
const BEYOND_RIM: f64 = 1e-6;

/// Most cells of a grid for each disc on it: on large surfaces with few discs cells are wider than a disc. Memory and speed alone depend on it.
const MOST_CELLS: f64 = 16.0;

/// Discs, each with what it is for.
#[derive(Debug)]
pub(crate) struct GatherIndex<P> {
    points: Vec<P>,
    /// Number of the grid of each place, beyond them where it has none.
    by_place: Vec<u32>,
    grids: Vec<Grid>,
    /// Where the list of each cell begins, of all grids in turn, and where the last one ends.
    starts: Vec<u32>,
    /// The lists of all cells.
    listed: Vec<Listed>,
}

/// The cells of one side of a surface.
#[derive(Debug, Clone, Copy)]
struct Grid {
    low: DVec2,
    high: DVec2,
    discs: u32,
    /// Radius of its largest disc [m].
    radius: f64,
    cells_per_length: f64,
    /// Cells across and along.
    cells: [usize; 2],
    /// Number of the first cell.
    first: usize,
}

/// A disc in the list of a cell.
#[derive(Debug, Clone, Copy, Default)]
struct Listed {
    /// From the low corner of its grid [m].
    centre: Vec2,
    number: u32,
}

impl Grid {
    const EMPTY: Self = Self {
        low: DVec2::INFINITY,
        high: DVec2::NEG_INFINITY,
        discs: 0,
        radius: 0.0,
        cells_per_length: 0.0,
        cells: [0; 2],
        first: 0,
    };

    /// Makes room for `disc`.
    fn cover(&mut self, disc: &Disc) {
        self.low = self.low.min(disc.centre - reach(disc));
        self.high = self.high.max(disc.centre + reach(disc));
        self.radius = self.radius.max(disc.radius);
        self.discs += 1;
    }

    /// Divides what is covered into cells, the first with number `first`; how many there are.
    fn divide(&mut self, first: usize) -> usize {
        if self.discs == 0 {
            return 0;
        }
        let extent = self.high - self.low;
        let side = self.radius.max((extent.x * extent.y / (MOST_CELLS * f64::from(self.discs))).sqrt());
        self.cells_per_length = side.recip();
        self.cells = (extent / side).to_array().map(|cells| cells as usize + 1);
        self.first = first;
        self.cells[0] * self.cells[1]
    }

    /// Column and row of the cell of a covered place.
    fn cell(&self, at: DVec2) -> [usize; 2] {
        let [x, y] = ((at - self.low) * self.cells_per_length).to_array();
        [(x as usize).min(self.cells[0] - 1), (y as usize).min(self.cells[1] - 1)]
    }

    /// Number of the cell of a covered place.
    fn number(&self, at: DVec2) -> usize {
        let [x, y] = self.cell(at);
        self.first + y * self.cells[0] + x
    }

    /// Numbers of the cells that `disc` touches.
    fn touched(&self, disc: &Disc) -> impl Iterator<Item = usize> + use<> {
        let (low, high) = (self.cell(disc.centre - reach(disc)), self.cell(disc.centre + reach(disc)));
        let (first, across) = (self.first, self.cells[0]);
        (low[1]..=high[1]).flat_map(move |y| (low[0]..=high[0]).map(move |x| first + y * across + x))
    }
}

/// How far from its centre a disc is looked for [m].
fn reach(disc: &Disc) -> f64 {
    disc.radius * (1.0 + BEYOND_RIM)
}

impl<P: AsRef<Disc>> GatherIndex<P> {
    /// Indexes the discs of `points`.
    #[must_use]
    pub(crate) fn new(points: Vec<P>) -> Self {
        let places = points.iter().map(|point| point.as_ref().place as usize + 1).max().unwrap_or(0);
        let (mut by_place, mut grids) = (vec![u32::MAX; places], Vec::new());
        for disc in points.iter().map(AsRef::as_ref) {
            let number = &mut by_place[disc.place as usize];
            if *number == u32::MAX {
                *number = grids.len() as u32;
                grids.push(Grid::EMPTY);
            }
            grids[*number as usize].cover(disc);
        }
        let mut cells = 0;
        for grid in &mut grids {
            cells += grid.divide(cells);
        }
        let grid = |disc: &Disc| &grids[by_place[disc.place as usize] as usize];
        // Neighbours in the room are neighbours in memory: sonels come from everywhere, and what is not in the cache costs most of a visit.
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by_cached_key(|&point| {
            let disc = points[point].as_ref();
            grid(disc).number(disc.centre)
        });
        let mut numbers = vec![0_u32; points.len()];
        (0..).zip(&order).for_each(|(number, &point)| numbers[point] = number);
        // Each list is filled from its end, so that its start is found on the way, and in the order of the points: no point changes the order of
        // others, which sums would show in their last bit.
        let mut starts = vec![0_u32; cells + 1];
        let touched = |disc: &Disc| grid(disc).touched(disc);
        points.iter().map(AsRef::as_ref).flat_map(touched).for_each(|cell| starts[cell] += 1);
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        let mut listed = vec![Listed::default(); end as usize];
        for (&number, disc) in numbers.iter().zip(points.iter().map(AsRef::as_ref)) {
            for cell in touched(disc) {
                starts[cell] -= 1;
                let centre = (disc.centre - grid(disc).low).as_vec2();
                listed[starts[cell] as usize] = Listed { centre, number };
            }
        }
        let mut unsorted: Vec<Option<P>> = points.into_iter().map(Some).collect();
        let points = order.iter().map(|&point| unsorted[point].take().expect("each point once")).collect();
        Self { points, by_place, grids, starts, listed }
    }

    /// Lists in `found` every disc on `place` that `at`, in the plane of its surface, lies in and is seen from, and how much more
    /// dense the disc of half the size finds it: nothing where it lies beside that.
    ///
    /// A list, and no visitor: what is read of many discs in a short loop is waited for at once.
    #[inline]
    pub(crate) fn around(&self, place: u32, at: DVec2, found: &mut Vec<(u32, f64)>) {
        found.clear();
        let number = self.by_place.get(place as usize).copied().unwrap_or(u32::MAX);
        let Some(grid) = self.grids.get(number as usize) else { return };
        if !(at.cmpge(grid.low).all() && at.cmple(grid.high).all()) {
            return;
        }
        let cell = grid.number(at);
        let nearly = grid.radius + BEYOND_RIM * (grid.radius + (grid.high - grid.low).max_element());
        let limit = (nearly * nearly) as f32;
        let from_low = (at - grid.low).as_vec2();
        for disc in &self.listed[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
            if (from_low - disc.centre).length_squared() <= limit {
                found.push((disc.number, 0.0));
            }
        }
        found.retain_mut(|(number, gain)| {
            let Disc { view, centre, radius, .. } = self.points[*number as usize].as_ref();
            let offset = at - *centre;
            let (squared, squared_radius) = (offset.length_squared(), radius * radius);
            if squared <= 0.5 * squared_radius {
                *gain = view.area / view.inner_area;
            }
            squared <= squared_radius && view.sees(offset)
        });
    }

    /// The disc of this number.
    #[inline]
    pub(crate) fn point(&self, number: u32) -> &P {
        &self.points[number as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::super::disc::View;
    use super::*;
    use sonel_sampling::{Purpose, StreamFamily};

    struct Numbered(u32, Disc);

    impl AsRef<Disc> for Numbered {
        fn as_ref(&self) -> &Disc {
            &self.1
        }
    }

    fn discs(count: usize) -> (Vec<Numbered>, Vec<DVec2>) {
        let mut stream = StreamFamily::new(3, Purpose::VisibilityRay, [0; 4]).stream(0);
        let mut random = || DVec2::new(f64::from(stream.uniform()), f64::from(stream.uniform())) * 10.0 - 5.0;
        let points = (0..count)
            .map(|number| {
                let view = View { area: 1.0, inner_area: 0.5, hidden_by: Vec::new() };
                let radius = if number % 2 == 0 { 0.7 } else { 0.3 };
                Numbered(number as u32, Disc { place: number as u32 % 3, centre: random(), radius, view })
            })
            .collect();
        (points, (0..2000).map(|_| random()).collect())
    }

    /// Places at which `index` finds other discs than looking at all of them, and how many it finds.
    fn compared(index: &GatherIndex<Numbered>, places: &[DVec2]) -> (usize, usize) {
        let (mut wrong, mut found_any) = (0, 0);
        for &at in places {
            let mut listed = Vec::new();
            index.around(1, at, &mut listed);
            let mut found: Vec<u32> = listed.iter().map(|(number, _)| index.point(*number).0).collect();
            found.sort_unstable();
            let mut expected: Vec<u32> = index
                .points
                .iter()
                .filter(|Numbered(_, disc)| disc.place == 1 && disc.centre.distance(at) <= disc.radius)
                .map(|point| point.0)
                .collect();
            expected.sort_unstable();
            found_any += found.len();
            wrong += usize::from(found != expected);
        }
        (wrong, found_any)
    }

    #[test]
    fn the_grid_finds_what_looking_at_every_disc_finds() {
        let (points, places) = discs(300);
        let mut index = GatherIndex::new(points);
        let (wrong, found_any) = compared(&index, &places);
        assert!(wrong == 0 && found_any > 1000, "{wrong}, {found_any}");
        index.listed.reverse();
        assert!(compared(&index, &places).0 > 10, "a grid whose cells are mixed up is noticed");
    }
}
