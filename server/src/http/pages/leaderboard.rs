//! The leaderboard as plain HTML, which a script keeps up to date where there is one.

use super::assets::is_built;
use super::rules_in_words::{connect, in_words, legend, rules_of};
use super::shell::{Page, answer};
use crate::archive::Archive;
use crate::auth::sha256_hex;
use crate::competition::Competition;
use crate::names::printable;
use crate::problem::Problem;
use crate::rules::Phase;
use crate::store::{LeaderboardRow, Store, TaskBest};
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, ETAG, HOST, IF_NONE_MATCH, X_CONTENT_TYPE_OPTIONS};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use maud::{Markup, html};
use palmares_protocol::reply::TaskInfo;
use std::collections::BTreeSet;
use std::sync::{Arc, LazyLock};

/// Address of the style sheet of a server without its viewer.
pub(super) const PLAIN: &str = "/assets/plain.css";

const STYLE: &str = include_str!("plain.css");

/// What the page shows.
struct Shown<'a> {
    rows: &'a [LeaderboardRow],
    tasks: &'a [TaskInfo],
    /// Name and port under which the reader found the server.
    here: &'a str,
    title: &'a str,
    /// Of an official competition.
    phase: Option<Phase>,
    /// Whether the reader may see replays, and the server has a page for them.
    replays: bool,
}

