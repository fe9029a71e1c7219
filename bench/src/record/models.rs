//! A page depends on the engine and on these: hashes of hands, tasks and controllers.

use super::pages::{RecordError, RecordPart};
use palmares_models::content::ContentHash;
use palmares_models::hand::Hand;
use palmares_tasks::Task;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Digits of a content hash in a record.
const DIGITS: usize = 12;
/// The kind and the name of a controllers' hash.
const CONTROLLERS: &str = "controllers";

/// The root of the repository.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Hashes of what a part depends on beside the engine.
pub(super) fn models(part: &RecordPart, root: &Path) -> Result<BTreeMap<String, String>, RecordError> {
    let short = |hash: &str| hash.chars().take(DIGITS).collect::<String>();
    let missing =
        |kind, name: &str| RecordError::NotBuiltIn { part: part.name.clone(), kind, name: name.to_owned() };
    let mut models = BTreeMap::new();
    for name in &part.hands {
        let hand = Hand::builtin(name).ok_or_else(|| missing("hand", name))?;
        models.insert(format!("hand {name}"), short(&hand.content_hash()));
    }
    let tasks = Task::builtin();
    for name in &part.tasks {
        let task = tasks.iter().find(|task| task.name == *name).ok_or_else(|| missing("task", name))?;
        models.insert(format!("task {name}"), short(task.content_hash()));
    }
    if !part.controllers.is_empty() {
        models.insert(CONTROLLERS.to_owned(), short(&controllers(part, root)?));
    }
    Ok(models)
}

/// SHA-256 of names and texts of the controllers' files; `client-py/benchmarks/record.py` computes the same.
fn controllers(part: &RecordPart, root: &Path) -> Result<String, RecordError> {
    let mut hash = ContentHash::of(CONTROLLERS);
    for named in &part.controllers {
        let failed =
            |source| RecordError::Controller { part: part.name.clone(), path: named.clone(), source };
        for path in files(root, named).map_err(failed)? {
            hash.text(&path);
            hash.text(&fs::read_to_string(root.join(&path)).map_err(failed)?);
        }
    }
    Ok(hash.to_hex())
}

/// A file, or the Python files in a folder, by name.
fn files(root: &Path, named: &str) -> io::Result<Vec<String>> {
    if !root.join(named).is_dir() {
        return Ok(vec![named.to_owned()]);
    }
    let mut found = Vec::new();
    for entry in fs::read_dir(root.join(named))? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name.ends_with(".py") {
            found.push(format!("{named}/{name}"));
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(controllers: &[&str]) -> RecordPart {
        RecordPart {
            controllers: controllers.iter().map(|name| (*name).to_owned()).collect(),
            ..RecordPart::default()
        }
    }

    /// `client-py/tests/test_record.py` has the same folder and the same digest.
    #[test]
    fn the_digest_of_controllers_is_that_of_python() {
        let folder = std::env::temp_dir().join(format!("palmares-record-{}", std::process::id()));
        fs::create_dir_all(folder.join("skills")).expect("a folder");
        for (name, text) in
            [("a.py", "one\n"), ("skills/c.py", "σ\n"), ("skills/b.py", "two\n"), ("skills/d.txt", "-")]
        {
            fs::write(folder.join(name), text).expect("written");
        }
        let digest = |of: &[&str]| controllers(&part(of), &folder).map(|hash| hash[..DIGITS].to_owned());
        assert_eq!(digest(&["a.py", "skills"]).expect("readable"), "e0e1f027098d");
        assert_ne!(digest(&["a.py"]).expect("readable"), digest(&["skills"]).expect("readable"));
        let missing = digest(&["absent.py"]).expect_err("there is none").to_string();
        assert!(missing.contains("absent.py"), "{missing}");
        fs::remove_dir_all::<PathBuf>(folder).expect("removed");
    }

    #[test]
    fn a_hand_that_is_not_built_in_is_named() {
        let part = RecordPart { name: "report".into(), hands: vec!["paw".into()], ..RecordPart::default() };
        let error = models(&part, Path::new(".")).expect_err("no such hand").to_string();
        assert_eq!(error, "bench/src/record/pages.toml: part `report`: hand `paw` is not built in");
    }
}
