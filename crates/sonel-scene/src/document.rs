//! Tables and values of a TOML document with their full key and position.
//!
//! Every reader reports what is wrong with a value and returns `None` for it, so that reading goes on to the next.

use std::ops::Range;

use glam::DVec3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::report::Report;
use crate::suggest::suggest;

/// A table with its full key; the document itself has an empty one.
pub(crate) struct Table<'t> {
    path: String,
    pub(crate) at: usize,
    entries: &'t DeTable<'t>,
}

/// A value with its full key.
pub(crate) struct Entry<'t> {
    pub(crate) path: String,
    pub(crate) at: usize,
    value: &'t DeValue<'t>,
}

/// A finite number and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Number {
    pub(crate) value: f64,
    pub(crate) at: usize,
}

/// The items of a list that are finite numbers; the others are in the report.
pub(crate) struct Numbers {
    pub(crate) readable: Vec<Number>,
    /// Whether every item was readable, so that their count and order mean something.
    pub(crate) is_complete: bool,
}

impl<'t> Table<'t> {
    /// The whole document.
    pub(crate) fn document(entries: &'t DeTable<'t>) -> Self {
        Self { path: String::new(), at: 0, entries }
    }

    /// Full key of this table.
    pub(crate) fn path(&self) -> &str {
        &self.path
    }

    /// Full key of an entry of this table.
    pub(crate) fn path_of(&self, key: &str) -> String {
        let key = quoted_key(key);
        if self.path.is_empty() { key } else { format!("{}.{key}", self.path) }
    }

    /// The value of a key, if it is there.
    pub(crate) fn get(&self, key: &str) -> Option<Entry<'t>> {
        let (_, value) = self.entries.iter().find(|(found, _)| found.get_ref() == key)?;
        Some(Entry { path: self.path_of(key), at: value.span().start, value: value.get_ref() })
    }

    /// Where the value of a key stands, in bytes.
    pub(crate) fn span_of(&self, key: &str) -> Option<Range<usize>> {
        let (_, value) = self.entries.iter().find(|(found, _)| found.get_ref() == key)?;
        Some(value.span())
    }

    /// Keys and values in the order of the file.
    pub(crate) fn in_file_order(&self) -> Vec<(&'t str, Entry<'t>)> {
        let mut sorted: Vec<_> = self.entries.iter().collect();
        sorted.sort_by_key(|(key, _)| key.span().start);
        let entry = |(key, value): (&'t Spanned<_>, &'t Spanned<DeValue<'t>>)| {
            let key: &'t std::borrow::Cow<'t, str> = key.get_ref();
            (key.as_ref(), Entry { path: self.path_of(key), at: value.span().start, value: value.get_ref() })
        };
        sorted.into_iter().map(entry).collect()
    }

    /// Reports every key that is not `known`.
    pub(crate) fn allow_only(&self, known: &[&str], report: &mut Report<'_>) {
        for (key, _) in self.entries.iter() {
            let name = key.get_ref();
            if !known.contains(&name.as_ref()) {
                let advice = suggest(name, known.iter().copied());
                report.problem(key.span().start, format!("{}: unknown key; {advice}", self.path_of(name)));
            }
        }
    }
}

impl<'t> Entry<'t> {
    /// Reports `message` about this value.
    pub(crate) fn problem(&self, report: &mut Report<'_>, message: &str) {
        report.problem(self.at, format!("{}: {message}", self.path));
    }

    fn expected(&self, what: &str, report: &mut Report<'_>) {
        self.problem(report, &format!("expected {what}, found {}", self.kind()));
    }

