//! The progress of many replays, on standard error.

use std::io::{IsTerminal, Write, stderr};
use std::time::{Duration, Instant};

/// Time between two lines where standard error is no terminal, such as in a log.
const LOG_PERIOD: Duration = Duration::from_secs(10);

/// A line that changes, or lines of a log.
pub(super) struct Progress {
    shown: bool,
    total: usize,
    terminal: bool,
    /// Whether the terminal has a line that is to be replaced.
    open: bool,
    logged: Instant,
}

impl Progress {
    pub(super) fn new(shown: bool, total: usize) -> Self {
        Progress { shown, total, terminal: stderr().is_terminal(), open: false, logged: Instant::now() }
    }

    /// Shows the progress. The reader of standard error may have ended.
    pub(super) fn show(&mut self, done: usize, not_verified: usize, elapsed: Duration) {
        if !self.shown || (!self.terminal && self.logged.elapsed() < LOG_PERIOD) {
            return;
        }
        let line = line(done, self.total, not_verified, elapsed);
        if self.terminal {
            let _ = write!(stderr(), "\r{line}\x1b[K");
            self.open = true;
        } else {
            let _ = writeln!(stderr(), "{line}");
            self.logged = Instant::now();
        }
    }

    /// Removes the line from the terminal.
    pub(super) fn clear(&mut self) {
        if std::mem::take(&mut self.open) {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}

fn line(done: usize, total: usize, not_verified: usize, elapsed: Duration) -> String {
    let rate = done as f64 / elapsed.as_secs_f64().max(1e-3);
    let mut line = format!("{done} of {total} replays, {rate:.1} per second");
    if done > 0 {
        let left = Duration::from_secs_f64((total - done) as f64 / rate);
        line += &format!(", {} left", duration(left));
    }
    if not_verified > 0 {
        line += &format!(", {not_verified} not verified");
    }
    line
}

/// `2 h 5 min`, `3 min 20 s` or `4.2 s`.
pub(super) fn duration(time: Duration) -> String {
    let s = time.as_secs();
    match s {
        0..60 => format!("{:.1} s", time.as_secs_f64()),
        60..3600 => format!("{} min {} s", s / 60, s % 60),
        _ => format!("{} h {} min", s / 3600, s / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_count_rate_and_remaining_time() {
        let s = Duration::from_secs;
        assert_eq!(line(0, 9, 0, s(1)), "0 of 9 replays, 0.0 per second");
        assert_eq!(
            line(30, 630, 2, s(60)),
            "30 of 630 replays, 0.5 per second, 20 min 0 s left, 2 not verified"
        );
        assert_eq!(duration(s(7500)), "2 h 5 min");
        assert_eq!(duration(Duration::from_millis(4230)), "4.2 s");
    }
}
