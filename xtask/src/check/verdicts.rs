//! Verdicts of earlier runs. The engine is deterministic, so a check is a function of its program and of the files that it may
//! read: `cargo xtask test --quick` keeps the verdict of a check whose files have not changed.

use super::counts::Tally;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// The inputs of a verdict.
#[derive(Clone, Debug, Default)]
pub(super) struct Inputs {
    /// Programs and libraries that it runs.
    pub(super) programs: Vec<PathBuf>,
    /// Which of the repository's files it may read.
    pub(super) files: Files,
}

#[derive(Clone, Debug, Default)]
pub(super) enum Files {
    /// All files.
    #[default]
    All,
    /// These folders and files, without the Rust sources that are compiled into programs.
    Under(Vec<String>),
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Verdict {
    key: String,
    tally: Tally,
    pub(super) seconds: f64,
}

/// The kept verdicts by the name of their check, and the files as they are now.
pub(super) struct Verdicts {
    known: Mutex<BTreeMap<String, Verdict>>,
    /// Hash of each file of the repository that git does not ignore; None without git or its repository.
    files: Option<BTreeMap<String, String>>,
    toolchain: String,
}

impl Verdicts {
    pub(super) fn read() -> Self {
        let known =
            fs::read(place()).ok().and_then(|text| serde_json::from_slice(&text).ok()).unwrap_or_default();
        let said = |program: &str, argument: &str| -> String {
            let output = Command::new(program).arg(argument).output();
            output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default()
        };
        let files = hashes().inspect_err(|error| println!("verdicts are not kept: {error:#}")).ok();
        let toolchain = said("rustc", "-vV") + &said("python3", "-VV") + &said("node", "--version");
        Verdicts { known: Mutex::new(known), files, toolchain }
    }

