//! The hosts of a fleet, as this one read them last: with every beat, so that a request needs no query.

use palmares_store::HostRow;
use parking_lot::RwLock;

/// The other hosts whose leases are valid.
#[derive(Debug, Default)]
pub(crate) struct OtherHostRows(RwLock<Vec<HostRow>>);

impl OtherHostRows {
    /// Notes what was read.
    pub(crate) fn set(&self, rows: Vec<HostRow>) {
        *self.0.write() = rows;
    }

    /// A value of each.
    pub(crate) fn each<T>(&self, value: impl Fn(&HostRow) -> T) -> Vec<T> {
        self.0.read().iter().map(value).collect()
    }

    /// The place of a session in the queue of its host, from 1.
    pub(crate) fn place_in_queue(&self, session_id: &str) -> Option<usize> {
        let places = self.each(|host| host.waiting().position(|waiting| waiting == session_id));
        places.into_iter().flatten().next().map(|ahead| ahead + 1)
    }
}
