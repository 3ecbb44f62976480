//! Time windows of a picture.

use thiserror::Error;

/// Windows of time that do not overlap.
#[derive(Debug, Clone, PartialEq)]
pub struct Windows {
    /// From … to, as path lengths [m], and the number of the window; sorted.
    spans: Vec<(f64, f64, u32)>,
}

/// Faults of windows; times are from emission [s].
#[derive(Debug, Clone, PartialEq, Error)]
pub enum WindowError {
    /// A window that ends before it begins, or is not within the run.
    #[error(
        "the window from {0} to {1} s is not within the {2} s of the map: it begins at 0 or later and ends after its begin"
    )]
    Outside(f64, f64, f64),
    /// Two share some time.
    #[error("the windows from {} to {} s and from {} to {} s overlap: let one end where the other begins", .0[0], .0[1], .1[0], .1[1])]
    Overlap([f64; 2], [f64; 2]),
}

impl Windows {
    /// The windows from … to [s] of a run of `duration` [s]. What arrives where two meet belongs to the later one.
    ///
    /// # Errors
    /// Everything that is wrong with them.
    pub fn new(windows: &[[f64; 2]], speed_of_sound: f64, duration: f64) -> Result<Self, Vec<WindowError>> {
        let is_sound = |[from, to]: &[f64; 2]| *from >= 0.0 && from < to && *to <= duration;
        let outside = windows.iter().filter(|window| !is_sound(window));
        let mut errors: Vec<WindowError> =
            outside.map(|&[from, to]| WindowError::Outside(from, to, duration)).collect();
        let mut sorted: Vec<(u32, [f64; 2])> = (0..).zip(windows.iter().copied()).collect();
        sorted.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
        let neighbours = sorted.windows(2).map(|pair| [pair[0].1, pair[1].1]);
        let overlaps = neighbours.filter(|[first, second]| second[0] < first[1]);
        errors.extend(overlaps.map(|[first, second]| WindowError::Overlap(first, second)));
        if !errors.is_empty() {
            return Err(errors);
        }
        // What arrives at the very end of the run is within.
        let end = |to: f64| if to < duration { to * speed_of_sound } else { f64::INFINITY };
        let span = |(number, [from, to]): (u32, [f64; 2])| (from * speed_of_sound, end(to), number);
        Ok(Self { spans: sorted.into_iter().map(span).collect() })
    }

    /// Number of windows.
    #[must_use]
    pub fn count(&self) -> usize {
        self.spans.len()
    }

    /// The window of a path of `length` [m].
    #[must_use]
    pub fn of(&self, length: f64) -> Option<u32> {
        let begun = self.spans.partition_point(|&(from, ..)| from <= length);
        let &(_, to, number) = self.spans[..begun].last()?;
        (length < to).then_some(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arrival_at_a_border_belongs_to_the_later_window() {
        let windows = Windows::new(&[[0.02, 0.05], [0.0, 0.02], [0.08, 0.1]], 100.0, 0.1).unwrap();
        let found = [0.0, 1.99, 2.0, 4.9, 5.0, 7.9, 8.0, 10.0].map(|length| windows.of(length));
        assert_eq!(found, [Some(1), Some(1), Some(0), Some(0), None, None, Some(2), Some(2)]);
    }

    #[test]
    fn windows_that_overlap_or_are_not_within_the_run_are_refused() {
        let errors = |windows: &[[f64; 2]]| Windows::new(windows, 343.0, 0.5).unwrap_err();
        assert!(matches!(errors(&[[0.02, 0.04], [0.0, 0.03]])[..], [WindowError::Overlap([0.0, _], _)]));
        for window in [[0.0, 0.6], [0.2, 0.1], [0.1, 0.1], [-0.1, 0.2], [f64::NAN, 0.2]] {
            assert!(matches!(errors(&[window])[..], [WindowError::Outside(..)]), "{window:?}");
        }
        assert_eq!(errors(&[[0.0, 0.6], [0.1, 0.2]]).len(), 2);
    }
}
