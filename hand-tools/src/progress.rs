//! How far long work has got, on standard error: whoever waits sees that something goes on.

use std::time::{Duration, Instant};

/// So long nothing is said, and so long between two lines.
const PERIOD: Duration = Duration::from_secs(3);

/// Tells how far work has got, if it takes long.
pub(crate) struct Progress {
    /// What is done, of which a line tells.
    what: String,
    due: Instant,
}

impl Progress {
    /// Of a piece of work that begins now.
    pub(crate) fn of(what: impl Into<String>) -> Self {
        Progress { what: what.into(), due: Instant::now() + PERIOD }
    }

    /// It has got so far; `how_far` is asked only when a line is due.
    pub(crate) fn at(&mut self, how_far: impl FnOnce() -> String) {
        let now = Instant::now();
        if now >= self.due {
            self.due = now + PERIOD;
            eprintln!("{}: {}", self.what, how_far());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_work_says_nothing_and_long_work_not_too_much() {
        let (mut progress, mut lines) = (Progress::of("counting"), 0);
        let mut tell = |progress: &mut Progress| {
            progress.at(|| {
                lines += 1;
                "so far".to_owned()
            });
            lines
        };
        assert_eq!(tell(&mut progress), 0);
        progress.due = Instant::now();
        assert_eq!(tell(&mut progress), 1);
        assert_eq!(tell(&mut progress), 1);
    }
}
