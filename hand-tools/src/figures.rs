//! Tables of a hand's figures, compared with the built-in hands and the limits, and of its trials.

use crate::table::{table, wrapped};
use crate::trial::Trial;
use palmares_models::measure::number;
use palmares_tasks::Fault;
use palmares_tasks::inspect::FigureRow;
use std::fmt::Write as _;

/// Number of other hands that have a column each; of more, the least and the largest value are shown.
const MAX_OTHERS: usize = 4;

/// The table of figures, with remarks; it has at most `width` columns.
pub fn figures(name: &str, rows: &[FigureRow], width: Option<usize>) -> String {
    let others: Vec<String> = {
        let mut names: Vec<&String> = rows.iter().flat_map(|row| row.others.keys()).collect();
        names.sort();
        names.dedup();
        names.into_iter().filter(|other| *other != name).cloned().collect()
    };
    let mut head = vec!["figure".to_owned(), "unit".to_owned(), name.to_owned()];
    let many = others.len() > MAX_OTHERS;
    let range = ["least of others", "most of others"].map(str::to_owned);
    head.extend(if many { range.to_vec() } else { others.clone() });
    head.extend(["limit".to_owned(), String::new()]);
    let mut cells = vec![head];
    let shown = |value: Option<f64>| value.map_or("-".to_owned(), number);
    for row in rows {
        let mut line = vec![row.figure.clone(), row.unit.clone(), shown(row.value)];
        let values = others.iter().map(|other| row.others.get(other).copied());
        if many {
            let known: Vec<f64> = values.flatten().collect();
            line.push(shown(known.iter().copied().reduce(f64::min)));
            line.push(shown(known.iter().copied().reduce(f64::max)));
        } else {
            line.extend(values.map(shown));
        }
        let side = if row.bound == "least" { "≥" } else { "≤" };
        line.push(row.limit.map_or("none".to_owned(), |limit| format!("{side} {}", number(limit))));
        line.push(match (row.allowed, row.beyond_others) {
            (false, _) => "NOT ALLOWED".to_owned(),
            (true, true) => "beyond all".to_owned(),
            (true, false) => String::new(),
        });
        cells.push(line);
    }
    let mut out = wrapped(&cells, 3, 1, width);
    for row in rows.iter().filter(|row| !row.allowed || row.beyond_others) {
        let _ = writeln!(out, "  {}", row.in_words());
    }
    out
}

/// The table of trials.
pub(crate) fn trials(played: &[Trial], refused: &[String]) -> String {
    let head = ["task", "script", "score", "fault", "beyond a limit", "joint", "motors' work (J)"];
    let mut cells = vec![head.map(str::to_owned).to_vec()];
    let mut notes = String::new();
    for trial in played {
        let script = format!("{:?}", trial.script).to_lowercase();
        cells.push(vec![
            trial.task.clone(),
            script.clone(),
            number(trial.score),
            trial.fault_code.map_or("none", Fault::code).to_owned(),
            number(trial.limit_excess),
            trial.joint.clone().unwrap_or("-".to_owned()),
            number(trial.motor_work_j),
        ]);
        for flag in &trial.flags {
            let _ = writeln!(notes, "  LOOK: {}, {script}: {flag}", trial.task);
        }
    }
    for why in refused {
        let _ = writeln!(notes, "  NOT PLAYED: {why}");
    }
    table(&cells) + &notes
}
