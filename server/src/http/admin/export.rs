//! Exports: leaderboard, sessions, runs, audit as tables, and a backup of everything.

use super::request::{MAX_ROWS, not_found};
use crate::backup;
use crate::http::csv::{self, Table};
use crate::http::extract::{Path, Query};
use crate::http::runs::SessionNow;
use crate::http::state::AppState;
use crate::session::Sessions;
use axum::Json;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use palmares_net::auth::Identity;
use palmares_net::transport::problem::Problem;
use palmares_protocol::{Code, Refusal};
use palmares_store::Store;
use palmares_store::{AuditEntry, NewAuditEntry};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io;
use std::sync::Arc;
use tokio::sync::mpsc;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Page {
    #[serde(default)]
    after: u64,
    #[serde(default = "max_rows")]
    limit: u32,
}

fn max_rows() -> u32 {
    MAX_ROWS
}

/// Records of the audit, oldest first.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Audit")]
pub(in crate::http) struct Records {
    records: Vec<AuditEntry>,
    /// Whether there are more, which `limit` left out.
    more: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Format {
    #[serde(default)]
    format: Option<String>,
}

/// The records of the audit after a number.
pub(super) async fn audit(
    State(store): State<Store>,
    Query(page): Query<Page>,
) -> Result<Json<Records>, Problem> {
    let limit = page.limit.min(MAX_ROWS);
    let mut records = store.audit(page.after, limit + 1).await?;
    let more = records.len() > limit as usize;
    records.truncate(limit as usize);
    Ok(Json(Records { records, more }))
}

/// `leaderboard`, `sessions`, `runs`, `audit`, as JSON or CSV.
pub(super) async fn export(
    State(app): State<AppState>,
    Path(what): Path,
    Query(format): Query<Format>,
) -> Result<Response, Problem> {
    let bad = |error: serde_json::Error| {
        tracing::error!(%error, "export");
        Problem::new(Code::Internal, "the table cannot be written")
    };
    let table = match what.as_str() {
        "leaderboard" => {
            let rows = app.store.leaderboard(app.competition.rules.official()).await?;
            csv::leaderboard(&rows, &app.competition.task_names())
        }
        "sessions" => {
            let rows = app.store.sessions(None).await?.into_iter();
            let rows: Vec<SessionNow> = rows.map(|row| SessionNow::of(row, &app)).collect();
            Table::new(&csv::SESSIONS, serde_json::to_value(rows).map_err(bad)?)
        }
        "runs" => {
            let rows = app.store.runs().await?;
            Table::new(&csv::RUNS, serde_json::to_value(rows).map_err(bad)?)
        }
        "audit" => {
            let rows = app.store.audit(0, u32::MAX).await?;
            Table::new(&csv::AUDIT, serde_json::to_value(rows).map_err(bad)?)
        }
        _ => return Err(not_found("there are leaderboard, sessions, runs, audit".into())),
    };
    match format.format.as_deref() {
        None | Some("json") => Ok(Json(table.rows).into_response()),
        Some("csv") => Ok(csv::response(&table)),
        Some(_) => Err(Problem::new(Code::BadRequest, "format: expected json or csv")),
    }
}

/// A backup of everything. It contains secrets that give control of the competition.
pub(super) async fn backup(
    State(backup): State<Arc<backup::Files>>,
    State(store): State<Store>,
    State(sessions): State<Arc<Sessions>>,
    identity: Identity,
) -> Result<Response, Problem> {
    let entry =
        NewAuditEntry { actor: &identity.token_id, action: "backup", subject: "everything", reason: None };
    store.record(&entry).await?;
    // The backup has the clocks as of now.
    sessions.save_clocks().await?;
    let tables = store.dump().await?;
    let (sender, receiver) = mpsc::channel::<io::Result<Bytes>>(4);
    let files = backup.clone();
    // On a thread of its own: it writes as fast as the organizer reads, which may take long.
    let writer = std::thread::Builder::new().name("backup".into()).spawn(move || {
        let failed = sender.clone();
        if let Err(error) = backup::write(Pipe(sender), &tables, &files) {
            tracing::error!(%error, "backup failed");
            // The archive ends without its directory, so that it is not valid.
            let _ = failed.blocking_send(Err(io::Error::other("the backup failed")));
        }
    });
    writer.map_err(|error| {
        tracing::error!(%error, "cannot start a thread for a backup");
        Problem(Refusal::new(Code::Internal, "the backup could not be started").retry_after(5.0))
    })?;
    let stream =
        stream::unfold(receiver, async |mut receiver| receiver.recv().await.map(|part| (part, receiver)));
    let headers = [
        (CONTENT_TYPE, "application/zip"),
        (CONTENT_DISPOSITION, "attachment; filename=\"palmares-backup.zip\""),
        (CACHE_CONTROL, "no-store"),
    ];
    Ok((headers, Body::from_stream(stream)).into_response())
}

/// Passes written data to the connection.
struct Pipe(mpsc::Sender<io::Result<Bytes>>);

impl io::Write for Pipe {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let gone = |_| io::Error::from(io::ErrorKind::BrokenPipe);
        self.0.blocking_send(Ok(Bytes::copy_from_slice(buffer))).map_err(gone)?;
        Ok(buffer.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
