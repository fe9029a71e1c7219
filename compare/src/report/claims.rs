//! Statements of README.md and docs/physics.md about the peers: written from the committed reports between
//! two marks, and compared with them by a test. ARCHITECTURE.md has none.

use super::comparison::{Comparison, distinct};
use super::dominance::{PeerResult, Verdict};
use super::runner::read;
use super::{front_figure, front_table};
use crate::grasps::table::Table;
use anyhow::{Context, Result, bail};
use palmares_bench::rigs::softhand_in_words;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The mark before a document's claims.
pub const BEGIN: &str = "<!-- claims: written by `palmares-compare claims --write`; do not edit -->";
/// The mark after them.
pub const END: &str = "<!-- end of claims -->";

/// The reports, in the repository. Where two reports have a case, the last one counts.
const REPORTS: [&str; 3] =
    ["docs/report/report.json", "docs/report/further/report.json", "docs/report/hands/report.json"];

/// The picture of README.
const FIGURE: &str = "docs/report/one_look.svg";
/// The counted grasps.
const GRASPS: &str = "docs/report/grasps/grasps.json";

/// A file with what it should say.
struct Written {
    file: &'static str,
    text: String,
    wanted: String,
}

/// The files whose claims differ from the committed reports.
///
/// # Errors
/// A report or document cannot be read, or has no marks.
pub fn stale(root: &Path) -> Result<Vec<&'static str>> {
    let files = files(root)?.into_iter();
    Ok(files.filter(|it| it.text != it.wanted).map(|it| it.file).collect())
}

/// Writes the claims anew.
///
/// # Errors
/// A report or document cannot be read or written, or has no marks.
pub fn write(root: &Path) -> Result<()> {
    for Written { file, wanted, .. } in files(root)? {
        let path = root.join(file);
        match wanted.is_empty() {
            true if path.exists() => fs::remove_file(&path),
            true => Ok(()),
            false => fs::write(&path, wanted),
        }
        .with_context(|| format!("cannot write {file}"))?;
    }
    Ok(())
}

/// Every file, a picture without content if there is nothing to show.
fn files(root: &Path) -> Result<[Written; 3]> {
    let made = REPORTS.iter().map(|file| root.join(file)).filter(|file| file.exists());
    let mut reports = made.map(|file| read(&file)).collect::<Result<Vec<_>>>()?;
    // Claims about another engine hold for the engine that is built.
    let built = palmares_tasks::identity::fingerprint();
    reports.retain(|report| report.record.engine == built);
    for k in 0..reports.len() {
        let later: Vec<String> = reports[k + 1..]
            .iter()
            .flat_map(|report| &report.results)
            .map(|result| result.case.clone())
            .collect();
        reports[k].results.retain(|result| !later.contains(&result.case));
        reports[k].runs.retain(|run| !later.contains(&run.case));
    }
    let grasps = Table::read(&root.join(GRASPS)).ok().filter(|table| table.record.engine == built);
    let text =
        |file: &str| fs::read_to_string(root.join(file)).with_context(|| format!("cannot read {file}"));
    let document = |file: &'static str, claims: String| {
        let text = text(file)?;
        let wanted = replaced(&text, &claims).with_context(|| file.to_owned())?;
        Ok::<_, anyhow::Error>(Written { file, text, wanted })
    };
    Ok([
        document("README.md", readme(&reports, grasps.as_ref()))?,
        document("docs/physics.md", physics(&reports))?,
        Written {
            file: FIGURE,
            text: text(FIGURE).unwrap_or_default(),
            wanted: front_figure::picture(&reports)?.unwrap_or_default(),
        },
    ])
}

/// A document with other claims.
fn replaced(text: &str, claims: &str) -> Result<String> {
    let parts = text.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?.1)));
    let Some((before, after)) = parts else {
        bail!("there is no `{BEGIN}` with an `{END}` behind it");
    };
    Ok(format!("{before}{BEGIN}\n{claims}{END}{after}"))
}

/// A document without its claims.
#[cfg(test)]
fn outside(text: &str) -> Result<String> {
    Ok(replaced(text, "")?.replace(BEGIN, "").replace(END, ""))
}

fn readme(reports: &[Comparison], grasps: Option<&Table>) -> String {
    if reports.is_empty() {
        return NOTHING.to_owned();
    }
    let hand = softhand_in_words();
    let count: usize = reports.iter().map(|report| report.results.len()).sum();
    let commits = distinct(reports.iter().map(|report| &report.record.commit)).join(", ");
    wrapped(&format!(
        "Each cell has the longest step that solves the scene, the CPU time of a simulated second at it, the starts solved and the \
         deepest overlap, of several starts the median. Each engine has the best of the settings that were played. {hand} {EMULATOR} The figure has all {count} comparisons (commit \
         {commits}; [scenes, settings and runs](docs/report/README.md))."
    )) + "\n"
        + &front_table::table(reports, grasps)
        + "\n![A row a scene: the CPU time of each other engine over that of Palmares at no larger error](docs/report/one_look.svg)\n"
}

fn physics(reports: &[Comparison]) -> String {
    let all = || reports.iter().flat_map(|report| &report.results);
    let mut out = String::new();
    for (verdict, title) in [(Verdict::Lost, "A peer is ahead in:"), (Verdict::Neither, "Neither solves:")] {
        let of: Vec<&PeerResult> = all().filter(|result| result.verdict() == verdict).collect();
        if !of.is_empty() {
            out += &format!("{title}\n\n");
            of.into_iter().for_each(|result| bullet(&mut out, result));
            out += "\n";
        }
    }
    match (reports.is_empty(), out.is_empty()) {
        (true, _) => NOTHING.to_owned(),
        (false, true) => wrapped(&format!(
            "In the {} comparisons that the engine of this version has played and that are decided \
             ([page](report/hands/README.md)), no peer is ahead with its named settings.",
            all().filter(|result| result.verdict() == Verdict::Won).count()
        )),
        (false, false) => out,
    }
}

