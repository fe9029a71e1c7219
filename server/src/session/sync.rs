//! Locks of [`super::registry`]. A test replaces them to try schedules of its threads.

pub(super) use parking_lot::Mutex;
