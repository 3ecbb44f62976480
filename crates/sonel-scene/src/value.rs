//! Values of a scene document: read from TOML with their places, or made in code.

use std::fmt::Write;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value of a scene document: a text, a number, a truth value, a list or a table.
#[derive(Clone, Debug)]
pub struct Value {
    /// Bytes of the file; none of a value made in code.
    pub(crate) span: Range<usize>,
    pub(crate) kind: Kind,
}

#[derive(Clone, Debug)]
pub(crate) enum Kind {
    Text(String),
    Number(f64),
    Flag(bool),
    /// A date as written: TOML has them, scenes do not.
    Date(String),
    List(Vec<Value>),
    Table(Entries),
}

/// Keys, where they stand, and their values, in the order of the file.
#[derive(Clone, Debug, Default)]
pub(crate) struct Entries(pub(crate) Vec<(String, usize, Value)>);

impl Entries {
    pub(crate) fn get(&self, key: &str) -> Option<&Value> {
        self.0.iter().find(|(found, ..)| found == key).map(|(.., value)| value)
    }

    /// Entries made in code, in their order.
    pub(crate) fn made<K: Into<String>, V: Into<Value>>(entries: impl IntoIterator<Item = (K, V)>) -> Self {
        Self(entries.into_iter().map(|(key, value)| (key.into(), 0, value.into())).collect())
    }

    /// The entries of a TOML document.
    pub(crate) fn parsed(table: &DeTable<'_>) -> Self {
        let entry = |(key, value): (&Spanned<_>, &Spanned<DeValue<'_>>)| {
            let name: &std::borrow::Cow<'_, str> = key.get_ref();
            (name.clone().into_owned(), key.span().start, Value::parsed(value))
        };
        let mut entries: Vec<_> = table.iter().map(entry).collect();
        entries.sort_by_key(|(_, at, _)| *at);
        Self(entries)
    }
}

impl Value {
    /// A table of `entries`, in their order.
    pub fn table<K: Into<String>, V: Into<Self>>(entries: impl IntoIterator<Item = (K, V)>) -> Self {
        Kind::Table(Entries::made(entries)).into()
    }

    fn parsed(value: &Spanned<DeValue<'_>>) -> Self {
        let kind = match value.get_ref() {
            DeValue::String(text) => Kind::Text(text.clone().into_owned()),
            DeValue::Float(float) => Kind::Number(float.as_str().parse().unwrap_or(f64::NAN)),
            DeValue::Integer(integer) if integer.radix() == 10 => {
                Kind::Number(integer.as_str().parse().unwrap_or(f64::NAN))
            }
            DeValue::Integer(integer) => {
                let number = i64::from_str_radix(integer.as_str(), integer.radix());
                Kind::Number(number.map_or(f64::NAN, |number| number as f64))
            }
            DeValue::Boolean(flag) => Kind::Flag(*flag),
            DeValue::Datetime(date) => Kind::Date(date.to_string()),
            DeValue::Array(items) => Kind::List(items.iter().map(Self::parsed).collect()),
            DeValue::Table(table) => Kind::Table(Entries::parsed(table)),
        };
        Self { span: value.span(), kind }
    }

    /// The value as TOML writes it within a line.
    fn inline(&self) -> String {
        match &self.kind {
            Kind::Text(text) => quoted(text),
            Kind::Number(number) if number.is_nan() => "nan".to_owned(),
            Kind::Number(number) => format!("{number:?}"),
            Kind::Flag(flag) => flag.to_string(),
            Kind::Date(date) => date.clone(),
            Kind::List(items) => {
                format!("[{}]", items.iter().map(Self::inline).collect::<Vec<_>>().join(", "))
            }
            Kind::Table(Entries(entries)) => {
                let entry = |(key, _, value): &(String, usize, Self)| {
                    format!("{} = {}", quoted_key(key), value.inline())
                };
                format!("{{ {} }}", entries.iter().map(entry).collect::<Vec<_>>().join(", "))
            }
        }
    }

    fn is_table(&self) -> bool {
        matches!(self.kind, Kind::Table(_))
    }
}

/// A document as the text of a TOML file: values, then tables of tables, then lists of tables.
pub(crate) fn to_toml(Entries(entries): &Entries) -> String {
    let mut text = String::new();
    let lines = |text: &mut String, entries: &Entries| {
        for (key, _, value) in &entries.0 {
            let _ = writeln!(text, "{} = {}", quoted_key(key), value.inline());
        }
    };
    let (tables, values): (Vec<_>, Vec<_>) = entries.iter().partition(|(_, _, value)| match &value.kind {
        Kind::Table(entries) => !entries.0.is_empty() && entries.0.iter().all(|(.., value)| value.is_table()),
        Kind::List(items) => !items.is_empty() && items.iter().all(Value::is_table),
        _ => false,
    });
    lines(&mut text, &Entries(values.into_iter().cloned().collect()));
    for (key, _, value) in tables {
        let (open, close) = if value.is_table() { ("[", "]") } else { ("[[", "]]") };
        let parts: Vec<(String, &Value)> = match &value.kind {
            Kind::Table(Entries(entries)) => {
                entries.iter().map(|(name, _, value)| (format!(".{}", quoted_key(name)), value)).collect()
            }
            Kind::List(items) => items.iter().map(|item| (String::new(), item)).collect(),
            _ => Vec::new(),
        };
        for (name, part) in parts {
            let _ = writeln!(text, "\n{open}{}{name}{close}", quoted_key(key));
            if let Kind::Table(entries) = &part.kind {
                lines(&mut text, entries);
            }
        }
    }
    text
}

impl From<Kind> for Value {
    fn from(kind: Kind) -> Self {
        Self { span: 0..0, kind }
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Kind::Text(text.to_owned()).into()
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Kind::Text(text).into()
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Kind::Number(number).into()
    }
}

impl From<bool> for Value {
    fn from(flag: bool) -> Self {
        Kind::Flag(flag).into()
    }
}

impl<T: Into<Self>> From<Vec<T>> for Value {
    fn from(items: Vec<T>) -> Self {
        Kind::List(items.into_iter().map(Into::into).collect()).into()
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
