//! Purposes of rooms and their target reverberation times.
//!
//! The target is that of a standard in the octaves 250 … 2000 Hz ([`crate::requirement`]). DIN 18041 counts restaurants among the rooms for longer
//! stays (B3), canteens of schools among those with special need of quiet (B5).

use std::str::FromStr;

use thiserror::Error;

use crate::requirement::{Size, State, shipped};

/// A band in which all targets hold [Hz].
const MIDDLE_HZ: f64 = 500.0;

/// What a room is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Purpose {
    name: &'static str,
    /// Name of a room of the purpose, and of the source in it.
    pub(super) titles: [&'static str; 2],
    /// The first entry for its floor and for its ceiling, whose values stand for furniture that is not drawn.
    pub(super) surfaces: [&'static str; 2],
    /// Name of its requirement.
    requirement: &'static str,
}

const CHAIRS: [&str; 2] = ["chairs-wooden", "plasterboard-ceiling"];
const CARPET: [&str; 2] = ["carpet-thin", "plasterboard-ceiling"];
const PARQUET: [&str; 2] = ["floor-parquet", "plasterboard-ceiling"];
const BOARDS: [&str; 2] = ["floor-wood", "plaster-painted"];

impl Purpose {
    /// All purposes.
    pub const ALL: [Self; 8] = [
        Self::new("classroom", ["Classroom", "teacher"], CHAIRS, "din18041-a3"),
        Self::new("inclusive-classroom", ["Inclusive classroom", "teacher"], CHAIRS, "din18041-a4"),
        Self::new("lecture", ["Lecture room", "talker"], CHAIRS, "din18041-a2"),
        Self::new("music", ["Music room", "musician"], PARQUET, "din18041-a1"),
        Self::new("sport", ["Sports hall", "coach"], BOARDS, "din18041-a5"),
        Self::new("office", ["Office", "talker"], CARPET, "asr-a3.7-open-plan"),
        Self::new("restaurant", ["Restaurant", "guest"], CHAIRS, "din18041-b3"),
        Self::new("studio", ["Control room", "loudspeaker"], CARPET, "ebu-3276"),
    ];

    const fn new(
        name: &'static str,
        titles: [&'static str; 2],
        surfaces: [&'static str; 2],
        requirement: &'static str,
    ) -> Self {
        Self { name, titles, surfaces, requirement }
    }

    /// Its name in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.name
    }

    /// Whether its target is that of the occupied room.
    pub(super) fn is_occupied(self) -> bool {
        shipped()[self.requirement].state == State::Occupied
    }

    /// The target for a room of a volume [m³] and height [m] in a sentence; outside the sizes that the standard has, why there is none.
    #[must_use]
    pub fn target(self, volume: f64, height: f64) -> String {
        let requirement = &shipped()[self.requirement];
        let (source, size) = (&requirement.source, Size { volume: Some(volume), height: Some(height) });
        let time = match requirement.value(size) {
            Ok(time) => time,
            Err(reason) => return format!("none: {source}: {reason}"),
        };
        let [low, high] = requirement.range(MIDDLE_HZ, size).unwrap_or([time; 2]);
        let range =
            if low > 0.0 { format!("{time:.2} s, within {low:.2} …") } else { "at most".to_owned() };
        let state = if self.is_occupied() { "occupied" } else { "empty" };
        format!("T {range} {high:.2} s from 250 to 2000 Hz, {state} ({source})")
    }
}

/// No purpose that a standard has a target for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("known: {}", Purpose::ALL.map(Purpose::name).join(", "))]
pub struct UnknownPurpose;

impl FromStr for Purpose {
    type Err = UnknownPurpose;

    fn from_str(text: &str) -> Result<Self, UnknownPurpose> {
        let found = Self::ALL.into_iter().find(|purpose| purpose.name() == text);
        found.ok_or(UnknownPurpose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_those_of_the_standard() {
        for (purpose, volume, expected) in [
            ("classroom", 200.0, "T 0.57 s, within 0.45 … 0.68 s"),
            ("sport", 3000.0, "T 1.61 s"),
            ("lecture", 20.0, "none: DIN 18041:2016-03, A2: volume 20 m³ outside 50 … 5000 m³"),
            ("office", 200.0, "T at most 0.60 s from 250 to 2000 Hz, empty (ASR A3.7"),
            ("restaurant", 200.0, "T at most 0.87 s from 250 to 2000 Hz, empty (DIN 18041:2016-03, B3"),
            ("studio", 100.0, "T 0.25 s, within 0.20 … 0.30 s from 250 to 2000 Hz, empty (EBU Tech"),
        ] {
            let text = purpose.parse::<Purpose>().expect("a purpose").target(volume, 3.0);
            assert!(text.starts_with(expected), "{text}");
        }
    }
}
