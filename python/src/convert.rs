//! Values of Python as those of the crate `sonel`, and reports as Python's objects.

use std::fmt::Display;
use std::str::FromStr;

use glam::DVec3;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyMapping, PyString};
use sonel::{
    AbsorptionUncertainty, Change, Coefficients, Pattern, ReceiverPoint, SceneValue, Sensitivity, Variants,
    parse_count, parse_time,
};

use crate::Error;

/// A message of bad input.
pub(crate) fn refused(message: impl Display) -> PyErr {
    Error::new_err(sonel::names::message(&message.to_string()))
}

/// An object in JSON as Python's.
pub(crate) fn object<'py>(py: Python<'py>, json: &serde_json::Value) -> PyResult<Bound<'py, PyAny>> {
    use serde_json::Value as Json;
    match json {
        Json::Null => Ok(py.None().into_bound(py)),
        Json::Bool(flag) => flag.into_bound_py_any(py),
        Json::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(number), _) => number.into_bound_py_any(py),
            (_, Some(number)) => number.into_bound_py_any(py),
            _ => number.as_f64().into_bound_py_any(py),
        },
        Json::String(text) => text.into_bound_py_any(py),
        Json::Array(items) => {
            let items: Vec<_> = items.iter().map(|item| object(py, item)).collect::<PyResult<_>>()?;
            PyList::new(py, items)?.into_bound_py_any(py)
        }
        Json::Object(entries) => {
            let dict = PyDict::new(py);
            for (key, value) in entries {
                dict.set_item(key, object(py, value)?)?;
            }
            dict.into_bound_py_any(py)
        }
    }
}

/// The entries of a mapping.
fn entries<'py>(mapping: &Bound<'py, PyMapping>) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    let entry = |item: Bound<'py, PyAny>| -> PyResult<_> {
        let (key, value): (Bound<'py, PyAny>, Bound<'py, PyAny>) = item.extract()?;
        Ok((key.str()?.to_string(), value))
    };
    mapping.items()?.iter().map(entry).collect()
}

/// Arrays and numbers of numpy as Python's lists and numbers.
fn plain<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    match value.getattr_opt("tolist")? {
        Some(tolist) => tolist.call0(),
        None => Ok(value.clone()),
    }
}

/// A value of a scene.
pub(crate) fn value(given: &Bound<'_, PyAny>) -> PyResult<SceneValue> {
    let given = plain(given)?;
    if let Ok(flag) = given.cast::<PyBool>() {
        return Ok(flag.is_true().into());
    }
    if let Ok(text) = given.cast::<PyString>() {
        return Ok(text.to_string().into());
    }
    if let Ok(mapping) = given.cast::<PyMapping>() {
        let entries = entries(mapping)?.into_iter().map(|(key, given)| Ok((key, value(&given)?)));
        return Ok(SceneValue::table(entries.collect::<PyResult<Vec<_>>>()?));
    }
    if let Ok(number) = given.extract::<f64>() {
        return Ok(number.into());
    }
    let Ok(items) = given.try_iter() else {
        let kind = given.get_type().name()?.to_string();
        return Err(refused(format!("a scene holds texts, numbers, lists and mappings, not {kind}")));
    };
    Ok(items.map(|item| value(&item?)).collect::<PyResult<Vec<_>>>()?.into())
}

