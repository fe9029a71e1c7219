//! The kept ranking equals the one that is computed from all runs.

use super::*;
use crate::location::Dialect;
use std::collections::BTreeMap;

/// A row of the query: the best run of a team in a task, its team's runs that count, and its team's runs with the true state.
type Best = (String, String, f64, String, String, i64, i64, i64);

/// Team, runs, whether it only used sensors, and score, run, status and end of its best run of each task.
type Standing = BTreeMap<String, (i64, bool, BTreeMap<String, (f64, String, String, i64)>)>;

/// The ranking, from all runs.
async fn computed(store: &Store, official: bool) -> Standing {
    let best: Vec<Best> = sqlx::query_as(
        "SELECT team, task, score, run_id, status, ended_at, runs, \
             (SELECT COUNT(*) FROM runs AS seeing WHERE seeing.team = ranked.team AND sensing = 'truth' \
              AND (seeing.k IS NOT NULL) = ($1 = 1)) AS seeing FROM ( \
           SELECT team, task, score, run_id, status, ended_at, \
                  COUNT(*) OVER (PARTITION BY team) AS runs, \
                  ROW_NUMBER() OVER (PARTITION BY team, task ORDER BY score DESC, ended_seq, run_id) AS place \
           FROM runs WHERE score IS NOT NULL AND (status = 'practice' AND $1 = 0 OR \
             status IN ('provisional', 'verified') AND $1 = 1) \
         ) AS ranked WHERE place = 1",
    )
    .bind(i64::from(official))
    .fetch_all(&store.pool())
    .await
    .expect("query");
    let mut teams = Standing::new();
    for (team, task, score, run_id, status, ended_at, runs, seeing) in best {
        let row = teams.entry(team).or_insert((runs, seeing == 0, BTreeMap::new()));
        row.2.insert(task, (score, run_id, status, ended_at));
    }
    teams
}

/// The ranking, as it is kept.
async fn kept(store: &Store, official: bool) -> Standing {
    let rows = store.leaderboard(official).await.expect("query");
    let standing = |row: LeaderboardRow| {
        let tasks = row.tasks.into_iter();
        let tasks = tasks.map(|(task, b)| (task, (b.score, b.run_id, b.status, b.ended_unix_ms))).collect();
        (row.team, (row.runs, row.sensors_only, tasks))
    };
    rows.into_iter().map(standing).collect()
}

async fn assert_kept(store: &Store, after: &str) {
    for official in [false, true] {
        assert_eq!(kept(store, official).await, computed(store, official).await, "{after}");
    }
}

/// A xorshift generator: the sequences are the same in every run.
struct Draw(u64);

impl Draw {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 % end as u64).expect("small")
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }
}

fn entry<'a>(action: &'a str, subject: &'a str) -> NewAuditEntry<'a> {
    NewAuditEntry { actor: "tok_1", action, subject, reason: Some("because") }
}

/// One write that may change the ranking, of a random run. Returns its name.
async fn random_write(store: &Store, draw: &mut Draw, runs: &mut Vec<(String, bool)>) -> String {
    let write = draw.below(10);
    if write < 3 || runs.is_empty() {
        let (n, official) = (runs.len(), draw.below(3) > 0);
        let (team, task) = (draw.of(&["crabs", "eels", "rays"]), draw.of(&["balls", "shelf"]));
        let sensing = if draw.below(8) == 0 { Sensing::Truth } else { Sensing::Sensors };
        let (mode, k) = if official { ("official", Some(n as u64 + 1)) } else { ("practice", None) };
        begin_in(store, mode, team, task, &format!("r{n}"), k, sensing).await;
        runs.push((format!("r{n}"), official));
        return format!("begin r{n}");
    }
    let (run_id, official) = runs[draw.below(runs.len())].clone();
    let status = if official { "provisional" } else { "practice" };
    match write {
        3..=6 => {
            let status = if draw.below(6) == 0 { draw.of(&["voided", "aborted"]) } else { status };
            // Few scores, so that ties are common.
            finish(store, &run_id, draw.of(&[-0.5, 0.0, 1.0, 2.5]), status).await;
            store.set_replay(&run_id, "replays/r.mcap", "ef").await.expect("notes");
            format!("finish {run_id} as {status}")
        }
        7 => {
            let verdict = draw.of(&[VerificationStatus::Verified, VerificationStatus::Rejected]);
            judge(store, &run_id, verdict).await;
            format!("{verdict:?} {run_id}")
        }
        8 if draw.below(2) == 0 => {
            store.reverify(&run_id, &entry("run.reverify", &run_id)).await.expect("query");
            format!("reverify {run_id}")
        }
        8 => {
            store.void_run(&run_id, &entry("run.void", &run_id)).await.expect("query");
            format!("void {run_id}")
        }
        _ if draw.below(4) == 0 => {
            for (run_id, _) in runs {
                store.abort_open_runs(&held(&format!("s-{run_id}"))).await.expect("aborts");
            }
            "abort all open".into()
        }
        _ => {
            let session = format!("s-{run_id}");
            store.void_session(&session, &entry("session.void", &session)).await.expect("query");
            format!("void {session}")
        }
    }
}

