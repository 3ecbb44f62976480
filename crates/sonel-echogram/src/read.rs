//! Reading a response, with every shape checked against the others.

use std::io::{Read, Seek};

use npyz::Deserialize;

use crate::archive::ArchiveReader;
use crate::{Arrivals, Batches, Response, ResponseError};

/// Power level where a file states none [dB re 1 pW]: the scene file's default.
const DEFAULT_POWER_LEVEL_DB: f64 = 90.0;
/// Speed of sound where a file states none [m/s]: dry air at 20 °C.
const DEFAULT_SPEED_OF_SOUND: f64 = 343.0;
/// ρc where a file states none [Pa s/m]: levels then equal intensity levels.
const DEFAULT_IMPEDANCE: f64 = 400.0;

impl Response {
    /// Reads a response. Unknown arrays are ignored; batches and arrivals may be missing.
    ///
    /// # Errors
    /// When the file is no archive, is damaged, lacks an array, or arrays contradict each other or hold impossible values.
    pub fn read(input: impl Read + Seek) -> Result<Self, ResponseError> {
        let mut file = Arrays { archive: ArchiveReader::new(input)? };
        let center_frequency_hz: Vec<f64> = file.list("center_frequency_hz")?;
        let time_edges_s: Vec<f64> = file.list("time_edges_s")?;
        let receiver_names: Vec<String> = file.list("receiver_name")?;
        let source_names: Vec<String> = file.list("source_name")?;
        let (s, r) = (source_names.len(), receiver_names.len());
        let (b, t) = (center_frequency_hz.len(), time_edges_s.len().saturating_sub(1));
        check(&time_edges_s, "time_edges_s", "does not ascend", |edges| {
            edges.len() > 1 && edges.windows(2).all(|pair| pair[0] < pair[1])
        })?;
        let energy: Vec<f64> = file.required("energy", &[s, r, b, t])?;
        check(&energy, "energy", "holds values that are no energies", |energy| {
            energy.iter().all(|value| value.is_finite() && *value >= 0.0)
        })?;
        let response = Self {
            receiver_positions: file.points("receiver_position_m", r)?,
            source_positions: file.points("source_position_m", s)?,
            source_power_level_db: file
                .optional("source_power_level_db", &[s, b])?
                .unwrap_or_else(|| vec![DEFAULT_POWER_LEVEL_DB; s * b]),
            speed_of_sound: file.scalar("speed_of_sound", DEFAULT_SPEED_OF_SOUND)?,
            characteristic_impedance: file.scalar("characteristic_impedance", DEFAULT_IMPEDANCE)?,
            batches: file.batches(s, r, b)?,
            arrivals: file.arrivals(s, r, b)?,
            metadata: file.metadata()?,
            center_frequency_hz,
            time_edges_s,
            receiver_names,
            source_names,
            energy,
        };
        Ok(response)
    }
}

fn check<T>(
    values: &[T],
    key: &str,
    problem: &str,
    sound: impl Fn(&[T]) -> bool,
) -> Result<(), ResponseError> {
    if sound(values) {
        return Ok(());
    }
    Err(ResponseError::Array { key: key.to_owned(), problem: problem.to_owned() })
}

struct Arrays<R: Read + Seek> {
    archive: ArchiveReader<R>,
}

impl<R: Read + Seek> Arrays<R> {
    /// A required array of one axis and any length.
    fn list<T: Deserialize>(&mut self, key: &str) -> Result<Vec<T>, ResponseError> {
        let (shape, values) =
            self.archive.array(key)?.ok_or_else(|| ResponseError::Missing(key.to_owned()))?;
        check(&shape, key, "should have one axis", |shape| shape.len() == 1)?;
        Ok(values)
    }

    fn optional<T: Deserialize>(
        &mut self,
        key: &str,
        expected: &[usize],
    ) -> Result<Option<Vec<T>>, ResponseError> {
        let Some((shape, values)) = self.archive.array(key)? else { return Ok(None) };
        if shape != expected {
            let problem = format!("has shape {shape:?} instead of {expected:?}");
            return Err(ResponseError::Array { key: key.to_owned(), problem });
        }
        Ok(Some(values))
    }

    fn required<T: Deserialize>(&mut self, key: &str, expected: &[usize]) -> Result<Vec<T>, ResponseError> {
        self.optional(key, expected)?.ok_or_else(|| ResponseError::Missing(key.to_owned()))
    }

    fn points(&mut self, key: &str, count: usize) -> Result<Vec<[f64; 3]>, ResponseError> {
        let values: Vec<f64> = self.required(key, &[count, 3])?;
        check(&values, key, "holds coordinates that are not finite", |all| {
            all.iter().all(|x| x.is_finite())
        })?;
        Ok(values.chunks_exact(3).map(|point| [point[0], point[1], point[2]]).collect())
    }

    fn scalar(&mut self, key: &str, default: f64) -> Result<f64, ResponseError> {
        let value = self.optional::<f64>(key, &[])?.map_or(default, |values| values[0]);
        check(&[value], key, "is not above zero", |value| value[0].is_finite() && value[0] > 0.0)?;
        Ok(value)
    }

