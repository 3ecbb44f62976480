//! Purposes of rooms and their target reverberation times.
//!
//! The target depends on the volume and holds for the occupied room, for sport for the empty hall, in the octaves 250 … 2000 Hz, within ± 20 %.
//!
//! References: [DIN18041] (docs/references.md).

use std::str::FromStr;

use sonel_acoustics::din18041::{GROUP_A, Use};

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
}

/// Relative tolerance of the target.
const TOLERANCE: f64 = 0.2;

impl Purpose {
    /// All purposes.
    pub const ALL: [Self; 5] =
        [Self::Classroom, Self::InclusiveClassroom, Self::Lecture, Self::Music, Self::Sport];

    /// Its name in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Classroom => "classroom",
            Self::InclusiveClassroom => "inclusive-classroom",
            Self::Lecture => "lecture",
            Self::Music => "music",
            Self::Sport => "sport",
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
        }
    }

    /// DIN 18041:2016, 4.2.3.
    fn din(self) -> &'static Use {
        &GROUP_A[match self {
            Self::Music => 0,
            Self::Lecture => 1,
            Self::Classroom => 2,
            Self::InclusiveClassroom => 3,
            Self::Sport => 4,
        }]
    }

    /// The target for a room of a volume [m³] in a sentence; outside the volumes that the standard has, why there is none.
    #[must_use]
    pub fn target(self, volume: f64) -> String {
        let Use { class, volumes: [least, most], .. } = self.din();
        let source = format!("DIN 18041:2016, {class}");
        let Some(time) = self.din().time(volume) else {
            let to = if most.is_finite() { format!("… {most} m³") } else { "m³ and more".to_owned() };
            return format!("none: {source} holds for {least} {to}, this room has {volume:.0} m³");
        };
        let [low, high] = [1.0 - TOLERANCE, 1.0 + TOLERANCE].map(|part| part * time);
        let state = if self.din().is_occupied() { "occupied" } else { "empty" };
        format!("T {time:.2} s, within {low:.2} … {high:.2} s from 250 to 2000 Hz, {state} ({source})")
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
        let text = Purpose::Classroom.target(200.0);
        assert!(text.starts_with("T 0.57 s, within 0.45 … 0.68 s"), "{text}");
        assert!(Purpose::Sport.target(3000.0).starts_with("T 1.61 s"));
        assert!(Purpose::Lecture.target(20.0).starts_with("none: DIN 18041:2016, A2 holds for 50 … 5000 m³"));
    }
}
