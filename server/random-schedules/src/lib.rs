//! Tries random schedules of a test's threads, with shuttle.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A lock with the methods of parking_lot's, which tries schedules.
#[derive(Debug, Default)]
pub struct Mutex<T>(shuttle::sync::Mutex<T>);

impl<T> Mutex<T> {
    /// A lock of this value.
    pub fn new(value: T) -> Self {
        Mutex(shuttle::sync::Mutex::new(value))
    }

    /// Waits for the lock, and holds it while the guard lives.
    pub fn lock(&self) -> shuttle::sync::MutexGuard<'_, T> {
        self.0.lock().expect("no schedule panics while it holds the lock")
    }
}

/// Tries `number` schedules, or as many as `PALMARES_SCHEDULES` says, and prints their number.
pub fn try_schedules(name: &str, number: usize, schedule: fn()) {
    let wanted = std::env::var("PALMARES_SCHEDULES").ok().and_then(|number| number.parse().ok());
    let tried = Arc::new(AtomicUsize::new(0));
    let count = tried.clone();
    shuttle::check_random(
        move || {
            count.fetch_add(1, Ordering::Relaxed);
            schedule();
        },
        wanted.unwrap_or(number),
    );
    println!("{name}: {} schedules", tried.load(Ordering::Relaxed));
}
