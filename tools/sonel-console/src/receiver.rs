//! Receivers on the command line.

use glam::DVec3;
use sonel_renderer::ReceiverPoint;

/// Reads `NAME=x,y,z` [m].
///
/// # Errors
/// A sentence that says what is right.
pub fn parse_receiver(text: &str) -> Result<ReceiverPoint, String> {
    let wrong = || format!("\"{text}\" is no receiver: write NAME=x,y,z such as \"seat 12=60,9,60\"");
    let (name, position) = text.rsplit_once('=').ok_or_else(wrong)?;
    let numbers: Vec<f64> = position
        .split(',')
        .map(|number| number.trim().parse().map_err(|_| wrong()))
        .collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, z] if !name.trim().is_empty() => {
            Ok(ReceiverPoint { name: name.trim().to_owned(), position: DVec3::new(x, y, z) })
        }
        _ => Err(wrong()),
    }
}
