//! The past actions of a run, to be played again for a replay. Copies share their common part, so that
//! snapshots and forks of long runs cost next to nothing.

use palmares_tasks::Action;
use palmares_tasks::observation::Wrench;
use std::sync::Arc;

/// Actions in a shared part. Later actions are copied with every snapshot.
const PART: usize = 8;

/// A push that begins with the next tick.
#[derive(Clone, Debug)]
pub(crate) struct Push {
    pub(crate) link: String,
    pub(crate) wrench: Wrench,
    pub(crate) duration_s: f64,
}

/// The inputs of a tick.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) pushes: Vec<Push>,
    pub(crate) action: Action,
}

/// The ticks of a run, the oldest first.
#[derive(Clone, Debug, Default)]
pub(crate) struct History {
    full: Option<Arc<HistorySegment>>,
    last: Vec<Entry>,
}

#[derive(Debug)]
struct HistorySegment {
    before: Option<Arc<HistorySegment>>,
    entries: Vec<Entry>,
}

impl History {
    /// Another tick.
    pub(crate) fn push(&mut self, entry: Entry) {
        self.last.push(entry);
        if self.last.len() == PART {
            let entries = std::mem::take(&mut self.last);
            self.full = Some(Arc::new(HistorySegment { before: self.full.take(), entries }));
        }
    }

    /// All ticks, the oldest first.
    pub(crate) fn entries(&self) -> Vec<Entry> {
        let mut parts = Vec::new();
        let mut part = self.full.as_ref();
        while let Some(this) = part {
            parts.push(this.entries.as_slice());
            part = this.before.as_ref();
        }
        parts.reverse();
        parts.push(&self.last);
        parts.concat()
    }
}

impl Drop for HistorySegment {
    /// One after the other: a long run's parts would not fit on the stack.
    fn drop(&mut self) {
        let mut before = self.before.take();
        while let Some(mut part) = before.and_then(Arc::into_inner) {
            before = part.before.take();
        }
    }
}