/// One number for all bands, or one for each.
fn coefficients(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Coefficients> {
    let given = plain(given)?;
    if let Ok(number) = given.extract::<f64>() {
        return Ok(number.into());
    }
    let wrong = |_| refused(format!("{name} is {given}: give a number, or one number per band"));
    match given.extract::<Vec<f64>>().map_err(wrong)?[..] {
        [number] => Ok(number.into()),
        ref numbers => Ok(numbers.to_vec().into()),
    }
}

/// Levels in the octaves 125 … 8000 Hz: words, or seven numbers.
pub(crate) fn octaves<L: FromStr<Err: Display>>(name: &str, given: &Bound<'_, PyAny>) -> PyResult<L> {
    let text = match given.cast::<PyString>() {
        Ok(text) => text.to_string(),
        Err(_) => {
            let wrong = |_| refused(format!("{name} is {given}: give words or seven levels"));
            let levels: Vec<f64> = plain(given)?.extract().map_err(wrong)?;
            levels.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
        }
    };
    text.parse().map_err(|wrong| refused(format!("{name}: {wrong}")))
}

/// Standard uncertainties of absorption: a number or numbers for all materials, or each by the name of its material.
pub(crate) fn uncertainties(given: &Bound<'_, PyAny>) -> PyResult<Vec<AbsorptionUncertainty>> {
    let of = |material: Option<String>, given: &Bound<'_, PyAny>| -> PyResult<_> {
        let uncertainty = coefficients("material_uncertainty", given)?;
        Ok(AbsorptionUncertainty { material, uncertainty, is_relative: false })
    };
    match given.cast::<PyMapping>() {
        Ok(mapping) => entries(mapping)?.into_iter().map(|(name, given)| of(Some(name), &given)).collect(),
        Err(_) => Ok(vec![of(None, given)?]),
    }
}

