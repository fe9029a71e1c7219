//! The ranking for all readers of this server: read from the database at most once a second, and only if somebody needs it.

use super::frame::text;
use super::hub::Hub;
use super::messages::{Ranking, WatchReply};
use axum::extract::ws::Utf8Bytes;
use palmares_metrics::METRICS;
use palmares_store::{LeaderboardRow, ReadTeams, Store, StoreError};
use parking_lot::Mutex;
use sqlx::AnyConnection;
use std::sync::{Arc, OnceLock};
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

/// Shortest time from the end of a reading to the begin of the next.
const PERIOD: Duration = Duration::from_secs(1);

/// A ranking as it was read once.
#[derive(Debug)]
pub(crate) struct ReadRanking {
    /// The rows, best first.
    pub(crate) rows: Vec<LeaderboardRow>,
    /// Number of changes that the hub had counted before.
    pub(super) changes: u64,
    /// The revision in the database.
    revision: i64,
    message: OnceLock<Utf8Bytes>,
}

impl ReadRanking {
    /// The message for viewers, written once for all.
    pub(super) fn message(&self) -> Utf8Bytes {
        let write = || text(&WatchReply::Leaderboard(Ranking { rows: self.rows.clone() }));
        self.message.get_or_init(write).clone()
    }
}

/// The outcome of the readings.
#[derive(Clone, Debug, Default)]
pub(super) struct Readings {
    pub(super) newest: Option<Arc<ReadRanking>>,
    failed: u64,
}

/// The task that reads.
#[derive(Debug)]
struct Reader {
    running: bool,
    not_before: Instant,
}

/// The ranking for all readers of this server.
#[derive(Debug)]
pub(crate) struct RankingCache {
    store: Store,
    official: bool,
    hub: Arc<Hub>,
    readings: watch::Sender<Readings>,
    reader: Mutex<Reader>,
    /// What was read last.
    teams: tokio::sync::Mutex<ReadTeams>,
}

impl RankingCache {
    /// The ranking of a competition, or of practice.
    pub(crate) fn new(store: Store, official: bool, hub: Arc<Hub>) -> Self {
        let reader = Mutex::new(Reader { running: false, not_before: Instant::now() });
        RankingCache {
            store,
            official,
            hub,
            readings: watch::Sender::default(),
            reader,
            teams: Default::default(),
        }
    }

    /// The ranking with every change that was stored before this call. After a recent reading it waits for the next one.
    pub(crate) async fn current(self: &Arc<Self>) -> Result<Arc<ReadRanking>, StoreError> {
        let needed = self.hub.ranking_count();
        let mut readings = self.readings.subscribe();
        let failed = readings.borrow().failed;
        loop {
            let seen = readings.borrow_and_update().clone();
            if let Some(newest) = seen.newest.filter(|newest| newest.changes >= needed) {
                return Ok(newest);
            }
            if seen.failed > failed {
                // The error is this caller's own.
                let rows = self.store.leaderboard(self.official).await?;
                let message = OnceLock::new();
                return Ok(Arc::new(ReadRanking { rows, changes: needed, revision: 0, message }));
            }
            self.refresh();
            // The sender is in `self`.
            let _ = readings.changed().await;
        }
    }

    /// Changes with every reading.
    pub(super) fn readings(&self) -> watch::Receiver<Readings> {
        self.readings.subscribe()
    }

    /// Reads the ranking soon, if it has changed since the last reading.
    pub(super) fn refresh(self: &Arc<Self>) {
        let mut reader = self.reader.lock();
        if reader.running || !self.is_stale() {
            return;
        }
        reader.running = true;
        let (cache, begin) = (self.clone(), reader.not_before);
        tokio::spawn(async move {
            sleep_until(begin).await;
            cache.read().await;
        });
    }

    /// Compares the ranking with its revision in the database, which changes with the writes of every server. The beat of a server calls
    /// this.
    pub(crate) async fn follow(&self, connection: &mut AnyConnection) -> Result<(), StoreError> {
        // A stale ranking is read again when somebody needs it.
        if self.is_stale() {
            return Ok(());
        }
        let revision = self.store.leaderboard_revision(connection, self.official).await?;
        if self.readings.borrow().newest.as_ref().is_some_and(|newest| newest.revision != revision) {
            self.hub.ranking_changed();
        }
        Ok(())
    }

    /// Whether the ranking has changed since it was read, or was never read.
    pub(super) fn is_stale(&self) -> bool {
        let needed = self.hub.ranking_count();
        self.readings.borrow().newest.as_ref().is_none_or(|newest| newest.changes < needed)
    }

