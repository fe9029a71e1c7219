//! The result of a search as a page to read.

use super::table::{Found, Table};
use palmares_bench::rigs::softhand_in_words;
use std::fmt::Write;

/// Sets that a scene's table shows.
const SHOWN: usize = 12;

/// Markdown.
pub(super) fn write(table: &Table) -> String {
    let steps = table.steps_ms.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let mut page = format!(
        "# What the options of other engines give\n\n\
         Written by `palmares-compare search`; do not edit.\n\n\
         {}\n\n\
         {} The search begins with the named settings of the [report](../README.md#the-engines-and-their-settings). Then it changes one \
         documented option at a time of the best set whose changes were not tried yet. Options have the names of the engine's \
         own documentation. In each of these rounds all sets play a few plays, the best third of them twice as many, and so on, \
         until the best ones have played all (successive halving); where no set solves any play yet, all that end equally go on. The order of the plays is drawn for the scene. \
         A scene is played at {steps} ms, a case from several starts that differ by at most a tenth of a \
         millimetre; `grasps` are the first of each family of [drawn grasps](../grasps/README.md). \
         The number of plays that solve the scene decides, then how the others end, then the deepest \
         overlap. It says what a set does at these steps; the report says what the named settings do at all. \
         A search ends where its time is over, if need be within a round: the sets that it tried last have few plays then, and say \
         little. `search.json` has every play; `--go-on` plays what it does not have.\n\n\
         | scene | engine | sets tried | sets that played all | sets that solve any play | most plays solved | by named settings |\n\
         |---|---|---|---|---|---|---|\n",
        table.record.line(),
        softhand_in_words()
    );
    for found in &table.found {
        let Found { scene, engine, version, plays, sets, .. } = found;
        let solved = |solved: Option<usize>| solved.map_or("–".to_owned(), |n| format!("{n} of {plays}"));
        let (most, named) = (solved(found.most()), solved(found.most_named()));
        let _ = writeln!(
            page,
            "| {scene} | {engine} {version} | {} | {} | {} | {most} | {named} |",
            sets.len(),
            found.whole().count(),
            found.solving().count(),
        );
    }
    for found in &table.found {
        let _ = writeln!(
            page,
            "\n## {} on {}\n\n| options | plays solved |\n|---|---|",
            found.scene, found.engine
        );
        for set in found.sets.iter().take(SHOWN) {
            let unfinished = match set.unfinished {
                0 => String::new(),
                n => format!(", {n} more unfinished"),
            };
            let _ = writeln!(page, "| `{}` | {} of {}{unfinished} |", set.settings, set.solved, set.of);
        }
    }
    page
}
