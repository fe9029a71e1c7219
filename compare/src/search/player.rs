//! Plays what a search asks for, several plays at once, and keeps the outcomes.

use super::halving::Player;
use super::kept::{At, Sets};
use super::plays::{SearchScene, Wanted};
use super::score::Outcome;
use crate::engine::EngineKind;
use anyhow::Result;
use parking_lot::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Plays are written at least this often.
const SAVED_EVERY: Duration = Duration::from_secs(30);

/// Plays on engines.
pub(super) struct Engines<'a> {
    pub scene: &'a SearchScene,
    /// All plays of the scene.
    pub plays: Vec<At>,
    pub limit_s: f64,
    /// Number of plays at once.
    pub jobs: usize,
    /// The end of the time that it has.
    pub until: Option<Instant>,
    /// The plays that are known.
    pub sets: Mutex<Sets>,
    /// Writes them.
    pub save: &'a (dyn Fn(&Sets) -> Result<()> + Sync),
}

impl Engines<'_> {
    fn time_is_up(&self) -> bool {
        self.until.is_some_and(|end| Instant::now() >= end)
    }

    fn known(&self, kind: EngineKind, at: At) -> Option<Outcome> {
        self.sets.lock().get(kind.settings())?.get(&at).copied()
    }

    fn play_one(&self, kind: EngineKind, at: At) -> Result<()> {
        let outcome = Wanted { scene: self.scene, kind, at, limit_s: self.limit_s }.play()?;
        self.sets.lock().entry(kind.settings().to_owned()).or_default().insert(at, outcome);
        Ok(())
    }

    /// Plays what is missing; `false` if the time was up before the end.
    fn play_all(&self, missing: &[(EngineKind, At)]) -> Result<bool> {
        let (next, failed) = (AtomicUsize::new(0), Mutex::new(None));
        let (begin, progress) = (Instant::now(), Mutex::new((0, Instant::now())));
        let work = || {
            while let Some(&(kind, at)) = missing.get(next.fetch_add(1, Ordering::Relaxed)) {
                if self.time_is_up() {
                    return;
                }
                let (done, saved) = &mut *match self.play_one(kind, at) {
                    Ok(()) => progress.lock(),
                    Err(error) => {
                        *failed.lock() = Some(error);
                        next.store(missing.len(), Ordering::Relaxed);
                        return;
                    }
                };
                *done += 1;
                if saved.elapsed() < SAVED_EVERY {
                    continue;
                }
                *saved = Instant::now();
                let left_min =
                    begin.elapsed().as_secs_f64() / *done as f64 * (missing.len() - *done) as f64 / 60.0;
                println!("  {done} of {} plays, {left_min:.1} min left", missing.len());
                if let Err(error) = (self.save)(&self.sets.lock()) {
                    *failed.lock() = Some(error);
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..self.jobs.max(1) {
                scope.spawn(work);
            }
        });
        (self.save)(&self.sets.lock())?;
        match failed.into_inner() {
            Some(error) => Err(error),
            None => Ok(progress.into_inner().0 == missing.len()),
        }
    }
}

impl Player for Engines<'_> {
    fn play(&self, asked: &[(EngineKind, usize)]) -> Result<Option<Vec<Outcome>>> {
        let wanted = asked.iter().map(|&(kind, number)| (kind, self.plays[number]));
        let wanted: Vec<(EngineKind, At)> = wanted.collect();
        let missing: Vec<_> =
            wanted.iter().copied().filter(|&(kind, at)| self.known(kind, at).is_none()).collect();
        if !missing.is_empty() {
            let engine = missing[0].0.name();
            println!(
                "{} {engine}: {} plays, {} of them known",
                self.scene.name,
                wanted.len(),
                wanted.len() - missing.len()
            );
            if !self.play_all(&missing)? {
                return Ok(None);
            }
        }
        Ok(wanted.iter().map(|&(kind, at)| self.known(kind, at)).collect())
    }
}
