//! Runs and sessions, with the fields that the client may see.

use super::extract::{Path, Query};
use crate::competition::Competition;
use crate::competition::rules::Rules;
use crate::http::state::AppState;
use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use palmares_net::auth::{Auth, Identity, Role, forbidden};
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use palmares_store::names::printable;
use palmares_store::{ListFilter, RunRecord, SessionRow, Store};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

fn organizer(identity: Option<&Identity>) -> bool {
    identity.is_some_and(|identity| identity.role == Role::Organizer)
}

/// Whether it is a run of the client's team.
fn own(run: &RunRecord, identity: Option<&Identity>) -> bool {
    identity.is_some_and(|identity| identity.team.as_ref() == Some(&run.team))
}

/// Refuses a run to those who may see only the leaderboard of it: until the seeds are revealed, hand, time, reason and events of a run
/// tell other teams about a scene that they have not played yet, or how to play it.
fn may_see(run: &RunRecord, identity: Option<&Identity>, rules: &Rules) -> Result<(), Problem> {
    let watches = identity.is_some_and(|identity| matches!(identity.role, Role::Viewer | Role::Organizer));
    if rules.revealed() || watches || own(run, identity) {
        return Ok(());
    }
    let needed = "a token of the run's team, a spectator's or an organizer's, until the seeds are revealed";
    Err(Problem(forbidden(needed)))
}

/// Removes the fields that the client may not see: hidden seeds, and sessions of other teams.
fn redacted_for(mut run: RunRecord, identity: Option<&Identity>, rules: &Rules) -> RunRecord {
    if organizer(identity) || !rules.official() {
        return run;
    }
    (run.similar, run.verify_problem) = (None, None);
    (run.verify_host, run.verify_tries) = (None, None);
    if !rules.revealed() {
        (run.seed, run.seed_hex) = (None, None);
    }
    if !own(&run, identity) {
        run.session_id = None;
    }
    run
}

/// A run.
pub(super) async fn run(
    State(auth): State<Arc<Auth>>,
    State(competition): State<Arc<Competition>>,
    State(store): State<Store>,
    Path(id): Path,
    headers: HeaderMap,
) -> Result<Json<RunRecord>, Problem> {
    let identity = auth.identify(&store, &headers).await?;
    let run = store.run(&id).await?;
    let run = run.ok_or_else(|| Problem::new(Code::NotFound, format!("no run `{}`", shortened(&id))))?;
    may_see(&run, identity.as_ref(), &competition.rules)?;
    Ok(Json(redacted_for(run, identity.as_ref(), &competition.rules)))
}

/// Runs, newest first.
#[derive(Serialize, JsonSchema)]
pub(super) struct RunList {
    pub(super) runs: Vec<RunRecord>,
    /// Whether there are more, which `limit` left out.
    pub(super) more: bool,
}

/// The query of the list of runs.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RunsQuery {
    team: Option<String>,
    task: Option<String>,
    limit: Option<u32>,
}

/// The newest runs whose replays the client may see, without their events.
pub(super) async fn runs(
    State(app): State<AppState>,
    Query(query): Query<RunsQuery>,
    headers: HeaderMap,
) -> Result<Json<RunList>, Problem> {
    const MAX_ROWS: u32 = 200;
    let identity = app.auth.identify(&app.store, &headers).await?;
    let filter = ListFilter {
        team: query.team,
        task: query.task,
        limit: query.limit.unwrap_or(MAX_ROWS).min(MAX_ROWS),
        ..ListFilter::default()
    };
    let (runs, more) = app.store.list_runs(&filter).await?;
    let seen =
        runs.into_iter().filter(|run| run.has_replay() && may_replay(run, identity.as_ref(), &app).is_ok());
    let runs = seen.map(|run| {
        let mut run = redacted_for(run, identity.as_ref(), &app.competition.rules);
        // They can be long; the run itself has them.
        run.events = None;
        run
    });
    Ok(Json(RunList { runs: runs.collect(), more }))
}

/// Refuses the replay of a run to clients that may not see it.
pub(super) fn may_replay(
    run: &RunRecord,
    identity: Option<&Identity>,
    app: &AppState,
) -> Result<(), Problem> {
    let organizer = organizer(identity);
    // The file contains the seed, which is the same for all teams.
    if run.k.is_some() && !organizer && !app.competition.rules.revealed() {
        return Err(Problem(forbidden("an organizer's token until the seeds are revealed")));
    }
    // The file contains an uploaded hand, which is for its team only.
    let foreign = !organizer && !own(run, identity);
    if run.k.is_none() && app.competition.hand(&run.hand).is_none() && foreign {
        return Err(Problem(forbidden("a token of the run's team, whose own hand it holds")));
    }
    Ok(())
}

/// A session with its current clock.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Session")]
pub(super) struct SessionNow {
    #[serde(flatten)]
    row: SessionRow,
    /// Time spent, the greater of both times, s.
    elapsed_s: f64,
    /// Time left, s; null without a limit.
    left_s: Option<f64>,
    /// Its place in its host's queue for a world, from 1, while it waits for one.
    #[serde(skip_serializing_if = "Option::is_none")]
    place_in_queue: Option<usize>,
}

impl SessionNow {
    /// The session of a row. The clock of an open session is ahead of the database, which has the clock before the open run.
    pub(super) fn of(mut row: SessionRow, app: &AppState) -> Self {
        if let Some(clock) = app.clocks.get(&row.session_id) {
            let spent = clock.spent(app.lifecycle.now());
            (row.clock_wall_s, row.clock_simulated_s) = (spent.wall_s, spent.simulated_s);
            row.refunded_s = clock.refunded_s();
        }
        let most_s = row.limit_s.unwrap_or(f64::INFINITY);
        let elapsed_s = row.clock_wall_s.max(row.clock_simulated_s).min(most_s);
        let left_s = row.limit_s.map(|limit_s| limit_s - elapsed_s);
        let here = app.compute.admission.place_in_queue(&row.session_id);
        let place_in_queue = here.or_else(|| app.host_rows.place_in_queue(&row.session_id));
        SessionNow { row, elapsed_s, left_s, place_in_queue }
    }

    /// Team, id and time left, for organizers.
    pub(super) fn in_words(&self) -> String {
        let SessionRow { team, session_id, paused_unix_ms, .. } = &self.row;
        let left = match self.left_s {
            Some(left_s) => format!("at most {}:{:02} left", left_s as u64 / 60, left_s as u64 % 60),
            None => "without a limit".to_owned(),
        };
        let paused = if paused_unix_ms.is_some() { ", paused" } else { "" };
        format!("{} ({session_id}, {left}{paused})", printable(team))
    }
}

/// Sessions, newest first.
#[derive(Serialize, JsonSchema)]
pub(super) struct Sessions {
    sessions: Vec<SessionNow>,
}

/// The sessions: a team's own; all for organizers and viewers, and in practice for clients without a token.
pub(super) async fn sessions(
    State(app): State<AppState>,
    headers: HeaderMap,
) -> Result<Json<Sessions>, Problem> {
    let identity = if app.competition.rules.official() {
        Some(app.auth.require(&app.store, &headers).await?)
    } else {
        app.auth.identify(&app.store, &headers).await?
    };
    let team = match &identity {
        Some(Identity { role: Role::Team, team, .. }) => Some(team.as_deref().unwrap_or_default()),
        _ => None,
    };
    let sessions = app.store.sessions(team).await?;
    let sessions = sessions.into_iter().map(|row| SessionNow::of(row, &app)).collect();
    Ok(Json(Sessions { sessions }))
}
