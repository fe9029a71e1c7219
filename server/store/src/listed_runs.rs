//! The table of runs in a data directory, for programs beside the server.

use serde_json::{Value, json};
use sqlx::any::{AnyConnectOptions, install_default_drivers};
use sqlx::{ConnectOptions, Connection};
use std::path::Path;
use std::str::FromStr;

/// The runs in the SQLite database of a data directory: id, team, status, score and digest of the replay, as in the export, and whether
/// the replay is in the shared storage. The server may run meanwhile.
///
/// # Errors
/// The database cannot be read.
pub fn runs_in(data_dir: &Path) -> anyhow::Result<Vec<Value>> {
    install_default_drivers();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let file = data_dir.join("palmares.sqlite").canonicalize()?;
        let url = format!("sqlite://{}?mode=ro", super::location::percent_encoded(&file));
        let mut connection = AnyConnectOptions::from_str(&url)?.connect().await?;
        type Row = (String, String, String, Option<f64>, Option<String>, Option<i64>);
        let rows: Vec<Row> = sqlx::query_as(
            "SELECT run_id, team, status, score, replay_sha256, replay_stored_at FROM runs ORDER BY run_id",
        )
        .fetch_all(&mut connection)
        .await?;
        connection.close().await?;
        let run = |(run_id, team, status, score, replay_sha256, stored_at): Row| {
            json!({
                "run_id": run_id, "team": team, "status": status, "score": score, "replay_sha256": replay_sha256,
                "stored": stored_at.is_some(),
            })
        };
        Ok(rows.into_iter().map(run).collect())
    })
}
