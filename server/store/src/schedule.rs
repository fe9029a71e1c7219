//! The table `slots`: when teams may begin their sessions.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::host::Held;
use super::transaction::Transaction;
use std::collections::BTreeSet;

/// A time slot of a team.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Slot {
    /// Its begin, ms since 1970 UTC.
    pub begins_unix_ms: i64,
    /// The team.
    pub team: String,
    /// Its end, ms since 1970 UTC.
    pub ends_unix_ms: i64,
}

from_row!(Slot { begins_unix_ms: "begins_at", team, ends_unix_ms: "ends_at" });

/// The clock of an open official session that has started, as stored.
#[derive(Clone, Debug, PartialEq)]
pub struct PlayingClock {
    /// The session.
    pub session_id: String,
    /// Its length, s.
    pub limit_s: Option<f64>,
    /// Wall-clock time, s.
    pub wall_s: f64,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Begin of its own pause, ms since 1970 UTC.
    pub paused_unix_ms: Option<i64>,
}

from_row!(PlayingClock {
    session_id,
    limit_s,
    wall_s: "clock_wall_s",
    simulated_s: "clock_simulated_s",
    paused_unix_ms: "paused_at"
});

const ALL: &str = "SELECT team, begins_at, ends_at FROM slots ORDER BY begins_at, team";

impl Store {
    /// The schedule: all slots by begin and team.
    pub async fn schedule(&self) -> Result<Vec<Slot>, StoreError> {
        Ok(sqlx::query_as(ALL).fetch_all(&self.pool()).await?)
    }

    /// The slots of a team by begin; None without a schedule.
    pub async fn slots_of(&self, team: &str) -> Result<Option<Vec<Slot>>, StoreError> {
        let query =
            sqlx::query_as("SELECT team, begins_at, ends_at FROM slots WHERE team = $1 ORDER BY begins_at");
        let slots: Vec<Slot> = query.bind(team).fetch_all(&self.pool()).await?;
        if slots.is_empty() {
            let any: i64 = sqlx::query_scalar("SELECT COUNT(*) FROM slots").fetch_one(&self.pool()).await?;
            return Ok((any > 0).then_some(slots));
        }
        Ok(Some(slots))
    }

    /// Changes the schedule by an organizer's command: `change` makes the new one from the present one, or refuses.
    pub async fn change_schedule<E>(
        &self,
        entry: &NewAuditEntry<'_>,
        change: impl FnOnce(Vec<Slot>) -> Result<Vec<Slot>, E> + Send,
    ) -> Result<Result<(), E>, StoreError> {
        // The record's number orders commands of all hosts: the schedule that is read next is the present one.
        let mut recorded = self.recorded(entry).await?;
        let transaction = &mut recorded.transaction;
        let before: Vec<Slot> = sqlx::query_as(ALL).fetch_all(&mut **transaction).await?;
        let after = match change(before.clone()) {
            Ok(after) => after,
            Err(refusal) => return Ok(Err(refusal)),
        };
        let (before, after) = (BTreeSet::from_iter(before), BTreeSet::from_iter(after));
        for slot in before.difference(&after) {
            delete(transaction, slot).await?;
        }
        for slot in after.difference(&before) {
            insert(transaction, slot).await?;
        }
        recorded.commit().await?;
        Ok(Ok(()))
    }

    /// The clocks of the open official sessions that have started.
    pub async fn playing_clocks(&self) -> Result<Vec<PlayingClock>, StoreError> {
        let query = sqlx::query_as(
            "SELECT session_id, limit_s, clock_wall_s, clock_simulated_s, paused_at FROM sessions \
             WHERE mode = 'official' AND status = 'open' AND clock_started = 1",
        );
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// The teams of the competition.
    pub async fn team_names(&self) -> Result<BTreeSet<String>, StoreError> {
        let names: Vec<String> = sqlx::query_scalar("SELECT team FROM teams").fetch_all(&self.pool()).await?;
        Ok(names.into_iter().collect())
    }

    /// Stores the length of a session that is shorter than before, s.
    pub async fn shorten_session(&self, held: &Held, limit_s: f64) -> Result<(), StoreError> {
        let mut transaction = self.fenced(held).await?;
        let query = sqlx::query("UPDATE sessions SET limit_s = $1 WHERE session_id = $2 AND status = 'open'");
        query.bind(limit_s).bind(held.session_id.clone()).execute(&mut *transaction).await?;
        Ok(transaction.commit().await?)
    }

    /// The session of a team was paused from `from` to `to`, ms since 1970 UTC: its running slot ends later.
    pub async fn extend_slots_of(&self, team: &str, from: i64, to: i64) -> Result<(), StoreError> {
        let mut transaction = self.write().await?;
        extend(&mut transaction, Some(team), from, to).await?;
        Ok(transaction.commit().await?)
    }
}

async fn delete(transaction: &mut Transaction, slot: &Slot) -> Result<(), StoreError> {
    sqlx::query("DELETE FROM slots WHERE team = $1 AND begins_at = $2")
        .bind(slot.team.clone())
        .bind(slot.begins_unix_ms)
        .execute(&mut **transaction)
        .await?;
    Ok(())
}

async fn insert(transaction: &mut Transaction, slot: &Slot) -> Result<(), StoreError> {
    sqlx::query("INSERT INTO slots (team, begins_at, ends_at) VALUES ($1, $2, $3)")
        .bind(slot.team.clone())
        .bind(slot.begins_unix_ms)
        .bind(slot.ends_unix_ms)
        .execute(&mut **transaction)
        .await?;
    Ok(())
}

/// Moves the ends of slots that were running during a pause, so that as much of each slot is left as when the pause, or the slot in
/// the pause, began. Of one team or of all.
pub(super) async fn extend(
    transaction: &mut Transaction,
    team: Option<&str>,
    from: i64,
    to: i64,
) -> Result<(), StoreError> {
    const EXTEND: &str = "UPDATE slots SET ends_at = $1 + ends_at - CASE WHEN begins_at > $2 THEN begins_at ELSE $2 END \
         WHERE begins_at < $1 AND ends_at > $2";
    let query = match team {
        Some(team) => sqlx::query(sqlx::AssertSqlSafe(format!("{EXTEND} AND team = $3")))
            .bind(to)
            .bind(from)
            .bind(team.to_owned()),
        None => sqlx::query(EXTEND).bind(to).bind(from),
    };
    query.execute(&mut **transaction).await?;
    Ok(())
}
