//! The decisions of an import, by kind.

use palmares_hand_import::decision::{Decision, DecisionKind};
use palmares_protocol::text::printable;
use std::fmt::Write as _;

/// A section for each kind that there is. Of all but problems it has at most `most` lines; the others are comments in `folder`.
pub(crate) fn listed(decisions: &[Decision], most: usize, folder: &str) -> String {
    let mut out = String::new();
    for (kind, title) in [
        (DecisionKind::Taken, "Taken in other words"),
        (DecisionKind::Guessed, "Guessed"),
        (DecisionKind::Dropped, "Dropped"),
        (DecisionKind::Problem, "Problems"),
    ] {
        let found: Vec<&Decision> = decisions.iter().filter(|decision| decision.kind == kind).collect();
        if found.is_empty() {
            continue;
        }
        let _ = writeln!(out, "\n{title}: {}", found.len());
        let most = if kind == DecisionKind::Problem { found.len() } else { most };
        for decision in found.iter().take(most) {
            let file = decision.file.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
            let line = format!("{file}: {}: {}", decision.element, decision.text);
            let lines: Vec<_> = line.lines().map(printable).collect();
            let _ = writeln!(out, "  {}", lines.join("\n    "));
        }
        if found.len() > most {
            let more = found.len() - most;
            let _ = writeln!(out, "  … {more} more; --all prints them, and they are comments in {folder}");
        }
    }
    out
}
