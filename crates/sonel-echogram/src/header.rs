//! The header of a numpy array, checked before use.
//!
//! The header is a Python dictionary literal. A general parser of such literals can be led to exhaust the stack or
//! the memory by nested brackets or huge lengths; this one understands only what numpy writes for plain arrays, and
//! compares the bytes they take with those that are there.
//!
//! References: NumPy Enhancement Proposal 1, the array format.

/// Longest header believed; numpy's for plain arrays have 128 bytes [bytes].
const LONGEST: usize = 4096;
/// Deepest nesting of a plain array's header: the tuple of its shape within the dictionary.
const DEEPEST: usize = 2;

/// Checks that `array` is a plain array whose header announces exactly the bytes that follow it.
///
/// # Errors
/// What is wrong, as a predicate.
pub fn check(array: &[u8]) -> Result<(), String> {
    let (header, payload) = split(array)?;
    let brackets = header.chars().filter(|c| "([{".contains(*c)).count();
    if brackets > DEEPEST {
        return Err("holds no plain numbers or texts".to_owned());
    }
    let type_string = value_of(header, "'descr'")?.strip_prefix('\'').and_then(|text| text.split_once('\''));
    let size = type_string.and_then(|(type_string, _)| element_size(type_string));
    let axes = value_of(header, "'shape'")?.strip_prefix('(').and_then(|text| text.split_once(')'));
    let (axes, _) = axes.ok_or("has a header without shape")?;
    let axes = axes.split(',').map(str::trim).filter(|axis| !axis.is_empty());
    let count =
        axes.map(|axis| axis.parse().ok()).try_fold(1_usize, |product, axis| product.checked_mul(axis?));
    let announced = count.zip(size).and_then(|(count, size)| count.checked_mul(size));
    match announced {
        None => Err("has a header without a readable type or shape".to_owned()),
        Some(announced) if announced != payload => {
            Err(format!("announces {announced} bytes, but holds {payload}"))
        }
        Some(_) => Ok(()),
    }
}

/// Bytes an element takes [bytes]; none for types that no response has.
fn element_size(type_string: &str) -> Option<usize> {
    let (kind, size) = type_string.split_at_checked(2)?;
    let size: usize = size.parse().ok()?;
    match kind {
        "<f" | ">f" | "<i" | ">i" | "<u" | ">u" | "|i" | "|u" => Some(size),
        "<U" | ">U" => size.checked_mul(4),
        _ => None,
    }
}

/// The header's text, and how many bytes follow it.
fn split(array: &[u8]) -> Result<(&str, usize), String> {
    let cut_off = "ends within its header";
    let preamble = array.first_chunk::<12>().ok_or(cut_off)?;
    if &preamble[..6] != b"\x93NUMPY" {
        return Err("does not begin like a numpy array".to_owned());
    }
    let (begin, length) = match (preamble[6], preamble[7]) {
        (1, 0) => (10, usize::from(u16::from_le_bytes([preamble[8], preamble[9]]))),
        (2 | 3, 0) => {
            (12, u32::from_le_bytes([preamble[8], preamble[9], preamble[10], preamble[11]]) as usize)
        }
        (major, minor) => return Err(format!("has array version {major}.{minor}; 1.0 to 3.0 are read")),
    };
    if length > LONGEST {
        return Err(format!("has a header of {length} bytes, longer than any plain array's"));
    }
    let header = array.get(begin..begin + length).ok_or(cut_off)?;
    let header = std::str::from_utf8(header).map_err(|_| "has a header that is not text")?;
    Ok((header, array.len() - begin - length))
}

/// What follows `key` and its colon.
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
            assert_eq!(check(&array(header, payload)), Ok(()), "{header}");
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
            let error = check(&array(header, 8)).unwrap_err();
            assert!(error.contains(message), "{header}: {error}");
        }
        assert!(check(b"PK").unwrap_err().contains("ends within"));
        assert!(check(b"\x93NUMPY\x02\x00\xff\xff\xff\xff").unwrap_err().contains("longer"));
        assert!(check(b"\x93NUMPY\x09\x00\x00\x00\x00\x00").unwrap_err().contains("version 9.0"));
        assert!(check(b"\x93NUMPZ\x01\x00\x00\x00\x00\x00").unwrap_err().contains("does not begin"));
    }
}
