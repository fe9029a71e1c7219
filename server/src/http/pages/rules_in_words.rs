//! Text of the leaderboard page: the rules of each task, how to connect, and the legend.

use crate::rules::CompetitionPhase;
use maud::{Markup, html};
use palmares_protocol::reply::TaskInfo;

/// The phase of a competition.
pub(super) fn in_words(phase: CompetitionPhase) -> &'static str {
    match phase {
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
                "A run lasts at most " (limit_s / 60) ":" (format!("{:02}", limit_s % 60)) " of simulated time, a tick "
                ((1000.0 * task.tick_s).round()) " ms."
            }
        }
    }
}

/// How to connect a program.
pub(super) fn connect(here: &str, phase: Option<CompetitionPhase>) -> Markup {
    html! {
        section.panel {
            h3 { "Connect" }
            @if phase.is_some() {
                p {
                    "A team needs its token: the organizer makes it and gives it to the team. Keep it out of programs and \
                     addresses; the Python client reads it from the environment:"
                }
                pre tabindex="0" {
                    "export PALMARES_TOKEN=plm_…   # your team's\n\
                     python -m palmares.examples.balls_softhand --url http://" (here)
                }
            } @else {
                p { "No token is needed. With the Python client:" }
                pre tabindex="0" {
                    "pip install ./client-py\npython -m palmares.examples.balls_softhand --url http://" (here)
                }
            }
            p {
                "Or any program that speaks WebSocket, subprotocol " code { "palmares.v1.json" } ", to "
                code { "ws://" (here) "/v1/control" }
                @if phase.is_some() { ", with the token in the header " code { "Authorization: Bearer plm_…" } }
                "."
            }
        }
    }
}

/// The legend.
pub(super) fn legend(phase: Option<CompetitionPhase>, replays: bool) -> Markup {
    html! {
        p {
            "Best score of each task; equal totals: the earlier first. Sensors: place among the teams that never saw the \
             true state of the world. "
            @if phase.is_some() {
                b { "✓ verified" } ": the server has played the run's replay again and found the same score. "
                b { "… provisional" } ": it has not yet; the score may still fall. "
            }
            @if replays {
                "A score opens its replay."
            } @else if matches!(phase, Some(CompetitionPhase::Closed | CompetitionPhase::Open)) {
                "Replays open when the competition is over."
            }
        }
    }
}
