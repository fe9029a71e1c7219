//! The table `hosts`: the servers that share the database, and which sessions are theirs.
//!
//! A host renews its lease twice a second. After the end of a lease other hosts may take its sessions; that is a hint only. A write is
//! safe because it locks the session's row on the condition that the owner's epoch is unchanged: see [`Store::fenced`]. A condition
//! without the lock would be checked before the write of another owner and hold after it.

use super::database::Store;
use super::error::StoreError;
use super::host::{ALONE, ENGINE, Held, Host, HostRow, LEASE, OwnedSession, PROCESS_DIGITS, Renewal, alive};
use super::transaction::Transaction;
use palmares_metrics::METRICS;
use palmares_tasks::identity;
use sqlx::{AnyConnection, AssertSqlSafe};
use std::time::{Duration, Instant};

/// Longest wait for the lease of an earlier process of the same host.
const PATIENCE: Duration = Duration::from_millis(3000);

/// Time between two attempts.
const RETRY_PERIOD: Duration = Duration::from_millis(100);

/// Sessions in one statement.
const BATCH: usize = 500;

fn count(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

impl Store {
    /// The name of this host in the fleet; None without a fleet.
    pub fn host_name(&self) -> Option<&str> {
        self.host.fleet.then_some(self.host.host_id.as_str())
    }

    /// Enters this server among the hosts. Waits until the lease of its earlier process has ended.
    ///
    /// # Errors
    /// A host that runs has the same name, or cannot share the database with this one.
    pub(super) async fn enter(&self, host: &Host, place: &str) -> Result<(), StoreError> {
        let began = Instant::now();
        loop {
            let mut transaction = self.write().await?;
            self.check_engine(&mut transaction, place).await?;
            let alive = alive(&mut transaction, self.dialect).await?;
            let rival = self.rival(host, place, &alive);
            let Err(rival) = rival else {
                self.write_host(&mut transaction, host).await?;
                return Ok(transaction.commit().await?);
            };
            transaction.rollback().await?;
            let may_end = matches!(rival, StoreError::Taken { .. } | StoreError::SameHost { .. });
            if !may_end || began.elapsed() >= PATIENCE {
                return Err(rival);
            }
            tokio::time::sleep(RETRY_PERIOD).await;
        }
    }

    /// Refuses a host of a fleet whose engine is not that with which the competition was opened, as long as it is open.
    async fn check_engine(&self, connection: &mut AnyConnection, place: &str) -> Result<(), StoreError> {
        let (phase, opened_with) =
            (self.setting_by(connection, "phase").await?, self.setting_by(connection, ENGINE).await?);
        let engine = identity::engine();
        match opened_with {
            Some(opened_with)
                if self.host.fleet && phase.as_deref() == Some("open") && opened_with != engine =>
            {
                Err(StoreError::Engine { place: place.to_owned(), opened_with, engine })
            }
            _ => Ok(()),
        }
    }

    /// Refuses this host beside those that run.
    fn rival(&self, host: &Host, place: &str, alive: &[HostRow]) -> Result<(), StoreError> {
        let place = place.to_owned();
        for other in alive {
            let refused =
                |why: String| StoreError::Host { place: place.clone(), host: other.host_id.clone(), why };
            if other.host_id == self.host.host_id {
                return Err(match self.host.fleet {
                    false => StoreError::Taken { place },
                    true => StoreError::SameHost { place, host: other.host_id.clone() },
                });
            }
            if !self.host.fleet || other.host_id == ALONE {
                let why = "; servers share a database only if each has [fleet] in its competition.toml, with a host \
                           of its own";
                return Err(refused(why.into()));
            }
            let engine = identity::engine();
            if other.engine != engine {
                let theirs = &other.engine;
                return Err(refused(format!(
                    ", which plays with the engine {theirs}, this one with {engine}: their scores cannot be \
                     compared; use the same version, or stop the other hosts first"
                )));
            }
            if other.config_sha256 != host.config_sha256 {
                return Err(refused(
                    ", whose competition.toml, tasks or hands differ from those of this one".into(),
                ));
            }
        }
        Ok(())
    }

    async fn write_host(&self, transaction: &mut Transaction, host: &Host) -> Result<(), StoreError> {
        let lease_until = format!("{} + {}", self.dialect.now_ms(), LEASE.as_millis());
        let sql = format!(
            "INSERT INTO hosts (host_id, incarnation, engine, config_sha256, build_hash, internal_url, state, places, \
             taken, lease_until) VALUES ($1, $2, $3, $4, $5, $6, 'up', $7, 0, {lease_until}) \
             ON CONFLICT (host_id) DO UPDATE SET incarnation = excluded.incarnation, engine = excluded.engine, \
             config_sha256 = excluded.config_sha256, build_hash = excluded.build_hash, \
             internal_url = excluded.internal_url, state = 'up', places = excluded.places, taken = 0, idle = 0, \
             waiting = '', lease_until = excluded.lease_until"
        );
        sqlx::query(AssertSqlSafe(sql))
            .bind(self.host.host_id.clone())
            .bind(self.host.incarnation())
            .bind(identity::engine())
            .bind(host.config_sha256.clone())
            .bind(host.build_hash.clone())
            .bind(host.internal_url.clone())
            .bind(count(host.places))
            .execute(&mut **transaction)
            .await?;
        Ok(())
    }

    /// Gives up the lease: others need not wait for its end.
    pub(super) async fn leave(&self) -> Result<(), StoreError> {
        if self.is_shared() {
            sqlx::query("UPDATE hosts SET lease_until = 0 WHERE host_id = $1 AND incarnation = $2")
                .bind(self.host.host_id.clone())
                .bind(self.host.incarnation())
                .execute(&self.pool())
                .await?;
        }
        Ok(())
    }

    /// Renews the lease. False if another process has taken this host's place.
    pub async fn renew(&self, connection: &mut AnyConnection, renewal: Renewal) -> Result<bool, StoreError> {
        let sql = format!(
            "UPDATE hosts SET lease_until = {} + {}, places = $1, taken = $2, state = $3, incarnation = $4, idle = $5, \
             waiting = $6 WHERE host_id = $7 AND SUBSTR(incarnation, 1, {PROCESS_DIGITS}) = $8",
            self.dialect.now_ms(),
            LEASE.as_millis()
        );
        let renewed = sqlx::query(AssertSqlSafe(sql))
            .bind(count(renewal.places))
            .bind(count(renewal.taken))
            .bind(if renewal.draining { "draining" } else { "up" })
            .bind(self.host.incarnation())
            .bind(count(renewal.idle))
            .bind(renewal.waiting.join(" "))
            .bind(self.host.host_id.clone())
            .bind(self.host.process.clone())
            .execute(connection)
            .await?;
        Ok(renewed.rows_affected() == 1)
    }

    /// Makes this process another owner: the sessions that it has given up have none.
    pub fn renew_incarnation(&self) {
        self.host.give_up();
    }

    /// The present epochs of these sessions, and the hosts that want them.
    pub async fn owners_of(
        &self,
        connection: &mut AnyConnection,
        held: &[Held],
    ) -> Result<Vec<OwnedSession>, StoreError> {
        let mut owned = Vec::new();
        for batch in held.chunks(BATCH) {
            let places: Vec<String> = (1..=batch.len()).map(|k| format!("${k}")).collect();
            let sql = format!(
                "SELECT session_id, epoch, wanted_by, wanted_firmly, status, paused_at FROM sessions \
                 WHERE session_id IN ({})",
                places.join(", ")
            );
            let mut query = sqlx::query_as(AssertSqlSafe(sql));
            for held in batch {
                query = query.bind(held.session_id.clone());
            }
            type Row = (String, i64, Option<String>, i64, String, Option<i64>);
            let rows: Vec<Row> = query.fetch_all(&mut *connection).await?;
            for (session_id, epoch, wanted_by, firmly, status, paused_at) in rows {
                let Some(held) = batch.iter().find(|held| held.session_id == session_id) else { continue };
                let wanted = wanted_by.filter(|host| *host != self.host.host_id);
                let (held, firmly) = (held.clone(), firmly != 0);
                let (ended, paused) = (status != "open", paused_at.is_some());
                owned.push(OwnedSession { held, epoch, wanted, firmly, ended, paused });
            }
        }
        Ok(owned)
    }

    /// The hosts whose leases are valid.
    pub async fn hosts(&self) -> Result<Vec<HostRow>, StoreError> {
        alive(&mut *self.pool().acquire().await?, self.dialect).await
    }

    /// The other hosts whose leases are valid.
    pub async fn other_hosts(&self, connection: &mut AnyConnection) -> Result<Vec<HostRow>, StoreError> {
        let mut hosts = alive(connection, self.dialect).await?;
        hosts.retain(|host| host.host_id != self.host.host_id);
        Ok(hosts)
    }

    /// Name and address of another host that has a session, by the id of the session or of one of its runs.
    pub async fn owner_elsewhere(
        &self,
        session_id: &str,
        run_id: &str,
    ) -> Result<Option<(String, Option<String>)>, StoreError> {
        let sql = format!(
            "SELECT hosts.host_id, hosts.internal_url FROM sessions JOIN hosts ON hosts.host_id = sessions.owner \
             AND hosts.incarnation = sessions.owner_incarnation AND hosts.lease_until >= {} \
             WHERE hosts.host_id <> $1 AND (session_id = $2 OR session_id = (SELECT runs.session_id FROM runs \
             WHERE run_id = $3)) AND sessions.status = 'open'",
            self.dialect.now_ms()
        );
        let query = sqlx::query_as(AssertSqlSafe(sql)).bind(self.host.host_id.clone());
        let query = query.bind(session_id.to_owned()).bind(run_id.to_owned());
        Ok(query.fetch_optional(&self.pool()).await?)
    }

    /// A transaction of a session's owner. It locks the session's row.
    ///
    /// # Errors
    /// [`StoreError::Stale`] if the session has another owner.
    pub(super) async fn fenced(&self, held: &Held) -> Result<Transaction, StoreError> {
        let mut transaction = self.write().await?;
        let locked = sqlx::query("UPDATE sessions SET epoch = epoch WHERE session_id = $1 AND epoch = $2")
            .bind(held.session_id.clone())
            .bind(held.epoch)
            .execute(&mut *transaction)
            .await?;
        if locked.rows_affected() == 1 {
            return Ok(transaction);
        }
        METRICS.stale_writes.inc();
        held.lose();
        Err(StoreError::Stale { session_id: held.session_id.clone() })
    }

    /// Makes this process the owner of open official sessions that have none: sessions without an owner, of a host whose lease has
    /// ended, or of this host's earlier process. At most `max` of them, those first whose clients are here. With `only` it takes this
    /// session, also if this process owns it. A session whose client is at another host is left to that host.
    pub async fn take_sessions(&self, max: usize, only: Option<&str>) -> Result<Vec<Held>, StoreError> {
        let mut transaction = self.write().await?;
        let now = self.dialect.now_ms();
        let sql = format!(
            "UPDATE sessions SET owner = $1, owner_incarnation = $2, epoch = epoch + 1, wanted_by = NULL, \
             wanted_firmly = 0 WHERE session_id IN (SELECT free.session_id FROM sessions AS free \
             LEFT JOIN hosts ON hosts.host_id = free.owner AND hosts.incarnation = free.owner_incarnation \
             AND hosts.lease_until >= {now} AND (hosts.host_id <> $1 OR hosts.incarnation <> $2 OR $3 <> free.session_id) \
             WHERE free.mode = 'official' AND free.status = 'open' AND hosts.host_id IS NULL \
             AND ($3 = '' OR $3 = free.session_id) \
             AND (free.wanted_by IS NULL OR free.wanted_by = $1 OR NOT EXISTS (SELECT 1 FROM hosts AS wanting \
             WHERE wanting.host_id = free.wanted_by AND wanting.lease_until >= {now})) \
             ORDER BY CASE WHEN free.wanted_by = $1 THEN 0 ELSE 1 END, free.created_at, free.session_id \
             LIMIT $4{}) RETURNING session_id, epoch",
            self.dialect.lock_rows_of("free")
        );
        let taken: Vec<(String, i64)> = sqlx::query_as(AssertSqlSafe(sql))
            .bind(self.host.host_id.clone())
            .bind(self.host.incarnation())
            .bind(only.unwrap_or_default().to_owned())
            .bind(count(max))
            .fetch_all(&mut *transaction)
            .await?;
        transaction.commit().await?;
        Ok(taken.into_iter().map(|(session_id, epoch)| Held::new(session_id, epoch)).collect())
    }

    /// Takes a session that its owner has given up, unless another host wants it.
    pub async fn take_released(&self, session_id: &str) -> Result<Option<Held>, StoreError> {
        let query = sqlx::query_as(
            "UPDATE sessions SET owner = $1, owner_incarnation = $2, epoch = epoch + 1, wanted_by = NULL, \
             wanted_firmly = 0 WHERE session_id = $3 AND mode = 'official' AND status = 'open' AND owner IS NULL \
             AND (wanted_by IS NULL OR wanted_by = $1) RETURNING session_id, epoch",
        );
        let query = query.bind(self.host.host_id.clone()).bind(self.host.incarnation());
        let mut transaction = self.write().await?;
        let taken: Option<(String, i64)> =
            query.bind(session_id.to_owned()).fetch_optional(&mut *transaction).await?;
        transaction.commit().await?;
        Ok(taken.map(|(session_id, epoch)| Held::new(session_id, epoch)))
    }

    /// The official sessions of this process that are open, or have an open run.
    pub async fn own_sessions(&self) -> Result<Vec<Held>, StoreError> {
        let query = sqlx::query_as(
            "SELECT session_id, epoch FROM sessions WHERE mode = 'official' AND owner = $1 AND owner_incarnation = $2 \
             AND (status = 'open' OR session_id IN (SELECT runs.session_id FROM runs WHERE runs.status = 'open')) \
             ORDER BY session_id",
        );
        let query = query.bind(self.host.host_id.clone()).bind(self.host.incarnation());
        let own: Vec<(String, i64)> = query.fetch_all(&self.pool()).await?;
        Ok(own.into_iter().map(|(session_id, epoch)| Held::new(session_id, epoch)).collect())
    }

    /// Ends the practice sessions of hosts that are gone. Their runs are left to [`Store::take_ended_sessions`].
    pub async fn end_lost_practice(&self) -> Result<(), StoreError> {
        let now = self.dialect.now_ms();
        let sql = format!(
            "UPDATE sessions SET status = 'ended', ended_at = $1, epoch = epoch + 1 WHERE mode = 'practice' \
             AND status = 'open' AND NOT EXISTS (SELECT 1 FROM hosts WHERE hosts.host_id = sessions.owner \
             AND hosts.incarnation = sessions.owner_incarnation AND hosts.lease_until >= {now})"
        );
        sqlx::query(AssertSqlSafe(sql)).bind(super::unix_ms()).execute(&self.pool()).await?;
        Ok(())
    }

    /// Makes this process the owner of sessions that have ended with an open run, while no host was there to close it.
    pub async fn take_ended_sessions(&self) -> Result<Vec<Held>, StoreError> {
        let mut transaction = self.write().await?;
        let sql = format!(
            "UPDATE sessions SET owner = $1, owner_incarnation = $2, epoch = epoch + 1 WHERE session_id IN \
             (SELECT ended.session_id FROM sessions AS ended WHERE ended.status <> 'open' AND ended.session_id IN \
             (SELECT runs.session_id FROM runs WHERE runs.status = 'open') AND NOT EXISTS (SELECT 1 FROM hosts \
             WHERE hosts.host_id = ended.owner AND hosts.incarnation = ended.owner_incarnation \
             AND hosts.lease_until >= {}) ORDER BY ended.session_id{}) RETURNING session_id, epoch",
            self.dialect.now_ms(),
            self.dialect.lock_rows_of("ended")
        );
        let taken: Vec<(String, i64)> = sqlx::query_as(AssertSqlSafe(sql))
            .bind(self.host.host_id.clone())
            .bind(self.host.incarnation())
            .fetch_all(&mut *transaction)
            .await?;
        transaction.commit().await?;
        Ok(taken.into_iter().map(|(session_id, epoch)| Held::new(session_id, epoch)).collect())
    }

    /// Gives a session up: whoever wants it may take it.
    pub async fn release_session(&self, held: &Held) -> Result<(), StoreError> {
        let mut transaction = self.fenced(held).await?;
        sqlx::query("UPDATE sessions SET owner = NULL, owner_incarnation = NULL WHERE session_id = $1")
            .bind(held.session_id.clone())
            .execute(&mut *transaction)
            .await?;
        Ok(transaction.commit().await?)
    }

    /// Asks the owner of a session for it, since its client is here.
    pub async fn want_session(&self, session_id: &str, firmly: bool) -> Result<(), StoreError> {
        sqlx::query(
            "UPDATE sessions SET wanted_by = $1, wanted_firmly = $2 WHERE session_id = $3 AND status = 'open' \
             AND (owner IS NULL OR owner <> $1)",
        )
        .bind(self.host.host_id.clone())
        .bind(i64::from(firmly))
        .bind(session_id.to_owned())
        .execute(&self.pool())
        .await?;
        Ok(())
    }
}
