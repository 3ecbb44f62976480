//! Encoding of the header by bincode, which no other module uses.
//!
//! Fixed-width little-endian integers, lengths as u64, structs as their fields in order: no variable-length integers, no
//! enums, options or maps, so that the bytes can be described in half a page (docs/formats/sonelmap.md) and another
//! codec can take over.

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
pub(crate) use bincode::{Decode, Encode};

/// Largest header accepted [bytes]. Chosen, not measured: it bounds memory.
const LARGEST_HEADER: usize = 16 << 20;

/// Memory that decoding may claim for every byte of a header: no record is more than three times as large in memory as
/// the least that it takes in the file.
const CLAIM_PER_BYTE: usize = 4;

fn configuration<const LIMIT: usize>() -> Configuration<LittleEndian, Fixint, Limit<LIMIT>> {
    bincode::config::standard().with_fixed_int_encoding().with_little_endian().with_limit::<LIMIT>()
}

/// The header as it stands in the file.
#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct HeaderRecord {
    pub tool_version: String,
    pub settings: SettingsRecord,
    pub effects: Vec<EffectRecord>,
    pub scene: SceneRecord,
    /// Origin of the stored positions in the axes of the scene [m].
    pub center: [f64; 3],
    pub chunk_count: u64,
    pub sections: Vec<SectionRecord>,
}

#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct SettingsRecord {
    pub emissions: u64,
    pub seed: u64,
    pub batches: u32,
    pub spectral: u32,
    pub mode: u32,
    pub shard_index: u32,
    pub shard_count: u32,
    pub chunk_emissions: u64,
    pub survival: f64,
}

#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct EffectRecord {
    pub name: String,
    pub on: Vec<u8>,
    pub reason: String,
}

/// A named run of bytes outside the header.
#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct SectionRecord {
    pub name: String,
    pub offset: u64,
    pub length: u64,
    pub digest: [u8; 32],
}

#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct SceneRecord {
    pub name: String,
    pub up: [f64; 3],
    pub third_octaves: u8,
    pub nominal_frequencies: Vec<f64>,
    /// Temperature [°C], relative humidity [%] and pressure [kPa].
    pub air: [f64; 3],
    pub speed_of_sound: f64,
    pub air_attenuation: Vec<f64>,
    pub duration: f64,
    pub scene_digest: [u8; 32],
    pub mesh_digest: [u8; 32],
    pub materials: Vec<MaterialRecord>,
    pub sources: Vec<SourceRecord>,
    pub receivers: Vec<ReceiverRecord>,
}

#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct MaterialRecord {
    pub name: String,
    pub absorption: Vec<f64>,
    pub scattering: Vec<f64>,
    pub transmission: Vec<f64>,
    /// Empty where the scene names no source.
    pub source: String,
}

#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct SourceRecord {
    pub name: String,
    pub position: [f64; 3],
    pub power_level_db: Vec<f64>,
    pub directivity: String,
    pub aim: [f64; 3],
}

#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct ReceiverRecord {
    pub name: String,
    pub position: [f64; 3],
    pub aim: [f64; 3],
}

/// Regions of other air: the section that only a scene with such regions has.
#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct MediaRecord {
    pub regions: Vec<RegionRecord>,
    pub interfaces: Vec<u32>,
    pub at_sources: Vec<u32>,
    pub sides: Vec<[u32; 2]>,
}

/// Variants of materials, each with the number of the material: the section that only a scene with such has.
pub(crate) type VariantsRecord = Vec<(u32, MaterialRecord)>;

/// Named choices among the variants, numbers of materials and of their variants: the section that only a scene with such has.
pub(crate) type DesignsRecord = Vec<(String, Vec<[u32; 2]>)>;

/// Measured directivities and those of receivers: the section that only a scene with such has.
#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct DirectivityRecord {
    pub balloons: Vec<BalloonRecord>,
    pub sources: Vec<RollRecord>,
    /// Pattern of each receiver.
    pub receivers: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct BalloonRecord {
    pub name: String,
    pub azimuths: u32,
    pub polars: u32,
    /// By azimuth, polar angle and band.
    pub factors: Vec<f64>,
}

