//! The progress of long work, on standard error.

use std::io::{IsTerminal, Write, stderr};
use std::time::{Duration, Instant};

/// Time between two lines where standard error is no terminal, such as in a log.
const LOG_PERIOD: Duration = Duration::from_secs(10);

/// A line that changes, or lines of a log.
pub(crate) struct Progress {
    shown: bool,
    total: usize,
    /// The counted things, such as `replays`.
    counted: &'static str,
    terminal: bool,
    /// Whether the terminal has a line that is to be replaced.
    open: bool,
    logged: Instant,
}

impl Progress {
    pub(crate) fn new(shown: bool, total: usize, counted: &'static str) -> Self {
        let terminal = stderr().is_terminal();
        Progress { shown, total, counted, terminal, open: false, logged: Instant::now() }
    }

    /// Shows the progress, and a remark if there is one. The reader of standard error may have ended.
    pub(crate) fn show(&mut self, done: usize, remark: Option<&str>, elapsed: Duration) {
        if !self.shown || (!self.terminal && self.logged.elapsed() < LOG_PERIOD) {
            return;
        }
        let line = line(done, self.total, self.counted, remark, elapsed);
        if self.terminal {
            let _ = write!(stderr(), "\r{line}\x1b[K");
            self.open = true;
        } else {
            let _ = writeln!(stderr(), "{line}");
            self.logged = Instant::now();
        }
    }

    /// Removes the line from the terminal.
    pub(crate) fn clear(&mut self) {
        if std::mem::take(&mut self.open) {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}

fn line(done: usize, total: usize, counted: &str, remark: Option<&str>, elapsed: Duration) -> String {
    let rate = done as f64 / elapsed.as_secs_f64().max(1e-3);
    let mut line = format!("{done} of {total} {counted}, {rate:.1} per second");
    if done > 0 {
        let left = Duration::from_secs_f64((total - done) as f64 / rate);
        line += &format!(", {} left", duration(left));
    }
    if let Some(remark) = remark {
        line += &format!(", {remark}");
    }
    line
}

/// `2 h 5 min`, `3 min 20 s` or `4.2 s`.
pub(crate) fn duration(time: Duration) -> String {
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
        assert_eq!(line(0, 9, "pictures", None, s(1)), "0 of 9 pictures, 0.0 per second");
        assert_eq!(
            line(30, 630, "replays", Some("2 not verified"), s(60)),
            "30 of 630 replays, 0.5 per second, 20 min 0 s left, 2 not verified"
        );
        assert_eq!(duration(s(7500)), "2 h 5 min");
        assert_eq!(duration(Duration::from_millis(4230)), "4.2 s");
    }
}
