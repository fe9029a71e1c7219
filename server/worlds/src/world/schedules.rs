//! Random schedules of the threads that use a backlog: world, client, shipper, and the next owner.
//!
//! `PALMARES_SCHEDULES=100000 cargo test -p palmares-worlds backlog_schedules -- --nocapture` tries more, and prints their number.

/// The module's copy with locks and atomics that try schedules.
mod sync {
    pub(super) use palmares_random_schedules::Mutex;
    pub(super) use shuttle::sync::Arc;
    pub(super) use shuttle::sync::atomic::{AtomicBool, AtomicU64, Ordering};
}

#[expect(clippy::duplicate_mod, reason = "this copy has other locks")]
#[expect(unreachable_pub, reason = "this copy is private")]
#[expect(dead_code, reason = "the schedules use a part of it")]
#[path = "backlog.rs"]
mod backlog;

use backlog::{Backlog, Gate, Group, Lost, MAX_UNSTORED};
use palmares_random_schedules::try_schedules;
use shuttle::rand::{Rng, thread_rng};
use shuttle::sync::atomic::{AtomicU64, Ordering};
use shuttle::sync::{Arc, Mutex};
use shuttle::{future, thread};
use std::collections::BTreeMap;

/// Number of schedules that the tests try.
const SCHEDULES: usize = 150;
/// Ticks of a run: more than the gate lets pass.
const TICKS: u64 = MAX_UNSTORED + 8;
/// Ticks without a statement that wake the shipper.
const AT_ONCE: usize = 10;

/// The rows of a run, its session's epoch, and statements whose answer was lost: they may still succeed.
#[derive(Default)]
struct Database {
    epoch: u64,
    rows: BTreeMap<u64, Vec<u64>>,
    late: Vec<(u64, u64, Vec<u64>)>,
}

impl Database {
    /// As the fenced statement: false if the session has another owner.
    fn store(&mut self, epoch: u64, from: u64, ticks: &[u64]) -> bool {
        if epoch == self.epoch {
            self.rows.insert(from, ticks.to_vec());
        }
        epoch == self.epoch
    }

    fn send(&mut self, group: &Group<u64>) -> Result<bool, ()> {
        let ticks = group.ticks.to_vec();
        match thread_rng().gen_range(0..4) {
            0 => {
                self.late.push((0, group.from, ticks));
                Err(())
            }
            1 => {
                self.store(0, group.from, &ticks);
                Err(())
            }
            _ => Ok(self.store(0, group.from, &ticks)),
        }
    }

    /// A statement that was given up succeeds after all.
    fn late(&mut self) {
        if !self.late.is_empty() {
            let (epoch, from, ticks) = self.late.remove(0);
            self.store(epoch, from, &ticks);
        }
    }

    /// All ticks in order, without gaps.
    fn log(&self) -> Vec<u64> {
        let mut log = Vec::new();
        for (from, ticks) in &self.rows {
            assert_eq!(*from, log.len() as u64, "a gap, or a row twice");
            log.extend(ticks);
        }
        log
    }
}

/// Sends until all is stored, or the session has another owner.
fn ship(backlog: &Backlog<u64>, database: &Mutex<Database>, ended: &AtomicU64) {
    loop {
        let last = ended.load(Ordering::SeqCst) == 1;
        match backlog.take() {
            Some(group) => {
                let answer = database.lock().expect("whole").send(&group);
                match answer {
                    Ok(true) => backlog.confirm(),
                    Ok(false) => return backlog.lose(),
                    Err(()) => {}
                }
            }
            None if last => return,
            None => thread::yield_now(),
        }
        if thread_rng().gen_bool(0.2) {
            database.lock().expect("whole").late();
        }
    }
}

/// Plays in lockstep. Returns the last tick that the client has seen.
fn play(backlog: &Backlog<u64>, database: &Mutex<Database>) -> Result<u64, (u64, Lost)> {
    let gate: Gate = backlog.gate().clone();
    let mut tick = 0;
    while tick < TICKS {
        // A step of one to three ticks. The observers get its last tick after the answer.
        let repeat = thread_rng().gen_range(1..=3);
        (1..repeat).for_each(|ahead| _ = backlog.add(tick + ahead));
        tick += repeat;
        if let Err(lost) = future::block_on(gate.open(tick)) {
            return Err((tick - repeat, lost));
        }
        let stored = database.lock().expect("whole").rows.values().map(Vec::len).sum::<usize>() as u64;
        assert!(tick <= stored + MAX_UNSTORED, "the client sees tick {tick}, and {stored} are stored");
        assert!(backlog.add(tick) <= AT_ONCE + TICKS as usize);
    }
    Ok(tick)
}

#[test]
fn backlog_schedules_of_a_run_with_a_failing_database() {
    try_schedules("a failing database", SCHEDULES, || {
        let (backlog, database) = (Backlog::new(), Arc::new(Mutex::new(Database::default())));
        let ended = Arc::new(AtomicU64::new(0));
        let shipper = {
            let (backlog, database, ended) = (backlog.clone(), database.clone(), ended.clone());
            thread::spawn(move || ship(&backlog, &database, &ended))
        };
        let seen = play(&backlog, &database).expect("one owner");
        future::block_on(backlog.all_stored()).expect("one owner");
        assert_eq!(database.lock().expect("whole").log(), (1..=seen).collect::<Vec<_>>());
        ended.store(1, Ordering::SeqCst);
        shipper.join().expect("no panic");
        let mut database = database.lock().expect("whole");
        (0..database.late.len()).for_each(|_| database.late());
        assert_eq!(database.log(), (1..=seen).collect::<Vec<_>>(), "late statements change nothing");
    });
}

#[test]
fn backlog_schedules_of_a_run_that_is_taken_over() {
    try_schedules("a take-over", SCHEDULES, || {
        let (backlog, database) = (Backlog::new(), Arc::new(Mutex::new(Database::default())));
        let ended = Arc::new(AtomicU64::new(0));
        let shipper = {
            let (backlog, database, ended) = (backlog.clone(), database.clone(), ended.clone());
            thread::spawn(move || ship(&backlog, &database, &ended))
        };
        let other = {
            let database = database.clone();
            thread::spawn(move || {
                let mut database = database.lock().expect("whole");
                database.epoch += 1;
                database.log().len() as u64
            })
        };
        let seen = match play(&backlog, &database) {
            Ok(seen) => seen,
            Err((seen, Lost)) => seen,
        };
        let continued = other.join().expect("no panic");
        assert!(seen <= continued + MAX_UNSTORED, "{seen} seen, {continued} continued");
        ended.store(1, Ordering::SeqCst);
        shipper.join().expect("no panic");
        let mut database = database.lock().expect("whole");
        (0..database.late.len()).for_each(|_| database.late());
        assert_eq!(database.log().len() as u64, continued, "the earlier owner writes nothing more");
    });
}
