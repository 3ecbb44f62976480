//! The arrays of a response file, in their order, with what their values may be: what is checked, and what is written.

use std::borrow::Cow;

use crate::directions::LATERAL_KEYS;
use crate::{Directions, FORMAT_VERSION, Lateral, Response};

/// One array of the file.
pub(crate) struct Array<'a> {
    pub key: &'static str,
    pub shape: Vec<usize>,
    pub allowed: Allowed,
    pub values: Values<'a>,
}

/// Values of an array in row-major order.
pub(crate) enum Values<'a> {
    Texts(Vec<&'a str>),
    U32(&'a [u32]),
    F32(&'a [f32]),
    F64(Cow<'a, [f64]>),
}

/// Values that an array may hold.
#[derive(Clone, Copy)]
pub(crate) enum Allowed {
    Any,
    Finite,
    /// Finite numbers of at least zero.
    Energy,
    /// Finite numbers above zero.
    Positive,
}

impl Response {
    /// Every array but the provenance and the digest. Shapes are those that the axes demand.
    pub(crate) fn arrays(&self) -> Vec<Array<'_>> {
        use {Allowed::*, Values::*};
        let (s, r, b, t) = (self.sources(), self.receivers(), self.bands(), self.bins());
        let mut arrays = Vec::new();
        let mut add = |key, shape: &[usize], allowed, values| {
            arrays.push(Array { key, shape: shape.to_vec(), allowed, values });
        };
        add("format_version", &[], Any, U32(&[FORMAT_VERSION]));
        add("center_frequency_hz", &[b], Positive, F64((&self.center_frequency_hz).into()));
        add("time_edges_s", &[self.time_edges_s.len()], Finite, F64((&self.time_edges_s).into()));
        add("receiver_name", &[r], Any, Texts(texts(&self.receiver_names)));
        add("receiver_position_m", &[r, 3], Finite, F64(self.receiver_positions.as_flattened().into()));
        let directivities = &self.receiver_directivities;
        if !directivities.is_empty() {
            let names = directivities.iter().map(|found| found.name.as_str()).collect();
            let aims = directivities.iter().flat_map(|found| found.aim).collect();
            let diffuse = directivities.iter().map(|found| found.diffuse_sensitivity).collect();
            add("receiver_directivity", &[r], Any, Texts(names));
            add("receiver_aim", &[r, 3], Finite, F64(aims));
            add("receiver_diffuse_sensitivity", &[r], Positive, F64(diffuse));
        }
        add("source_name", &[s], Any, Texts(texts(&self.source_names)));
        add("source_position_m", &[s, 3], Finite, F64(self.source_positions.as_flattened().into()));
        add("source_power_level_db", &[s, b], Finite, F64((&self.source_power_level_db).into()));
        let (speed, impedance) = ([self.speed_of_sound], [self.characteristic_impedance]);
        add("speed_of_sound", &[], Positive, F64(speed.to_vec().into()));
        add("characteristic_impedance", &[], Positive, F64(impedance.to_vec().into()));
        if !self.direct_times_s.is_empty() {
            add("direct_time_s", &[s, r], Energy, F64((&self.direct_times_s).into()));
        }
        add("energy", &[s, r, b, t], Energy, F64((&self.energy).into()));
        let of_batches = self.batches.as_ref().map_or([0; 5], |of| [of.weight.len(), s, r, b, of.bins]);
        if let Some(batches) = &self.batches {
            let edges = [s, r, batches.bins.saturating_add(1)];
            add("batch_weight", &[batches.weight.len()], Energy, F64((&batches.weight).into()));
            add("batch_time_edges_s", &edges, Finite, F64((&batches.time_edges_s).into()));
            add("energy_batches", &of_batches, Energy, F32(&batches.energy));
            if !batches.kernel_difference.is_empty() {
                add("kernel_difference_batches", &of_batches, Finite, F32(&batches.kernel_difference));
            }
        }
        if let Some(missing) = &self.missing {
            add("missing_fluence", &[s, b], Energy, F64((&missing.fluence).into()));
            add("missing_decay_rate", &[s, b], Positive, F64((&missing.decay_rate).into()));
        }
        let (arrivals, a) = (&self.arrivals, self.arrivals.source.len());
        add("arrival_source", &[a], Any, U32(&arrivals.source));
        add("arrival_receiver", &[a], Any, U32(&arrivals.receiver));
        add("arrival_time_s", &[a], Finite, F64((&arrivals.time_s).into()));
        add("arrival_energy", &[a, b], Energy, F64((&arrivals.energy).into()));
        add("arrival_direction", &[a, 3], Finite, F64((&arrivals.direction).into()));
        add("arrival_order", &[a], Any, U32(&arrivals.order));
        add("arrival_kind", &[a], Any, U32(&arrivals.kind));
        if let Some(Directions { lateral_axes, lateral, moment }) = &self.directions {
            add("lateral_axis", &[r, 3], Finite, F64(lateral_axes.as_flattened().into()));
            for (Lateral { energy, energy_batches, kernel_difference }, keys) in
                lateral.iter().zip(LATERAL_KEYS)
            {
                add(keys[0], &[s, r, b, t], Energy, F64(energy.into()));
                if self.batches.is_some() || !energy_batches.is_empty() {
                    add(keys[1], &of_batches, Energy, F32(energy_batches));
                }
                if !kernel_difference.is_empty() {
                    add(keys[2], &of_batches, Finite, F32(kernel_difference));
                }
            }
            add("direction_moment", &[s, r, b, t, 3], Finite, F64(moment.into()));
        }
        arrays
    }
}

fn texts(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).collect()
}
