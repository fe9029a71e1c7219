//! The leaderboard as plain HTML, which a script keeps up to date where there is one.

use super::shell::{Page, answer};
use crate::competition::Competition;
use crate::names::printable;
use crate::problem::Problem;
use crate::rules::Phase;
use crate::store::{LeaderboardRow, Store, TaskBest};
use axum::extract::State;
use axum::http::HeaderMap;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, HOST};
use axum::response::IntoResponse;
use maud::{Markup, html};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Address of the style sheet of a server without its viewer.
pub(super) const PLAIN: &str = "/assets/plain.css";

/// `GET /`.
pub(in crate::http) async fn leaderboard(
    State(competition): State<Arc<Competition>>,
    State(store): State<Store>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    let rows = store.leaderboard(competition.rules.official()).await?;
    let here = headers.get(HOST).and_then(|value| value.to_str().ok()).unwrap_or("127.0.0.1:8080");
    let tasks: Vec<&str> = competition.tasks.iter().map(|task| task.name.as_str()).collect();
    let phase = competition.rules.official().then(|| competition.rules.phase());
    let title = if phase.is_some() { competition.rules.name.as_str() } else { "Practice leaderboard" };
    let body = render(&rows, &tasks, here, title, phase);
    let page = Page {
        name: "leaderboard",
        argument: "",
        title: "Leaderboard",
        body,
        plain_style: Some(PLAIN),
        refresh_s: Some(10),
    };
    Ok(answer(&page, &competition))
}

/// `GET /assets/plain.css`.
pub(in crate::http) async fn plain_style() -> impl IntoResponse {
    ([(CONTENT_TYPE, "text/css"), (CACHE_CONTROL, "no-cache")], include_str!("plain.css"))
}

/// `phase`: of an official competition.
fn render(rows: &[LeaderboardRow], tasks: &[&str], here: &str, title: &str, phase: Option<Phase>) -> Markup {
    html! {
        div.title { h1 { "Leaderboard" } p.lead { (name(title)) } }
        @match (rows.is_empty(), phase) {
            (false, _) => (table(rows, tasks)),
            (true, None) => (empty(here)),
            (true, Some(phase)) => (empty_official(here, phase)),
        }
        footer {
            p {
                "Best score of each task; equal totals: the earlier first. A score marked … is not verified yet. Sensors: \
                 place among the teams that never saw the true state of the world. "
                a href="/v1/leaderboard" { "as JSON" } " " a href="/v1/leaderboard.csv" { "as CSV" }
            }
        }
    }
}

fn empty(here: &str) -> Markup {
    html! {
        section.empty {
            h2 { "No finished run yet" }
            p { "Start a client and close a run, and its team appears here:" }
            pre {
                "pip install ./client-py\npython client-py/examples/balls_softhand.py --url http://" (here)
            }
            p {
                "or connect a WebSocket of your own to " code { "ws://" (here) "/v1/control" }
                " with the subprotocol " code { "palmares.v1.json" } "."
            }
        }
    }
}

fn empty_official(here: &str, phase: Phase) -> Markup {
    let now = match phase {
        Phase::Closed => "The competition is not open: sessions can begin when the organizer opens it.",
        Phase::Open => "The competition is open.",
        Phase::Revealed => "The competition is over.",
    };
    html! {
        section.empty {
            h2 { "No finished run yet" }
            p { (now) }
            p {
                "A team needs its token: the organizer makes it and gives it to the team. Keep it out of programs and \
                 addresses; the Python client reads it from the environment:"
            }
            pre {
                "export PALMARES_TOKEN=plm_…   # your team's\n\
                 python client-py/examples/balls_softhand.py --url http://" (here)
            }
            p {
                "A WebSocket of your own to " code { "ws://" (here) "/v1/control" } ", subprotocol "
                code { "palmares.v1.json" } ", sends it in the header " code { "Authorization: Bearer plm_…" } "."
            }
        }
    }
}

fn table(rows: &[LeaderboardRow], tasks: &[&str]) -> Markup {
    // Tasks of today first, then those that only old runs know.
    let old: BTreeSet<&str> = rows.iter().flat_map(|row| row.tasks.keys().map(String::as_str)).collect();
    let columns: Vec<&str> =
        tasks.iter().copied().chain(old.into_iter().filter(|name| !tasks.contains(name))).collect();
    html! {
        div.scroll {
            table {
                thead {
                    tr {
                        th.n scope="col" { "Rank" }
                        th scope="col" { "Team" }
                        th.n scope="col" { "Total" }
                        @for task in &columns { th.n scope="col" { (task) } }
                        th.n scope="col" { "Sensors" }
                        th.n scope="col" { "Runs" }
                    }
                }
                tbody {
                    @for row in rows {
                        tr {
                            td.n.rank { (row.rank) }
                            th scope="row" { (name(&row.team)) }
                            td.n.total { (points(row.total)) }
                            @for task in &columns { (cell(task, row.tasks.get(*task))) }
                            td.n data-label="Sensors" {
                                @if let Some(rank) = row.sensors_rank { (rank) } @else { "–" }
                            }
                            td.n data-label="Runs" { (row.runs) }
                        }
                    }
                }
            }
        }
    }
}

