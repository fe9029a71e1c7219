//! Progress of long work on standard error.

use std::time::{Duration, Instant};

/// Time before the first line, and between two lines.
const PERIOD: Duration = Duration::from_secs(3);

/// Prints the progress of work that takes long.
pub(crate) struct Progress {
    /// Name of the work.
    what: String,
    due: Instant,
}

impl Progress {
    /// For work that begins now.
    pub(crate) fn of(what: impl Into<String>) -> Self {
        Progress { what: what.into(), due: Instant::now() + PERIOD }
    }

    /// Reports progress; `how_far` is called only if a line is due.
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
    fn short_work_prints_nothing_and_long_work_one_line_a_period() {
        let (mut progress, mut lines) = (Progress::of("counting"), 0);
        let mut report = |progress: &mut Progress| {
            progress.at(|| {
                lines += 1;
                "half".to_owned()
            });
            lines
        };
        assert_eq!(report(&mut progress), 0);
        progress.due = Instant::now();
        assert_eq!(report(&mut progress), 1);
        assert_eq!(report(&mut progress), 1);
    }
}
