//! Reading a response, with every shape checked against the others.

use std::io::{Read, Seek};

use crate::archive::{ArchiveReader, Element, wrong};
use crate::check::check;
use crate::directions::LATERAL_KEYS;
use crate::{
    Arrivals, Batches, Directions, FORMAT_VERSION, Lateral, Missing, Provenance, ReceiverDirectivity,
    Response, ResponseError,
};

impl Response {
    /// Reads a response. Unknown arrays are ignored; batches and what follows the last bin may be missing.
    ///
    /// # Errors
    /// When the file is no archive, is damaged, lacks an array, or arrays contradict each other or hold impossible values.
    pub fn read(input: impl Read + Seek) -> Result<Self, ResponseError> {
        let mut file = ArchiveReader::new(input)?;
        match file.scalar("format_version")? {
            FORMAT_VERSION => {}
            found => return Err(ResponseError::Version { found }),
        }
        let center_frequency_hz: Vec<f64> = file.list("center_frequency_hz")?;
        let time_edges_s: Vec<f64> = file.list("time_edges_s")?;
        let receiver_names: Vec<String> = file.list("receiver_name")?;
        let source_names: Vec<String> = file.list("source_name")?;
        let (s, r) = (source_names.len(), receiver_names.len());
        let (b, t) = (center_frequency_hz.len(), time_edges_s.len().saturating_sub(1));
        let energy: Vec<f64> = file.required("energy", &[s, r, b, t])?;
        let batches = file.batches(s, r, b)?;
        let shape = batches.as_ref().map(|found| [found.weight.len(), s, r, b, found.bins]);
        let response = Self {
            directions: file.directions([s, r, b, t], shape)?,
            receiver_positions: file.points("receiver_position_m", r)?,
            receiver_directivities: file.directivities(r)?,
            source_positions: file.points("source_position_m", s)?,
            source_power_level_db: file.required("source_power_level_db", &[s, b])?,
            speed_of_sound: file.scalar("speed_of_sound")?,
            characteristic_impedance: file.scalar("characteristic_impedance")?,
            direct_times_s: file.optional("direct_time_s", &[s, r])?.unwrap_or_default(),
            batches,
            missing: file.missing(s, b)?,
            arrivals: file.arrivals(b)?,
            provenance: file.provenance()?,
            center_frequency_hz,
            time_edges_s,
            receiver_names,
            source_names,
            energy,
        };
        file.check_digest()?;
        check(&response)?;
        Ok(response)
    }
}

impl<R: Read + Seek> ArchiveReader<R> {
    /// A required array of one axis and any length.
    fn list<T: Element>(&mut self, key: &str) -> Result<Vec<T>, ResponseError> {
        let (shape, values) = self.array(key)?.ok_or_else(|| ResponseError::Missing(key.to_owned()))?;
        if shape.len() != 1 {
            return Err(wrong(key, format!("has shape {shape:?} instead of one axis")));
        }
        Ok(values)
    }

    fn optional<T: Element>(
        &mut self,
        key: &str,
        expected: &[usize],
    ) -> Result<Option<Vec<T>>, ResponseError> {
        let Some((shape, values)) = self.array(key)? else { return Ok(None) };
        if shape != expected {
            return Err(wrong(key, format!("has shape {shape:?} instead of {expected:?}")));
        }
        Ok(Some(values))
    }

    fn required<T: Element>(&mut self, key: &str, expected: &[usize]) -> Result<Vec<T>, ResponseError> {
        self.optional(key, expected)?.ok_or_else(|| ResponseError::Missing(key.to_owned()))
    }

    fn points(&mut self, key: &str, count: usize) -> Result<Vec<[f64; 3]>, ResponseError> {
        let values: Vec<f64> = self.required(key, &[count, 3])?;
        Ok(values.chunks_exact(3).map(|point| [point[0], point[1], point[2]]).collect())
    }