/// A team's best score of a task.
fn cell(task: &str, best: Option<&TaskBest>) -> Markup {
    html! {
        @if let Some(best) = best {
            td.n data-label=(task) {
                a href={ "/v1/runs/" (best.run_id) } title=(best.status) {
                    (points(best.score)) @if best.status == "provisional" { " …" }
                }
            }
        } @else {
            td.n.none data-label=(task) { "–" }
        }
    }
}

/// Points with one decimal and a true minus sign.
fn points(score: f64) -> String {
    // Adding zero turns −0 into 0.
    format!("{:.1}", score + 0.0).replace('-', "−")
}

/// A name: its direction of writing is its own, and what cannot be seen in it is spelt.
fn name(text: &str) -> Markup {
    html! { bdi { (printable(text)) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(team: &str) -> LeaderboardRow {
        let best =
            TaskBest { score: 3.5, run_id: "run_1".into(), status: "practice".into(), ended_unix_ms: 0 };
        LeaderboardRow {
            rank: 1,
            team: team.into(),
            total: -0.5,
            runs: 2,
            reached_unix_ms: 0,
            sensors_only: false,
            sensors_rank: None,
            tasks: [("balls".to_owned(), best)].into(),
        }
    }

    #[test]
    fn what_a_team_calls_itself_is_text() {
        let page = render(&[row("<script>alert('x')</script>\"&")], &["balls"], "h", "t", None).into_string();
        assert!(page.contains("&lt;script&gt;alert('x')&lt;/script&gt;&quot;&amp;"));
        assert!(!page.contains("<script"));
    }

    #[test]
    fn every_task_has_a_column_also_when_only_old_runs_know_it() {
        let page = render(&[row("a")], &["shelf"], "h", "t", None).into_string();
        assert!(page.contains(">shelf</th>") && page.contains(">balls</th>"));
        assert!(page.contains("class=\"n none\" data-label=\"shelf\">–<") && page.contains("−0.5"));
    }

    #[test]
    fn a_score_says_whether_it_is_verified_and_who_needs_sensors_only() {
        let mut early = row("a");
        early.sensors_rank = Some(7);
        early.tasks.insert(
            "shelf".into(),
            TaskBest { status: "provisional".into(), ..early.tasks["balls"].clone() },
        );
        let page = render(&[early], &["balls", "shelf"], "h", "t", None).into_string();
        assert!(page.contains("title=\"provisional\">3.5 …<") && page.contains(">7</td>"), "{page}");
    }

    #[test]
    fn an_empty_leaderboard_tells_how_to_fill_it() {
        let page = render(&[], &["balls"], "app:1\"><script>", "<i>", None).into_string();
        assert!(page.contains("ws://app:1&quot;&gt;&lt;script&gt;/v1/control"));
        assert!(page.contains("<p class=\"lead\"><bdi>&lt;i&gt;</bdi></p>"));
        assert!(!page.contains("PALMARES_TOKEN"));
    }

    #[test]
    fn an_empty_official_one_says_that_a_token_is_needed_and_whether_it_is_open() {
        let said = [(Phase::Closed, "is not open"), (Phase::Open, "is open."), (Phase::Revealed, "is over")];
        for (phase, words) in said {
            let page = render(&[], &["balls"], "app:1", "Cup", Some(phase)).into_string();
            for part in [words, "PALMARES_TOKEN=", "Authorization: Bearer"] {
                assert!(page.contains(part), "{part}: {page}");
            }
        }
    }

    #[test]
    fn a_name_keeps_its_direction_to_itself_and_hides_nothing() {
        let page = render(&[row("\u{202e}sbarc"), row("\u{200b}")], &["balls"], "h", "t", None).into_string();
        assert!(
            page.contains("<bdi>\\u{202E}sbarc</bdi>") && page.contains("<bdi>\\u{200B}</bdi>"),
            "{page}"
        );
        assert!(!page.contains('\u{202e}'));
    }
}