#[tokio::test]
async fn the_kept_ranking_is_that_of_all_runs_after_any_writes() {
    for (index, place) in places().await.into_iter().enumerate() {
        let store = place.open().await;
        let (mut draw, mut runs, mut writes) = (Draw(7), Vec::new(), Vec::new());
        let (mut revision, mut connection) = (0, store.connection().await.expect("connects"));
        let mut read = ReadTeams::default();
        for i in 0..150 {
            let before = kept(&store, true).await;
            writes.push(random_write(&store, &mut draw, &mut runs).await);
            let last = format!("{i}: {}", writes.last().expect("one"));
            assert_kept(&store, &last).await;
            let now = store.leaderboard_revision(&mut connection, true).await.expect("query");
            assert!(now > revision || now == revision && kept(&store, true).await == before, "{last}");
            // Read from what was read before and the changes since.
            let rows = store.read_leaderboard(true, &mut read).await.expect("query");
            assert_eq!(
                (rows, read.revision()),
                (store.leaderboard(true).await.expect("query"), now),
                "{last}"
            );
            revision = now;
        }
        assert!(!kept(&store, true).await.is_empty() && !kept(&store, false).await.is_empty());
        for verb in ["Rejected", "void r", "void s-", "reverify", "abort", "finish"] {
            assert!(writes.iter().any(|write| write.starts_with(verb)), "no {verb} in {writes:?}");
        }

        // A backup does not contain the ranking; its runs make it again.
        let tables = store.dump().await.expect("dumps");
        let other = places().await.swap_remove(index);
        let copy = other.open().await;
        copy.fill(&tables).await.expect("restores");
        assert_kept(&copy, "restore").await;
        for official in [false, true] {
            assert_eq!(kept(&copy, official).await, kept(&store, official).await);
        }
        copy.close().await;
        store.close().await;
    }
}

#[tokio::test]
async fn the_ranking_of_an_older_database_is_computed_once() {
    for place in places().await {
        let store = place.open().await;
        let (mut draw, mut runs) = (Draw(11), Vec::new());
        for _ in 0..60 {
            random_write(&store, &mut draw, &mut runs).await;
        }
        let before = [kept(&store, false).await, kept(&store, true).await];
        // Back to the schema before the ranking was kept; the next start migrates again.
        let undo = match store.dialect {
            Dialect::Sqlite => {
                "DROP TRIGGER runs_truth; DROP TRIGGER runs_restored; DROP TRIGGER runs_judged; DROP VIEW best_counted;"
            }
            Dialect::Postgres => {
                "DROP TRIGGER runs_begun ON runs; DROP TRIGGER runs_judged ON runs; DROP FUNCTION runs_begun; \
                 DROP FUNCTION runs_judged; DROP FUNCTION best_counted;"
            }
        };
        let undo = format!(
            "{undo} DROP TABLE best; DROP INDEX runs_best_official; DROP INDEX runs_best_practice; DROP INDEX runs_session; \
             CREATE INDEX runs_best ON runs (team, task, score); DROP INDEX runs_ended; \
             ALTER TABLE runs DROP COLUMN ended_seq; DELETE FROM _sqlx_migrations WHERE version IN (8, 14)"
        );
        sqlx::raw_sql(sqlx::AssertSqlSafe(undo)).execute(&store.pool()).await.expect("undoes");
        store.close().await;

        let store = place.open().await;
        assert_kept(&store, "migration").await;
        assert_eq!([kept(&store, false).await, kept(&store, true).await], before);
        random_write(&store, &mut draw, &mut runs).await;
        assert_kept(&store, "after the migration").await;
        store.close().await;
    }
}

