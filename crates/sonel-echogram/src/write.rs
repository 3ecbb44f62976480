//! Writing a response.

use std::io::{Seek, Write};

use serde_json::Value;

use crate::archive::ArchiveWriter;
use crate::arrays::{Array, Values};
use crate::check::check;
use crate::{Provenance, Response, ResponseError};

impl Response {
    /// Writes the response as a numpy archive and returns what it was written to.
    ///
    /// # Errors
    /// When the response is not sound (nothing is written then), or `out` cannot be written.
    pub fn write<W: Write + Seek>(&self, out: W) -> Result<W, ResponseError> {
        check(self)?;
        let mut archive = ArchiveWriter::new(out);
        for Array { key, shape, values, .. } in self.arrays() {
            match values {
                Values::Texts(texts) => archive.texts(key, &shape, &texts),
                Values::U32(numbers) => archive.numbers(key, &shape, numbers),
                Values::F32(numbers) => archive.numbers(key, &shape, numbers),
                Values::F64(numbers) => archive.numbers(key, &shape, &numbers),
            }?;
        }
        archive.texts("metadata_json", &[], &[&self.provenance.to_json().to_string()])?;
        archive.finish_with_digest()
    }
}

impl Provenance {
    /// What files and programs state of it.
    #[must_use]
    pub fn to_json(&self) -> Value {
        serde_json::to_value(self).expect("keys are texts")
    }
}