    async fn read(&self) {
        // Before reading: a change in between is read once more.
        let changes = self.hub.ranking_count();
        let began = Instant::now();
        let mut teams = self.teams.lock().await;
        let read = self.store.read_leaderboard(self.official, &mut teams).await;
        let revision = teams.revision();
        drop(teams);
        METRICS.ranking_read.observe(began.elapsed());
        {
            let mut reader = self.reader.lock();
            *reader = Reader { running: false, not_before: Instant::now() + PERIOD };
        }
        self.readings.send_modify(|readings| match read {
            Ok(rows) => {
                let message = OnceLock::new();
                readings.newest = Some(Arc::new(ReadRanking { rows, changes, revision, message }));
            }
            Err(error) => {
                // Viewers keep the last ranking.
                tracing::error!(%error, "the database failed");
                readings.failed += 1;
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_store::{Host, Location};
    use serde_json::json;

    /// A cache on an empty database in a folder of its own.
    async fn cache() -> (Arc<RankingCache>, tempfile::TempDir) {
        let folder = tempfile::tempdir().expect("a folder");
        let store =
            Store::open(&Location::DataDir(folder.path().into()), &Host::alone()).await.expect("opens");
        (Arc::new(RankingCache::new(store, true, Arc::default())), folder)
    }

    /// Stores a run as another server would: the hub of this one does not notice.
    async fn store_a_run(store: &Store) {
        let row = |columns: serde_json::Value| columns.as_object().expect("an object").clone();
        let session = json!({"session_id": "s", "team": "crabs", "mode": "official", "created_at": 1});
        let run = json!({
            "run_id": "r", "session_id": "s", "team": "crabs", "task": "balls", "hand": "pinch", "mode": "lockstep",
            "sensing": "sensors", "seed_hex": "00", "server_version": "0", "build_hash": "0", "started_at": 1,
            "ended_at": 2, "status": "verified", "score": 1.5, "k": 1,
        });
        let tables = [("sessions".to_owned(), vec![row(session)]), ("runs".to_owned(), vec![row(run)])];
        store.fill(&tables).await.expect("fills");
    }

    #[tokio::test]
    async fn many_readers_share_a_reading_and_every_reader_gets_the_changes_before_it() {
        let (cache, _folder) = cache().await;
        let first = cache.current().await.expect("reads");
        assert!(Arc::ptr_eq(&first, &cache.current().await.expect("reads")), "nothing has changed");
        // The first reading was less than a period ago: all these readers wait for one second reading.
        cache.hub.ranking_changed();
        let began = Instant::now();
        let readers: Vec<_> = (0..100)
            .map(|_| {
                let cache = cache.clone();
                tokio::spawn(async move { cache.current().await.expect("reads") })
            })
            .collect();
        let mut read = Vec::new();
        for reader in readers {
            read.push(reader.await.expect("joins"));
        }
        assert!(read.iter().all(|ranking| Arc::ptr_eq(ranking, &read[0])));
        assert!(!Arc::ptr_eq(&first, &read[0]));
        assert!(began.elapsed() > PERIOD / 2, "not before the period has passed");
        assert_eq!(read[0].message().as_ptr(), read[99].message().as_ptr(), "written once");
        cache.store.close().await;
    }

    #[tokio::test]
    async fn a_change_by_another_server_is_found_by_its_revision() {
        let (cache, _folder) = cache().await;
        let mut connection = cache.store.connection().await.expect("connects");
        let mut count = async || {
            cache.follow(&mut connection).await.expect("reads");
            cache.hub.ranking_count()
        };
        assert_eq!(count().await, 0, "nobody has needed the ranking yet");
        cache.current().await.expect("reads");
        assert_eq!(count().await, 0);
        store_a_run(&cache.store).await;
        assert_eq!(count().await, 1);
        assert_eq!(count().await, 1, "counted once");
        assert_eq!(cache.current().await.expect("reads").rows[0].team, "crabs");
        assert_eq!(count().await, 1);
        cache.store.close().await;
    }

    #[tokio::test]
    async fn a_failure_is_every_readers_own_and_viewers_keep_the_ranking() {
        let (cache, _folder) = cache().await;
        cache.current().await.expect("reads");
        cache.store.close().await;
        cache.hub.ranking_changed();
        assert!(cache.current().await.is_err());
        assert!(cache.readings().borrow().newest.is_some());
    }
}