#[tokio::test]
async fn a_change_with_an_older_time_is_found_by_the_sum_of_revisions() {
    for place in places().await {
        let store = place.open().await;
        for (k, team) in ["crabs", "eels"].into_iter().enumerate() {
            begin_in(&store, "official", team, "balls", team, Some(k as u64 + 1), Sensing::Sensors).await;
            finish(&store, team, 1.0, "provisional").await;
        }
        let mut read = ReadTeams::default();
        assert_eq!(store.read_leaderboard(true, &mut read).await.expect("query").len(), 2);
        // As after a long transaction, or with the database's clock set back by a minute.
        judge(&store, "eels", VerificationStatus::Rejected).await;
        let older = "UPDATE best SET changed_at = changed_at - 60000 WHERE team = 'eels'";
        sqlx::query(older).execute(&store.pool()).await.expect("older");
        let rows = store.read_leaderboard(true, &mut read).await.expect("query");
        assert_eq!(rows, store.leaderboard(true).await.expect("query"));
        assert_eq!((rows.len(), rows[0].team.as_str()), (1, "crabs"));
        store.close().await;
    }
}

#[tokio::test]
async fn results_that_are_stored_at_once_are_all_in_the_ranking() {
    for place in places().await {
        let store = place.open().await;
        for n in 0..24 {
            begin_in(&store, "official", "crabs", "balls", &format!("r{n}"), Some(n + 1), Sensing::Sensors)
                .await;
        }
        let mut writers = Vec::new();
        for n in 0..24 {
            let store = store.clone();
            writers.push(tokio::spawn(async move {
                let run_id = format!("r{n}");
                finish(&store, &run_id, f64::from(n % 7), "provisional").await;
                if n % 2 == 0 {
                    let verdict = VerificationStatus::Rejected;
                    judge(&store, &run_id, verdict).await;
                }
            }));
        }
        for writer in writers {
            writer.await.expect("joins");
        }
        assert_kept(&store, "concurrent writes").await;
        assert_eq!(kept(&store, true).await["crabs"].0, 12);
        store.close().await;
    }
}

/// Ends a run at a time of the server's clock.
async fn finish_at(store: &Store, run_id: &str, score: f64, ended_unix_ms: i64) {
    let outcome = outcome(score);
    let run = FinishedRunRow {
        held: &held(&format!("s-{run_id}")),
        replay: None,
        ended_unix_ms: Some(ended_unix_ms),
        run_id,
        status: "practice",
        outcome: &outcome,
        note: None,
        missed_ticks: 0,
        cost_s: (1.0, 1.0),
        clock: None,
    };
    store.finish_run(&run).await.expect("finish");
}

#[tokio::test]
async fn a_clock_that_is_set_back_changes_no_tie() {
    for place in places().await {
        let store = place.open().await;
        for (team, run_id) in [("a", "r9"), ("b", "r5"), ("a", "r1"), ("a", "r7")] {
            begin(&store, team, "balls", run_id).await;
        }
        // By the clock the second one ended an hour before the first.
        let hour = 3_600_000;
        finish_at(&store, "r9", 4.0, 10 * hour).await;
        finish_at(&store, "r5", 4.0, 9 * hour).await;
        finish_at(&store, "r1", 4.0, 8 * hour).await;
        let ranking = |rows: Vec<LeaderboardRow>| {
            rows.into_iter()
                .map(|row| (row.rank, row.team, row.tasks["balls"].run_id.clone()))
                .collect::<Vec<_>>()
        };
        let expected = vec![(1, "a".to_owned(), "r9".to_owned()), (2, "b".to_owned(), "r5".to_owned())];
        assert_eq!(ranking(store.leaderboard(false).await.expect("query")), expected);
        // Also after a restore.
        let tables = store.dump().await.expect("dumps");
        for copy in places().await {
            let copy = copy.open().await;
            copy.fill(&tables).await.expect("fills");
            assert_eq!(ranking(copy.leaderboard(false).await.expect("query")), expected);
            // The next one comes after all others, whatever its clock says.
            finish_at(&copy, "r7", 4.0, hour).await;
            assert_eq!(ranking(copy.leaderboard(false).await.expect("query")), expected);
            copy.close().await;
        }
        // A backup of an earlier version has no order but that of the clock.
        let mut old = tables;
        for row in old.iter_mut().filter(|(table, _)| table == "runs").flat_map(|(_, rows)| rows) {
            row.remove("ended_seq");
        }
        let copy = places().await.remove(0);
        let copy = copy.open().await;
        copy.fill(&old).await.expect("fills");
        let first = ranking(copy.leaderboard(false).await.expect("query"))[0].clone();
        assert_eq!(first, (1, "a".to_owned(), "r1".to_owned()));
        copy.close().await;
        store.close().await;
    }
}
