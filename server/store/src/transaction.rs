//! A transaction on a connection of the pool. The connection goes back to the pool only after a commit or a rollback that has
//! succeeded; every other end closes it.
//!
//! After a failure nobody knows what state a connection is in. On a full disk SQLite has rolled back by itself when a statement or the
//! commit fails; then the rollback fails as well, and sqlx, which counts the begins and the rollbacks of each connection, would
//! refuse every further transaction on it. A future that is dropped in the middle leaves no less doubt. A new connection costs
//! milliseconds.

use sqlx::pool::PoolConnection;
use sqlx::{Any, AnyConnection, AnyPool, Executor};
use std::ops::{Deref, DerefMut};

/// A transaction. Dropping it closes its connection, which rolls back.
#[derive(Debug)]
pub(super) struct Transaction {
    connection: PoolConnection<Any>,
    /// Whether it has ended as it should.
    ended: bool,
}

impl Transaction {
    /// Begins with a statement of [`super::location::Dialect`].
    pub(super) async fn begin(pool: &AnyPool, statement: &'static str) -> Result<Self, sqlx::Error> {
        let connection = pool.acquire().await?;
        // From now on a failure, or a future that is dropped, closes the connection.
        let mut transaction = Transaction { connection, ended: false };
        transaction.execute(statement).await?;
        Ok(transaction)
    }

    /// Commits.
    pub(super) async fn commit(mut self) -> Result<(), sqlx::Error> {
        self.execute("COMMIT").await?;
        self.ended = true;
        Ok(())
    }

    /// Rolls back.
    pub(super) async fn rollback(mut self) -> Result<(), sqlx::Error> {
        self.execute("ROLLBACK").await?;
        self.ended = true;
        Ok(())
    }
}

impl Deref for Transaction {
    type Target = AnyConnection;

    fn deref(&self) -> &AnyConnection {
        &self.connection
    }
}

impl DerefMut for Transaction {
    fn deref_mut(&mut self) -> &mut AnyConnection {
        &mut self.connection
    }
}

impl Drop for Transaction {
    fn drop(&mut self) {
        if !self.ended {
            self.connection.close_on_drop();
        }
    }
}
