//! Statements of README.md and docs/physics.md about the peers: written from the committed reports between
//! two marks, and compared with them by a test. ARCHITECTURE.md has none.

use super::comparison::Comparison;
use super::dominance::{PeerResult, Verdict};
use super::passes::BY_STARTS;
use super::runner::read;
use crate::engine::EngineKind;
use crate::grasps::table::{Sum, Table, best};
use crate::search::table as search;
use crate::trials::family::HandKind;
use anyhow::{Context, Result, bail};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The mark before a document's claims.
pub const BEGIN: &str = "<!-- claims: written by `palmares-compare claims --write`; do not edit -->";
/// The mark after them.
pub const END: &str = "<!-- end of claims -->";

/// The reports, the counted grasps and the search, in the repository. Where two reports have a case, the last one counts.
const REPORTS: [&str; 3] =
    ["docs/report/report.json", "docs/report/further/report.json", "docs/report/hands/report.json"];
const GRASPS: &str = "docs/report/grasps/grasps.json";
const SEARCH: &str = "docs/report/search/search.json";

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
    for k in 0..reports.len() {
        let later: Vec<String> = reports[k + 1..]
            .iter()
            .flat_map(|report| &report.results)
            .map(|result| result.case.clone())
            .collect();
        reports[k].results.retain(|result| !later.contains(&result.case));
    }
    let grasps = Table::read(&root.join(GRASPS))?;
    let search = Some(root.join(SEARCH)).filter(|file| file.exists());
    let search = search.map(|file| search::Table::read(&file)).transpose()?;
    let text =
        |file: &str| fs::read_to_string(root.join(file)).with_context(|| format!("cannot read {file}"));
    Ok([
        ("README.md", text("README.md")?, readme(&reports, &grasps, search.as_ref())),
        ("docs/physics.md", text("docs/physics.md")?, physics(&reports, &grasps)),
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

fn readme(reports: &[Comparison], grasps: &Table, search: Option<&search::Table>) -> String {
    let mut out = said_of_all(reports) + &said_of_grasps(grasps);
    out += &search.map_or_else(String::new, said_of_search);
    let all = || reports.iter().flat_map(|report| &report.results);
    let scenes = BY_STARTS.iter().flat_map(|case| all().filter(|result| result.case == *case));
    out += "Results in the scenes with hands:\n\n";
    scenes.for_each(|result| bullet(&mut out, result));
    out
}

fn physics(reports: &[Comparison], grasps: &Table) -> String {
    let mut out = said_of_all(reports);
    let all = || reports.iter().flat_map(|report| &report.results);
    for (verdict, title) in [(Verdict::Lost, "A peer is ahead in:"), (Verdict::Neither, "Neither solves:")] {
        let of: Vec<&PeerResult> = all().filter(|result| result.verdict() == verdict).collect();
        if !of.is_empty() {
            out += &format!("{title}\n\n");
            of.into_iter().for_each(|result| bullet(&mut out, result));
            out += "\n";
        }
    }
    out + &said_of_flips(grasps)
}

fn said_of_all(reports: &[Comparison]) -> String {
    let all = || reports.iter().flat_map(|report| &report.results);
    let count = |verdict: Verdict| all().filter(|result| result.verdict() == verdict).count();
    let mut commits: Vec<&str> = reports.iter().map(|report| &*report.record.commit).collect();
    commits.dedup();
    let commits = match &commits[..] {
        [one] => format!("commit {one}"),
        several => format!("commits {}", several.join(", ")),
    };
    let alone = all().filter(|result| result.verdict() == Verdict::Won && result.best().is_none()).count();
    let mut said = format!(
        "{} comparisons of a scene with another engine ({commits}), each at the same steps for both: in {} ours solves the scene \
         and no run of the other engine is both faster and at least as accurate with any of its settings (in {alone} of these \
         it solves the scene at no step); in {} it is ahead; in {} neither solves the scene.",
        all().count(),
        count(Verdict::Won),
        count(Verdict::Lost),
        count(Verdict::Neither),
    );
    match count(Verdict::Unknown) {
        0 => {}
        n => said += &format!(" In {n} no run of the other engine ended in its time."),
    }
    let mut settings: Vec<String> = Vec::new();
    for report in reports {
        let steps: Vec<&[f64]> = report.results.iter().map(|result| &*result.steps_ms).collect();
        let at = steps.first().filter(|first| steps.iter().all(|it| it == *first));
        let at = at
            .map_or("the steps that both played".to_owned(), |steps_ms| format!("{} ms", numbers(steps_ms)));
        let peers = report.engines.iter().filter(|note| note.ran && note.name != EngineKind::Own.name());
        for note in peers {
            let names: Vec<String> =
                note.settings.iter().map(|choice| format!("`{}`", choice.name)).collect();
            let (name, version) = (&note.name, &note.version);
            let line = format!("{name} {version} with {} at {at}", names.join(", "));
            if !settings.contains(&line) {
                settings.push(line);
            }
        }
    }
    said += &format!(" Settings and steps: {}.", settings.join("; "));
    wrapped(&said) + "\n"
}

fn numbers(of: &[f64]) -> String {
    of.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
}

/// Number of the random grasps that each engine holds; each peer at every step with the settings that hold most there.
fn said_of_grasps(grasps: &Table) -> String {
    let hand = HandKind::SoftHand.name();
    let steps_ms = grasps.common_steps(hand);
    let sums = grasps.drawn_at(hand, &steps_ms);
    let mut engines: Vec<&str> = sums.iter().map(|sum| sum.engine).collect();
    engines.dedup();
    let said = engines.into_iter().map(|engine| {
        let of: Vec<&Sum> = sums.iter().filter(|sum| sum.engine == engine).collect();
        let most = |k: usize| of.iter().rev().max_by_key(|sum| sum.counts[k].kept);
        let kept: Vec<String> =
            (0..steps_ms.len()).filter_map(|k| Some(most(k)?.counts[k].kept.to_string())).collect();
        let mut names: Vec<String> =
            (0..steps_ms.len()).filter_map(|k| Some(format!("`{}`", most(k)?.settings))).collect();
        names.sort();
        names.dedup();
        let (name, with) = match engine == EngineKind::Own.name() {
            true => ("ours", String::new()),
            false => {
                (engine, format!(", with the best of its settings at each step ({}),", names.join(", ")))
            }
        };
        format!("{name}{with} holds {}", kept.join(", "))
    });
    let said = said.collect::<Vec<_>>().join("; ");
    let of = sums.iter().flat_map(|sum| &sum.counts).map(|count| count.of + count.not_finished).max();
    wrapped(&format!(
        "Random grasps of the SoftHand, chosen before any engine played them (commit {}, \
         [all counts](docs/report/grasps/README.md)), of {} at {} ms: {said}.",
        grasps.record.commit,
        of.unwrap_or(0),
        numbers(&steps_ms),
    )) + "\n"
}

/// How often the outcome of a grasp changes with the step.
fn said_of_flips(grasps: &Table) -> String {
    let hand = HandKind::SoftHand.name();
    let steps_ms = grasps.common_steps(hand);
    let sums = grasps.drawn_at(hand, &steps_ms);
    let own = sums.iter().filter(|sum| sum.engine == EngineKind::Own.name());
    let said = own.chain(best(&sums)).map(|Sum { engine, settings, flips, .. }| {
        let (name, with) = match *engine == EngineKind::Own.name() {
            true => ("ours", String::new()),
            false => (*engine, format!(" with `{settings}`")),
        };
        let (percent, grasps, of) = (flips.percent(), flips.grasps, flips.of);
        format!("{name}{with} {percent:.1} %, in {grasps} of {of} grasps")
    });
    wrapped(&format!(
        "Outcomes of these [grasps](report/grasps/README.md) that differ from one of the steps {} ms to the next longer one, \
         each peer with the settings with which it holds most: {}.",
        numbers(&steps_ms),
        said.collect::<Vec<_>>().join("; "),
    )) + "\n"
}

/// What a search over the options of the peers found.
fn said_of_search(search: &search::Table) -> String {
    let mut engines: Vec<(&str, &str)> = search.found.iter().map(|it| (&*it.engine, &*it.version)).collect();
    engines.sort_unstable();
    engines.dedup();
    let said = engines.into_iter().map(|(engine, version)| {
        let of = search.found.iter().filter(|found| found.engine == engine);
        let scenes = of.map(|found| {
            let (most, plays, sets) = (found.most(), found.plays, found.sets.len());
            match found.solving().next() {
                Some(best) => {
                    format!("`{}` {most} of {plays} with `{}` ({sets} sets)", found.scene, best.settings)
                }
                None => format!("`{}` none of {plays} ({sets} sets)", found.scene),
            }
        });
        format!("{engine} {version}: {}", scenes.collect::<Vec<_>>().join(", "))
    });
    wrapped(&format!(
        "[A search](docs/report/search/README.md) over the documented options of the other engines at {} ms, and the most plays \
         of a scene that any set of options solves: {}.",
        numbers(&search.steps_ms),
        said.collect::<Vec<_>>().join("; "),
    )) + "\n"
}

fn bullet(out: &mut String, result: &PeerResult) {
    let PeerResult { case, peer, own_done, steps_ms, .. } = result;
    let tried = steps_ms.len();
    let unfinished = result.settings.iter().map(|outcome| outcome.unfinished).min().unwrap_or(0);
    let ended = match unfinished {
        0 => String::new(),
        n => format!(" ({n} did not end in time)"),
    };
    let theirs = match result.surest() {
        None => format!("{peer} succeeds with 0 of {tried} step lengths{ended}"),
        Some(it) => {
            format!("{peer} with `{}` succeeds with {} of {tried} step lengths{ended}", it.settings, it.done)
        }
    };
    let beside = match (result.verdict(), result.best()) {
        (Verdict::Lost, _) => format!("; it is ahead at {}", result.ahead()),
        (_, Some(best)) => best
            .times_as_fast()
            .map_or(String::new(), |times| format!("; ours is {times}, beside `{}`", best.settings)),
        _ => String::new(),
    };
    let _ = writeln!(out, "- `{case}`: {theirs}, ours with {own_done}{beside}.");
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

    /// The best that a search finds has to be played at every step: then no expert finds a better set among those.
    #[test]
    fn no_set_of_a_search_serves_a_peer_better_than_its_named_settings() {
        let file = root().join(SEARCH);
        if !file.exists() {
            println!("skipped: there is no {SEARCH}");
            return;
        }
        let search = search::Table::read(&file).expect("it can be read");
        for found in &search.found {
            let (scene, engine, most) = (&found.scene, &found.engine, found.most());
            assert_eq!(
                found.most_named(),
                most,
                "{engine} in {scene}: name the set that solves {most} plays"
            );
        }
    }

    #[test]
    fn counted_grasps_have_one_origin() {
        let marked = documents(root()).expect("they are in the repository");
        for (file, text, _) in marked {
            let text = outside(&text).expect("it has marks");
            for words in [" of 144", "all 144", "% of the outcomes", "% of the grasps"] {
                let line = text.lines().find(|line| line.contains(words));
                assert_eq!(line, None, "{file}: only the claims tell counts of grasps");
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
