//! Purposes of rooms and their target reverberation times.
//!
//! The target is that of a standard in the octaves 250 … 2000 Hz ([`crate::requirement`]). DIN 18041 counts restaurants among the rooms for longer
//! stays (B3), canteens of schools among those with special need of quiet (B5).

use std::str::FromStr;

use crate::requirement::{Size, State, shipped};

/// A band in which all targets hold [Hz].
const MIDDLE_HZ: f64 = 500.0;

/// What a room is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Teaching and meetings, several people speak.
    Classroom,
    /// The same with people who hear badly or listen in a foreign language.
    InclusiveClassroom,
    /// One talker for all.
    Lecture,
    /// Making music and singing.
    Music,
    /// Sport, swimming.
    Sport,
    /// Offices of several people.
    Office,
    /// Restaurants, canteens.
    Restaurant,
    /// Control and listening rooms.
    Studio,
}

impl Purpose {
    /// All purposes.
    pub const ALL: [Self; 8] = [
        Self::Classroom,
        Self::InclusiveClassroom,
        Self::Lecture,
        Self::Music,
        Self::Sport,
        Self::Office,
        Self::Restaurant,
        Self::Studio,
    ];

    /// Its name in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Classroom => "classroom",
            Self::InclusiveClassroom => "inclusive-classroom",
            Self::Lecture => "lecture",
            Self::Music => "music",
            Self::Sport => "sport",
            Self::Office => "office",
            Self::Restaurant => "restaurant",
            Self::Studio => "studio",
        }
    }

    /// Name of a room of the purpose, and of the source in it.
    pub(super) fn titles(self) -> [&'static str; 2] {
        match self {
            Self::Classroom => ["Classroom", "teacher"],
            Self::InclusiveClassroom => ["Inclusive classroom", "teacher"],
            Self::Lecture => ["Lecture room", "talker"],
            Self::Music => ["Music room", "musician"],
            Self::Sport => ["Sports hall", "coach"],
            Self::Office => ["Office", "talker"],
            Self::Restaurant => ["Restaurant", "guest"],
            Self::Studio => ["Control room", "loudspeaker"],
        }
    }

    /// The first entry for its floor and for its ceiling, whose values stand for furniture that is not drawn.
    pub(super) fn surfaces(self) -> [&'static str; 2] {
        match self {
            Self::Classroom | Self::InclusiveClassroom | Self::Lecture => {
                ["chairs-wooden", "plasterboard-ceiling"]
            }
            Self::Music => ["floor-parquet", "plasterboard-ceiling"],
            Self::Sport => ["floor-wood", "plaster-painted"],
            Self::Restaurant => ["chairs-wooden", "plasterboard-ceiling"],
            Self::Office | Self::Studio => ["carpet-thin", "plasterboard-ceiling"],
        }
    }

    /// Name of its requirement.
    fn requirement(self) -> &'static str {
        match self {
            Self::Music => "din18041-a1",
            Self::Lecture => "din18041-a2",
            Self::Classroom => "din18041-a3",
            Self::InclusiveClassroom => "din18041-a4",
            Self::Sport => "din18041-a5",
            Self::Office => "asr-a3.7-open-plan",
            Self::Restaurant => "din18041-b3",
            Self::Studio => "ebu-3276",
        }
    }

    /// Whether its target is that of the occupied room.
    pub(super) fn is_occupied(self) -> bool {
        shipped()[self.requirement()].state == State::Occupied
    }

    /// The target for a room of a volume [m³] and height [m] in a sentence; outside the sizes that the standard has, why there is none.
    #[must_use]
    pub fn target(self, volume: f64, height: f64) -> String {
        let requirement = &shipped()[self.requirement()];
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

impl FromStr for Purpose {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|purpose| purpose.name() == text);
        found.ok_or_else(|| format!("known: {}", Self::ALL.map(Self::name).join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_those_of_the_standard() {
        for (purpose, volume, expected) in [
            (Purpose::Classroom, 200.0, "T 0.57 s, within 0.45 … 0.68 s"),
            (Purpose::Sport, 3000.0, "T 1.61 s"),
            (Purpose::Lecture, 20.0, "none: DIN 18041:2016-03, A2: volume 20 m³ outside 50 … 5000 m³"),
            (Purpose::Office, 200.0, "T at most 0.60 s from 250 to 2000 Hz, empty (ASR A3.7"),
            (
                Purpose::Restaurant,
                200.0,
                "T at most 0.87 s from 250 to 2000 Hz, empty (DIN 18041:2016-03, B3",
            ),
            (Purpose::Studio, 100.0, "T 0.25 s, within 0.20 … 0.30 s from 250 to 2000 Hz, empty (EBU Tech"),
        ] {
            let text = purpose.target(volume, 3.0);
            assert!(text.starts_with(expected), "{text}");
        }
    }
}
