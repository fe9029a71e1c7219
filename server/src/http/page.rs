//! The leaderboard as a page: plain HTML from the server, no scripts, nothing from elsewhere.

use crate::competition::Competition;
use crate::names::printable;
use crate::problem::Problem;
use crate::rules::Phase;
use crate::store::LeaderboardRow;
use crate::store::Store;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, HOST};
use axum::response::{Html, IntoResponse};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::sync::Arc;

const STYLE: &str = include_str!("page.css");

/// `GET /`.
pub(super) async fn page(
    State(competition): State<Arc<Competition>>,
    State(store): State<Store>,
    headers: HeaderMap,
) -> Result<impl IntoResponse, Problem> {
    let rows = store.leaderboard(competition.rules.official()).await?;
    let here = headers.get(HOST).and_then(|value| value.to_str().ok()).unwrap_or("127.0.0.1:8080");
    let tasks: Vec<&str> = competition.tasks.iter().map(|task| task.name.as_str()).collect();
    let phase = competition.rules.official().then(|| competition.rules.phase());
    let title = if phase.is_some() { competition.rules.name.as_str() } else { "Practice leaderboard" };
    let page = render(&rows, &tasks, here, title, phase);
    let policy = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; frame-ancestors 'none'";
    Ok(([(CACHE_CONTROL, "no-store"), (CONTENT_SECURITY_POLICY, policy)], Html(page)))
}

/// `phase`: of an official competition.
fn render(rows: &[LeaderboardRow], tasks: &[&str], here: &str, title: &str, phase: Option<Phase>) -> String {
    let title = name(title);
    let body = match (rows.is_empty(), phase) {
        (false, _) => table(rows, tasks),
        (true, None) => empty(here),
        (true, Some(phase)) => empty_official(here, phase),
    };
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta http-equiv=\"refresh\" content=\"10\"><meta name=\"color-scheme\" content=\"light dark\">\
         <title>Palmares leaderboard</title><style>{STYLE}</style></head><body><main>\
         <header><h1>Palmares</h1><p>{title}</p></header>\n{body}\n\
         <footer>Best score of each task; equal totals: the earlier first. A score marked … is not verified yet. \
         Sensors: place among the teams that never saw the true state of the world. Refreshes every 10 s. \
         <a href=\"/v1/leaderboard\">as JSON</a> <a href=\"/v1/leaderboard.csv\">as CSV</a></footer></main></body></html>\n"
    )
}

fn empty(here: &str) -> String {
    let here = escape(here);
    format!(
        "<section class=\"empty\"><h2>No finished run yet</h2><p>Start a client and close a run, and its team \
         appears here:</p><pre>pip install ./client-py\npython client-py/examples/balls_softhand.py \
         --url http://{here}</pre><p>or connect a WebSocket of your own to <code>ws://{here}/v1/control</code> with \
         the subprotocol <code>palmares.v1.json</code>.</p></section>"
    )
}

fn empty_official(here: &str, phase: Phase) -> String {
    let here = escape(here);
    let now = match phase {
        Phase::Closed => "The competition is not open: sessions can begin when the organizer opens it.",
        Phase::Open => "The competition is open.",
        Phase::Revealed => "The competition is over.",
    };
    format!(
        "<section class=\"empty\"><h2>No finished run yet</h2><p>{now}</p><p>A team needs its token: the organizer \
         makes it and gives it to the team. Keep it out of programs and addresses; the Python client reads it from the \
         environment:</p><pre>export PALMARES_TOKEN=plm_…   # your team's\n\
         python client-py/examples/balls_softhand.py --url http://{here}</pre><p>A WebSocket of your own to \
         <code>ws://{here}/v1/control</code>, subprotocol <code>palmares.v1.json</code>, sends it in the header \
         <code>Authorization: Bearer plm_…</code>.</p></section>"
    )
}

