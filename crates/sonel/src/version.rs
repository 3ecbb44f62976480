//! Version of a program: `VERSION+REVISION.BUILD`, such as `0.1.0+1.3fa9c2d17b40aa01`.
//!
//! Programs of one version and revision write the same bytes for the same command. The build is a digest of the sources and
//! changes with every edit.

/// The version of a program whose results have `revision`.
#[must_use]
pub fn version(revision: u32) -> String {
    format!("{}+{revision}.{}", env!("CARGO_PKG_VERSION"), env!("SONEL_BUILD"))
}

/// A [`version`] without its build: what programs that write the same have alike.
#[must_use]
pub fn without_build(version: &str) -> &str {
    match version.split_once('+') {
        Some((_, metadata)) => {
            let build = metadata.find('.').map_or(0, |at| metadata.len() - at);
            &version[..version.len() - build]
        }
        None => version,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn builds_of_one_revision_are_alike_and_revisions_are_not() {
        assert_eq!(without_build("0.1.0+1.3fa9"), "0.1.0+1");
        assert_eq!(without_build("0.1.0+2"), "0.1.0+2");
        // Before there were revisions.
        assert_eq!(without_build("0.1.0"), "0.1.0");
        assert_eq!(without_build(&version(7)), format!("{}+7", env!("CARGO_PKG_VERSION")));
        assert_ne!(without_build(&version(7)), without_build(&version(8)));
    }
}
