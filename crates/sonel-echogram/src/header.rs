//! The header of a numpy array, written and checked before use.
//!
//! The header is a Python dictionary literal. A general parser of such literals can be led to exhaust the stack or
//! the memory by nested brackets or huge lengths; this one understands only what numpy writes for plain arrays, and
//! compares the bytes they take with those that are there.
//!
//! References: NumPy Enhancement Proposal 1, the array format.

use std::io;

/// Bytes before the text of a header of version 1.0: signature, version, length [bytes].
const PREAMBLE: usize = 10;
/// Headers end on multiples of this, so that values are aligned [bytes].
const LINE: usize = 64;
/// Longest header accepted [bytes]; numpy's for plain arrays have 128.
const LONGEST: usize = 4096;
/// Deepest nesting of a plain array's header: the tuple of its shape within the dictionary.
const DEEPEST: usize = 2;

/// A plain array whose header announces exactly the bytes that follow it.
#[derive(Debug, PartialEq)]
pub(crate) struct PlainArray<'a> {
    /// Type of the elements as numpy writes it, such as `<f8`.
    pub element: &'a str,
    pub shape: Vec<usize>,
    pub payload: &'a [u8],
}

/// Reads the header of `array`.
///
/// # Errors
/// The fault, as a predicate.
pub(crate) fn read(array: &[u8]) -> Result<PlainArray<'_>, String> {
    let (header, payload) = split(array)?;
    let brackets = header.chars().filter(|c| "([{".contains(*c)).count();
    if brackets > DEEPEST {
        return Err("holds no plain numbers or texts".to_owned());
    }
    let element = value_of(header, "'descr'")?.strip_prefix('\'').and_then(|text| text.split_once('\''));
    let element = element.map_or("", |(element, _)| element);
    let axes = value_of(header, "'shape'")?.strip_prefix('(').and_then(|text| text.split_once(')'));
    let (axes, _) = axes.ok_or("has a header without shape")?;
    let axes = axes.split(',').map(str::trim).filter(|axis| !axis.is_empty());
    let shape: Option<Vec<usize>> = axes.map(|axis| axis.parse().ok()).collect();
    let size = element_size(element);
    let announced = shape.as_ref().zip(size).and_then(|(shape, size)| {
        shape.iter().try_fold(size, |product: usize, &axis| product.checked_mul(axis))
    });
    match (shape, announced) {
        (Some(shape), Some(announced)) if announced == payload.len() => {
            let is_by_columns =
                value_of(header, "'fortran_order'").is_ok_and(|value| value.starts_with("True"));
            if is_by_columns && shape.len() > 1 {
                return Err("is stored by columns".to_owned());
            }
            Ok(PlainArray { element, shape, payload })
        }
        (_, Some(announced)) => Err(format!("announces {announced} bytes, but holds {}", payload.len())),
        _ => Err("has a header without a readable type or shape".to_owned()),
    }
}

/// The header of an array of `element`s: version 1.0, a comma after every axis, filled up with blanks to whole lines of 64 bytes.
///
/// # Errors
/// When there are too many axes.
pub(crate) fn written(element: &str, shape: &[usize]) -> io::Result<Vec<u8>> {
    let axes: String = shape.iter().map(|length| format!("{length}, ")).collect();
    let mut header = format!("{{'descr': '{element}', 'fortran_order': False, 'shape': ({axes}), }}");
    let length = (PREAMBLE + header.len() + 1).next_multiple_of(LINE) - PREAMBLE;
    header += &" ".repeat(length - 1 - header.len());
    header.push('\n');
    let stated = u16::try_from(length).map_err(|_| io::Error::other("an array has too many axes"))?;
    Ok([b"\x93NUMPY\x01\x00", &stated.to_le_bytes()[..], header.as_bytes()].concat())
}

/// Bytes an element takes [bytes]; none for types that no response has.
fn element_size(type_string: &str) -> Option<usize> {
    let (kind, size) = type_string.split_at_checked(2)?;
    let size: usize = size.parse().ok()?;
    match kind {
        "<f" | "<u" | "|u" | "|b" => Some(size),
        "<U" => size.checked_mul(4),
        _ => None,
    }
}

