//! Materials from published tables: the shipped library and the files of other programs.
//!
//! A [`LibraryEntry`] holds octaves as its source has them. [`Octaves::at`] gives a value for any band: that of the octave the
//! band lies in, or the nearest octave of the source, which is then called held. A scene takes entries by
//! `library = "NAME"`; its `material_files` are searched before the shipped library.
//!
//! References: [Vorlaender2008], [CoxDAntonio2017], [BiesHansenHoward2018] (docs/materials.md).

mod files;
mod lookup;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;

use crate::SceneErrors;

pub(crate) use files::read;
pub(crate) use lookup::{MaterialSources, read_material_sources};

/// The shipped entries.
const SHIPPED: &str = include_str!("materials.toml");

/// The octave that values begin with unless the source says otherwise [Hz].
const FIRST_OCTAVE_HZ: f64 = 125.0;

/// Coefficients in neighbouring octaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Octaves {
    /// Nominal centre of the lowest octave [Hz].
    pub first_hz: f64,
    /// One value an octave, upwards; at least one, 0 or more.
    pub values: Vec<f64>,
}

/// A material of a table: absorption, scattering or both.
#[derive(Clone, Debug, PartialEq)]
pub struct LibraryEntry {
    /// Name in `library`.
    pub name: String,
    /// The kind of material.
    pub group: String,
    /// Description.
    pub text: String,
    /// Random-incidence absorption coefficient α.
    pub absorption: Option<Octaves>,
    /// Scattering coefficient s.
    pub scattering: Option<Octaves>,
    /// Source of the numbers.
    pub source: String,
}

impl Octaves {
    /// The value for a band centred at `hz`, and whether it is held from the nearest octave.
    pub fn at(&self, hz: f64) -> (f64, bool) {
        let wanted = octave(hz) - octave(self.first_hz);
        let last = self.values.len() as i32 - 1;
        let index = wanted.clamp(0, last);
        (self.values[index as usize], index != wanted)
    }
}

/// The entries of a material file of another program; `name` tells its format by its ending and is what messages call it.
///
/// # Errors
/// Every problem of the file.
pub fn read_file(name: &str, bytes: &[u8]) -> Result<Vec<LibraryEntry>, SceneErrors> {
    read(name, bytes).map_err(|problems| SceneErrors::of_file(name, problems))
}

/// Octave of a frequency, counted from that of 1 kHz.
fn octave(hz: f64) -> i32 {
    libm::round(libm::log2(hz / 1000.0)) as i32
}

impl LibraryEntry {
    /// Whether every word occurs in its name, text, group or source, in any case.
    pub fn matches(&self, words: &[String]) -> bool {
        let all = format!("{} {} {} {}", self.name, self.text, self.group, self.source).to_lowercase();
        words.iter().all(|word| all.contains(&word.to_lowercase()))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Library {
    sources: BTreeMap<String, String>,
    groups: BTreeMap<String, BTreeMap<String, ShippedEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ShippedEntry {
    text: String,
    from_hz: Option<f64>,
    absorption: Option<Vec<f64>>,
    scattering: Option<Vec<f64>>,
    source: String,
    after: Option<String>,
}

/// The shipped entries, by group and name.
pub fn shipped() -> &'static [LibraryEntry] {
    static ENTRIES: LazyLock<Vec<LibraryEntry>> = LazyLock::new(read_shipped);
    &ENTRIES
}

fn read_shipped() -> Vec<LibraryEntry> {
    let library: Library = toml::from_str(SHIPPED).expect("the shipped library is read by a test");
    let Library { sources, groups } = &library;
    let entry = |group: &str, name: &str, row: &ShippedEntry| {
        let octaves = |values: &Option<Vec<f64>>| {
            let first_hz = row.from_hz.unwrap_or(FIRST_OCTAVE_HZ);
            values.as_ref().map(|values| Octaves { first_hz, values: values.clone() })
        };
        let after = row.after.as_ref().map_or(String::new(), |after| format!(", after {after}"));
        LibraryEntry {
            name: name.to_owned(),
            group: group.to_owned(),
            text: row.text.clone(),
            absorption: octaves(&row.absorption),
            scattering: octaves(&row.scattering),
            source: format!("{}{after}", sources[&row.source]),
        }
    };
    groups.iter().flat_map(|(group, rows)| rows.iter().map(|(name, row)| entry(group, name, row))).collect()
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "numbers are compared as they were read")]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn shipped_entries_are_sound_and_named_once() {
        let entries = shipped();
        assert!(entries.len() >= 120, "{}", entries.len());
        let names: BTreeSet<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(names.len(), entries.len());
        for entry in entries {
            let lists: Vec<&Octaves> = entry.absorption.iter().chain(&entry.scattering).collect();
            assert!(!lists.is_empty(), "{}", entry.name);
            for Octaves { first_hz, values } in lists {
                assert!((5..=8).contains(&values.len()), "{}", entry.name);
                assert!(values.iter().all(|value| (0.0..=1.0).contains(value)), "{}", entry.name);
                assert!([63.0, 125.0].contains(first_hz), "{}", entry.name);
            }
            assert!(entry.source.starts_with('[') && !entry.text.is_empty(), "{}", entry.name);
        }
    }

    /// Rows checked by hand against the tables.
    #[test]
    fn shipped_entries_have_the_numbers_of_their_sources() {
        let entries = shipped();
        let absorption = |name: &str| {
            let entry = entries.iter().find(|entry| entry.name == name).unwrap();
            [63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0]
                .map(|hz| entry.absorption.as_ref().unwrap().at(hz))
        };
        let values = |name: &str| absorption(name).map(|(value, _)| value);
        assert_eq!(values("concrete-rough"), [0.02, 0.02, 0.03, 0.03, 0.03, 0.04, 0.07, 0.07]);
        assert_eq!(values("curtain-fabric-folded"), [0.12, 0.12, 0.6, 0.98, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(values("concrete-block-coarse"), [0.36, 0.36, 0.44, 0.31, 0.29, 0.39, 0.25, 0.25]);
        assert_eq!(values("chairs-well-upholstered"), [0.28, 0.44, 0.6, 0.77, 0.84, 0.82, 0.7, 0.7]);
        let held = |name: &str| absorption(name).map(|(_, held)| held);
        assert_eq!(held("concrete-rough"), [true, false, false, false, false, false, false, false]);
        assert_eq!(held("chairs-well-upholstered"), [false, false, false, false, false, false, false, true]);
    }

    #[test]
    fn third_octaves_take_the_octave_they_lie_in() {
        let octaves = Octaves { first_hz: 125.0, values: vec![0.1, 0.2, 0.3] };
        let found = [80.0, 100.0, 125.0, 160.0, 200.0, 315.0, 400.0, 630.0, 800.0].map(|hz| octaves.at(hz));
        let octave = |value: f64| [(value, false); 3];
        assert_eq!(found[0], (0.1, true));
        assert_eq!(found[1..4], octave(0.1));
        assert_eq!(found[4..6], octave(0.2)[1..]);
        assert_eq!(found[6..8], octave(0.3)[1..]);
        assert_eq!(found[8], (0.3, true));
    }
}
