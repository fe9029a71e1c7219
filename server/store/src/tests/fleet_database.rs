//! A Postgres with sessions that have owners.

use super::postgres::postgres_database;
use super::{Host, Location, Store};
use sqlx::{AnyConnection, AssertSqlSafe, Connection, Executor};

/// A database with the tables of a fleet.
pub(super) struct FleetDatabase {
    url: String,
}

/// A take-over in progress: its transaction, and the new epoch.
pub(super) struct TakeOver(AnyConnection, i64);

impl TakeOver {
    /// Completes it. Returns the new epoch.
    pub(super) async fn commit(mut self) -> i64 {
        self.0.execute("COMMIT").await.expect("commits");
        self.1
    }
}

impl FleetDatabase {
    /// An empty database; none without Postgres.
    pub(super) async fn new() -> Option<Self> {
        let url = postgres_database().await?;
        let database = FleetDatabase { url };
        // Makes the tables.
        database.open().await.close().await;
        Some(database)
    }

    /// Opens it.
    pub(super) async fn open(&self) -> Store {
        Store::open(&Location::Url(self.url.clone()), &Host::alone()).await.expect("opens")
    }

    /// A connection of its own.
    pub(super) async fn connect(&self) -> AnyConnection {
        AnyConnection::connect(&self.url).await.expect("connects")
    }

    /// Executes a statement.
    pub(super) async fn execute(&self, sql: &str) {
        let mut connection = self.connect().await;
        connection.execute(AssertSqlSafe(sql.to_owned())).await.expect("executes");
        connection.close().await.expect("closes");
    }

    /// Adds a session.
    pub(super) async fn session(&self, session_id: &str, epoch: i64) {
        self.execute(&format!(
            "INSERT INTO sessions (session_id, team, mode, created_at, epoch) \
             VALUES ('{session_id}', 'crabs', 'official', 0, {epoch})"
        ))
        .await;
    }

    /// Gives a session to its next owner, in a transaction that has not ended.
    pub(super) async fn take_over_without_commit(&self, session_id: &str) -> TakeOver {
        let mut connection = self.connect().await;
        connection.execute("BEGIN").await.expect("begins");
        let sql = "UPDATE sessions SET epoch = epoch + 1 WHERE session_id = $1 RETURNING epoch";
        let epoch =
            sqlx::query_scalar(sql).bind(session_id).fetch_one(&mut connection).await.expect("updates");
        TakeOver(connection, epoch)
    }
}