    fn directivities(&mut self, count: usize) -> Result<Vec<ReceiverDirectivity>, ResponseError> {
        let Some(names) = self.optional::<String>("receiver_directivity", &[count])? else {
            return Ok(Vec::new());
        };
        let aims = self.points("receiver_aim", count)?;
        let diffuse: Vec<f64> = self.required("receiver_diffuse_sensitivity", &[count])?;
        let of = |((name, aim), diffuse_sensitivity)| ReceiverDirectivity { name, aim, diffuse_sensitivity };
        Ok(names.into_iter().zip(aims).zip(diffuse).map(of).collect())
    }

    fn scalar<T: Element + Copy>(&mut self, key: &str) -> Result<T, ResponseError> {
        Ok(self.required::<T>(key, &[])?[0])
    }

    fn batches(&mut self, s: usize, r: usize, b: usize) -> Result<Option<Batches>, ResponseError> {
        if !self.contains("batch_weight") {
            return Ok(None);
        }
        let weight: Vec<f64> = self.list("batch_weight")?;
        let key = "batch_time_edges_s";
        let (shape, time_edges_s) =
            self.array::<f64>(key)?.ok_or_else(|| ResponseError::Missing(key.to_owned()))?;
        let bins = shape.last().copied().unwrap_or(0).saturating_sub(1);
        if shape != [s, r, bins + 1] {
            return Err(wrong(key, format!("has shape {shape:?} instead of [{s}, {r}, bins + 1]")));
        }
        let energy: Vec<f32> = self.required("energy_batches", &[weight.len(), s, r, b, bins])?;
        let kernel_difference =
            self.optional("kernel_difference_batches", &[weight.len(), s, r, b, bins])?.unwrap_or_default();
        Ok(Some(Batches { weight, time_edges_s, bins, energy, kernel_difference }))
    }

    /// Energies by direction of `shape`, with batches of theirs.
    fn directions(
        &mut self,
        shape: [usize; 4],
        of_batches: Option<[usize; 5]>,
    ) -> Result<Option<Directions>, ResponseError> {
        if !self.contains("lateral_axis") {
            return Ok(None);
        }
        let [s, r, b, t] = shape;
        let mut lateral = <[Lateral; 2]>::default();
        for (lateral, keys) in lateral.iter_mut().zip(LATERAL_KEYS) {
            lateral.energy = self.required(keys[0], &shape)?;
            if let Some(shape) = of_batches {
                lateral.energy_batches = self.required(keys[1], &shape)?;
                lateral.kernel_difference = self.optional(keys[2], &shape)?.unwrap_or_default();
            }
        }
        let moment = self.required("direction_moment", &[s, r, b, t, 3])?;
        Ok(Some(Directions { lateral_axes: self.points("lateral_axis", r)?, lateral, moment }))
    }

    fn missing(&mut self, s: usize, b: usize) -> Result<Option<Missing>, ResponseError> {
        let Some(fluence) = self.optional("missing_fluence", &[s, b])? else { return Ok(None) };
        Ok(Some(Missing { fluence, decay_rate: self.required("missing_decay_rate", &[s, b])? }))
    }

    fn arrivals(&mut self, b: usize) -> Result<Arrivals, ResponseError> {
        let source: Vec<u32> = self.list("arrival_source")?;
        let a = source.len();
        Ok(Arrivals {
            receiver: self.required("arrival_receiver", &[a])?,
            time_s: self.required("arrival_time_s", &[a])?,
            energy: self.required("arrival_energy", &[a, b])?,
            direction: self.required("arrival_direction", &[a, 3])?,
            order: self.required("arrival_order", &[a])?,
            kind: self.required("arrival_kind", &[a])?,
            source,
        })
    }

