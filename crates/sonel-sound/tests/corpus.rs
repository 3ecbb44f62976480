//! SOFA files by the Python packages sofar and h5py (`sofa/make.py`): each is read as what it holds, or refused with a reason.

use std::f64::consts::TAU;

use glam::DVec3;
use sonel_sound::Head;

fn read(name: &str) -> Result<Head, String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/sofa");
    let file = std::fs::read(format!("{folder}/{name}.sofa")).expect("a file of the corpus");
    Head::read(&file, sonel_sound::SAMPLE_RATE_HZ).map_err(|error| error.to_string())
}

#[test]
fn responses_are_those_that_were_written_however_they_are_stored() {
    for name in ["sofar", "contiguous", "deflate-shuffle", "checksums", "single-precision"] {
        let head = read(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        for direction in 0..14_u8 {
            let (sine, cosine) = (TAU * f64::from(direction) / 14.0).sin_cos();
            for (ear, loud) in [1.0, 101.0].into_iter().enumerate() {
                let written =
                    |sample| if sample == usize::from(direction) { loud + f64::from(direction) } else { 0.0 };
                let response = head.response(DVec3::new(cosine, sine, 0.0), ear);
                // Positions have the precision of 32 bits, 6e-8, so that neighbours 0.45 away have a share of 1e-7, and delays are off by 1e-5.
                for (at, sample) in response.into_iter().enumerate() {
                    assert!(
                        (sample - written(at)).abs() < 1e-5 * loud,
                        "{name} {direction} {ear} {at}: {sample}"
                    );
                }
            }
        }
    }
}

#[test]
fn delays_that_are_no_number_of_samples_are_refused() {
    for (name, reason) in
        [("negative-delay", "a delay is negative"), ("endless-delay", "delay or position is not finite")]
    {
        let said = read(name).expect_err(name);
        assert!(said.contains(reason), "{name}: {said}");
    }
}

/// Two of them were read as other numbers.
#[test]
fn what_would_be_read_as_other_responses_is_refused() {
    for (name, reason) in [
        ("big-endian", "Data.IR is stored big-endian"),
        ("deflate", "Data.IR is stored by filters [1]"),
        ("chunked", "damaged, or stored otherwise"),
        ("many-chunks", "damaged, or stored otherwise"),
        ("hostile-claims", "Data.IR claims 69440000 bytes"),
        ("headers-earliest", "stored otherwise than by the netCDF library"),
        ("headers-v110", "stored otherwise than by the netCDF library"),
        ("headers-latest", "stored otherwise than by the netCDF library"),
    ] {
        let said = read(name).expect_err(name);
        assert!(said.contains(reason), "{name}: {said}");
    }
}