/// `GET /`.
pub(in crate::http) async fn leaderboard(
    State(archive): State<Option<Arc<Archive>>>,
    State(competition): State<Arc<Competition>>,
    State(store): State<Store>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    let rules = &competition.rules;
    let rows = store.leaderboard(rules.official()).await?;
    let phase = rules.official().then(|| rules.phase());
    let body = render(&Shown {
        rows: &rows,
        tasks: &competition.task_infos(),
        here: headers.get(HOST).and_then(|value| value.to_str().ok()).unwrap_or("127.0.0.1:8080"),
        title: if phase.is_some() { rules.name.as_str() } else { "Practice leaderboard" },
        phase,
        replays: matches!(phase, None | Some(Phase::Revealed)) && archive.is_some() && is_built("replay"),
    });
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
pub(in crate::http) async fn plain_style(headers: HeaderMap) -> Response {
    static TAG: LazyLock<String> = LazyLock::new(|| format!("\"{}\"", sha256_hex(STYLE.as_bytes())));
    let known = headers.get(IF_NONE_MATCH).is_some_and(|tag| tag.as_bytes() == TAG.as_bytes());
    let head = [
        (CONTENT_TYPE, "text/css"),
        (CACHE_CONTROL, "no-cache"),
        (ETAG, TAG.as_str()),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ];
    if known { (StatusCode::NOT_MODIFIED, head).into_response() } else { (head, STYLE).into_response() }
}

/// The viewer's script replaces what is in `board` and `tasks`, and the footer.
fn render(shown: &Shown<'_>) -> Markup {
    html! {
        div.title { h1 { "Leaderboard" } p.lead { (name(shown.title)) } }
        div id="board" {
            @if let Some(phase) = shown.phase { p.board-line { (in_words(phase)) } }
            @if shown.rows.is_empty() {
                section.empty {
                    h2 { "No finished run yet" }
                    p { "Start a client and close a run, and its team appears here. How to connect stands on this page." }
                }
            } @else {
                (table(shown))
            }
        }
        section id="tasks" {
            h2 { "Tasks" }
            @for task in shown.tasks { (rules_of(task)) }
            (connect(shown.here, shown.phase))
        }
        footer {
            (legend(shown.phase, shown.replays))
            p { a href="/v1/leaderboard" { "as JSON" } " " a href="/v1/leaderboard.csv" { "as CSV" } }
        }
    }
}

fn table(shown: &Shown<'_>) -> Markup {
    // Tasks of today first, then those that only old runs know.
    let today: Vec<&str> = shown.tasks.iter().map(|task| task.name.as_str()).collect();
    let old: BTreeSet<&str> =
        shown.rows.iter().flat_map(|row| row.tasks.keys().map(String::as_str)).collect();
    let columns: Vec<&str> =
        today.iter().copied().chain(old.into_iter().filter(|name| !today.contains(name))).collect();
    html! {
        div.scroll {
            table.cards.board {
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
                    @for row in shown.rows {
                        tr {
                            td.n.rank { (row.rank) }
                            th scope="row" { (name(&row.team)) }
                            td.n.total { (points(row.total)) }
                            @for task in &columns { (cell(task, row.tasks.get(*task), shown.replays)) }
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

/// A team's best score of a task, which leads to its replay or to what is stored of the run.
fn cell(task: &str, best: Option<&TaskBest>, replays: bool) -> Markup {
    html! {
        @if let Some(best) = best {
            td.n data-label=(task) {
                a href={ (if replays { "/replay/" } else { "/v1/runs/" }) (best.run_id) } title=(best.status) {
                    (points(best.score)) (mark(&best.status))
                }
            }
        } @else {
            td.n.none data-label=(task) { "–" }
        }
    }
}

/// Whether a score is verified.
fn mark(status: &str) -> &'static str {
    match status {
        "verified" => " ✓",
        "provisional" => " …",
        _ => "",
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

    fn task(name: &str) -> TaskInfo {
        let description = format!("Do {name}.");
        let (name, cameras) = (name.into(), vec![]);
        TaskInfo {
            name,
            description,
            tick_s: 0.01,
            step_s: 0.001,
            time_limit_s: 600.0,
            hash: String::new(),
            cameras,
        }
    }

    fn shown(
        rows: &[LeaderboardRow],
        tasks: &[&str],
        here: &str,
        title: &str,
        phase: Option<Phase>,
    ) -> String {
        let tasks: Vec<TaskInfo> = tasks.iter().map(|name| task(name)).collect();
        render(&Shown { rows, tasks: &tasks, here, title, phase, replays: false }).into_string()
    }

    #[test]
    fn what_a_team_calls_itself_is_text() {
        let page = shown(&[row("<script>alert('x')</script>\"&")], &["balls"], "h", "t", None);
        assert!(page.contains("&lt;script&gt;alert('x')&lt;/script&gt;&quot;&amp;"));
        assert!(!page.contains("<script"));
    }

    #[test]
    fn every_task_has_a_column_also_when_only_old_runs_know_it() {
        let page = shown(&[row("a")], &["shelf"], "h", "t", None);
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
        let page = shown(&[early], &["balls", "shelf"], "h", "t", None);
        assert!(page.contains("title=\"provisional\">3.5 …<") && page.contains(">7</td>"), "{page}");
    }

    #[test]
    fn a_score_opens_its_replay_where_the_rules_allow() {
        let (rows, tasks) = ([row("a")], [task("balls")]);
        let mut shown =
            Shown { rows: &rows, tasks: &tasks, here: "h", title: "t", phase: None, replays: false };
        let leads_to = |shown: &Shown<'_>, address: &str| {
            render(shown)
                .into_string()
                .contains(&format!("<a href=\"{address}/run_1\" title=\"practice\">3.5</a>"))
        };
        assert!(leads_to(&shown, "/v1/runs"));
        shown.replays = true;
        assert!(leads_to(&shown, "/replay"));
    }

    #[test]
    fn the_rules_stand_beside_it_in_words() {
        let page = shown(&[row("a")], &["balls", "shelf"], "h", "t", Some(Phase::Open));
        for part in
            ["Do balls.", "Do shelf.", "at most 10:00 of simulated time", "✓ verified", "… provisional"]
        {
            assert!(page.contains(part), "{part}: {page}");
        }
    }

    #[test]
    fn an_empty_leaderboard_tells_how_to_fill_it() {
        let page = shown(&[], &["balls"], "app:1\"><script>", "<i>", None);
        assert!(page.contains("ws://app:1&quot;&gt;&lt;script&gt;/v1/control"));
        assert!(page.contains("<p class=\"lead\"><bdi>&lt;i&gt;</bdi></p>"));
        assert!(!page.contains("PALMARES_TOKEN"));
    }

    #[test]
    fn an_empty_official_one_says_that_a_token_is_needed_and_whether_it_is_open() {
        let said = [(Phase::Closed, "is not open"), (Phase::Open, "is open."), (Phase::Revealed, "is over")];
        for (phase, words) in said {
            let page = shown(&[], &["balls"], "app:1", "Cup", Some(phase));
            for part in [words, "PALMARES_TOKEN=", "Authorization: Bearer"] {
                assert!(page.contains(part), "{part}: {page}");
            }
        }
    }

    #[test]
    fn a_name_keeps_its_direction_to_itself_and_hides_nothing() {
        let page = shown(&[row("\u{202e}sbarc"), row("\u{200b}")], &["balls"], "h", "t", None);
        assert!(
            page.contains("<bdi>\\u{202E}sbarc</bdi>") && page.contains("<bdi>\\u{200B}</bdi>"),
            "{page}"
        );
        assert!(!page.contains('\u{202e}'));
    }
}
