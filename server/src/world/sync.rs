//! Locks and atomics of [`super::backlog`]. A test replaces them to try schedules of its threads.

pub(super) use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
pub(super) use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
