//! The counts as a page to read.

use super::cell::Cell;
use super::row::OutcomeRow;
use super::table::{Sum, Table, best};
use super::tally::{Count, wilson};
use crate::engine::EngineKind;
use crate::peer_key::Kept;
use crate::trials::play::{MOVED_M, OVERLAP_M};
use palmares_bench::rigs::softhand_in_words;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Writing into a string cannot fail.
macro_rules! put {
    ($page:expr, $($argument:tt)*) => {{ let _ = writeln!($page, $($argument)*); }};
}

/// Markdown.
pub(super) fn write(table: &Table) -> String {
    let mut page = String::new();
    head(&mut page, table);
    let mut hands: Vec<&str> = table.rows.iter().map(|row| &*row.hand).collect();
    hands.dedup();
    for hand in hands {
        put!(page, "## {hand}\n");
        for [family, about] in &table.families {
            let rows: Vec<&OutcomeRow> =
                table.rows.iter().filter(|row| row.hand == hand && row.family == *family).collect();
            if !rows.is_empty() {
                put!(page, "### {family}\n\n{about}.\n");
                if family == "catalogue" {
                    put!(page, "{}.\n", table.catalogue.join(", "));
                }
                rows_of(&mut page, table, &rows);
            }
        }
        all_families(&mut page, table, hand);
    }
    put!(page, "## The engines' settings\n");
    for [engine, settings, about] in &table.engines {
        put!(page, "- **{engine}** `{settings}`: {about}");
    }
    page
}

fn head(page: &mut String, table: &Table) {
    put!(page, "# Grasps, counted\n");
    put!(page, "Written by `palmares-compare grasps`; do not edit.\n");
    put!(page, "{}\n", table.record.line());
    put!(
        page,
        "The hand stands palm down over an object on a pedestal, closes, lifts it by 10 cm, holds it still for 1.5 s and shakes \
        it by ±3 cm at 3 Hz for 2 s. Objects and placements are uniform random draws from ranges and a seed that were \
        written down before any engine had played them (`compare/src/trials/family.rs`): the first {} of each family. \
        A grasp is *kept* if the object is lifted by more than 5 cm, from half a second after the lift until the end \
        moves by less than {:.0} mm in the palm and is nowhere deeper than {:.0} mm in the hand, and if every step converges. That is judged \
        from poses alone, by the same code for all engines. Beside the count stands Wilson's interval at 95 %. *+n deep*: so many more would be kept, were they not \
        too deep. A *flip* is a change of the outcome from one step to the next longer one. Steps at which nothing was played show a dash. \
        The settings with which a peer keeps most are named below each table. Peers play the SoftHand alone: their adapters pass on no tendons whose R depends on q. {}\n",
        table.placements,
        1e3 * MOVED_M,
        1e3 * OVERLAP_M,
        softhand_in_words(),
    );
    let mut kept: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for cell in table.rows.iter().flat_map(|row| &row.cells) {
        if let Some(Kept { commit, date, .. }) = &cell.kept {
            *kept.entry((date, commit)).or_default() +=
                cell.count.of + cell.count.not_finished + cell.count.not_played;
        }
    }
    if !kept.is_empty() {
        let of = |((date, commit), runs): (&(&str, &str), &usize)| {
            format!("{runs} runs of commit {commit} of {date}")
        };
        let origins: Vec<String> = kept.iter().map(of).collect();
        put!(page, "Peers do not change with our engine, and their runs are kept: {}.\n", origins.join("; "));
    }
    if let Some(pairs) = &table.before {
        put!(
            page,
            "The engine of commit {} before ours keeps {} of the same {} plays; ours loses {} of these and keeps {} others. By \
             grasp, kept at most of its steps, ours loses {} and gains {} of {} (McNemar's exact test: p = {:.3}).\n",
            pairs.commit,
            pairs.kept_before,
            pairs.plays,
            pairs.lost,
            pairs.gained,
            pairs.grasps_lost,
            pairs.grasps_gained,
            pairs.grasps,
            pairs.p()
        );
    }
    let is_played = |kind: &EngineKind| {
        table.rows.iter().any(|row| (&*row.engine, &*row.settings) == (kind.name(), kind.settings()))
    };
    let left_out: Vec<String> =
        EngineKind::NAMES.iter().filter_map(|name| not_played(name, is_played)).collect();
    if !left_out.is_empty() {
        put!(page, "Not played: {}.\n", left_out.join("; "));
    }
    if table.rows.iter().flat_map(|row| &row.cells).any(|cell| cell.count.not_played > 0) {
        put!(
            page,
            "*+n not played*: so many objects have what the peer's adapter does not pass on, such as friction against rolling; they are \
             not counted.\n"
        );
    }
    if let Some(limit_s) = table.run_limit_cpu_s {
        put!(
            page,
            "A run of a peer that takes more than {limit_s} s of CPU time is not finished and not counted.\n"
        );
    }
}

