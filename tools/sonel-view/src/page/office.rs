//! An open-plan office: parameters of ISO 3382-3 along the receivers of its first source.

use serde::Serialize;
use sonel::analysis::ParameterValue;
use sonel::analysis::comparison::{Pairing, difference};
use sonel::analysis::modulation::Talk;
use sonel::analysis::open_plan::{Line, SPEECH_POWER_LEVEL_DB, line};

use super::Subject;
use super::number::Number;

/// A design as an office.
#[derive(Debug, Serialize)]
pub(crate) struct Office {
    pub numbers: Vec<OfficeNumber>,
    /// Level of VDI 2569, in words.
    pub level: Option<String>,
}

/// A number, and by how much it is more than that of the first design.
#[derive(Debug, Serialize)]
pub(crate) struct OfficeNumber {
    /// Symbol and unit.
    pub label: &'static str,
    pub value: Number,
    pub less: Option<Number>,
}

impl Office {
    /// All designs, with the noise in which they are heard.
    pub(super) fn all(subjects: &[Subject]) -> Vec<Self> {
        let lines: Vec<Line> = subjects.iter().filter_map(along).collect();
        lines.iter().enumerate().map(|(index, line)| Self::of(line, (index > 0).then(|| &lines[0]))).collect()
    }

    fn of(line: &Line, first: Option<&Line>) -> Self {
        let less = |index: usize, value: &ParameterValue| {
            let before = first?.numbers()[index].2;
            Some(Number::of(&difference(before, value, Pairing::Independent), 1.0))
        };
        let numbers = line.numbers().into_iter().enumerate().map(|(index, (label, _, value))| OfficeNumber {
            label,
            value: Number::of(value, 1.0),
            less: less(index, value),
        });
        Self { numbers: numbers.collect(), level: line.propagation() }
    }
}

fn along(subject: &Subject) -> Option<Line> {
    let talk = subject.talk.clone()?;
    let talk = Talk { power_level_db: talk.power_level_db.or(Some(SPEECH_POWER_LEVEL_DB)), ..talk };
    let receivers: Vec<usize> = (0..subject.echograms().receivers()).collect();
    Some(line(subject.echograms(), 0, &receivers, &talk))
}
