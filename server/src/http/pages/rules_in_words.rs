//! Panels next to the ranking: each task's rules, how to connect, and the legend. The viewer's script shows the same texts.

use crate::competition::rules::CompetitionPhase;
use maud::{Markup, html};
use palmares_protocol::reply::TaskInfo;

/// How to install the client. A team has the wheel, or the sources.
const INSTALL: &str = "pip install palmares-*.whl\n# in the sources: pip install -e client-py\n";

/// The phase of a competition as a sentence, or its pause.
pub(super) fn in_words(phase: CompetitionPhase, paused: bool) -> &'static str {
    match phase {
        CompetitionPhase::Closed | CompetitionPhase::Open if paused => {
            "The competition is paused: all clocks are stopped."
        }
        CompetitionPhase::Closed => {
            "The competition is not open: sessions can begin when the organizer opens it."
        }
        CompetitionPhase::Open => "The competition is open.",
        CompetitionPhase::Revealed => "The competition is over.",
    }
}

/// A task's rules.
pub(super) fn rules_of(task: &TaskInfo) -> Markup {
    let limit_s = task.time_limit_s.round() as u64;
    html! {
        section.panel.task {
            h3 { (task.name) }
            p { (task.description) }
            p.soft {
                "Time limit of a run: " (limit_s / 60) ":" (format!("{:02}", limit_s % 60)) " of simulated time. Tick: "
                ((1000.0 * task.tick_s).round()) " ms."
            }
        }
    }
}

/// How a program connects.
pub(super) fn connect(here: &str, phase: Option<CompetitionPhase>) -> Markup {
    html! {
        section.panel {
            h3 { "Connect" }
            @if phase.is_some() {
                p {
                    "Your team needs its token, which the organizers give you. Do not write it into programs or addresses; \
                     the Python client reads it from the environment:"
                }
                pre tabindex="0" {
                    (INSTALL)
                    "export PALMARES_TOKEN=plm_…   # your team's\n\
                     python -m palmares.examples.balls_softhand --url http://" (here)
                }
            } @else {
                p { "No token is needed. With the Python client:" }
                pre tabindex="0" {
                    (INSTALL) "python -m palmares.examples.balls_softhand --url http://" (here)
                }
            }
            p { a href="/docs/teams" { "How to write a controller" } }
            p {
                "Or with any WebSocket program: subprotocol " code { "palmares.v1.json" } ", address "
                code { "ws://" (here) "/v1/control" }
                @if phase.is_some() { ", and the token in the header " code { "Authorization: Bearer plm_…" } }
                "."
            }
        }
    }
}

/// The meaning of the columns and status marks.
pub(super) fn legend(phase: Option<CompetitionPhase>, replays: bool) -> Markup {
    html! {
        p {
            "Each task counts with the best score. With equal totals the earlier team is first. Sensors: rank among the \
             teams that used only sensor readings, never the true state. "
            @if phase.is_some() {
                b { "✓ verified" } ": the server has replayed the run and confirmed its score. "
                b { "… provisional" } ": not replayed yet; the score may still change. "
            }
            @if replays {
                "Click a score to see its replay."
            } @else if matches!(phase, Some(CompetitionPhase::Closed | CompetitionPhase::Open)) {
                "Replays become public when the competition is over."
            }
        }
    }
}
