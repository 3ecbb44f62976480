//! Receivers on the command line.

use glam::DVec3;
use sonel::acoustics::Pattern;
use sonel::rendering::{ReceiverPoint, Sensitivity};

/// Reads `NAME=x,y,z` [m] or, with a directivity and its aim, `NAME=x,y,z,cardioid,x,y,z`.
///
/// # Errors
/// A sentence that says what is right.
pub fn parse_receiver(text: &str) -> Result<ReceiverPoint, String> {
    let wrong = || {
        format!(
            "\"{text}\" is not a receiver: write NAME=x,y,z such as \"seat 12=60,9,60\", or with a directivity and its aim \
             \"mic=60,9,60,cardioid,0,0,-1\""
        )
    };
    let (name, rest) = text.rsplit_once('=').ok_or_else(wrong)?;
    let fields: Vec<&str> = rest.split(',').map(str::trim).collect();
    let vector = |fields: &[&str]| -> Result<DVec3, String> {
        let numbers = fields.iter().map(|field| field.parse().map_err(|_| wrong()));
        let numbers = numbers.collect::<Result<Vec<f64>, _>>()?;
        Ok(DVec3::from_array(numbers.try_into().map_err(|_| wrong())?))
    };
    if name.trim().is_empty() {
        return Err(wrong());
    }
    let receiver = |position: &[&str]| Ok(ReceiverPoint::omni(name.trim(), vector(position)?));
    match &fields[..] {
        [x, y, z, word, aim @ ..] => {
            let pattern: Pattern = word.parse().map_err(|unknown| format!("\"{text}\": {unknown}"))?;
            let aim = vector(aim)?.try_normalize();
            let aim = aim.ok_or_else(|| format!("\"{text}\": the aim of the receiver has no length"))?;
            Ok(ReceiverPoint { sensitivity: Sensitivity { pattern, aim }, ..receiver(&[x, y, z])? })
        }
        position => receiver(position),
    }
}
