//! CHANGELOG.md: the section of a version.

use super::version::Version;
use anyhow::{Context, Result, ensure};

const UNRELEASED: &str = "## [Unreleased]\n";

/// The changelog with what was unreleased under this version and date, and an empty section for what comes next.
pub(crate) fn released(changelog: &str, version: Version, date: &str) -> Result<String> {
    let (before, rest) =
        changelog.split_once(UNRELEASED).context("CHANGELOG.md: no line `## [Unreleased]`")?;
    ensure!(!section_of(rest).is_empty(), "CHANGELOG.md: nothing is under `## [Unreleased]`");
    ensure!(section(changelog, version).is_none(), "CHANGELOG.md: there is a section {version} already");
    Ok(format!("{before}{UNRELEASED}\n## [{version}] - {date}\n{rest}"))
}

/// The changelog's section on a version.
pub(crate) fn section(changelog: &str, version: Version) -> Option<&str> {
    let (_, rest) = changelog.split_once(&format!("\n## [{version}]"))?;
    Some(section_of(rest.split_once('\n')?.1))
}

fn section_of(rest: &str) -> &str {
    rest.split("\n## ").next().unwrap_or_default().trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEFORE: &str =
        "# Changelog\n\n## [Unreleased]\n\n### Added\n\n- A hand.\n\n## [0.1.0] - 2026-01-02\n\n- First.\n";

    #[test]
    fn what_was_unreleased_becomes_the_section_of_the_version() {
        let version = "0.2.0".parse().expect("sound");
        let after = released(BEFORE, version, "2026-03-04").expect("sound");
        assert!(
            after.starts_with("# Changelog\n\n## [Unreleased]\n\n## [0.2.0] - 2026-03-04\n\n### Added\n")
        );
        assert_eq!(section(&after, version), Some("### Added\n\n- A hand."));
        assert_eq!(section(&after, "0.1.0".parse().expect("sound")), Some("- First."));
        assert_eq!(section(BEFORE, version), None);
    }

    #[test]
    fn a_release_without_a_change_is_refused() {
        let version = "0.2.0".parse().expect("sound");
        let empty = released(BEFORE, version, "2026-03-04").expect("sound");
        let error = released(&empty, "0.3.0".parse().expect("sound"), "2026-03-05").expect_err("refused");
        assert_eq!(error.to_string(), "CHANGELOG.md: nothing is under `## [Unreleased]`");
        assert!(released(BEFORE, "0.1.0".parse().expect("sound"), "2026-03-05").is_err());
    }
}
