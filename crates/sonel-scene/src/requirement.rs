//! What rooms shall meet: tables of standards, and those of users in the same form.
//!
//! The value of a parameter follows from the volume or the height of the room; every band has a range about it, or a mean over bands an upper limit.
//!
//! References: `requirements.toml` names the source of every entry (docs/references.md).

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;
use thiserror::Error;

/// The shipped requirements.
const SHIPPED: &str = include_str!("requirements.toml");

/// Requirements by name.
pub type Requirements = BTreeMap<String, Requirement>;

/// A requirement of a standard.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Requirement {
    /// What it is for.
    pub title: String,
    /// Where its numbers stand.
    pub source: String,
    /// The state of the room for which they hold.
    pub state: State,
    /// Short name of the parameter.
    pub parameter: String,
    rooms: Vec<Rooms>,
    /// Band [Hz], lowest and highest part of the value.
    #[serde(default)]
    bands: Vec<[f64; 3]>,
    /// What the value may lie beyond these ends, in its unit.
    #[serde(default)]
    tolerance: f64,
    /// Bands [Hz] whose mean is judged: of these sets that of which a response has most.
    #[serde(default)]
    pub means: Vec<Vec<f64>>,
}

/// Whether people are in the room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// They are.
    Occupied,
    /// They are not.
    Unoccupied,
}

/// Rooms of some volumes or heights, with the value as a function of these: slope · lg + `cube_root` · ∛ + offset.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Rooms {
    volume: Option<[f64; 2]>,
    height: Option<[f64; 2]>,
    #[serde(default)]
    slope: f64,
    #[serde(default)]
    cube_root: f64,
    #[serde(default)]
    offset: f64,
}

/// What a requirement needs to know of a room.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Size {
    /// Volume of a closed room [m³].
    pub volume: Option<f64>,
    /// Clear height [m].
    pub height: Option<f64>,
}

/// Why a requirement says nothing of a room, in a sentence.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct DoesNotApply(pub String);

/// The shipped requirements.
pub fn shipped() -> &'static Requirements {
    static READ: LazyLock<Requirements> = LazyLock::new(|| read(SHIPPED).expect("the shipped requirements"));
    &READ
}

/// The requirements of a file.
///
/// # Errors
/// What is wrong with it, with its line.
pub fn read(text: &str) -> Result<Requirements, toml::de::Error> {
    let found: Requirements = toml::from_str(text)?;
    let faulty = found.iter().find(|(_, requirement)| !requirement.is_complete());
    match faulty {
        Some((name, _)) => Err(serde::de::Error::custom(format!(
            "[{name}] needs one of `bands` and `means`, and in each of `rooms` one of `volume` and `height`, whose ends rise"
        ))),
        None => Ok(found),
    }
}

impl Requirement {
    fn is_complete(&self) -> bool {
        let ends = |rooms: &Rooms| rooms.volume.xor(rooms.height).is_some_and(|[least, most]| least < most);
        self.bands.is_empty() != self.means.is_empty()
            && !self.rooms.is_empty()
            && self.rooms.iter().all(ends)
    }

    /// The value for a room.
    ///
    /// # Errors
    /// Why there is none.
    pub fn value(&self, size: Size) -> Result<f64, DoesNotApply> {
        let (mut begin, mut end) = (String::new(), String::new());
        for rooms in &self.rooms {
            let (what, unit, found, [least, most]) = match rooms.volume {
                Some(ends) => ("volume", "m³", size.volume, ends),
                None => ("height", "m", size.height, rooms.height.unwrap_or_default()),
            };
            let found = found.ok_or_else(|| DoesNotApply(format!("the response states no {what}")))?;
            if (least..=most).contains(&found) {
                return Ok(rooms.slope * libm::log10(found)
                    + rooms.cube_root * libm::cbrt(found)
                    + rooms.offset);
            }
            if begin.is_empty() {
                begin = format!("{what} {found:.0} {unit} outside {least}");
            }
            end = if most.is_finite() { format!(" … {most} {unit}") } else { format!(" {unit} and more") };
        }
        Err(DoesNotApply(begin + &end))
    }

    /// Lowest and highest value in a band of a room; none where nothing is said of it.
    pub fn range(&self, hz: f64, size: Size) -> Option<[f64; 2]> {
        let value = self.value(size).ok()?;
        if self.means.iter().flatten().any(|of| of.total_cmp(&hz).is_eq()) {
            return Some([0.0, value]);
        }
        let [_, low, high] = self.bands.iter().find(|[of, ..]| of.total_cmp(&hz).is_eq())?;
        Some([low * value - self.tolerance, high * value + self.tolerance])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(volume: f64) -> Size {
        Size { volume: Some(volume), height: None }
    }

    /// Teaching in 187 m³: 0.32 · 2.272 − 0.17 = 0.557 s. Group B asks for A/V of 0.2 m⁻¹ up to 2.5 m, 1/(3.13 + 4.69 lg 4) at 4 m.
    #[test]
    fn values_are_those_of_the_standards() {
        let value = |name: &str, size| shipped()[name].value(size).expect("a value");
        let height = |height: f64| Size { volume: None, height: Some(height) };
        for (found, expected) in [
            (value("din18041-a3", volume(187.0)), 0.557),
            (value("din18041-a5", volume(3000.0)), 1.608),
            (value("din18041-a5", volume(20_000.0)), 2.0),
            (value("din18041-b3", height(2.4)), 0.163 / 0.2),
            (value("din18041-b3", height(4.0)), 0.163 * (3.13 + 4.69 * 0.60206)),
            (value("ansi-s12.60", volume(300.0)), 0.7),
            (value("ebu-3276", volume(100.0)), 0.25),
            (value("ebu-3276", volume(409.6)), 0.4),
        ] {
            assert!((found - expected).abs() < 1e-3, "{found} instead of {expected}");
        }
        // The two lines of group B meet.
        for name in ["din18041-b2", "din18041-b3", "din18041-b4", "din18041-b5"] {
            assert!((value(name, height(2.5)) - value(name, height(2.5001))).abs() < 2e-3, "{name}");
        }
        assert!(shipped()["vdi2569-b"].range(125.0, volume(90.0)) == Some([0.0, 0.9]));
        let [low, high] = shipped()["ebu-3276"].range(250.0, volume(100.0)).expect("a range");
        assert!((low - 0.2).abs() < 1e-4 && (high - 0.3).abs() < 1e-4, "{low} {high}");
    }

    #[test]
    fn what_has_no_value_and_what_is_no_requirement_says_why() {
        let reason = |size| shipped()["din18041-a4"].value(size).unwrap_err().to_string();
        assert_eq!(reason(volume(600.0)), "volume 600 m³ outside 30 … 500 m³");
        assert_eq!(reason(Size::default()), "the response states no volume");
        let complete = "[own]\ntitle = \"\"\nsource = \"\"\nstate = \"occupied\"\nparameter = \"t20\"\nrooms = [{ volume = [0, 9], offset = 1 }]\n";
        let with = |more: &str| read(&format!("{complete}{more}"));
        assert!(with("bands = [[500, 0, 1]]").is_ok());
        assert!(with("").unwrap_err().to_string().contains("[own] needs one of"));
        assert!(with("band = [[500, 0, 1]]").unwrap_err().to_string().contains("unknown field `band`"));
    }
}
