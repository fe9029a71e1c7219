//! The leaderboard as plain HTML, which the page's script updates.

use super::assets::is_built;
use super::rules_in_words::{connect, in_words, legend, rules_of};
use super::shell::{Page, respond};
use crate::archive::Archive;
use crate::competition::Competition;
use crate::competition::rules::CompetitionPhase;
use crate::watch::RankingCache;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, ETAG, HOST, IF_NONE_MATCH, X_CONTENT_TYPE_OPTIONS};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use maud::{Markup, html};
use palmares_net::auth::sha256_hex;
use palmares_net::transport::problem::Problem;
use palmares_protocol::reply::TaskInfo;
use palmares_store::names::printable;
use palmares_store::{LeaderboardRow, TaskBest};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::sync::{Arc, LazyLock};

/// Address of the style sheet for a server without its viewer.
pub(super) const PLAIN: &str = "/assets/plain.css";

const STYLE: &str = include_str!("plain.css");

/// The data of the page.
struct Shown<'a> {
    rows: &'a [LeaderboardRow],
    tasks: &'a [TaskInfo],
    /// Name and port of the server in the reader's address.
    here: &'a str,
    title: &'a str,
    /// CompetitionPhase of an official competition.
    phase: Option<CompetitionPhase>,
    /// Whether all sessions are paused.
    paused: bool,
    /// Whether the reader may see replays and the server has the page for them.
    replays: bool,
}

