//! Maps as outputs of a run that may write several.

use sonel::MapStore;
use sonel_map::{MapError, SonelMap};

use crate::output::Output;

/// Keeps maps beside their final place; the last one is published.
pub struct MapOutputs<'a> {
    create: &'a dyn Fn() -> anyhow::Result<Output>,
    last: Option<Output>,
}

impl<'a> MapOutputs<'a> {
    /// Begins each map with `create`.
    #[must_use]
    pub fn new(create: &'a dyn Fn() -> anyhow::Result<Output>) -> Self {
        Self { create, last: None }
    }

    /// The last map that was written.
    ///
    /// # Panics
    /// Where none was.
    #[must_use]
    pub fn last(self) -> Output {
        self.last.expect("a trace writes a map")
    }
}

impl MapStore for MapOutputs<'_> {
    type Writer = Output;

    fn begin(&mut self) -> std::io::Result<Output> {
        (self.create)().map_err(|error| std::io::Error::other(format!("{error:#}")))
    }

    fn open(&mut self, mut written: Output) -> Result<SonelMap, MapError> {
        let map = SonelMap::open(written.file()?)?;
        self.last = Some(written);
        Ok(map)
    }
}
