//! The counts as a page to read.

use super::play::{MOVED_M, OVERLAP_M};
use super::table::{Cell, Row, Table};
use super::tally::{Count, Flips, wilson};
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
            let rows: Vec<&Row> =
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
    let machine = &table.machine;
    put!(page, "# Grasps, counted\n");
    put!(page, "Written by `palmares-bench grasps`; do not edit.\n");
    put!(page, "Commit {}; {}, {}.\n", table.commit, machine.processor, machine.system);
    put!(
        page,
        "The hand stands palm down over an object on a pedestal, closes, lifts it by 10 cm, holds it still for 1.5 s and shakes \
        it by ±3 cm at 3 Hz for 2 s. Objects and placements are uniform random draws from ranges and a seed that were \
        written down before any engine had played them (`bench/src/grasps/family.rs`): the first {} of each family. \
        A grasp is *kept* if the object is lifted by more than 5 cm, from half a second after the lift until the end \
        moves by less than {:.0} mm in the palm and is nowhere deeper than {:.0} mm in the hand, and if every step converges. That is judged \
        from poses alone, by the same code for all engines. Beside the count stands Wilson's interval at 95 %. *+n deep*: so many more would be kept, were they not \
        too deep. A *flip* is a change of the outcome from one step to the next longer one. Runs that took too long are not \
        counted. Peers play the SoftHand alone: they have no tendons whose R depends on q.\n",
        table.placements,
        1e3 * MOVED_M,
        1e3 * OVERLAP_M,
    );
}

fn columns(page: &mut String, table: &Table) {
    let steps: String = table.steps_ms.iter().map(|step| format!(" {step} ms |")).collect();
    put!(page, "| engine |{steps} flips | grasps that flip | overlap |");
    put!(page, "|---|{}---|---|---|", "---|".repeat(table.steps_ms.len()));
}

fn rows_of(page: &mut String, table: &Table, rows: &[&Row]) {
    columns(page, table);
    for row in rows {
        let counts: Vec<Count> = row.cells.iter().map(|cell| cell.count).collect();
        line(page, &row.engine, &row.settings, &counts, row.flips, depth(&row.cells));
    }
    page.push('\n');
}

fn line(page: &mut String, engine: &str, settings: &str, counts: &[Count], flips: Flips, depth: Option<f64>) {
    let cells: String = counts.iter().map(|count| format!(" {} |", words(count))).collect();
    let percent = 100.0 * flips.flips as f64 / flips.pairs.max(1) as f64;
    let depth = depth.map_or("–".to_owned(), |mm| format!("{mm:.2} mm"));
    put!(
        page,
        "| {engine} `{settings}` |{cells} {} of {} ({percent:.1} %) | {} of {} | {depth} |",
        flips.flips,
        flips.pairs,
        flips.grasps,
        flips.of
    );
}

/// `17 of 24 (51–85 %)`, and what else happened.
fn words(count: &Count) -> String {
    if count.of + count.not_finished == 0 {
        return "–".to_owned();
    }
    let [low, high] = wilson(count.kept, count.of).map(|p| 100.0 * p);
    let mut words = format!("{} of {} ({low:.0}–{high:.0} %)", count.kept, count.of);
    for (number, what) in
        [(count.overlapping, "deep"), (count.diverged, "diverged"), (count.not_finished, "not finished")]
    {
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
    let of_hand = |row: &&Row| row.hand == hand && !row.family.starts_with("case_");
    put!(page, "### All drawn families together, {hand}\n");
    columns(page, table);
    for [engine, settings, _] in &table.engines {
        let rows: Vec<&Row> = table
            .rows
            .iter()
            .filter(of_hand)
            .filter(|row| row.engine == *engine && row.settings == *settings)
            .collect();
        if rows.is_empty() {
            continue;
        }
        let counts: Vec<Count> = (0..table.steps_ms.len())
            .map(|k| rows.iter().fold(Count::default(), |sum, row| sum + row.cells[k].count))
            .collect();
        let flips = rows.iter().fold(Flips::default(), |sum, row| sum + row.flips);
        line(page, engine, settings, &counts, flips, None);
    }
    page.push('\n');
}
