//! README's table: a row a scene, a column an engine.

use super::comparison::{Comparison, Run, distinct};
use super::dominance::PeerResult;
use super::front_figure::{place, title};
use crate::engine::EngineKind;
use crate::grasps::table::Table;
use crate::scene_id;
use crate::trials::family::HandKind;
use palmares_bench::cases;
use std::fmt::Write;

/// The scenes of the table, in words.
const SCENES: [(&str, &str); 5] = [
    ("SoftHand on a cylinder", "softhand_cylinder"),
    ("SoftHand on a box", "softhand_box"),
    ("SoftHand among ten balls", "softhand_balls"),
    ("SoftHand in a heap of thirty objects", "thirty_objects_and_hand"),
    ("SoftHand closing in the air", "softhand_free"),
];
/// What is not known.
const NOTHING: &str = "not played";

/// The table, from reports and counted grasps of the engine that is built.
pub(super) fn table(reports: &[Comparison], grasps: Option<&Table>) -> String {
    let peers = peers(reports);
    let mut out = format!(
        "| | Palmares |{}\n",
        peers.iter().map(|peer| format!(" {} |", peer.shown())).collect::<String>()
    );
    let _ = writeln!(out, "|---|---|{}", "---|".repeat(peers.len()));
    let engines = || std::iter::once(EngineKind::Own.name()).chain(peers.iter().map(|peer| &*peer.name));
    for (words, case) in SCENES {
        let runs: Vec<&Run> =
            reports.iter().flat_map(|report| &report.runs).filter(|run| run.case == case).collect();
        if !runs.is_empty() {
            let cells = engines().map(|engine| format!(" {} |", cell(&runs, engine)));
            let _ = writeln!(out, "| {words} |{}", cells.collect::<String>());
        }
    }
    if let Some(grasps) = grasps {
        let cells = engines().map(|engine| format!(" {} |", kept(grasps, engine)));
        let _ = writeln!(out, "| drawn grasps of the SoftHand that hold |{}", cells.collect::<String>());
    }
    let rigid = rigid();
    let results =
        || reports.iter().flat_map(|report| &report.results).filter(|result| rigid.contains(&&*result.case));
    let medians = peers
        .iter()
        .map(|peer| format!(" {} |", median(results().filter(|result| result.peer == peer.name))));
    let _ =
        writeln!(out, "| rigid bodies, median of their time over ours | 1 |{}", medians.collect::<String>());
    out
}

/// An engine in the head of the table.
struct Peer {
    name: String,
    version: String,
}

impl Peer {
    fn shown(&self) -> String {
        format!("{} {}", title(&self.name), self.version)
    }
}

fn peers(reports: &[Comparison]) -> Vec<Peer> {
    let names = distinct(
        reports.iter().flat_map(|report| &report.engines).filter(|note| note.ran).map(|note| &note.name),
    );
    let version = |name: &str| {
        reports
            .iter()
            .flat_map(|report| &report.engines)
            .find(|note| note.ran && note.name == name)
            .map(|it| &*it.version)
    };
    let peers = names.into_iter().filter(|name| *name != EngineKind::Own.name());
    peers
        .map(|name| Peer { name: name.to_owned(), version: version(name).unwrap_or_default().to_owned() })
        .collect()
}

/// Of the runs with the longest step that solves the scene, the fastest.
fn cell(runs: &[&Run], engine: &str) -> String {
    let of: Vec<&&Run> = runs.iter().filter(|run| run.engine == engine).collect();
    let played: Vec<&&Run> = of.into_iter().filter(|run| !run.not_played).collect();
    let solving = played.iter().filter(|run| run.error.is_some() && run.does_it());
    let Some(longest) = solving.clone().map(|run| run.dt_ms).reduce(f64::max) else {
        return match (played.is_empty(), played.iter().any(|run| run.unfinished)) {
            (true, _) => NOTHING.to_owned(),
            (false, true) => "unfinished".to_owned(),
            (false, false) => "no step".to_owned(),
        };
    };
    let best = solving.filter(|run| run.dt_ms == longest).min_by(|a, b| a.cpu_s.total_cmp(&b.cpu_s));
    let Some(run) = best else { return NOTHING.to_owned() };
    let mut out = format!("{longest} ms; {} ms", digits(1e3 * run.cpu_s));
    if let Some(starts) = run.starts {
        let _ = write!(out, "; {} of {}", starts.done, starts.tried + starts.unfinished);
    }
    let overlap = run.starts.map_or(run.invariants.max_penetration_mm, |starts| starts.median_overlap_mm);
    if let Some(overlap) = overlap {
        let _ = write!(out, "; {} mm", digits(overlap));
    }
    out
}

/// The most grasps that an engine keeps at a step, with any of its settings, of the steps that a peer has played, too.
fn kept(grasps: &Table, engine: &str) -> String {
    let all = grasps.drawn(HandKind::SoftHand.name());
    let with_peers: Vec<bool> = (0..grasps.steps_ms.len())
        .map(|step| all.iter().any(|sum| sum.engine != EngineKind::Own.name() && sum.counts[step].of > 0))
        .collect();
    let sums = all.into_iter().filter(|sum| sum.engine == engine);
    let counts = sums.flat_map(|sum| grasps.steps_ms.iter().zip(&with_peers).zip(sum.counts));
    let counts = counts.filter(|((_, with_peers), count)| **with_peers && count.of > 0);
    let best = counts.map(|((step, _), count)| (step, count)).max_by_key(|(_, count)| count.kept);
    best.map_or(NOTHING.to_owned(), |(step, count)| format!("{} of {} at {step} ms", count.kept, count.of))
}

/// Names of the cases without a hand.
fn rigid() -> Vec<&'static str> {
    let peers = cases::all().filter(|case| case.peers);
    peers.filter(|case| !scene_id::of_case(case).hand).map(|case| case.name).collect()
}

/// Median of the least ratios of a peer's time to ours; a scene in which the peer is ahead comes before all others.
fn median<'a>(results: impl Iterator<Item = &'a PeerResult>) -> String {
    let mut ratios: Vec<f64> = results.filter_map(place).collect();
    ratios.sort_by(f64::total_cmp);
    match ratios.len() {
        0 => NOTHING.to_owned(),
        count => {
            let middle = (ratios[(count - 1) / 2] * ratios[count / 2]).sqrt();
            format!("{} in {count} scenes", digits(middle))
        }
    }
}

/// Two digits.
fn digits(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        size if size >= 10.0 => format!("{x:.0}"),
        size if size >= 1.0 => format!("{x:.1}"),
        size if size >= 0.1 => format!("{x:.2}"),
        _ => format!("{x:.1e}"),
    }
}