    fn kind(&self) -> &'static str {
        match self.value {
            DeValue::String(_) => "a text in quotes",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        }
    }

    /// A text.
    pub(crate) fn text(&self, report: &mut Report<'_>) -> Option<&'t str> {
        match self.value {
            DeValue::String(text) => Some(text.as_ref()),
            _ => {
                self.expected("a text in quotes", report);
                None
            }
        }
    }

    /// A text with something in it.
    pub(crate) fn filled_text(&self, report: &mut Report<'_>) -> Option<&'t str> {
        let text = self.text(report)?;
        if text.trim().is_empty() {
            self.problem(report, "is empty: write a text or leave the key out");
            return None;
        }
        Some(text)
    }

    /// One text or a list of them, each with its own place.
    pub(crate) fn texts(&self, report: &mut Report<'_>) -> Vec<(&'t str, Entry<'t>)> {
        let entries = match self.value {
            DeValue::Array(items) => items
                .iter()
                .enumerate()
                .map(|(i, item)| {
                    let path = format!("{}[{}]", self.path, i + 1);
                    Entry { path, at: item.span().start, value: item.get_ref() }
                })
                .collect(),
            _ => vec![Entry { path: self.path.clone(), at: self.at, value: self.value }],
        };
        entries.into_iter().filter_map(|entry: Entry<'t>| Some((entry.filled_text(report)?, entry))).collect()
    }

    /// True or false.
    pub(crate) fn flag(&self, report: &mut Report<'_>) -> Option<bool> {
        match self.value {
            DeValue::Boolean(flag) => Some(*flag),
            _ => {
                self.expected("true or false", report);
                None
            }
        }
    }

    /// A finite number.
    pub(crate) fn number(&self, report: &mut Report<'_>) -> Option<Number> {
        let Some(value) = number_of(self.value) else {
            self.expected("a number", report);
            return None;
        };
        if !value.is_finite() {
            self.problem(report, &format!("{value} is not a finite number"));
            return None;
        }
        Some(Number { value, at: self.at })
    }

    /// A finite number above zero.
    pub(crate) fn positive(&self, report: &mut Report<'_>) -> Option<f64> {
        let number = self.number(report)?;
        if number.value <= 0.0 {
            self.problem(report, &format!("{} is not positive", number.value));
            return None;
        }
        Some(number.value)
    }

    /// A list of finite numbers.
    pub(crate) fn numbers(&self, report: &mut Report<'_>) -> Option<Numbers> {
        let DeValue::Array(items) = self.value else {
            self.expected("a list of numbers such as [1.0, 2.0]", report);
            return None;
        };
        let item = |(i, item): (usize, &'t Spanned<DeValue<'t>>)| {
            let path = format!("{}[{}]", self.path, i + 1);
            Entry { path, at: item.span().start, value: item.get_ref() }.number(report)
        };
        let readable: Vec<Number> = items.iter().enumerate().filter_map(item).collect();
        Some(Numbers { is_complete: readable.len() == items.len(), readable })
    }

    /// One finite number, or a list of them.
    pub(crate) fn number_or_list(&self, report: &mut Report<'_>) -> Option<Numbers> {
        match self.value {
            DeValue::Array(_) => self.numbers(report),
            _ => self.number(report).map(|number| Numbers { readable: vec![number], is_complete: true }),
        }
    }

    /// Whether this is a list.
    pub(crate) fn is_list(&self) -> bool {
        matches!(self.value, DeValue::Array(_))
    }

    /// Whether this is a list with nothing in it.
    pub(crate) fn is_empty_list(&self) -> bool {
        matches!(self.value, DeValue::Array(items) if items.is_empty())
    }

    /// Three finite numbers.
    pub(crate) fn vector(&self, report: &mut Report<'_>) -> Option<DVec3> {
        let Numbers { readable, is_complete: true } = self.numbers(report)? else { return None };
        let [x, y, z] = readable[..] else {
            self.problem(report, &format!("expected three numbers [x, y, z], found {}", readable.len()));
            return None;
        };
        Some(DVec3::new(x.value, y.value, z.value))
    }

    /// A table.
    pub(crate) fn table(&self, report: &mut Report<'_>) -> Option<Table<'t>> {
        match self.value {
            DeValue::Table(entries) => Some(Table { path: self.path.clone(), at: self.at, entries }),
            _ => {
                self.expected("a table", report);
                None
            }
        }
    }

    /// The tables of a list of tables; `header` is how the file writes one.
    pub(crate) fn tables(&self, header: &str, report: &mut Report<'_>) -> Vec<Table<'t>> {
        let DeValue::Array(items) = self.value else {
            self.expected(&format!("tables, each begun by {header}"), report);
            return Vec::new();
        };
        let entry = |(i, item): (usize, &'t Spanned<DeValue<'t>>)| {
            let Range { start: at, .. } = item.span();
            Entry { path: format!("{}[{}]", self.path, i + 1), at, value: item.get_ref() }.table(report)
        };
        items.iter().enumerate().filter_map(entry).collect()
    }
}

/// A key as a TOML file writes it: in quotes unless it is made of letters, digits, `_` and `-`.
pub(crate) fn quoted_key(key: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.chars().all(is_bare) { key.to_owned() } else { quoted(key) }
}

/// A text in quotes, as a TOML file writes it.
pub(crate) fn quoted(text: &str) -> String {
    let escaped = |letter: char| match letter {
        '"' | '\\' => format!("\\{letter}"),
        control if control.is_control() => format!("\\u{:04X}", u32::from(control)),
        letter => letter.to_string(),
    };
    format!("\"{}\"", text.chars().map(escaped).collect::<String>())
}

/// The number a value stands for, if it is one; it may be infinite or no number.
fn number_of(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
        DeValue::Integer(integer) => {
            i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|integer| integer as f64)
        }
        _ => None,
    }
}
