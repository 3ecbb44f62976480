//! Purposes of rooms and their target reverberation times.
//!
//! The target depends on the volume and holds for the occupied room in the octaves 250 … 2000 Hz, within ± 20 %.
//!
//! References: [DIN18041] (docs/references.md).

use std::str::FromStr;

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

/// A target of a purpose: T = slope · lg(V / 1 m³) + offset [s], for volumes [m³] of a range.
struct Law {
    class: &'static str,
    slope: f64,
    offset: f64,
    volumes: [f64; 2],
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

    /// The first entry for its floor and for its ceiling, whose values stand for furniture that is not drawn, and whether a wall has windows.
    pub(super) fn surfaces(self) -> ([&'static str; 2], bool) {
        match self {
            Self::Classroom | Self::InclusiveClassroom | Self::Lecture => {
                (["chairs-wooden", "plasterboard-ceiling"], true)
            }
            Self::Music => (["floor-parquet", "plasterboard-ceiling"], true),
            Self::Sport => (["floor-wood", "plaster-painted"], true),
        }
    }

    /// DIN 18041:2016, 4.2.3.
    fn law(self) -> Law {
        let (class, slope, offset, volumes) = match self {
            Self::Classroom => ("A3", 0.32, -0.17, [30.0, 1000.0]),
            Self::InclusiveClassroom => ("A4", 0.26, -0.14, [30.0, 500.0]),
            Self::Lecture => ("A2", 0.37, -0.14, [50.0, 5000.0]),
            Self::Music => ("A1", 0.45, 0.07, [30.0, 1000.0]),
            Self::Sport => ("A5", 0.75, -1.0, [200.0, 10_000.0]),
        };
        Law { class, slope, offset, volumes }
    }

    /// The target for a room of a volume [m³] in a sentence; outside the volumes that the standard has, why there is none.
    #[must_use]
    pub fn target(self, volume: f64) -> String {
        let Law { class, slope, offset, volumes: [least, most] } = self.law();
        let source = format!("DIN 18041:2016, {class}");
        if !(least..=most).contains(&volume) {
            return format!("none: {source} holds for {least} … {most} m³, this room has {volume:.0} m³");
        }
        let time = slope * libm::log10(volume) + offset;
        let [low, high] = [1.0 - TOLERANCE, 1.0 + TOLERANCE].map(|part| part * time);
        format!("T {time:.2} s, within {low:.2} … {high:.2} s from 250 to 2000 Hz, occupied ({source})")
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