fn table(rows: &[LeaderboardRow], tasks: &[&str]) -> String {
    // Tasks of today first, then those that only old runs know.
    let old: BTreeSet<&str> = rows.iter().flat_map(|row| row.tasks.keys().map(String::as_str)).collect();
    let columns: Vec<&str> =
        tasks.iter().copied().chain(old.into_iter().filter(|name| !tasks.contains(name))).collect();
    let mut html = String::from(
        "<div class=\"scroll\"><table><thead><tr><th scope=\"col\" class=\"n\">Rank</th>\
         <th scope=\"col\">Team</th><th scope=\"col\" class=\"n\">Total</th>",
    );
    // Writing into a string cannot fail.
    for task in &columns {
        let _ = write!(html, "<th scope=\"col\" class=\"n\">{}</th>", escape(task));
    }
    html.push_str(
        "<th scope=\"col\" class=\"n\">Sensors</th><th scope=\"col\" class=\"n\">Runs</th></tr></thead><tbody>",
    );
    for row in rows {
        let _ = write!(
            html,
            "\n<tr><td class=\"n rank\">{}</td><th scope=\"row\">{}</th><td class=\"n total\">{}</td>",
            row.rank,
            name(&row.team),
            points(row.total)
        );
        for task in &columns {
            let label = escape(task);
            let _ = match row.tasks.get(*task) {
                Some(best) => write!(
                    html,
                    "<td class=\"n\" data-label=\"{label}\"><a href=\"/v1/runs/{}\" title=\"{}\">{}{}</a></td>",
                    escape(&best.run_id),
                    escape(&best.status),
                    points(best.score),
                    if best.status == "provisional" { " …" } else { "" }
                ),
                None => write!(html, "<td class=\"n none\" data-label=\"{label}\">–</td>"),
            };
        }
        let place = row.sensors_rank.map_or("–".to_owned(), |place| place.to_string());
        let runs = row.runs;
        let _ = write!(
            html,
            "<td class=\"n\" data-label=\"Sensors\">{place}</td><td class=\"n\" data-label=\"Runs\">{runs}</td></tr>"
        );
    }
    html.push_str("</tbody></table></div>");
    html
}

/// Points with one decimal and a true minus sign.
fn points(score: f64) -> String {
    // Adding zero turns −0 into 0.
    format!("{:.1}", score + 0.0).replace('-', "−")
}

/// A name as HTML: its direction of writing is its own, and what cannot be seen in it is spelt.
fn name(text: &str) -> String {
    format!("<bdi>{}</bdi>", escape(&printable(text)))
}

/// Text as HTML, in elements and in quoted attributes.
fn escape(text: &str) -> String {
    let mut html = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => html.push_str("&amp;"),
            '<' => html.push_str("&lt;"),
            '>' => html.push_str("&gt;"),
            '"' => html.push_str("&quot;"),
            '\'' => html.push_str("&#39;"),
            other => html.push(other),
        }
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::TaskBest;

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
        let page = render(&[row("<script>alert('x')</script>\"&")], &["balls"], "h", "t", None);
        assert!(page.contains("&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&quot;&amp;"));
        assert!(!page.contains("<script"));
    }

    #[test]
    fn every_task_has_a_column_also_when_only_old_runs_know_it() {
        let page = render(&[row("a")], &["shelf"], "h", "t", None);
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
        let page = render(&[early], &["balls", "shelf"], "h", "t", None);
        assert!(page.contains("title=\"provisional\">3.5 …<") && page.contains(">7</td>"), "{page}");
    }

    #[test]
    fn an_empty_leaderboard_tells_how_to_fill_it() {
        let page = render(&[], &["balls"], "app:1\"><script>", "<i>", None);
        assert!(page.contains("ws://app:1&quot;&gt;&lt;script&gt;/v1/control"));
        assert!(page.contains("<p><bdi>&lt;i&gt;</bdi></p>"));
        assert!(!page.contains("PALMARES_TOKEN"));
    }

    #[test]
    fn an_empty_official_one_says_that_a_token_is_needed_and_whether_it_is_open() {
        let said = [(Phase::Closed, "is not open"), (Phase::Open, "is open."), (Phase::Revealed, "is over")];
        for (phase, words) in said {
            let page = render(&[], &["balls"], "app:1", "Cup", Some(phase));
            for part in [words, "PALMARES_TOKEN=", "Authorization: Bearer"] {
                assert!(page.contains(part), "{part}: {page}");
            }
        }
    }

    #[test]
    fn a_name_keeps_its_direction_to_itself_and_hides_nothing() {
        let page = render(&[row("\u{202e}sbarc"), row("\u{200b}")], &["balls"], "h", "t", None);
        assert!(
            page.contains("<bdi>\\u{202E}sbarc</bdi>") && page.contains("<bdi>\\u{200B}</bdi>"),
            "{page}"
        );
        assert!(!page.contains('\u{202e}'));
    }
}
