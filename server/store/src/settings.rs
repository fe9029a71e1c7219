//! Settings of the competition, by name.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use sqlx::AnyConnection;

pub(super) const WRITE: &str = "INSERT INTO settings (key, value) VALUES ($1, $2) \
     ON CONFLICT (key) DO UPDATE SET value = excluded.value";

impl Store {
    /// The value of a setting.
    pub async fn setting(&self, key: &str) -> Result<Option<String>, StoreError> {
        let query = sqlx::query_scalar("SELECT value FROM settings WHERE key = $1").bind(key);
        Ok(query.fetch_optional(&self.pool()).await?)
    }

    /// The value of a setting, read by a connection outside the pool.
    pub async fn setting_by(
        &self,
        connection: &mut AnyConnection,
        key: &str,
    ) -> Result<Option<String>, StoreError> {
        let query = sqlx::query_scalar("SELECT value FROM settings WHERE key = $1").bind(key.to_owned());
        Ok(query.fetch_optional(connection).await?)
    }

    /// Stores the value of a setting unless it has one; returns the stored value. Of several servers, the first one decides.
    pub async fn pin_setting(&self, key: &str, value: &str) -> Result<String, StoreError> {
        sqlx::query("INSERT INTO settings (key, value) VALUES ($1, $2) ON CONFLICT (key) DO NOTHING")
            .bind(key)
            .bind(value)
            .execute(&self.pool())
            .await?;
        let query = sqlx::query_scalar("SELECT value FROM settings WHERE key = $1").bind(key);
        Ok(query.fetch_one(&self.pool()).await?)
    }

    /// Stores the value of a setting.
    pub async fn store_setting(&self, key: &str, value: &str) -> Result<(), StoreError> {
        sqlx::query(WRITE).bind(key).bind(value).execute(&self.pool()).await?;
        Ok(())
    }

    /// Stores settings, with an audit entry.
    pub async fn change_settings(
        &self,
        settings: &[(&str, &str)],
        entry: &NewAuditEntry<'_>,
    ) -> Result<(), StoreError> {
        let mut recorded = self.recorded(entry).await?;
        for (key, value) in settings {
            sqlx::query(WRITE).bind(*key).bind(*value).execute(&mut *recorded.transaction).await?;
        }
        recorded.commit().await
    }
}