/// `GET /`.
pub(in crate::http) async fn leaderboard(
    State(archive): State<Option<Arc<Archive>>>,
    State(competition): State<Arc<Competition>>,
    State(ranking): State<Arc<RankingCache>>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    let rules = &competition.rules;
    let ranking = ranking.current().await?;
    let phase = rules.official().then(|| rules.phase());
    let body = render(&Shown {
        rows: &ranking.rows,
        tasks: &competition.task_infos(),
        here: headers.get(HOST).and_then(|value| value.to_str().ok()).unwrap_or("127.0.0.1:8080"),
        title: if phase.is_some() { rules.name.as_str() } else { "Practice leaderboard" },
        phase,
        paused: rules.is_paused(),
        replays: matches!(phase, None | Some(CompetitionPhase::Revealed))
            && archive.is_some()
            && is_built("replay"),
    });
    let page = Page {
        name: "leaderboard",
        argument: "",
        title: "Leaderboard",
        body,
        plain_style: Some(PLAIN),
        refresh_s: Some(10),
        form: false,
    };
    Ok(respond(&page, &competition))
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

/// The viewer's script replaces the content of `board` and `tasks`, and the footer.
fn render(shown: &Shown<'_>) -> Markup {
    html! {
        div.title { h1 { "Leaderboard" } p.lead { (name(shown.title)) } }
        div id="board" {
            @if let Some(phase) = shown.phase { p.board-line { (in_words(phase, shown.paused)) } }
            @if shown.rows.is_empty() {
                section.empty {
                    h2 { "No finished run yet" }
                    p { "Start a client and close a run, and its team appears here. See below how to connect." }
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
    // Current tasks first, then tasks of old runs.
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
                            th scope="row" { a.team href=(address_of(&row.team)) { (name(&row.team)) } }
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

/// A team's best score of a task, with a link to its replay where the rules allow it.
fn cell(task: &str, best: Option<&TaskBest>, replays: bool) -> Markup {
    html! {
        @if let Some(best) = best {
            td.n data-label=(task) {
                @let score = html! { (points(best.score)) (mark(&best.status)) };
                @if replays {
                    a href={ "/replay/" (best.run_id) } title=(best.status) { (score) }
                } @else {
                    span title=(best.status) { (score) }
                }
            }
        } @else {
            td.n.none data-label=(task) { "–" }
        }
    }
}

/// The mark of a score's status.
fn mark(status: &str) -> &'static str {
    match status {
        "verified" => " ✓",
        "provisional" => " …",
        _ => "",
    }
}

/// Points with one decimal and a minus sign (U+2212).
fn points(score: f64) -> String {
    // Adding zero turns −0 into 0.
    format!("{:.1}", score + 0.0).replace('-', "−")
}

/// The address of a team's page.
fn address_of(team: &str) -> String {
    let mut address = String::from("/teams/");
    for byte in team.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' => address.push(char::from(byte)),
            // A string takes everything.
            byte => {
                let _ = write!(address, "%{byte:02X}");
            }
        }
    }
    address
}

/// A name with an isolated direction of writing, and with invisible characters escaped.
fn name(text: &str) -> Markup {
    html! { bdi { (printable(text)) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(team: &str) -> LeaderboardRow {
        let best = TaskBest {
            score: 3.5,
            run_id: "run_1".into(),
            status: "practice".into(),
            ended_unix_ms: 0,
            ended_seq: 1,
        };
        LeaderboardRow {
            rank: 1,
            team: team.into(),
            total: -0.5,
            runs: 2,
            reached_unix_ms: 0,
            reached_seq: 1,
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
            goals: Vec::new(),
            arm: Vec::new(),
        }
    }

    fn shown(
        rows: &[LeaderboardRow],
        tasks: &[&str],
        here: &str,
        title: &str,
        phase: Option<CompetitionPhase>,
    ) -> String {
        let tasks: Vec<TaskInfo> = tasks.iter().map(|name| task(name)).collect();
        render(&Shown { rows, tasks: &tasks, here, title, phase, paused: false, replays: false })
            .into_string()
    }

    #[test]
    fn the_name_of_a_team_is_text() {
        let page = shown(&[row("<script>alert('x')</script>\"&")], &["balls"], "h", "t", None);
        assert!(page.contains("&lt;script&gt;alert('x')&lt;/script&gt;&quot;&amp;"));
        assert!(!page.contains("<script"));
    }

    #[test]
    fn a_name_leads_to_the_page_of_the_team() {
        let page = shown(&[row("a/b ü?")], &["balls"], "h", "t", None);
        assert!(page.contains("href=\"/teams/a%2Fb%20%C3%BC%3F\"><bdi>a/b ü?</bdi></a>"), "{page}");
    }

    #[test]
    fn every_task_of_a_run_has_a_column() {
        let page = shown(&[row("a")], &["shelf"], "h", "t", None);
        assert!(page.contains(">shelf</th>") && page.contains(">balls</th>"));
        assert!(page.contains("class=\"n none\" data-label=\"shelf\">–<") && page.contains("−0.5"));
    }

    #[test]
    fn a_row_shows_verification_and_sensors_rank() {
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
    fn a_score_links_to_its_replay_where_the_rules_allow() {
        let (rows, tasks) = ([row("a")], [task("balls")]);
        let mut shown = Shown {
            rows: &rows,
            tasks: &tasks,
            here: "h",
            title: "t",
            phase: None,
            paused: false,
            replays: false,
        };
        let page = render(&shown).into_string();
        assert!(page.contains("<span title=\"practice\">3.5</span>") && !page.contains("run_1"), "{page}");
        shown.replays = true;
        let page = render(&shown).into_string();
        assert!(page.contains("<a href=\"/replay/run_1\" title=\"practice\">3.5</a>"), "{page}");
    }

    #[test]
    fn the_rules_of_the_tasks_are_on_the_page() {
        let page = shown(&[row("a")], &["balls", "shelf"], "h", "t", Some(CompetitionPhase::Open));
        for part in [
            "Do balls.",
            "Do shelf.",
            "Time limit of a run: 10:00 of simulated time",
            "✓ verified",
            "… provisional",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
    }

    #[test]
    fn an_empty_leaderboard_shows_how_to_connect() {
        let page = shown(&[], &["balls"], "app:1\"><script>", "<i>", None);
        assert!(page.contains("ws://app:1&quot;&gt;&lt;script&gt;/v1/control"));
        assert!(page.contains("<p class=\"lead\"><bdi>&lt;i&gt;</bdi></p>"));
        assert!(!page.contains("PALMARES_TOKEN"));
    }

    #[test]
    fn an_empty_official_leaderboard_shows_the_phase_and_asks_for_a_token() {
        let said = [
            (CompetitionPhase::Closed, "is not open"),
            (CompetitionPhase::Open, "is open."),
            (CompetitionPhase::Revealed, "is over"),
        ];
        for (phase, words) in said {
            let page = shown(&[], &["balls"], "app:1", "Cup", Some(phase));
            for part in [words, "PALMARES_TOKEN=", "Authorization: Bearer"] {
                assert!(page.contains(part), "{part}: {page}");
            }
        }
    }

    #[test]
    fn a_name_is_isolated_and_shows_invisible_characters() {
        let page = shown(&[row("\u{202e}sbarc"), row("\u{200b}")], &["balls"], "h", "t", None);
        assert!(
            page.contains("<bdi>\\u{202E}sbarc</bdi>") && page.contains("<bdi>\\u{200B}</bdi>"),
            "{page}"
        );
        assert!(!page.contains('\u{202e}'));
    }
}
