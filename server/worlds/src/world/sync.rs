//! Locks and atomics of [`super::backlog`]. A test replaces them to try schedules of its threads.

pub(super) use parking_lot::Mutex;
pub(super) use std::sync::Arc;
pub(super) use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