    /// Hash of everything that a verdict hangs on; None where a program or the files cannot be read.
    pub(super) fn key(&self, inputs: &Inputs) -> Option<String> {
        let mut hash = Sha256::new();
        hash.update(&self.toolchain);
        for program in &inputs.programs {
            hash.update(Sha256::digest(fs::read(program).ok()?));
        }
        for (path, content) in self.files.as_ref()?.iter().filter(|(path, _)| inputs.files.has(path)) {
            hash.update(format!("{path}\0{content}\0"));
        }
        Some(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// The verdict on the same files, if there is one: its tests count as kept.
    pub(super) fn kept(&self, name: &str, key: &str) -> Option<Tally> {
        let known = self.known.lock().ok()?;
        let Verdict { tally, .. } = known.get(name).filter(|verdict| verdict.key == key)?;
        Some(Tally { passed: 0, kept: tally.passed, ..*tally })
    }

    /// Time that a check took at last, s.
    pub(super) fn seconds(&self, name: &str) -> Option<f64> {
        self.known.lock().ok()?.get(name).map(|verdict| verdict.seconds)
    }

    /// Remembers a check without a failure; forgets one that failed.
    pub(super) fn remember(&self, name: &str, key: Option<String>, tally: Tally, seconds: f64) -> Result<()> {
        let Ok(mut known) = self.known.lock() else { return Ok(()) };
        match key {
            Some(key) if tally.failed == 0 => {
                drop(known.insert(name.to_owned(), Verdict { key, tally, seconds }))
            }
            _ => drop(known.remove(name)),
        }
        fs::write(place(), serde_json::to_string(&*known)?).with_context(|| place().display().to_string())
    }
}

impl Files {
    fn has(&self, path: &str) -> bool {
        match self {
            Files::All => true,
            Files::Under(places) => {
                !path.ends_with(".rs")
                    && places.iter().any(|place| {
                        path.strip_prefix(place.as_str())
                            .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
                    })
            }
        }
    }

    /// Whether a crate's tests start the server, whose path they have from `PALMARES_SERVER_BIN`.
    pub(super) fn starts_server(folder: &Path) -> Result<bool> {
        let texts =
            sources(folder)?.into_iter().map(fs::read_to_string).collect::<std::io::Result<Vec<_>>>()?;
        Ok(texts.iter().any(|text| text.contains("PALMARES_SERVER_BIN")))
    }

    /// The files that a crate's tests may read: its own, and those of every folder that its sources name as `../NAME`. A crate
    /// that names the repository's root may read all of it.
    pub(super) fn of_crate(folder: &Path) -> Result<Self> {
        let own = folder.file_name().and_then(|name| name.to_str()).context("a crate's folder")?.to_owned();
        let mut places = vec![own];
        for source in sources(folder)? {
            let text = fs::read_to_string(&source).with_context(|| source.display().to_string())?;
            // Included files are in the program.
            let text: String =
                text.lines().filter(|line| !line.contains("include_")).collect::<Vec<_>>().join("\n");
            for (before, after) in text.match_indices("..").map(|(at, _)| text.split_at(at)) {
                let after = &after[2..];
                if !before.ends_with(['"', '/']) {
                    continue;
                }
                if after.starts_with('"') {
                    return Ok(Files::All);
                }
                if let Some(rest) = after.strip_prefix('/') {
                    let end = rest
                        .find(|c: char| !(c.is_ascii_alphanumeric() || "_-.".contains(c)))
                        .unwrap_or(rest.len());
                    places.push(rest[..end].to_owned());
                }
            }
        }
        // A path that leads two levels up, or out of the repository, may be any.
        if places.iter().any(|place| place.is_empty() || place == "..") {
            return Ok(Files::All);
        }
        Ok(Files::Under(places))
    }
}

/// Rust sources of a crate.
fn sources(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(sources(&path)?);
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            found.push(path);
        }
    }
    Ok(found)
}

fn place() -> PathBuf {
    workspace::root().join("target/verdicts.json")
}

/// Hashes of all files that git tracks, and of new ones that it does not ignore.
fn hashes() -> Result<BTreeMap<String, String>> {
    let root = workspace::root();
    let mut git = Command::new("git");
    git.current_dir(&root).args([
        "ls-files",
        "-z",
        "--cached",
        "--others",
        "--exclude-standard",
        "--deduplicate",
    ]);
    let listed = git.output().context("cannot start git")?;
    ensure!(listed.status.success(), "git ls-files: {}", String::from_utf8_lossy(&listed.stderr));
    let names = String::from_utf8(listed.stdout).context("a file's name is not UTF-8")?;
    let mut hashes = BTreeMap::new();
    for name in names.split('\0').filter(|name| !name.is_empty()) {
        // A file that is deleted but still tracked has no content.
        let Ok(content) = fs::read(root.join(name)) else { continue };
        hashes.insert(
            name.to_owned(),
            Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect(),
        );
    }
    Ok(hashes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::counts::PASSED;

    fn verdicts(files: &[(&str, &str)]) -> Verdicts {
        let files = files.iter().map(|(path, hash)| ((*path).to_owned(), (*hash).to_owned())).collect();
        Verdicts { known: Mutex::default(), files: Some(files), toolchain: "1.90".into() }
    }

    #[test]
    fn a_verdict_is_kept_until_a_file_or_a_program_changes() {
        let folder = tempfile::tempdir().expect("a folder");
        let program = folder.path().join("program");
        fs::write(&program, "one").expect("written");
        let inputs = Inputs {
            programs: vec![program.clone()],
            files: Files::Under(vec!["models".into(), "README.md".into()]),
        };
        let key = |files: &[(&str, &str)]| verdicts(files).key(&inputs).expect("a key");
        let before = key(&[("models/a.toml", "1"), ("README.md", "1"), ("docs/b.md", "1")]);
        assert_eq!(before, key(&[("models/a.toml", "1"), ("README.md", "1"), ("docs/b.md", "2")]));
        assert_eq!(before, key(&[("models/a.toml", "1"), ("README.md", "1"), ("models/c.rs", "2")]));
        assert_ne!(before, key(&[("models/a.toml", "2"), ("README.md", "1")]));
        assert_ne!(before, key(&[("models/a.toml", "1"), ("README.md", "2")]));
        assert_ne!(before, key(&[("models/a.toml", "1"), ("models/new.toml", "1"), ("README.md", "1")]));
        assert_eq!(before, key(&[("models/a.toml", "1"), ("modelsx/new.toml", "1"), ("README.md", "1")]));
        fs::write(&program, "two").expect("written");
        assert_ne!(before, key(&[("models/a.toml", "1"), ("README.md", "1")]));
        fs::remove_file(&program).expect("removed");
        assert_eq!(verdicts(&[]).key(&inputs), None);
    }

    #[test]
    fn kept_tests_do_not_count_as_passed_and_skipped_ones_stay_skipped() {
        let verdicts = verdicts(&[]);
        let tally = Tally { passed: 3, skipped: 2, ..Tally::default() };
        let known = Verdict { key: "k".into(), tally, seconds: 1.0 };
        verdicts.known.lock().expect("free").insert("gates".into(), known);
        assert_eq!(verdicts.kept("gates", "k"), Some(Tally { kept: 3, skipped: 2, ..Tally::default() }));
        assert_eq!(verdicts.kept("gates", "l"), None);
        assert_eq!(verdicts.kept("other", "k"), None);
        assert_eq!(PASSED.plus(tally).passed, 4);
    }

    #[test]
    fn the_files_of_a_crate_are_those_that_its_sources_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let source = folder.path().join("lib.rs");
        let own = folder.path().file_name().and_then(|name| name.to_str()).expect("a name").to_owned();
        fs::write(&source, "let a = \"../docs/hands.md\"; let b = \"/../tasks\"; // 1..2, and so on ...")
            .expect("written");
        let Files::Under(places) = Files::of_crate(folder.path()).expect("files") else {
            panic!("not all files")
        };
        assert_eq!(places, [own, "docs".to_owned(), "tasks".to_owned()]);
        assert!(!Files::starts_server(folder.path()).expect("sources"));
        fs::write(&source, "std::env::var(\"PALMARES_SERVER_BIN\")").expect("written");
        assert!(Files::starts_server(folder.path()).expect("sources"));
        for root in ["\"..\"", "\"../..\"", "\"/..\"", "\"../../other\""] {
            fs::write(&source, root).expect("written");
            assert!(matches!(Files::of_crate(folder.path()), Ok(Files::All)), "{root}");
        }
    }
}
