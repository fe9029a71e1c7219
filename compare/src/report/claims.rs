//! Statements of README.md and docs/physics.md about the peers: written from the committed reports between
//! two marks, and compared with them by a test. ARCHITECTURE.md has none.

use super::comparison::{Comparison, distinct};
use super::dominance::{PeerResult, Verdict};
use super::runner::read;
use crate::engine::EngineKind;
use anyhow::{Context, Result, bail};
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

/// The documents whose claims differ from the committed reports.
///
/// # Errors
/// A report or document cannot be read, or has no marks.
pub fn stale(root: &Path) -> Result<Vec<&'static str>> {
    let mut stale = Vec::new();
    for (file, text, wanted) in documents(root)? {
        if replaced(&text, &wanted).with_context(|| file.to_owned())? != text {
            stale.push(file);
        }
    }
    Ok(stale)
}

/// Writes the claims anew.
///
/// # Errors
/// A report or document cannot be read or written, or has no marks.
pub fn write(root: &Path) -> Result<()> {
    for (file, text, wanted) in documents(root)? {
        let new = replaced(&text, &wanted).with_context(|| file.to_owned())?;
        fs::write(root.join(file), new).with_context(|| format!("cannot write {file}"))?;
    }
    Ok(())
}

/// Name, text and claims of every document.
fn documents(root: &Path) -> Result<[(&'static str, String, String); 2]> {
    let made = REPORTS.iter().map(|file| root.join(file)).filter(|file| file.exists());
    let mut reports = made.map(|file| read(&file)).collect::<Result<Vec<_>>>()?;
    // Claims about another engine hold for the engine that is built.
    reports.retain(|report| report.record.engine == palmares_tasks::identity::fingerprint());
    for k in 0..reports.len() {
        let later: Vec<String> = reports[k + 1..]
            .iter()
            .flat_map(|report| &report.results)
            .map(|result| result.case.clone())
            .collect();
        reports[k].results.retain(|result| !later.contains(&result.case));
    }
    let text =
        |file: &str| fs::read_to_string(root.join(file)).with_context(|| format!("cannot read {file}"));
    Ok([
        ("README.md", text("README.md")?, readme(&reports)),
        ("docs/physics.md", text("docs/physics.md")?, physics(&reports)),
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

fn readme(reports: &[Comparison]) -> String {
    let mut out = String::new();
    for report in reports {
        out += &table(report);
    }
    if out.is_empty() { NOTHING.to_owned() } else { out }
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

/// The claims, where no report is of this engine.
const NOTHING: &str = "No comparison has been measured with the engine of this version.\n";

/// A row for each scene of a report, a column for each engine: the steps at which it does the scene.
fn table(report: &Comparison) -> String {
    let peers: Vec<_> =
        report.engines.iter().filter(|note| note.ran && note.name != EngineKind::Own.name()).collect();
    let cases = distinct(report.results.iter().map(|result| &result.case));
    let of = |case: &str, peer: &str| {
        report.results.iter().find(|result| result.case == case && result.peer == peer)
    };
    let steps = report.results.iter().map(|result| &*result.steps_ms).max_by_key(|steps| steps.len());
    let starts = report.runs.iter().filter_map(|run| Some(run.starts.as_ref()?.tried));
    let from = match (starts.clone().min(), starts.max()) {
        (Some(least), Some(most)) if least == most => format!(", each judged by {most} starts"),
        (Some(least), Some(most)) => format!(", each judged by {least} to {most} starts"),
        _ => String::new(),
    };
    let mut out = wrapped(&format!(
        "The number of step lengths, of {} ms, at which an engine does a scene{from}. Of another engine: the best of its \
         named settings, and at least how many times our CPU time it takes for an equal or smaller error. Settings without \
         a name may do better. [Scenes, settings, all runs](docs/report/hands/README.md) (commit {}).",
        numbers(steps.unwrap_or_default()),
        report.record.commit,
    ));
    let heads = peers
        .iter()
        .map(|note| format!(" {} {}, {} settings |", note.name, note.version, note.settings.len()));
    let _ = writeln!(out, "\n| scene | ours |{}", heads.collect::<String>());
    let _ = writeln!(out, "|---|---|{}", "---|".repeat(peers.len()));
    for case in cases {
        let results: Vec<_> = peers.iter().map(|note| of(case, &note.name)).collect();
        let own = results
            .iter()
            .flatten()
            .next()
            .map_or(String::new(), |result| format!("{} of {}", result.own_done, result.steps_ms.len()));
        let cells =
            results.into_iter().map(|result| format!(" {} |", result.map_or("not played".into(), cell)));
        let _ = writeln!(out, "| `{case}` | {own} |{}", cells.collect::<String>());
    }
    out
}

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

fn numbers(of: &[f64]) -> String {
    of.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
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
        let marked = documents(root()).expect("they are in the repository");
        let marked = marked.map(|(file, text, _)| (file, outside(&text).expect("it has marks")));
        let bare = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("it is in the repository");
        for (file, text) in marked.into_iter().chain([("ARCHITECTURE.md", bare)]) {
            let mut text = text.split_whitespace().collect::<Vec<_>>().join(" ");
            for neutral in NEUTRAL {
                text = text.replace(neutral, "");
            }
            for peer in ["rapier", "MuJoCo", "mujoco", " peer"] {
                let at = text.find(peer);
                let around = at.map(|at| text[at..].chars().take(120).collect::<String>());
                assert_eq!(around, None, "{file}: a claim that no report stands behind");
            }
        }
    }

    #[test]
    fn counted_grasps_have_one_origin() {
        let marked = documents(root()).expect("they are in the repository");
        for (file, text, _) in marked {
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
        let claims = || documents(folder.path()).expect("readable").map(|(_, _, claims)| claims);
        let report = fs::read_to_string(root().join(hands)).expect("readable");
        let json: serde_json::Value = serde_json::from_str(&report).expect("a report");
        let measured = json["engine"].as_str().expect("its engine");
        let of = |engine: &str| {
            fs::write(folder.path().join(hands), report.replace(measured, engine)).expect("written");
            claims()
        };
        let built = palmares_tasks::identity::fingerprint();
        assert!(of(&built).iter().all(|claims| claims != NOTHING), "a report of the engine that is built");
        assert_eq!(of("0123456789abcdef"), [NOTHING, NOTHING]);
    }

    #[test]
    fn claims_are_put_between_their_marks_and_nowhere_else() {
        let text = format!("before\n{BEGIN}\nold\n{END}\nafter\n");
        assert_eq!(replaced(&text, "new\n").expect("marked"), text.replace("old", "new"));
        assert!(replaced("no marks", "new\n").is_err());
    }
}