/// The header's text and what follows it.
fn split(array: &[u8]) -> Result<(&str, &[u8]), String> {
    let cut_off = "ends within its header";
    let preamble = array.first_chunk::<12>().ok_or(cut_off)?;
    if &preamble[..6] != b"\x93NUMPY" {
        return Err("does not begin like a numpy array".to_owned());
    }
    let (begin, length) = match (preamble[6], preamble[7]) {
        (1, 0) => (PREAMBLE, usize::from(u16::from_le_bytes([preamble[8], preamble[9]]))),
        (2 | 3, 0) => {
            (12, u32::from_le_bytes([preamble[8], preamble[9], preamble[10], preamble[11]]) as usize)
        }
        (major, minor) => return Err(format!("has array version {major}.{minor}; 1.0 to 3.0 are read")),
    };
    if length > LONGEST {
        return Err(format!("has a header of {length} bytes, longer than any plain array's"));
    }
    let (header, payload) = array[begin..].split_at_checked(length).ok_or(cut_off)?;
    let header = std::str::from_utf8(header).map_err(|_| "has a header that is not text")?;
    Ok((header, payload))
}

/// Text after `key` and its colon.
fn value_of<'a>(header: &'a str, key: &str) -> Result<&'a str, String> {
    let value = header.split_once(key).and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
    value.map(str::trim_start).ok_or_else(|| format!("has a header without {key}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array(header: &str, payload: usize) -> Vec<u8> {
        let length = u16::try_from(header.len()).unwrap();
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(length.to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.resize(bytes.len() + payload, 0);
        bytes
    }

    #[test]
    fn what_numpy_writes_is_believed() {
        for (header, payload) in [
            ("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }          \n", 48),
            ("{'descr': '<f4', 'fortran_order': False, 'shape': (5,), }\n", 20),
            ("{'descr': '<U7', 'fortran_order': False, 'shape': (), }\n", 28),
            ("{'descr': '|u1', 'fortran_order': False, 'shape': (0, 3), }\n", 0),
        ] {
            let array = array(header, payload);
            assert_eq!(read(&array).map(|found| found.payload.len()), Ok(payload), "{header}");
        }
    }

    #[test]
    fn headers_end_on_whole_lines() {
        let cases: [(&str, &[usize], &str); 3] =
            [("<f8", &[2, 3], "(2, 3, )"), ("<u4", &[5], "(5, )"), ("<U7", &[], "()")];
        for (element, shape, written) in cases {
            let bytes = super::written(element, shape).unwrap();
            let text = format!("{{'descr': '{element}', 'fortran_order': False, 'shape': {written}, }}");
            assert_eq!(bytes, array(&format!("{text:117}\n"), 0));
        }
    }

    #[test]
    fn headers_that_lie_or_attack_are_refused() {
        let nested = format!("{{'descr': '<f8', 'shape': {}", "(".repeat(4000));
        for (header, message) in [
            ("{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }", "announces 16 bytes, but holds 8"),
            ("{'descr': '<f8', 'shape': (4294967296, 4294967296, 8), }", "readable type or shape"),
            ("{'descr': '<U4611686018427387904', 'shape': (), }", "readable type or shape"),
            ("{'descr': '<U1152921504606846975', 'shape': (), }", "but holds 8"),
            ("{'descr': '<f8', 'shape': (-1,), }", "readable type or shape"),
            ("{'descr': '|O', 'shape': (1,), }", "readable type or shape"),
            ("{'descr': [('a', '<f8')], 'shape': (1,), }", "no plain numbers"),
            ("{'descr': '<f8', }", "without 'shape'"),
            (&nested, "no plain numbers"),
        ] {
            let error = read(&array(header, 8)).unwrap_err();
            assert!(error.contains(message), "{header}: {error}");
        }
        assert!(read(b"PK").unwrap_err().contains("ends within"));
        assert!(read(b"\x93NUMPY\x02\x00\xff\xff\xff\xff").unwrap_err().contains("longer"));
        assert!(read(b"\x93NUMPY\x09\x00\x00\x00\x00\x00").unwrap_err().contains("version 9.0"));
        assert!(read(b"\x93NUMPZ\x01\x00\x00\x00\x00\x00").unwrap_err().contains("does not begin"));
    }
}