/// The settings of an engine for grasps that are not played; the engine alone if none are.
fn not_played(engine: &str, is_played: impl Fn(&EngineKind) -> bool) -> Option<String> {
    let (played, left_out): (Vec<_>, Vec<_>) = EngineKind::all()
        .filter(|kind| kind.name() == engine && kind.plays_grasps())
        .partition(|kind| is_played(kind));
    let settings: Vec<String> = left_out.iter().map(|kind| format!("`{}`", kind.settings())).collect();
    match (played.is_empty(), left_out.is_empty()) {
        (_, true) => None,
        (true, false) => Some(engine.to_owned()),
        (false, false) => Some(format!("of {engine} {}", settings.join(", "))),
    }
}

fn columns(page: &mut String, table: &Table) {
    let steps: String = table.steps_ms.iter().map(|step| format!(" {step} ms |")).collect();
    put!(page, "| engine |{steps} flips | grasps that flip | overlap |");
    put!(page, "|---|{}---|---|---|", "---|".repeat(table.steps_ms.len()));
}

fn rows_of(page: &mut String, table: &Table, rows: &[&OutcomeRow]) {
    columns(page, table);
    let sums: Vec<Sum> = rows.iter().map(|row| Sum::of(row)).collect();
    for (row, sum) in rows.iter().zip(&sums) {
        line(page, sum, depth(&row.cells));
    }
    at_their_best(page, &sums);
}

fn line(page: &mut String, sum: &Sum, depth: Option<f64>) {
    let Sum { engine, settings, counts, flips } = sum;
    let cells: String = counts.iter().map(|count| format!(" {} |", words(count))).collect();
    let depth = depth.map_or("–".to_owned(), |mm| format!("{mm:.2} mm"));
    put!(
        page,
        "| {engine} `{settings}` |{cells} {} of {} ({:.1} %) | {} of {} | {depth} |",
        flips.flips,
        flips.pairs,
        flips.percent(),
        flips.grasps,
        flips.of
    );
}

fn at_their_best(page: &mut String, sums: &[Sum]) {
    page.push('\n');
    for sum in best(sums) {
        let (Sum { engine, settings, .. }, all) = (sum, sum.all());
        match all.kept {
            0 => put!(page, "{engine} keeps none.\n"),
            kept => put!(page, "{engine} at its best: `{settings}`, {kept} of {} over all steps.\n", all.of),
        }
    }
}

/// `17 of 24 (51–85 %)`, and what else happened.
fn words(count: &Count) -> String {
    if count.of + count.not_finished + count.not_played == 0 {
        return "–".to_owned();
    }
    if count.of + count.not_finished == 0 {
        return "not played".to_owned();
    }
    let [low, high] = wilson(count.kept, count.of).map(|p| 100.0 * p);
    let mut words = format!("{} of {} ({low:.0}–{high:.0} %)", count.kept, count.of);
    for (number, what) in [
        (count.overlapping, "deep"),
        (count.diverged, "diverged"),
        (count.not_finished, "not finished"),
        (count.not_played, "not played"),
    ] {
        if number > 0 {
            let _ = write!(words, " +{number} {what}");
        }
    }
    words
}

/// Median overlap at the step in the middle.
fn depth(cells: &[Cell]) -> Option<f64> {
    cells.get(cells.len() / 2)?.overlap_mm
}

/// All drawn families together.
fn all_families(page: &mut String, table: &Table, hand: &str) {
    put!(page, "### All drawn families together, {hand}\n");
    columns(page, table);
    let sums = table.drawn(hand);
    sums.iter().for_each(|sum| line(page, sum, None));
    at_their_best(page, &sums);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_engine_of_which_nothing_is_played_is_named_alone() {
        assert_eq!(not_played("drake", |_| false).as_deref(), Some("drake"));
        assert_eq!(not_played("drake", |_| true), None);
        let text = not_played("rapier", |kind| kind.settings() == "default").expect("some are left out");
        assert!(text.starts_with("of rapier `stiff120`, ") && !text.contains("default"), "{text}");
    }
}
