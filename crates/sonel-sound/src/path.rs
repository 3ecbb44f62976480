//! Paths of listeners: straight pieces between waypoints, each with a constant speed.

use glam::DVec3;

use crate::SoundError;

/// Highest speed of a listener [m/s].
pub(crate) const FASTEST: f64 = 100.0;
/// Shorter paths are a single place [m]: names of places have millimetres.
const STANDING: f64 = 1e-3;

/// Where a listener is at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// Time [s].
    pub time: f64,
    /// Position in the axes of the scene [m].
    pub position: DVec3,
}

/// A path through waypoints.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    points: Vec<Waypoint>,
    /// Length of the path up to each waypoint [m].
    lengths: Vec<f64>,
}

impl Path {
    /// A path through these points: the listener is at the first one before its time and stays at the last one.
    ///
    /// # Errors
    /// When there is no point, one is not finite, times do not rise, or the listener exceeds 100 m/s.
    pub fn new(points: Vec<Waypoint>) -> Result<Self, SoundError> {
        let refused = |number: usize, problem: String| SoundError::Path { number, problem };
        if points.is_empty() {
            return Err(refused(1, "is missing: give at least one point".to_owned()));
        }
        if let Some(index) =
            points.iter().position(|point| !(point.time.is_finite() && point.position.is_finite()))
        {
            return Err(refused(index + 1, "is not finite".to_owned()));
        }
        let mut lengths = vec![0.0];
        for (index, pair) in points.windows(2).enumerate() {
            let [before, time] = [pair[0].time, pair[1].time];
            let (number, duration) = (index + 2, time - before);
            let way = pair[1].position.distance(pair[0].position);
            if duration <= 0.0 {
                return Err(refused(
                    number,
                    format!("has the time {time} s after {before} s: times must rise"),
                ));
            }
            if way > FASTEST * duration {
                let problem =
                    format!("is reached at {:.1} m/s; at most {FASTEST} m/s are allowed", way / duration);
                return Err(refused(number, problem));
            }
            lengths.push(lengths[index] + way);
        }
        Ok(Self { points, lengths })
    }

    /// Its length [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// Time of the first waypoint [s].
    #[must_use]
    pub fn begin(&self) -> f64 {
        self.points[0].time
    }

    /// Pieces of equal length, at most `longest` [m], that it is divided into; none where the listener stands.
    #[must_use]
    pub fn pieces(&self, longest: f64) -> usize {
        if self.length() < STANDING { 0 } else { (self.length() / longest).ceil() as usize }
    }

    /// Ends of these pieces: the places from which the path is rendered.
    #[must_use]
    pub fn places(&self, longest: f64) -> Vec<DVec3> {
        let pieces = self.pieces(longest);
        (0..=pieces).map(|index| self.place(self.length() * index as f64 / pieces.max(1) as f64)).collect()
    }

    /// Position after a length of the path, also straight on before its beginning and behind its end [m].
    #[must_use]
    pub fn place(&self, length: f64) -> DVec3 {
        // Pieces of no length have no direction.
        let after = self.lengths.partition_point(|end| *end <= length);
        let moved = |index: &usize| self.lengths[*index] > self.lengths[index - 1];
        let piece = (1..=after.min(self.points.len() - 1)).rev().find(moved);
        let piece = if after < self.points.len() && after > 0 { Some(after) } else { piece };
        let piece = piece.or_else(|| (1..self.points.len()).find(moved));
        let Some(piece) = piece else { return self.points[0].position };
        let (begin, end) = (self.points[piece - 1].position, self.points[piece].position);
        let share = (length - self.lengths[piece - 1]) / (self.lengths[piece] - self.lengths[piece - 1]);
        begin + share * (end - begin)
    }

    /// Position and length of the path at a time [s].
    #[must_use]
    pub fn at(&self, time: f64) -> (DVec3, f64) {
        let last = self.points.len() - 1;
        let after = self.points.partition_point(|point| point.time <= time);
        if after == 0 || after > last {
            let index = after.min(last);
            return (self.points[index].position, self.lengths[index]);
        }
        let (begin, end) = (self.points[after - 1], self.points[after]);
        let share = (time - begin.time) / (end.time - begin.time);
        let length = self.lengths[after - 1] + share * (self.lengths[after] - self.lengths[after - 1]);
        (begin.position + share * (end.position - begin.position), length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    fn path(points: &[(f64, [f64; 3])]) -> Result<Path, SoundError> {
        Path::new(
            points
                .iter()
                .map(|(time, position)| Waypoint { time: *time, position: (*position).into() })
                .collect(),
        )
    }

    #[test]
    fn a_path_with_a_rest_is_gone_at_its_speeds() {
        let path =
            path(&[(1.0, [0.0; 3]), (2.0, [2.0, 0.0, 0.0]), (5.0, [2.0, 0.0, 0.0]), (6.0, [2.0, 1.0, 0.0])])
                .unwrap();
        for (time, position, length) in [
            (0.0, DVec3::ZERO, 0.0),
            (1.5, dvec3(1.0, 0.0, 0.0), 1.0),
            (4.0, dvec3(2.0, 0.0, 0.0), 2.0),
            (5.25, dvec3(2.0, 0.25, 0.0), 2.25),
            (9.0, dvec3(2.0, 1.0, 0.0), 3.0),
        ] {
            let (found, along) = path.at(time);
            assert!(
                found.distance(position) < 1e-12 && (along - length).abs() < 1e-12,
                "{time}: {found} {along}"
            );
            assert!(path.place(length).distance(position) < 1e-12, "{length}");
        }
        assert!(path.place(-0.5).distance(dvec3(-0.5, 0.0, 0.0)) < 1e-12);
        assert!(path.place(3.5).distance(dvec3(2.0, 1.5, 0.0)) < 1e-12);
        assert_eq!((path.pieces(0.7), path.places(0.7).len()), (5, 6));
    }

    #[test]
    fn who_stands_is_at_one_place() {
        let path = path(&[(0.0, [1.0; 3]), (5.0, [1.0; 3])]).unwrap();
        assert_eq!(
            (path.places(0.1), path.at(3.0), path.place(0.7)),
            (vec![DVec3::ONE], (DVec3::ONE, 0.0), DVec3::ONE)
        );
    }

    #[test]
    fn impossible_paths_are_named() {
        for (points, message) in [
            (&[][..], "point 1 is missing"),
            (&[(0.0, [0.0; 3]), (0.0, [1.0; 3])], "point 2 has the time 0 s after 0 s"),
            (&[(0.0, [0.0; 3]), (0.01, [0.0, 2.0, 0.0])], "200.0 m/s; at most 100"),
            (&[(0.0, [f64::NAN; 3])], "point 1 is not finite"),
        ] {
            let error = path(points).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    }
}
