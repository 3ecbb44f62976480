//! How parameters change with the coefficients of materials, from one rendering of a map.

use crate::study::sensitivity::{Varied, VariedMap};
use sonel_acoustics::Coefficient;
use sonel_renderer::ReceiverPoint;

use crate::error::At;
use crate::{Error, Map, Mode, Observer, Result};

use super::{PreparedRendering, RenderOptions};

impl Map {
    /// Parameters at the receivers of a rendering with `options`, and for a small change of each of `coefficients` of every material in use.
    /// All share packets, rays and random numbers, so that differences have hardly any noise of their own. Edges do not diffract.
    ///
    /// # Errors
    /// The errors of [`Self::render`]; a map of the paper's mode.
    pub fn sensitivity(
        &self,
        receivers: &[ReceiverPoint],
        coefficients: &[Coefficient],
        options: &RenderOptions,
        observer: &dyn Observer,
    ) -> Result<Varied> {
        let label = || self.label().to_owned();
        if self.sonels().header().settings.mode == Mode::Paper {
            let name = label();
            return Err(Error::refused(format!(
                "{name}: materials of maps of `mode` paper cannot be changed: trace with `mode` accurate"
            )));
        }
        self.check()?;
        let PreparedRendering { mut map, geometry, settings, receivers, .. } =
            self.prepare(receivers, options, observer)?;
        VariedMap { map: &mut map, geometry: &geometry, receivers: &receivers, render: settings }
            .vary(coefficients, observer)
            .at(label)
    }
}
