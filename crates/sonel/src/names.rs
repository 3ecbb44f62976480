//! Names that users give.

/// The place of `wanted` among the `known` names.
///
/// # Errors
/// A sentence that begins with `none`, such as `the map has no source`, and lists the known names.
pub fn place<'a>(
    known: impl IntoIterator<Item = &'a str>,
    wanted: &str,
    none: &str,
) -> Result<usize, String> {
    let known: Vec<&str> = known.into_iter().collect();
    let found = known.iter().position(|name| *name == wanted);
    found.ok_or_else(|| format!("{none} \"{wanted}\"; it has {}", known.join(", ")))
}
