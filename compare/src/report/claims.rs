//! Statements of README.md and docs/physics.md about the peers: written from the committed reports between
//! two marks, and compared with them by a test. ARCHITECTURE.md has none.

use super::comparison::Comparison;
use super::dominance::PeerResult;
use super::passes::BY_STARTS;
use super::runner::read;
use crate::engine::EngineKind;
use crate::grasps::table::{Sum, Table, best};
use crate::trials::family::HandKind;
use anyhow::{Context, Result, bail};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The mark before a document's claims.
pub const BEGIN: &str = "<!-- claims: written by `palmares-compare claims --write`; do not edit -->";
/// The mark after them.
pub const END: &str = "<!-- end of claims -->";

/// The reports and the counted grasps, in the repository.
const REPORTS: [&str; 2] = ["docs/report/report.json", "docs/report/further/report.json"];
const GRASPS: &str = "docs/report/grasps/grasps.json";
/// The step of the grasps in the claims, ms.
const GRASPS_MS: f64 = 1.0;

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
    let [main, further] = REPORTS;
    let reports = [read(&root.join(main))?, read(&root.join(further))?];
    let grasps = Table::read(&root.join(GRASPS))?;
    let text =
        |file: &str| fs::read_to_string(root.join(file)).with_context(|| format!("cannot read {file}"));
    Ok([
        ("README.md", text("README.md")?, readme(&reports, &grasps)),
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

fn readme(reports: &[Comparison; 2], grasps: &Table) -> String {
    let mut out = said_of_all(reports) + &said_of_grasps(grasps);
    let scenes = BY_STARTS.iter().flat_map(|case| reports[0].results.iter().filter(|v| v.case == *case));
    out += "Results in the scenes with hands:\n\n";
    scenes.for_each(|result| bullet(&mut out, result));
    out
}

fn physics(reports: &[Comparison; 2]) -> String {
    let mut out = said_of_all(reports);
    let ahead: Vec<&PeerResult> = reports.iter().flat_map(Comparison::ahead).collect();
    if !ahead.is_empty() {
        out += "A peer is ahead in:\n\n";
        ahead.into_iter().for_each(|result| bullet(&mut out, result));
    }
    out
}

fn said_of_all(reports: &[Comparison; 2]) -> String {
    let [main, further] = reports;
    let all: usize = reports.iter().map(|report| report.results.len()).sum();
    let ahead: usize = reports.iter().map(|report| report.ahead().count()).sum();
    let commits = if main.record.commit == further.record.commit {
        format!("commit {}", main.record.commit)
    } else {
        format!("commits {} and {}", main.record.commit, further.record.commit)
    };
    let peers = main.engines.iter().filter(|note| note.ran && note.name != EngineKind::Own.name());
    let peers: Vec<String> = peers
        .map(|note| {
            let names: Vec<String> =
                note.settings.iter().map(|choice| format!("`{}`", choice.name)).collect();
            format!("{} {} with {}", note.name, note.version, names.join(", "))
        })
        .collect();
    wrapped(&format!(
        "In {} of {all} comparisons of a scene with another engine ({commits}; {}) no run of that engine is both faster than \
         ours and at least as accurate, with any of its settings.",
        all - ahead,
        peers.join("; "),
    )) + "\n"
}

/// Number of the random grasps that each engine holds; each peer with its best settings.
fn said_of_grasps(grasps: &Table) -> String {
    let sums = grasps.drawn(HandKind::SoftHand.name());
    let own = sums.iter().filter(|sum| sum.engine == EngineKind::Own.name());
    let at = grasps.steps_ms.iter().position(|step| *step == GRASPS_MS);
    let said = own.chain(best(&sums)).map(|sum| {
        let (Sum { engine, settings, flips, .. }, all) = (sum, sum.all());
        let (which, count) = match at.map(|at| sum.counts[at]).filter(|count| count.of > 0) {
            Some(count) => (format!("at {GRASPS_MS} ms"), count),
            None => ("over all steps".into(), all),
        };
        let (name, settings) = match *engine == EngineKind::Own.name() {
            true => ("ours", String::new()),
            false => (*engine, format!(" with `{settings}`")),
        };
        let flips = match flips.pairs {
            0 => String::new(),
            _ => format!(", and {:.1} % of the outcomes differ with the next longer step", flips.percent()),
        };
        format!("{name}{settings} holds {} of {} {which}{flips}", count.kept, count.of)
    });
    let said = said.collect::<Vec<_>>().join("; ");
    wrapped(&format!(
        "Random grasps of the SoftHand, chosen before any engine played them (commit {}, \
         [all counts](docs/report/grasps/README.md)): {said}.",
        grasps.record.commit,
    )) + "\n"
}

fn bullet(out: &mut String, result: &PeerResult) {
    let tried = result.settings.first().map_or(0, |first| first.tried);
    let said = match result.best() {
        None => format!("{} succeeds with 0 of {tried} step lengths", result.peer),
        Some(best) => {
            format!(
                "{} with `{}` succeeds with {} of {tried} step lengths",
                result.peer, best.settings, best.done
            )
        }
    };
    let ours = match result.best() {
        None => format!("ours with {}", result.own_done),
        Some(_) if !result.holds() => format!("it is ahead at {}", result.ahead()),
        Some(best) => {
            let times =
                best.least_advantage.map_or(String::new(), |x| format!(" and at least {x:.1} times as fast"));
            format!("ours with {}{times}", result.own_done)
        }
    };
    let _ = writeln!(out, "- `{}`: {said}, {ours}.", result.case);
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
    fn claims_are_put_between_their_marks_and_nowhere_else() {
        let text = format!("before\n{BEGIN}\nold\n{END}\nafter\n");
        assert_eq!(replaced(&text, "new\n").expect("marked"), text.replace("old", "new"));
        assert!(replaced("no marks", "new\n").is_err());
    }
}