    fn batches(&mut self, s: usize, r: usize, b: usize) -> Result<Option<Batches>, ResponseError> {
        let Some((_, weight)) = self.archive.array::<f64>("batch_weight")? else { return Ok(None) };
        let (shape, time_edges_s) = self
            .archive
            .array::<f64>("batch_time_edges_s")?
            .ok_or_else(|| ResponseError::Missing("batch_time_edges_s".to_owned()))?;
        let bins = shape.last().copied().unwrap_or(0).saturating_sub(1);
        check(&shape, "batch_time_edges_s", "has another shape than [S, R, bins + 1]", |shape| {
            shape == [s, r, bins + 1]
        })?;
        let energy: Vec<f32> = self.required("energy_batches", &[weight.len(), s, r, b, bins])?;
        check(&energy, "energy_batches", "holds values that are no energies", |energy| {
            energy.iter().all(|value| value.is_finite() && *value >= 0.0)
        })?;
        check(&time_edges_s, "batch_time_edges_s", "does not ascend", |edges| {
            edges.chunks_exact(bins + 1).all(|row| row.windows(2).all(|pair| pair[0] <= pair[1]))
        })?;
        check(&weight, "batch_weight", "holds negative weights", |weight| {
            weight.iter().all(|value| value.is_finite() && *value >= 0.0)
        })?;
        Ok(Some(Batches { weight, time_edges_s, bins, energy }))
    }

    fn arrivals(&mut self, s: usize, r: usize, b: usize) -> Result<Arrivals, ResponseError> {
        let Some((_, source)) = self.archive.array::<u32>("arrival_source")? else {
            return Ok(Arrivals::default());
        };
        let a = source.len();
        let receiver: Vec<u32> = self.required("arrival_receiver", &[a])?;
        check(&source, "arrival_source", "names sources that do not exist", |all| {
            all.iter().all(|&index| (index as usize) < s)
        })?;
        check(&receiver, "arrival_receiver", "names receivers that do not exist", |all| {
            all.iter().all(|&index| (index as usize) < r)
        })?;
        Ok(Arrivals {
            source,
            receiver,
            time_s: self.required("arrival_time_s", &[a])?,
            energy: self.required("arrival_energy", &[a, b])?,
            direction: self.required("arrival_direction", &[a, 3])?,
            order: self.required("arrival_order", &[a])?,
            kind: self.required("arrival_kind", &[a])?,
        })
    }

    fn metadata(&mut self) -> Result<serde_json::Value, ResponseError> {
        let Some(text) = self.optional::<String>("metadata_json", &[])? else {
            return Ok(serde_json::Value::Null);
        };
        serde_json::from_str(&text[0]).map_err(|error| ResponseError::Array {
            key: "metadata_json".to_owned(),
            problem: format!("is no JSON: {error}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::batch_time_edges;

    fn response() -> Response {
        let edges = batch_time_edges(0.01, 0.2);
        let bins = edges.len() - 1;
        Response {
            center_frequency_hz: vec![500.0, 1000.0],
            time_edges_s: (0..=200).map(|edge| f64::from(edge) * 0.001).collect(),
            receiver_names: vec!["Sitz 12".into(), "größer".into()],
            receiver_positions: vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]],
            source_names: vec!["stage".into()],
            source_positions: vec![[0.0, 0.0, 1.0]],
            source_power_level_db: vec![90.0, 91.0],
            speed_of_sound: 343.0,
            characteristic_impedance: 413.3,
            energy: (0..800).map(f64::from).collect(),
            batches: Some(Batches {
                weight: vec![0.5, 0.5],
                time_edges_s: [edges.clone(), edges].concat(),
                bins,
                energy: vec![0.25; 2 * 2 * 2 * bins],
            }),
            arrivals: Arrivals {
                source: vec![0],
                receiver: vec![1],
                time_s: vec![0.0123],
                energy: vec![1e-3, 2e-3],
                direction: vec![0.0, 0.6, 0.8],
                order: vec![0],
                kind: vec![0],
            },
            metadata: serde_json::json!({ "seed": 1, "note": "ü" }),
        }
    }

    fn bytes(response: &Response) -> Vec<u8> {
        response.write(Cursor::new(Vec::new())).unwrap().into_inner()
    }

    #[test]
    fn a_response_survives_the_file() {
        let written = response();
        let read = Response::read(Cursor::new(bytes(&written))).unwrap();
        assert_eq!(read, written);
        assert_eq!(read.echogram(0, 1, 1)[0].to_bits(), 600.0_f64.to_bits());
    }

    #[test]
    fn the_same_response_has_the_same_bytes() {
        assert_eq!(bytes(&response()), bytes(&response()));
    }

    #[test]
    fn a_response_without_arrivals_and_batches_is_read() {
        let bare = Response { batches: None, arrivals: Arrivals::default(), ..response() };
        assert_eq!(Response::read(Cursor::new(bytes(&bare))).unwrap(), bare);
    }

    #[test]
    fn contradicting_shapes_are_named() {
        let mut wrong = response();
        wrong.receiver_positions.pop();
        wrong.receiver_names.pop();
        wrong.energy.truncate(400);
        wrong.batches.as_mut().unwrap().energy.pop();
        // The writer trusts its caller; the file it makes here is refused.
        let written = std::panic::catch_unwind(|| bytes(&wrong));
        if let Ok(written) = written {
            assert!(Response::read(Cursor::new(written)).is_err());
        }
    }

    #[test]
    fn truncated_and_damaged_files_are_errors() {
        let good = bytes(&response());
        for length in (0..good.len()).step_by(97) {
            assert!(Response::read(Cursor::new(&good[..length])).is_err(), "cut at {length}");
        }
        let mut refused = 0;
        for at in (0..good.len()).step_by(101) {
            let mut damaged = good.clone();
            damaged[at] ^= 0x10;
            refused += u32::from(Response::read(Cursor::new(damaged)).is_err());
        }
        assert!(refused > 0);
    }

    #[test]
    fn negative_and_infinite_energies_are_refused() {
        for value in [-1.0, f64::NAN, f64::INFINITY] {
            let mut wrong = response();
            wrong.energy[5] = value;
            let error = Response::read(Cursor::new(bytes(&wrong))).unwrap_err();
            assert!(error.to_string().contains("no energies"), "{error}");
        }
    }
}