    fn provenance(&mut self) -> Result<Provenance, ResponseError> {
        let text: Vec<String> = self.required("metadata_json", &[])?;
        let stated: Option<Provenance> = serde_json::from_str(&text[0]).map_err(|error| {
            wrong("metadata_json", format!("is not the JSON of docs/formats/response.md: {error}"))
        })?;
        Ok(stated.unwrap_or_default())
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
            receiver_directivities: Vec::new(),
            source_names: vec!["stage".into()],
            source_positions: vec![[0.0, 0.0, 1.0]],
            source_power_level_db: vec![90.0, 91.0],
            speed_of_sound: 343.0,
            characteristic_impedance: 413.3,
            direct_times_s: Vec::new(),
            energy: (0..800).map(f64::from).collect(),
            batches: Some(Batches {
                weight: vec![0.5, 0.5],
                time_edges_s: [edges.clone(), edges].concat(),
                bins,
                energy: vec![0.25; 2 * 2 * 2 * bins],
                kernel_difference: vec![-0.001; 2 * 2 * 2 * bins],
            }),
            missing: Some(Missing { fluence: vec![1e-9, 2e-9], decay_rate: vec![14.0, 15.0] }),
            arrivals: Arrivals {
                source: vec![0],
                receiver: vec![1],
                time_s: vec![0.0123],
                energy: vec![1e-3, 2e-3],
                direction: vec![0.0, 0.6, 0.8],
                order: vec![0],
                kind: vec![0],
            },
            directions: Some(Directions {
                lateral_axes: vec![[0.0, 1.0, 0.0], [0.6, 0.8, 0.0]],
                lateral: [0.3, 0.5].map(|share| Lateral {
                    energy: (0..800).map(|bin| share * f64::from(bin)).collect(),
                    energy_batches: vec![share as f32; 2 * 2 * 2 * bins],
                    kernel_difference: if share > 0.4 { vec![-0.001; 2 * 2 * 2 * bins] } else { vec![] },
                }),
                moment: (0..2400).map(|value| f64::from(1200 - value)).collect(),
            }),
            provenance: serde_json::from_str(r#"{ "seed": 1, "note": "ü" }"#).unwrap(),
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
    fn bands_keep_their_rows_of_every_array() {
        let whole = response();
        let second = whole.of_bands(1..2);
        crate::check::check(&second).unwrap();
        assert_eq!(second.center_frequency_hz, [1000.0]);
        for receiver in 0..2 {
            assert_eq!(second.echogram(0, receiver, 0), whole.echogram(0, receiver, 1));
        }
        assert_eq!((second.arrivals.energy, second.missing.unwrap().decay_rate), (vec![2e-3], vec![15.0]));
        let moments = [&second.directions.unwrap().moment, &whole.directions.as_ref().unwrap().moment];
        assert_eq!(
            (moments[0].len(), moments[0][0], moments[0][600]),
            (1200, moments[1][600], moments[1][1800])
        );
        let all = whole.of_bands(0..2);
        assert_eq!(Response { provenance: whole.provenance.clone(), ..all }, whole);
    }

    #[test]
    fn the_same_response_has_the_same_bytes() {
        assert_eq!(bytes(&response()), bytes(&response()));
    }

    #[test]
    fn a_response_without_arrivals_and_batches_is_read() {
        let arrivals = Arrivals::default();
        let bare = Response { batches: None, missing: None, arrivals, directions: None, ..response() };
        assert_eq!(Response::read(Cursor::new(bytes(&bare))).unwrap(), bare);
    }

    fn reread(response: &Response) -> Result<Response, ResponseError> {
        Response::read(response.write(Cursor::new(Vec::new()))?)
    }

    #[test]
    fn contradicting_arrays_are_named_all_at_once_and_not_written() {
        let mut wrong = response();
        wrong.receiver_positions.pop();
        wrong.energy.truncate(400);
        wrong.batches.as_mut().unwrap().energy.pop();
        wrong.arrivals.kind.push(0);
        let error = wrong.write(Cursor::new(Vec::new())).unwrap_err().to_string();
        for key in ["receiver_position_m", "energy holds 400", "energy_batches", "arrival_kind"] {
            assert!(error.contains(key), "{key}: {error}");
        }
    }

    #[test]
    fn impossible_values_are_named() {
        type Spoil = fn(&mut Response);
        let spoilt: [(&str, Spoil); 9] = [
            ("energy holds -1", |wrong| wrong.energy[5] = -1.0),
            ("energy holds NaN", |wrong| wrong.energy[5] = f64::NAN),
            ("energy_batches holds inf", |wrong| wrong.batches.as_mut().unwrap().energy[3] = f32::INFINITY),
            ("batch_weight has no batch", |wrong| wrong.batches.as_mut().unwrap().weight.fill(0.0)),
            ("batch_time_edges_s does not", |wrong| wrong.batches.as_mut().unwrap().time_edges_s.swap(3, 9)),
            ("time_edges_s does not ascend: 0.007 follows 0.007", |wrong| wrong.time_edges_s[8] = 0.007),
            ("speed_of_sound holds 0", |wrong| wrong.speed_of_sound = 0.0),
            ("arrival_receiver names", |wrong| wrong.arrivals.receiver[0] = 2),
            ("source_power_level_db holds -inf", |wrong| wrong.source_power_level_db[1] = f64::NEG_INFINITY),
        ];
        for (message, spoil) in spoilt {
            let mut wrong = response();
            spoil(&mut wrong);
            let error = reread(&wrong).unwrap_err().to_string();
            assert!(error.contains(message), "{message}: {error}");
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        let good = bytes(&response());
        for length in 0..good.len() {
            assert!(Response::read(Cursor::new(&good[..length])).is_err(), "cut at {length}");
        }
    }

    /// Every 61st bit; tests/accept flips all bits.
    #[test]
    fn a_response_with_a_flipped_bit_is_refused_or_the_same() {
        // Dates, permissions and the copies of names before the contents are read by nobody.
        let (energy, time_edges_s) = (vec![1.0; 8], vec![0.0, 0.1, 0.2]);
        let small =
            Response { energy, time_edges_s, batches: None, missing: None, directions: None, ..response() };
        let good = bytes(&small);
        let bits = (0..good.len() * 8).step_by(61);
        let mut refused = 0;
        for bit in bits.clone() {
            let mut damaged = good.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            match Response::read(Cursor::new(damaged)) {
                Err(_) => refused += 1,
                Ok(read) => assert!(read == small, "bit {bit}"),
            }
        }
        assert!(refused > bits.len() * 7 / 10, "{refused} of {}", bits.len());
    }

    /// Names in the directory of the archive have no checksum of their own.
    #[test]
    fn an_array_under_another_name_is_refused() {
        let good = bytes(&Response { directions: None, ..response() });
        for key in ["kernel_difference_batches", "missing_fluence", "missing_decay_rate", "speed_of_sound"] {
            let name = format!("{key}.npy");
            let places: Vec<usize> =
                (0..good.len()).filter(|&at| good[at..].starts_with(name.as_bytes())).collect();
            assert_eq!(places.len(), 2, "{key}: before the content and in the directory");
            let mut damaged = good.clone();
            for at in places {
                damaged[at] ^= 1;
            }
            assert!(Response::read(Cursor::new(damaged)).is_err(), "{key}");
        }
    }

    #[test]
    fn arrays_have_the_bytes_numpy_expects() {
        let file = bytes(&response());
        let find = |needle: &[u8]| file.windows(needle.len()).position(|window| window == needle);
        for header in [
            "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2, 2, 200, ), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 1, 2, 2, ",
            "{'descr': '<U7', 'fortran_order': False, 'shape': (2, ), }",
            "{'descr': '<U21', 'fortran_order': False, 'shape': (), }",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (), }",
        ] {
            assert!(find(header.as_bytes()).is_some(), "{header}");
        }
        let text: Vec<u8> = "{\"seed\":1".chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
        assert!(find(&text).is_some());
    }

    #[test]
    fn another_version_is_refused_by_its_number() {
        let mut archive = crate::archive::ArchiveWriter::new(Cursor::new(Vec::new()));
        archive.numbers("format_version", &[], &[9_u32]).unwrap();
        let error = Response::read(archive.finish().unwrap()).unwrap_err();
        assert!(matches!(error, ResponseError::Version { found: 9 }), "{error}");
    }
}
