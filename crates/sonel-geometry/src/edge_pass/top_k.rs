//! The first few of many, in an order of their own.

/// An edge that comes near.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Near {
    /// What it is ordered by: how far its closest point is [m], or the square of its distance [m²]. Edges at one place follow by number.
    pub order: f64,
    /// Its number.
    pub edge: u32,
    /// Where on the edge it is near [m].
    pub along: f64,
    /// Square of the distance [m²].
    pub squared: f64,
}

impl Near {
    /// What it is sorted by.
    pub fn key(&self) -> (f64, u32) {
        (self.order, self.edge)
    }
}

/// An order and number before those of all edges.
pub(super) const BEFORE_ALL: (f64, u32) = (-1.0, 0);

/// The first `N` of all edges offered that come behind a given one.
#[derive(Debug)]
pub(super) struct TopK<const N: usize> {
    behind: (f64, u32),
    found: [Near; N],
    count: usize,
}

impl<const N: usize> TopK<N> {
    /// None yet, of those behind an order and number.
    pub fn behind(behind: (f64, u32)) -> Self {
        Self { behind, found: [Near::default(); N], count: 0 }
    }

    /// Takes one in, if it is among the first.
    #[inline]
    pub fn offer(&mut self, near: Near) {
        if near.key() <= self.behind {
            return;
        }
        let mut place = self.count;
        if self.is_full() {
            place -= 1;
            if self.found[place].key() <= near.key() {
                return;
            }
        } else {
            self.count += 1;
        }
        while place > 0 && near.key() < self.found[place - 1].key() {
            self.found[place] = self.found[place - 1];
            place -= 1;
        }
        self.found[place] = near;
    }

    fn is_full(&self) -> bool {
        self.count == N
    }

    /// The order behind which all are.
    pub fn start(&self) -> f64 {
        self.behind.0
    }

    /// Behind which there may be more; none where all were found.
    pub fn next(&self) -> Option<(f64, u32)> {
        self.is_full().then(|| self.found[N - 1].key())
    }

    /// The largest order that is still asked for, of those up to `limit`.
    #[inline]
    pub fn limit(&self, limit: f64) -> f64 {
        if self.is_full() { self.found[N - 1].order } else { limit }
    }

    /// Those found, in order.
    pub fn found(&self) -> &[Near] {
        &self.found[..self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_are_kept_in_order_and_the_rest_comes_next() {
        let orders: Vec<f64> = (0..40).map(|number| f64::from(number * 7 % 10)).collect();
        let mut behind = (1.0, 11);
        let mut walked = Vec::new();
        loop {
            let mut few = TopK::<6>::behind(behind);
            for (edge, &order) in orders.iter().enumerate() {
                few.offer(Near { order, edge: edge as u32, ..Near::default() });
            }
            walked.extend(few.found().iter().map(Near::key));
            let Some(next) = few.next() else { break };
            behind = next;
        }
        let all = orders.iter().enumerate().map(|(edge, &order)| (order, edge as u32));
        let mut expected: Vec<(f64, u32)> = all.filter(|&key| key > (1.0, 11)).collect();
        expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(walked, expected);
    }
}