/// The emulator on Klamp't that this program succeeds, in numbers of its authors (real-time factors 0.5 and 0.24).
const EMULATOR: &str = "The emulator of Rocchi and Hauser (2016) on Klamp't is not played: as published, not measured here, it takes \
                        2000 ms of CPU a simulated second with simple contacts and 4200 ms in a typical grasp, on an i7-6500U at \
                        2.5 GHz.";

/// The claims, where no report is of this engine.
const NOTHING: &str = "No comparison has been measured with the engine of this version.\n";

/// The result of a peer in a scene.
fn cell(result: &PeerResult) -> String {
    let Some(surest) = result.surest() else { return result.steps() };
    let times = result.settings.iter().filter_map(|outcome| outcome.least_advantage).reduce(f64::min);
    let times = match result.verdict() {
        Verdict::Lost => format!("; ahead at {}", result.ahead()),
        _ => times.map_or(String::new(), |times| format!("; {times:.1} times")),
    };
    format!("{} with `{}`{times}", surest.steps(), surest.settings)
}

fn bullet(out: &mut String, result: &PeerResult) {
    let PeerResult { case, peer, own_done, .. } = result;
    let _ = writeln!(out, "- `{case}`, {peer}: {}, ours {own_done}.", cell(result));
}

/// Lines of at most 110 characters.
fn wrapped(text: &str) -> String {
    let mut out = String::new();
    let mut line = 0;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if line > 0 && line + 1 + length > 110 {
            out.push('\n');
            line = 0;
        } else if line > 0 {
            out.push(' ');
            line += 1;
        }
        out += word;
        line += length;
    }
    out + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root() -> &'static Path {
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
    }

    fn documents(root: &Path) -> impl Iterator<Item = Written> {
        let files = files(root).expect("reports and documents can be read");
        files.into_iter().filter(|it| it.file.ends_with(".md"))
    }

    /// Sentences that name a peer without comparing anything.
    const NEUTRAL: [&str; 2] = [
        "cargo xtask report # speed against error beside rapier and MuJoCo, into docs/report; --quick takes minutes",
        "speed against error beside rapier and MuJoCo, every scene and step",
    ];

    #[test]
    fn what_the_documents_say_of_peers_is_what_the_reports_say() {
        let stale = stale(root()).expect("reports and documents are in the repository");
        assert!(stale.is_empty(), "{stale:?}: run `palmares-compare claims --write`");
    }

    #[test]
    fn nothing_else_is_said_of_peers() {
        let marked = documents(root()).map(|it| (it.file, outside(&it.text).expect("it has marks")));
        let bare = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("it is in the repository");
        for (file, text) in marked.into_iter().chain([("ARCHITECTURE.md", bare)]) {
            let mut text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            for neutral in NEUTRAL {
                text = text.replace(neutral, "");
            }
            for peer in ["rapier", "MuJoCo", "mujoco", "Drake", "drake", " peer"] {
                let at = text.find(peer);
                let around = at.map(|at| text[at..].chars().take(120).collect::<String>());
                assert_eq!(around, None, "{file}: a claim that no report stands behind");
            }
        }
    }

    #[test]
    fn counted_grasps_have_one_origin() {
        for Written { file, text, .. } in documents(root()) {
            let text = outside(&text).expect("it has marks");
            for words in [" of 144", "all 144", "% of the outcomes", "% of the grasps"] {
                let line = text.lines().find(|line| line.contains(words));
                assert_eq!(line, None, "{file}: only the claims state counts of grasps");
            }
        }
    }

    #[test]
    fn nothing_is_said_of_an_engine_that_is_not_built() {
        let folder = tempfile::tempdir().expect("a folder");
        let hands = "docs/report/hands/report.json";
        fs::create_dir_all(folder.path().join("docs/report/hands")).expect("made");
        for file in ["README.md", "docs/physics.md", hands] {
            fs::copy(root().join(file), folder.path().join(file)).expect("copied");
        }
        let written = || documents(folder.path()).map(|it| it.wanted.contains(NOTHING)).collect::<Vec<_>>();
        let report = fs::read_to_string(root().join(hands)).expect("readable");
        let json: serde_json::Value = serde_json::from_str(&report).expect("a report");
        let measured = json["engine"].as_str().expect("its engine");
        let of = |engine: &str| {
            fs::write(folder.path().join(hands), report.replace(measured, engine)).expect("written");
            written()
        };
        let built = palmares_tasks::identity::fingerprint();
        assert_eq!(of(&built), [false, false], "a report of the engine that is built");
        let figure =
            || files(folder.path()).expect("readable").into_iter().find(|it| it.file == FIGURE).expect("it");
        assert!(figure().wanted.contains("<svg"));
        assert_eq!(of("0123456789abcdef"), [true, true]);
        assert_eq!(figure().wanted, "");
    }

    #[test]
    fn claims_are_put_between_their_marks_and_nowhere_else() {
        let text = format!("before\n{BEGIN}\nold\n{END}\nafter\n");
        assert_eq!(replaced(&text, "new\n").expect("marked"), text.replace("old", "new"));
        assert!(replaced("no marks", "new\n").is_err());
    }
}