/// The balloon of a source.
#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct RollRecord {
    /// Number of the balloon from 1; 0 where the source has none.
    pub balloon: u32,
    pub up: [f64; 3],
}

#[derive(Debug, Clone, PartialEq, Encode, Decode)]
pub(crate) struct RegionRecord {
    pub name: String,
    pub inside: [f64; 3],
    /// As that of a scene.
    pub air: [f64; 3],
    pub speed_of_sound: f64,
    pub density: f64,
    pub air_attenuation: Vec<f64>,
}

/// Bytes of a header or of the record of a section.
pub(crate) fn encode(record: &impl Encode) -> Result<Vec<u8>, String> {
    bincode::encode_to_vec(record, configuration::<LARGEST_HEADER>())
        .map_err(|error| format!("header, regions, directivities or variants cannot be encoded: {error}"))
}

/// A header, or the record of a section, from its bytes. All of them must be used, unless a later minor version may have added fields at the end.
pub(crate) fn decode<D: Decode<()>>(bytes: &[u8], may_go_on: bool) -> Result<D, String> {
    let (record, used) = decode_within_limit(bytes)?;
    if used == bytes.len() || may_go_on {
        Ok(record)
    } else {
        Err(format!("the header has {} bytes too many", bytes.len() - used))
    }
}

/// bincode takes its limit as a constant and allocates what a length claims before it reads on: the smallest limit that
/// suffices for a header of this size.
fn decode_within_limit<D: Decode<()>>(bytes: &[u8]) -> Result<(D, usize), String> {
    const fn limit(largest: usize) -> usize {
        CLAIM_PER_BYTE * largest
    }
    match bytes.len() {
        0..=0x1000 => decode_with::<D, { limit(0x1000) }>(bytes),
        0x1001..=0x4000 => decode_with::<D, { limit(0x4000) }>(bytes),
        0x4001..=0x1_0000 => decode_with::<D, { limit(0x1_0000) }>(bytes),
        0x1_0001..=0x10_0000 => decode_with::<D, { limit(0x10_0000) }>(bytes),
        0x10_0001..=LARGEST_HEADER => decode_with::<D, { limit(LARGEST_HEADER) }>(bytes),
        length => Err(format!("a header of {length} bytes is larger than any that is written")),
    }
}

fn decode_with<D: Decode<()>, const LIMIT: usize>(bytes: &[u8]) -> Result<(D, usize), String> {
    bincode::decode_from_slice(bytes, configuration::<LIMIT>())
        .map_err(|error| format!("header, regions, directivities or variants cannot be decoded: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::Preamble;

    /// The header of the golden map.
    fn golden() -> Vec<u8> {
        let file: &[u8] = include_bytes!("../tests/golden/box-1.0.sonelmap");
        let preamble: Preamble = bytemuck::pod_read_unaligned(&file[..size_of::<Preamble>()]);
        file[preamble.header_offset as usize..].to_vec()
    }

    #[test]
    fn a_header_that_was_read_is_written_as_the_same_bytes() {
        let bytes = golden();
        assert_eq!(encode(&decode::<HeaderRecord>(&bytes, false).unwrap()).unwrap(), bytes);
    }

    #[test]
    fn a_header_must_be_used_up_unless_it_may_go_on() {
        let mut bytes = golden();
        bytes.push(0);
        assert!(
            decode::<HeaderRecord>(&bytes, false).is_err() && decode::<HeaderRecord>(&bytes, true).is_ok()
        );
        bytes.truncate(bytes.len() - 2);
        assert!(decode::<HeaderRecord>(&bytes, true).is_err());
    }

    #[test]
    fn headers_of_every_size_are_decoded_within_their_limits() {
        let small: HeaderRecord = decode(&golden(), false).unwrap();
        for effects in [0, 100, 1_000, 10_000, 100_000] {
            // Empty records claim the most for their bytes.
            let nothing = EffectRecord { name: String::new(), on: Vec::new(), reason: String::new() };
            let record = HeaderRecord { effects: vec![nothing; effects], ..small.clone() };
            assert_eq!(
                decode::<HeaderRecord>(&encode(&record).unwrap(), false).unwrap(),
                record,
                "{effects} effects"
            );
        }
        assert!(decode::<HeaderRecord>(&vec![0; LARGEST_HEADER + 1], false).is_err());
    }
}
