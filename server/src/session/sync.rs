//! Locks of [`super::registry`]. A test replaces them to try schedules of its threads.

pub(super) use std::sync::{Mutex, MutexGuard, PoisonError};
