//! The metrics of `GET /metrics`. They are global, so that every part can count without a reference.

mod declare;
mod process;

use declare::{Durations, Labelled, Number, Seconds, metrics};
use palmares_protocol::Code;
use process::ProcessMetrics;
use prometheus_client::encoding::text::{encode_eof, encode_registry};
use prometheus_client::metrics::counter::Counter;
use std::sync::LazyLock;
use std::time::Duration;
use strum::IntoEnumIterator;

/// The metrics of the process.
pub static METRICS: LazyLock<Metrics> = LazyLock::new(Metrics::new);

static PROCESS: LazyLock<ProcessMetrics> = LazyLock::new(ProcessMetrics::new);

metrics! {
    /// Counters, histograms and gauges.
    pub Metrics, "palmares":
    ticks: Counter = "ticks", "Ticks that were stepped";
    tick_compute: Durations = "tick_compute" in Seconds, "How long ticks computed, recording included";
    lateness: Durations = "tick_lateness" in Seconds, "How late ticks of realtime runs began";
    permit_wait: Durations = "permit_wait" in Seconds, "How long ticks waited for a processor";
    missed_ticks: Counter = "missed_ticks", "Ticks of realtime runs without a new action";
    stale_writes: Counter = "stale_writes", "Writes that were refused because the session has another owner";
    sessions_taken: Counter = "sessions_taken",
        "Sessions of other hosts or of an earlier process that this server has taken over";
    runs_continued: Counter = "runs_continued",
        "Runs of other hosts or of an earlier process that this server has continued";
    ranking_read: Durations = "ranking_read" in Seconds, "How long the ranking took to be read from the database";
    refusals: Labelled = "refusals", "Requests refused, by code";
    worlds: Number = "worlds_open", "Worlds that are open";
    idle_worlds: Number = "worlds_idle",
        "Open lockstep worlds without a request for 10 s, which do not count against max_worlds";
    waiting: Number = "sessions_waiting", "Sessions that were refused a world and wait for one";
    sessions: Number = "sessions_open", "Sessions that are open";
    viewers: Number = "viewers", "Viewers that are connected";
    relays: Number = "relays_open", "Connections by which other hosts of a fleet show runs of this one";
    unverified: Number = "verification_queue", "Runs that wait for their verification";
    verification_oldest: Seconds = "verification_oldest" in Seconds, "How long the oldest of these runs waits";
    verification_stuck: Number = "verification_stuck",
        "Runs without a verdict after three tries or more, or of another engine";
    uploads_waiting: Number = "uploads_waiting", "Replays that wait for the shared storage";
    upload_failures: Counter = "upload_failures", "Uploads that failed and are tried again";
    data_free: Number = "data_free" in Bytes,
        "Bytes that the server can still write in the file system of its data directory";
    data_size: Number = "data_size" in Bytes, "Size of the file system of the data directory";
    inconclusive: Labelled = "verification_inconclusive", "Tries of a verification without a verdict, by reason";
}

/// An open connection of another host.
#[derive(Debug)]
pub struct OpenRelay(Number);

impl Drop for OpenRelay {
    fn drop(&mut self) {
        self.0.dec();
    }
}

impl Metrics {
    fn new() -> Self {
        let metrics = Self::declared();
        // A counter that appears with its first event has no increase then: an alert would miss it.
        for code in Code::iter() {
            drop(metrics.refusals.get_or_create(&[("code", code.name())]));
        }
        metrics
    }

    /// Counts a tick with its computing time, recording included.
    pub fn ticked(&self, took: Duration) {
        self.ticks.inc();
        self.tick_compute.observe(took);
    }

    /// Counts the begin of a realtime tick, with its delay, and whether it had a new action.
    pub fn began(&self, late: Duration, fresh: bool) {
        self.lateness.observe(late);
        if !fresh {
            self.missed_ticks.inc();
        }
    }

    /// Counts a connection by which another host shows a run of this one, until the guard is dropped.
    pub fn relay(&self) -> OpenRelay {
        self.relays.inc();
        OpenRelay(self.relays.clone())
    }

    /// Counts a refused request.
    pub fn refused(&self, code: Code) {
        self.refusals.get_or_create(&[("code", code.name())]).inc();
    }

    /// Counts a try of a verification without a verdict.
    pub fn inconclusive(&self, reason: &'static str) {
        self.inconclusive.get_or_create(&[("reason", reason)]).inc();
    }

