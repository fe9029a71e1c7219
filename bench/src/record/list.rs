//! docs/pages-of-record.md: the parts, and which pages are of another engine.

use super::line::Line;
use super::models::{models, root};
use super::pages::{RecordError, RecordPart, parts};
use super::stamp::Record;
use anyhow::{Context, Result, ensure};
use palmares_tasks::identity;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The list, from the root of the repository.
pub const LIST: &str = "docs/pages-of-record.md";

const HEAD: &str = "\
# Pages of measured results

<!-- Written by `cargo xtask generate`; do not edit. -->

`cargo xtask pages-of-record` measures and writes these pages anew. It skips parts that it has finished with the present engine;
after a stop it continues. `--list` shows the parts, `--only report,grasps` selects, `--quick` plays each in its shortest form
into `target/pages-of-record`. Timings need an idle machine. The programs come from the sources here; MuJoCo, matplotlib and
stable-baselines3 from Python's package index, once.

One line of a page says how it was measured: the engine's fingerprint (`palmares-bench fingerprint` prints its parts), the first
digits of the content hashes of the hands, tasks and controllers that it plays, commit, day and machine.

";

/// The text of the list for the pages in the repository.
///
/// # Errors
/// A page is missing, or has no record.
pub fn text() -> Result<String> {
    let mut text = HEAD.to_owned();
    let parts = parts();
    text += "## Parts\n\n| part | what | usual minutes on two cores | pages |\n|---|---|---|---|\n";
    for RecordPart { name, about, minutes, pages, .. } in &parts {
        let shown = |page: &String| if root().join(page).exists() { link(page) } else { page.clone() };
        let pages: Vec<String> = pages.iter().map(shown).collect();
        let minutes = minutes.map_or("–".to_owned(), |minutes| minutes.to_string());
        writeln!(text, "| {name} | {about} | {minutes} | {} |", pages.join(", "))?;
    }
    let all: f64 = parts.iter().filter_map(|part| part.minutes).sum();
    writeln!(text, "\nTogether {all:.0} minutes, and the time of the parts without a number.")?;
    text += "\n## Engine of each page\n\nThe last column names what has changed since the page was measured: the engine, or hands, tasks and controllers \
             that it plays. Older pages do not name these.\n\n\
             | page | section | engine | commit | day | changed since |\n|---|---|---|---|---|---|\n";
    let engine = identity::fingerprint();
    for part in &parts {
        let models = models(part, &root())?;
        for page in &part.pages {
            if !root().join(page).exists() {
                writeln!(text, "| {page} |  |  |  |  | not measured yet |")?;
                continue;
            }
            for (section, line) in records(&root(), page)? {
                let changed = changed(&line, &engine, &models);
                let Line { engine, commit, date, .. } = &line;
                writeln!(text, "| {} | {section} | {engine} | {commit} | {date} | {changed} |", link(page))?;
            }
        }
    }
    Ok(text)
}

/// The changes since the page was measured, in words.
fn changed(line: &Line, engine: &str, models: &BTreeMap<String, String>) -> String {
    let mut changed = line.changed(engine, models);
    if line.models.is_empty() && !models.is_empty() {
        changed.retain(|name| name == "engine");
        changed.push("models not recorded".to_owned());
    }
    if changed.is_empty() { "–".to_owned() } else { changed.join(", ") }
}

/// A page's address from the list.
fn link(page: &str) -> String {
    let address = page.strip_prefix("docs/").map_or_else(|| format!("../{page}"), str::to_owned);
    format!("[{page}]({address})")
}

/// The records of a page with the headings above them.
fn records(root: &Path, page: &str) -> Result<Vec<(String, Line)>> {
    let text = fs::read_to_string(root.join(page)).with_context(|| format!("cannot read {page}"))?;
    let records = Line::all_of(&text).with_context(|| page.to_owned())?;
    ensure!(
        !records.is_empty(),
        "{page} has no record of its engine; `cargo xtask pages-of-record` writes the page with it"
    );
    Ok(records)
}

/// The part's record as it would be now, without commit, day and machine: a part that was played with it need not be played again.
///
/// # Errors
/// As [`Record::now`].
pub fn fingerprint(part: &str) -> Result<String, RecordError> {
    let line = Record::now(part)?.line().to_string();
    Ok(line.split_once("; commit ").map_or_else(|| line.clone(), |(models, _)| models.to_owned()))
}

/// Compares the list with the pages, or writes it.
///
/// # Errors
/// A page is missing or has no record, or the list is out of date.
pub fn check(write: bool) -> Result<()> {
    let (path, text) = (root().join(LIST), text()?);
    if write {
        return fs::write(&path, text).with_context(|| format!("cannot write {LIST}"));
    }
    let there = fs::read_to_string(&path).unwrap_or_default();
    ensure!(there == text, "{LIST} is out of date: `cargo xtask generate` writes it");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_says_which_pages_are_of_another_engine() {
        check(std::env::var_os("PALMARES_WRITE_DOCS").is_some()).expect("pages with records, and their list");
    }

    /// A page with numbers of another engine says nothing about the one that ships.
    #[test]
    fn every_page_is_of_the_engine_that_is_built() {
        let engine = identity::fingerprint();
        let (mut count, mut older) = (0, Vec::new());
        for page in parts().iter().flat_map(|part| &part.pages) {
            let records = records(&root(), page).expect("a page with records");
            count += records.len();
            if records.iter().any(|(_, line)| line.engine != engine) {
                older.push(page.clone());
            }
        }
        assert!(count > 10, "{count} records");
        assert!(
            older.is_empty(),
            "{older:?}: `cargo xtask pages-of-record` measures anew with engine {engine}"
        );
    }

    #[test]
    fn every_page_in_the_folders_of_measured_pages_is_declared() {
        let declared: Vec<String> = parts().into_iter().flat_map(|part| part.pages).collect();
        let mut folders =
            ["docs/pictures", "docs/report", "docs/training", "docs/validation"].map(str::to_owned).to_vec();
        let mut count = 0;
        while let Some(folder) = folders.pop() {
            // A folder that is not there yet has no page.
            for entry in fs::read_dir(root().join(&folder)).into_iter().flatten() {
                let entry = entry.expect("an entry");
                let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
                if entry.path().is_dir() {
                    folders.push(path);
                } else if path.ends_with(".md") {
                    count += 1;
                    assert!(declared.contains(&path), "{path}: bench/src/record/pages.toml does not name it");
                }
            }
        }
        assert!(count > 5, "{count} pages");
    }

    #[test]
    fn a_page_without_a_record_is_named() {
        let error = format!("{:#}", records(&root(), "README.md").expect_err("it has none"));
        assert!(error.starts_with("README.md has no record"), "{error}");
    }

    #[test]
    fn a_fingerprint_is_of_engine_and_models_alone() {
        let fingerprint = fingerprint("cameras").expect("a part");
        assert!(
            fingerprint.starts_with("Engine ") && fingerprint.contains("; hand softhand "),
            "{fingerprint}"
        );
        assert!(!fingerprint.contains("commit"), "{fingerprint}");
        assert!(super::fingerprint("none").expect_err("no part").to_string().contains("report, hand_scenes"));
    }
}
