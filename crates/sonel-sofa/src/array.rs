//! Arrays of a SOFA file as numbers, row by row, with their attributes.

use std::panic::{AssertUnwindSafe, catch_unwind};

use sofar::hdf::{DataFormat, DataObject, ParsedHdf, parse_with_children};

use crate::{SofaError, UNREAD, stored};

/// Classes of data types: integers and floating-point numbers.
const INTEGER: u8 = 0;
const FLOAT: u8 = 1;

/// An open file.
pub struct Sofa<'a> {
    parsed: ParsedHdf<'a>,
    file: &'a [u8],
}

/// Numbers with their shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Lengths of the axes, the last one fastest.
    pub shape: Vec<usize>,
    /// As many numbers as the shape has.
    pub values: Vec<f64>,
    /// Names and values of the attributes that are texts.
    attributes: Vec<(String, String)>,
}

impl<'a> Sofa<'a> {
    /// Opens the file whose bytes are `file`; arrays are read when they are asked for.
    ///
    /// # Errors
    /// When the bytes are no SOFA file.
    pub fn open(file: &'a [u8]) -> Result<Self, SofaError> {
        let sofa = Self { parsed: guarded(|| parse_with_children(file).ok())?, file };
        match sofa.attribute("Conventions") {
            Some("SOFA") => Ok(sofa),
            _ => Err("the file is no SOFA, or is stored otherwise than by the netCDF library".into()),
        }
    }

    /// A text among the attributes of the file, such as `SOFAConventions`.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&str> {
        let found = self.parsed.root.parsed_attributes.iter().find(|attribute| attribute.name == name);
        found?.value.as_deref()
    }

    /// The array `name`; none where the file has none of that name.
    ///
    /// # Errors
    /// When it is stored otherwise than by the netCDF library, or too large for its file.
    pub fn array(&self, name: &str) -> Result<Option<Array>, SofaError> {
        self.child(name)?.map(|object| numbers(name, &object)).transpose()
    }

    /// The array `name`, which the file must have.
    ///
    /// # Errors
    /// As of [`Self::array`], and where there is none.
    pub fn required(&self, name: &str) -> Result<Array, SofaError> {
        Ok(self.array(name)?.ok_or_else(|| format!("the file has no array {name}"))?)
    }

    /// Checks how those of the arrays `names` are stored that the file has.
    ///
    /// # Errors
    /// As of [`Self::array`].
    pub fn check(&self, names: &[&str]) -> Result<(), SofaError> {
        names.iter().try_for_each(|name| self.child(name).map(drop))
    }

    fn child(&self, name: &str) -> Result<Option<DataObject>, SofaError> {
        let parse = || Some(self.parsed.get_child(name).map(Result::ok));
        match guarded(parse).ok() {
            Some(None) => Ok(None),
            None | Some(Some(None)) => {
                let how = "stored otherwise than by the netCDF library in a few chunks";
                Err(format!("{name} is damaged, or {how}").into())
            }
            Some(Some(Some(object))) => {
                stored::check(name, &object, self.file)?;
                Ok(Some(object))
            }
        }
    }
}

impl Array {
    /// A text among its attributes, such as `Units`.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }
}

/// What `parse` finds; the library indexes what a damaged file says.
fn guarded<T>(parse: impl FnOnce() -> Option<T>) -> Result<T, SofaError> {
    catch_unwind(AssertUnwindSafe(parse)).ok().flatten().ok_or(UNREAD.into())
}

/// The numbers of an array whose bytes are little-endian.
fn numbers(name: &str, object: &DataObject) -> Result<Array, SofaError> {
    let bits = match object.dt.data_fmt {
        Some(DataFormat::Float { bit_precision, .. } | DataFormat::Fixed { bit_precision, .. }) => {
            bit_precision
        }
        None => 0,
    };
    let words = |size: usize| object.data.chunks_exact(size);
    let values: Vec<f64> = match (object.dt.class_and_version & 0x0f, bits, object.dt.size) {
        (FLOAT, 64, 8) => words(8).map(|word| f64::from_bits(little(word))).collect(),
        (FLOAT, 32, 4) => words(4).map(|word| f64::from(f32::from_bits(little(word) as u32))).collect(),
        (INTEGER, 64, 8) => words(8).map(|word| little(word) as i64 as f64).collect(),
        (INTEGER, 32, 4) => words(4).map(|word| f64::from(little(word) as u32 as i32)).collect(),
        _ => return Err(format!("{name} does not hold numbers of 32 or 64 bits").into()),
    };
    let shape: Option<Vec<usize>> =
        object.ds.dimension_size.iter().map(|size| usize::try_from(*size).ok()).collect();
    let shape = shape.ok_or(UNREAD)?;
    let count = shape.iter().try_fold(1_usize, |count, size| count.checked_mul(*size));
    if count != Some(values.len()) {
        return Err(format!("{name} holds {} numbers, its shape is {shape:?}", values.len()).into());
    }
    let text = |attribute: &sofar::hdf::Attribute| Some((attribute.name.clone(), attribute.value.clone()?));
    Ok(Array { shape, values, attributes: object.parsed_attributes.iter().filter_map(text).collect() })
}

/// Little-endian bytes as a number.
fn little(word: &[u8]) -> u64 {
    word.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}
