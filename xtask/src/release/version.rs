//! The files that contain the version.

use crate::workspace;
use anyhow::{Context, Result, bail, ensure};
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// Files with the version, and the text around it; `{}` is the version. Cargo.lock has it once per crate.
const PLACES: [(&str, &str); 4] = [
    ("Cargo.toml", "[workspace.package]\nversion = \"{}\"\n"),
    ("client-py/src/palmares/version.py", "VERSION = \"{}\"\n"),
    ("docs/protocol.md", "\"server\": {\"version\": \"{}\","),
    ("docs/schema/openapi.json", "    \"version\": \"{}\"\n"),
];

/// X.Y.Z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Version([u32; 3]);

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0;
        write!(f, "{x}.{y}.{z}")
    }
}

impl FromStr for Version {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<u32>, _> = text.split('.').map(str::parse).collect();
        let numbers: Option<[u32; 3]> = numbers.ok().and_then(|numbers| numbers.try_into().ok());
        numbers.map(Version).ok_or_else(|| "expected three numbers, as in 0.2.0".to_owned())
    }
}

/// The workspace's version.
pub(crate) fn current() -> Result<Version> {
    let manifest: toml::Table = read("Cargo.toml")?.parse().context("Cargo.toml")?;
    let version = manifest["workspace"]["package"]["version"].as_str().context("Cargo.toml: no version")?;
    version.parse().map_err(|wanted| anyhow::anyhow!("Cargo.toml: version {version}: {wanted}"))
}

/// The files with another version in them, each with its path from the root.
pub(crate) fn changed(from: Version, to: Version) -> Result<Vec<(&'static str, String)>> {
    let files =
        PLACES.iter().map(|&(path, around)| Ok((path, replaced(path, &read(path)?, around, from, to)?)));
    let mut files: Vec<_> = files.collect::<Result<_>>()?;
    files.push(("Cargo.lock", in_lock(&read("Cargo.lock")?, from, to)));
    Ok(files)
}

/// Crates of this workspace are those without a source.
fn in_lock(text: &str, from: Version, to: Version) -> String {
    const HEAD: &str = "[[package]]\n";
    let [from, to] = [from, to].map(|version| format!("\nversion = \"{version}\"\n"));
    let packages = text.split(HEAD).map(|package| {
        if package.contains("\nsource = ") { package.to_owned() } else { package.replacen(&from, &to, 1) }
    });
    packages.collect::<Vec<_>>().join(HEAD)
}

fn replaced(path: &str, text: &str, around: &str, from: Version, to: Version) -> Result<String> {
    let with = |version: Version| around.replace("{}", &version.to_string());
    match text.matches(&with(from)).count() {
        1 => Ok(text.replace(&with(from), &with(to))),
        count => bail!("{path}: expected {:?} once, found it {count} times", with(from)),
    }
}

fn read(path: &str) -> Result<String> {
    std::fs::read_to_string(workspace::root().join(path)).with_context(|| path.to_owned())
}

/// Writes files by their paths from the root.
pub(crate) fn write(files: &[(&str, String)]) -> Result<()> {
    for (path, text) in files {
        let path: &Path = &workspace::root().join(path);
        std::fs::write(path, text).with_context(|| format!("{}", path.display()))?;
    }
    Ok(())
}

/// Refuses a version that is not after the current one.
pub(crate) fn check_order(current: Version, wanted: Version) -> Result<()> {
    ensure!(wanted > current, "{wanted} does not come after the version in Cargo.toml, {current}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_ordered_by_number() {
        let [older, newer] = ["0.9.0", "0.10.0"].map(|text| text.parse::<Version>().expect("sound"));
        assert!(older < newer);
        assert!(check_order(newer, older).is_err());
        for wrong in ["1", "1.2", "1.2.3.4", "1.2.x", "v1.2.3", "-1.0.0"] {
            assert!(wrong.parse::<Version>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_place_has_the_version_of_the_workspace() {
        let current = current().expect("sound");
        let next = "999.0.0".parse().expect("sound");
        for (path, text) in changed(current, next).expect("sound") {
            assert!(text.contains("999.0.0"), "{path}");
        }
    }

    #[test]
    fn a_place_that_is_gone_is_named() {
        let [from, to] = ["0.1.0", "0.2.0"].map(|text| text.parse::<Version>().expect("sound"));
        let error =
            replaced("a.py", "VERSION = '0.1.0'\n", "VERSION = \"{}\"\n", from, to).expect_err("refused");
        assert_eq!(error.to_string(), r#"a.py: expected "VERSION = \"0.1.0\"\n" once, found it 0 times"#);
    }
}
