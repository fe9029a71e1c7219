//! The proof that the database takes writes.

use super::database::Store;
use super::error::StoreError;
use super::location::Dialect;
use super::number::unix_ms;

/// Sorts 128 kB with 64 kB of memory, so that Postgres writes a temporary file beside its tables. A small row alone may find space in
/// a page, and its record in a preallocated segment of the log, on a disk that is full.
const SPILL: &str = "SELECT COUNT(*) FROM (SELECT REPEAT('x', 500) || g AS line FROM generate_series(1, 256) AS g ORDER BY 1 OFFSET 0) AS lines";

impl Store {
    /// Writes and commits a row, as a run that is stored.
    pub async fn prove_writing(&self) -> Result<(), StoreError> {
        let mut transaction = self.write().await?;
        sqlx::query(
            "INSERT INTO proofs (host_id, proved_at) VALUES ($1, $2) \
             ON CONFLICT (host_id) DO UPDATE SET proved_at = excluded.proved_at",
        )
        .bind(self.host.host_id.clone())
        .bind(unix_ms())
        .execute(&mut *transaction)
        .await?;
        if self.dialect == Dialect::Postgres {
            sqlx::query("SET LOCAL work_mem = '64kB'").execute(&mut *transaction).await?;
            sqlx::query(SPILL).fetch_one(&mut *transaction).await?;
        }
        Ok(transaction.commit().await?)
    }
}