    /// All metrics in the text format of OpenMetrics.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing into a string cannot fail.
        let _ = encode_registry(&mut text, &self.registry)
            .and_then(|()| encode_registry(&mut text, PROCESS.read()))
            .and_then(|()| encode_eof(&mut text));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn read(path: &str) -> String {
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)).expect(path)
    }

    /// The metrics with a value each, as text.
    fn counted() -> String {
        let metrics = Metrics::new();
        metrics.ticked(Duration::from_micros(70));
        metrics.began(Duration::from_millis(3), false);
        metrics.began(Duration::from_micros(5), true);
        metrics.refused(Code::BadAction);
        metrics.inconclusive("missing_file");
        let _relay = metrics.relay();
        drop(metrics.relay());
        metrics.text()
    }

    #[test]
    fn counted_events_are_in_the_text() {
        let text = counted();
        for line in [
            "palmares_ticks_total 1",
            "palmares_tick_compute_seconds_count 1",
            "palmares_tick_compute_seconds_bucket{le=\"0.0001\"} 1",
            "palmares_tick_lateness_seconds_count 2",
            "palmares_tick_lateness_seconds_bucket{le=\"0.0032\"} 2",
            "palmares_missed_ticks_total 1",
            "palmares_refusals_total{code=\"bad_action\"} 1",
            "palmares_refusals_total{code=\"internal\"} 0",
            "palmares_relays_open 1",
            "palmares_verification_oldest_seconds 0.0",
            "palmares_verification_inconclusive_total{reason=\"missing_file\"} 1",
            "process_tasks 0",
            "# EOF",
        ] {
            assert!(text.lines().any(|have| have == line), "no `{line}` in\n{text}");
        }
    }

    /// docs/operations.md has a table of the declarations. `PALMARES_WRITE_DOCS=1 cargo test -p palmares-metrics --lib` writes it.
    #[cfg(target_os = "linux")]
    #[test]
    fn the_table_of_the_document_is_that_of_the_declarations() {
        let text = counted();
        let mut table = String::from("| metric | meaning |\n|---|---|\n");
        let after = |start: &str| {
            text.lines().filter_map(move |line| line.strip_prefix(start)?.split_once(' ')).collect::<Vec<_>>()
        };
        for ((name, help), (_, kind)) in after("# HELP ").into_iter().zip(after("# TYPE ")) {
            let total = if kind == "counter" { "_total" } else { "" };
            // The library ends a help with a full stop.
            table += &format!("| `{name}{total}` | {} |\n", help.trim_end_matches('.'));
        }
        let there = read("docs/operations.md");
        let (before, rest) = there.split_once("<!-- metrics -->\n").expect("a mark before the table");
        let (_, rest) = rest.split_once("<!-- /metrics -->\n").expect("a mark after the table");
        let wanted = format!("{before}<!-- metrics -->\n{table}<!-- /metrics -->\n{rest}");
        if std::env::var_os("PALMARES_WRITE_DOCS").is_some() {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/operations.md");
            std::fs::write(path, wanted).expect("written");
        } else {
            assert!(
                there == wanted,
                "docs/operations.md is not as declared; \
                 `PALMARES_WRITE_DOCS=1 cargo test -p palmares-metrics --lib` writes its table"
            );
        }
    }

    #[test]
    fn dashboards_and_alerts_use_metrics_that_exist_and_every_alert_is_explained() {
        let text = counted();
        for file in
            ["deploy/monitoring/alerts.yaml", "deploy/monitoring/dashboard.json", "docs/operations.md"]
        {
            let content = read(file);
            let names = content.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
            for name in names.filter(|name| name.starts_with("palmares_") && name.len() > "palmares_".len()) {
                let is_there = text.lines().any(|line| line.split([' ', '{']).any(|word| word == name));
                assert!(is_there || text.contains(&format!("# TYPE {name} ")), "{file}: no metric {name}");
            }
        }
        let guide = read("docs/operations.md");
        for alert in read("deploy/monitoring/alerts.yaml")
            .lines()
            .filter_map(|line| line.trim().strip_prefix("- alert: "))
        {
            assert!(
                guide.contains(&format!("\n### {alert}\n")),
                "docs/operations.md does not explain {alert}"
            );
        }
    }
}
