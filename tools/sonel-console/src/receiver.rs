//! Receivers on the command line.

use anyhow::{Context, ensure};
use glam::DVec3;
use sonel::acoustics::Pattern;
use sonel::rendering::{ReceiverPoint, Sensitivity};

/// Reads `NAME=x,y,z` [m] or, with a directivity and its aim, `NAME=x,y,z,cardioid,x,y,z`.
///
/// # Errors
/// A sentence that says what is right.
pub fn parse_receiver(text: &str) -> anyhow::Result<ReceiverPoint> {
    let wrong = || {
        format!(
            "\"{text}\" is not a receiver: write NAME=x,y,z such as \"seat 12=60,9,60\", or with a directivity and its aim \
             \"mic=60,9,60,cardioid,0,0,-1\""
        )
    };
    let (name, rest) = text.rsplit_once('=').with_context(wrong)?;
    let fields: Vec<&str> = rest.split(',').map(str::trim).collect();
    let vector = |fields: &[&str]| -> anyhow::Result<DVec3> {
        let numbers = fields.iter().map(|field| field.parse().ok());
        let numbers = numbers.collect::<Option<Vec<f64>>>().and_then(|numbers| numbers.try_into().ok());
        Ok(DVec3::from_array(numbers.with_context(wrong)?))
    };
    ensure!(!name.trim().is_empty(), wrong());
    let receiver = |position: &[&str]| Ok(ReceiverPoint::omni(name.trim(), vector(position)?));
    match &fields[..] {
        [x, y, z, word, aim @ ..] => {
            let pattern: Pattern = word.parse()?;
            let aim = vector(aim)?.try_normalize().context("the aim of the receiver has no length")?;
            Ok(ReceiverPoint { sensitivity: Sensitivity { pattern, aim }, ..receiver(&[x, y, z])? })
        }
        position => receiver(position),
    }
}