/// What `set` changes.
fn change((name, given): (String, Bound<'_, PyAny>)) -> PyResult<Change> {
    match given.cast::<PyString>() {
        Ok(text) => Change::parse(&name, &text.to_string()).map_err(refused),
        Err(_) => Change::of(&name, coefficients(&name, &given)?).map_err(refused),
    }
}

/// Variants of a material: words, a number, or several of either.
fn variants((name, given): (String, Bound<'_, PyAny>)) -> PyResult<Variants> {
    let given = plain(&given)?;
    if let Ok(text) = given.cast::<PyString>() {
        return Variants::parse(&name, &text.to_string()).map_err(refused);
    }
    if let Ok(words) = given.extract::<Vec<String>>() {
        return Variants::parse(&name, &words.join(",")).map_err(refused);
    }
    let values = match given.extract::<f64>() {
        Ok(number) => vec![number.into()],
        Err(_) => given.try_iter()?.map(|item| coefficients(&name, &item?)).collect::<PyResult<_>>()?,
    };
    Variants::of(&name, values).map_err(refused)
}

/// A receiver: name, position [m], directivity, aim.
pub(crate) type Receiver = (String, [f64; 3], String, Option<[f64; 3]>);

/// A receiver as renderings have it.
pub(crate) fn receiver((name, position, directivity, aim): Receiver) -> PyResult<ReceiverPoint> {
    if name.trim().is_empty() {
        return Err(refused("a receiver has an empty name: give it one"));
    }
    let receiver = ReceiverPoint::omni(name.trim(), DVec3::from(position));
    let pattern = directivity.parse::<Pattern>();
    let pattern = pattern.map_err(|unknown| refused(format!("receiver {name:?}: {unknown}")))?;
    let Some(aim) = aim else { return Ok(receiver) };
    let aim = DVec3::from(aim).try_normalize();
    let aim = aim.ok_or_else(|| refused(format!("receiver {name:?}: the aim has no length")))?;
    Ok(ReceiverPoint { sensitivity: Sensitivity { pattern, aim }, ..receiver })
}

/// Keyword arguments; those that are None are not there.
pub(crate) struct Keywords<'py>(pub Bound<'py, PyDict>);

impl<'py> Keywords<'py> {
    fn get(&self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.0.get_item(name)?.filter(|value| !value.is_none()))
    }

    /// Texts.
    pub(crate) fn texts(&self, name: &str) -> PyResult<Option<Vec<String>>> {
        let texts = self.get(name)?.map(|given| given.extract());
        texts.transpose().map_err(|_| refused(format!("`{name}` is neither a text nor a list of texts")))
    }

    /// A number.
    pub(crate) fn number(&self, name: &str) -> PyResult<Option<f64>> {
        let Some(given) = self.get(name)? else { return Ok(None) };
        let number = plain(&given)?.extract();
        number.map(Some).map_err(|_| refused(format!("`{name}` is {given}: give a number")))
    }

    /// A whole number that `T` holds, also as a float or a text such as `200k`.
    pub(crate) fn whole<T: TryFrom<u64>>(&self, name: &str) -> PyResult<Option<T>> {
        let Some(given) = self.get(name)? else { return Ok(None) };
        let whole =
            plain(&given)?.extract().ok().or_else(|| parse_count(&given.str().ok()?.to_string()).ok());
        let whole = whole.and_then(|whole: u64| T::try_from(whole).ok());
        let most = u64::MAX >> (64 - 8 * size_of::<T>());
        whole
            .map(Some)
            .ok_or_else(|| refused(format!("`{name}` is {given}: give a whole number from 0 to {most}")))
    }

    /// A time [s], also as a text such as `5min`.
    pub(crate) fn time(&self, name: &str) -> PyResult<Option<f64>> {
        let Some(given) = self.get(name)? else { return Ok(None) };
        parse_time(&plain(&given)?.str()?.to_string())
            .map(Some)
            .map_err(|wrong| refused(format!("`{name}`: {wrong}")))
    }

    /// A text.
    pub(crate) fn text(&self, name: &str) -> PyResult<Option<String>> {
        let Some(given) = self.get(name)? else { return Ok(None) };
        given.extract().map(Some).map_err(|_| refused(format!("`{name}` is {given}: give a text")))
    }

    /// A text that `T` is written in.
    pub(crate) fn parsed<T: FromStr<Err: Display>>(&self, name: &str) -> PyResult<Option<T>> {
        let parse = |text: String| text.parse().map_err(|wrong| refused(format!("`{name}`: {wrong}")));
        self.text(name)?.map(parse).transpose()
    }

    /// One of `choices`, by its name.
    pub(crate) fn choice<T: Copy>(
        &self,
        name: &str,
        choices: &[T],
        name_of: fn(T) -> &'static str,
    ) -> PyResult<Option<T>> {
        let Some(text) = self.text(name)? else { return Ok(None) };
        let found = choices.iter().copied().find(|&choice| name_of(choice) == text);
        let known = || choices.iter().map(|&choice| name_of(choice)).collect::<Vec<_>>().join(", ");
        found.map(Some).ok_or_else(|| refused(format!("`{name}` is {text:?}: choose among {}", known())))
    }

    /// Whether a flag is set; `default` where it is not there.
    pub(crate) fn flag(&self, name: &str, default: bool) -> PyResult<bool> {
        let Some(given) = self.get(name)? else { return Ok(default) };
        given.is_truthy().map_err(|_| refused(format!("`{name}` is {given}: give True or False")))
    }

    /// An object of a class of this module.
    pub(crate) fn class<T: pyo3::PyClass>(&self, name: &str) -> PyResult<Option<Bound<'py, T>>> {
        let cast = |given: Bound<'py, PyAny>| given.cast_into::<T>().map_err(PyErr::from);
        self.get(name)?.map(cast).transpose()
    }

    fn mapped<T>(
        &self,
        name: &str,
        read: fn((String, Bound<'py, PyAny>)) -> PyResult<T>,
    ) -> PyResult<Vec<T>> {
        let Some(given) = self.get(name)? else { return Ok(Vec::new()) };
        let Ok(mapping) = given.cast::<PyMapping>() else {
            return Err(refused(format!("`{name}` is {given}: give a mapping from names to values")));
        };
        entries(mapping)?.into_iter().map(read).collect()
    }

    /// The changes of `set`.
    pub(crate) fn changes(&self) -> PyResult<Vec<Change>> {
        self.mapped("set", change)
    }

    /// The variants of `variants`.
    pub(crate) fn variants(&self) -> PyResult<Vec<Variants>> {
        self.mapped("variants", variants)
    }
}
