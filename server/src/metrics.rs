//! The metrics of `GET /metrics`. They are global, so that every part can count without a reference.

use crate::disk_space::Space;
use crate::process_metrics::ProcessMetrics;
use palmares_protocol::Code;
use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::encoding::text::{encode_eof, encode_registry};
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use prometheus_client::registry::{Registry, Unit};
use std::sync::LazyLock;
use std::sync::atomic::AtomicU64;
use std::time::Duration;
use strum::IntoEnumIterator;

/// The metrics of the process.
pub(crate) static METRICS: LazyLock<Metrics> = LazyLock::new(Metrics::new);

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct CodeLabel {
    code: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct ReasonLabel {
    reason: &'static str,
}

/// Counters, histograms and gauges.
#[derive(Debug)]
pub(crate) struct Metrics {
    registry: Registry,
    process: ProcessMetrics,
    ticks: Counter,
    tick_compute: Histogram,
    lateness: Histogram,
    permit_wait: Histogram,
    missed_ticks: Counter,
    stale_writes: Counter,
    sessions_taken: Counter,
    runs_continued: Counter,
    ranking_read: Histogram,
    refusals: Family<CodeLabel, Counter>,
    worlds: Gauge,
    idle_worlds: Gauge,
    waiting: Gauge,
    sessions: Gauge,
    viewers: Gauge,
    relays: Gauge,
    unverified: Gauge,
    verification_oldest: Gauge<f64, AtomicU64>,
    verification_stuck: Gauge,
    inconclusive: Family<ReasonLabel, Counter>,
    uploads_waiting: Gauge,
    upload_failures: Counter,
    data_free: Gauge,
    data_size: Gauge,
}

/// An open connection of another host.
#[derive(Debug)]
pub(crate) struct OpenRelay(Gauge);

impl Drop for OpenRelay {
    fn drop(&mut self) {
        self.0.dec();
    }
}

/// Values that are read when the metrics are requested.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gauges {
    /// Open worlds, idle ones included.
    pub(crate) worlds: usize,
    /// Idle ones of them.
    pub(crate) idle_worlds: usize,
    /// Sessions that wait for a world.
    pub(crate) waiting: usize,
    /// Open sessions.
    pub(crate) sessions: usize,
    /// Connected viewers.
    pub(crate) viewers: usize,
    /// Runs that wait for their verification.
    pub(crate) unverified: usize,
}

fn gauge(value: usize) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}

impl Metrics {
    fn new() -> Self {
        // 50 µs to 1.6 s: a tick takes about 100 µs and is due every 10 ms.
        let histogram = || Histogram::new(exponential_buckets(5e-5, 2.0, 16));
        let mut metrics = Metrics {
            registry: Registry::default(),
            process: ProcessMetrics::new(),
            ticks: Counter::default(),
            tick_compute: histogram(),
            lateness: histogram(),
            permit_wait: histogram(),
            missed_ticks: Counter::default(),
            stale_writes: Counter::default(),
            sessions_taken: Counter::default(),
            runs_continued: Counter::default(),
            ranking_read: histogram(),
            refusals: Family::default(),
            worlds: Gauge::default(),
            idle_worlds: Gauge::default(),
            waiting: Gauge::default(),
            sessions: Gauge::default(),
            viewers: Gauge::default(),
            relays: Gauge::default(),
            unverified: Gauge::default(),
            verification_oldest: Gauge::default(),
            verification_stuck: Gauge::default(),
            inconclusive: Family::default(),
            uploads_waiting: Gauge::default(),
            upload_failures: Counter::default(),
            data_free: Gauge::default(),
            data_size: Gauge::default(),
        };
        // A counter that appears with its first event has no increase then: an alert would miss it.
        for code in Code::iter() {
            drop(metrics.refusals.get_or_create(&CodeLabel { code: code.name() }));
        }
        let mut registry = Registry::with_prefix("palmares");
        registry.register("ticks", "Ticks that were stepped", metrics.ticks.clone());
        let compute = "How long ticks computed, recording included";
        registry.register_with_unit("tick_compute", compute, Unit::Seconds, metrics.tick_compute.clone());
        let lateness = "How late ticks of realtime runs began";
        registry.register_with_unit("tick_lateness", lateness, Unit::Seconds, metrics.lateness.clone());
        let wait = "How long ticks waited for a processor";
        registry.register_with_unit("permit_wait", wait, Unit::Seconds, metrics.permit_wait.clone());
        let missed = "Ticks of realtime runs without a new action";
        registry.register("missed_ticks", missed, metrics.missed_ticks.clone());
        let stale = "Writes that were refused because the session has another owner";
        registry.register("stale_writes", stale, metrics.stale_writes.clone());
        let taken = "Sessions of other hosts or of an earlier process that this server has taken over";
        registry.register("sessions_taken", taken, metrics.sessions_taken.clone());
        let continued = "Runs of other hosts or of an earlier process that this server has continued";
        registry.register("runs_continued", continued, metrics.runs_continued.clone());
        let ranking = "How long the ranking took to be read from the database";
        registry.register_with_unit("ranking_read", ranking, Unit::Seconds, metrics.ranking_read.clone());
        registry.register("refusals", "Requests refused, by code", metrics.refusals.clone());
        registry.register("worlds_open", "Worlds that are open", metrics.worlds.clone());
        let idle = "Open lockstep worlds without a request for 10 s, which do not count against max_worlds";
        registry.register("worlds_idle", idle, metrics.idle_worlds.clone());
        let waiting = "Sessions that were refused a world and wait for one";
        registry.register("sessions_waiting", waiting, metrics.waiting.clone());
        registry.register("sessions_open", "Sessions that are open", metrics.sessions.clone());
        registry.register("viewers", "Viewers that are connected", metrics.viewers.clone());
        let relays = "Connections by which other hosts of a fleet show runs of this one";
        registry.register("relays_open", relays, metrics.relays.clone());
        let unverified = "Runs that wait for their verification";
        registry.register("verification_queue", unverified, metrics.unverified.clone());
        let oldest = "How long the oldest of these runs waits";
        registry.register_with_unit(
            "verification_oldest",
            oldest,
            Unit::Seconds,
            metrics.verification_oldest.clone(),
        );
        let stuck = "Runs without a verdict after three tries or more, or of another engine";
        registry.register("verification_stuck", stuck, metrics.verification_stuck.clone());
        let uploads = "Replays that wait for the shared storage";
        registry.register("uploads_waiting", uploads, metrics.uploads_waiting.clone());
        let failures = "Uploads that failed and are tried again";
        registry.register("upload_failures", failures, metrics.upload_failures.clone());
        let free = "Bytes that the server can still write in the file system of its data directory";
        registry.register_with_unit("data_free", free, Unit::Bytes, metrics.data_free.clone());
        let size = "Size of the file system of the data directory";
        registry.register_with_unit("data_size", size, Unit::Bytes, metrics.data_size.clone());
        let inconclusive = "Tries of a verification without a verdict, by reason";
        registry.register("verification_inconclusive", inconclusive, metrics.inconclusive.clone());
        metrics.registry = registry;
        metrics
    }

    /// Counts a tick with its computing time, recording included.
    pub(crate) fn ticked(&self, took: Duration) {
        self.ticks.inc();
        self.tick_compute.observe(took.as_secs_f64());
    }

    /// Counts the begin of a realtime tick, with its delay, and whether it had a new action.
    pub(crate) fn began(&self, late: Duration, fresh: bool) {
        self.lateness.observe(late.as_secs_f64());
        if !fresh {
            self.missed_ticks.inc();
        }
    }

    /// Counts the wait of a tick for its permit.
    pub(crate) fn waited(&self, wait: Duration) {
        self.permit_wait.observe(wait.as_secs_f64());
    }

    /// Counts a write that was refused because the session has another owner.
    pub(crate) fn refused_stale_write(&self) {
        self.stale_writes.inc();
    }

    /// Counts a session that this server has taken over, and whether its run continues.
    pub(crate) fn took_session(&self, run_continues: bool) {
        self.sessions_taken.inc();
        if run_continues {
            self.runs_continued.inc();
        }
    }

    /// Counts a reading of the ranking.
    pub(crate) fn ranking_read(&self, took: Duration) {
        self.ranking_read.observe(took.as_secs_f64());
    }

    /// Counts a connection by which another host shows a run of this one, until the guard is dropped.
    pub(crate) fn relay(&self) -> OpenRelay {
        self.relays.inc();
        OpenRelay(self.relays.clone())
    }

    /// Counts a refused request.
    pub(crate) fn refused(&self, code: Code) {
        self.refusals.get_or_create(&CodeLabel { code: code.name() }).inc();
    }

    /// Counts a try of a verification without a verdict.
    pub(crate) fn inconclusive(&self, reason: &'static str) {
        self.inconclusive.get_or_create(&ReasonLabel { reason }).inc();
    }

    /// Sets the number of replays that wait for the shared storage.
    pub(crate) fn uploads_waiting(&self, replays: usize) {
        self.uploads_waiting.set(gauge(replays));
    }

    /// Counts a failed upload.
    pub(crate) fn upload_failed(&self) {
        self.upload_failures.inc();
    }

    /// Sets how long the oldest run waits for its verification, and the number of runs whose verification is stuck.
    pub(crate) fn verification(&self, oldest: Duration, stuck: usize) {
        self.verification_oldest.set(oldest.as_secs_f64());
        self.verification_stuck.set(gauge(stuck));
    }

    /// Sets free bytes and size of the file system of the data directory.
    pub(crate) fn data_space(&self, space: Space) {
        let bytes = |bytes: u64| i64::try_from(bytes).unwrap_or(i64::MAX);
        self.data_free.set(bytes(space.free_bytes));
        self.data_size.set(bytes(space.size_bytes));
    }

    /// All metrics in the text format of OpenMetrics.
    pub(crate) fn text(&self, gauges: Gauges) -> String {
        self.worlds.set(gauge(gauges.worlds));
        self.idle_worlds.set(gauge(gauges.idle_worlds));
        self.waiting.set(gauge(gauges.waiting));
        self.sessions.set(gauge(gauges.sessions));
        self.viewers.set(gauge(gauges.viewers));
        self.unverified.set(gauge(gauges.unverified));
        let mut text = String::new();
        // Writing into a string cannot fail.
        let _ = encode_registry(&mut text, &self.registry)
            .and_then(|()| encode_registry(&mut text, self.process.read()))
            .and_then(|()| encode_eof(&mut text));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_metric_is_in_the_text() {
        let metrics = Metrics::new();
        metrics.ticked(Duration::from_micros(70));
        metrics.began(Duration::from_millis(3), false);
        metrics.began(Duration::from_micros(5), true);
        metrics.waited(Duration::from_micros(10));
        metrics.ranking_read(Duration::from_millis(30));
        metrics.refused(Code::BadAction);
        metrics.refused(Code::BadAction);
        metrics.inconclusive("missing_file");
        metrics.uploads_waiting(6);
        metrics.upload_failed();
        metrics.verification(Duration::from_millis(2500), 5);
        metrics.data_space(Space { free_bytes: 7, size_bytes: 9 });
        metrics.refused_stale_write();
        let _relay = metrics.relay();
        drop(metrics.relay());
        metrics.took_session(false);
        metrics.took_session(true);
        let text = metrics.text(Gauges {
            worlds: 3,
            idle_worlds: 2,
            waiting: 5,
            sessions: 2,
            viewers: 3,
            unverified: 4,
        });
        for line in [
            "palmares_ticks_total 1",
            "palmares_tick_compute_seconds_count 1",
            "palmares_tick_compute_seconds_bucket{le=\"0.0001\"} 1",
            "palmares_tick_lateness_seconds_count 2",
            "palmares_tick_lateness_seconds_bucket{le=\"0.0032\"} 2",
            "palmares_missed_ticks_total 1",
            "palmares_permit_wait_seconds_bucket{le=\"0.00005\"} 1",
            "# TYPE process_resident_memory_bytes gauge",
            "process_tasks 0",
            "palmares_stale_writes_total 1",
            "palmares_sessions_taken_total 2",
            "palmares_runs_continued_total 1",
            "palmares_ranking_read_seconds_count 1",
            "palmares_refusals_total{code=\"bad_action\"} 2",
            "palmares_worlds_open 3",
            "palmares_worlds_idle 2",
            "palmares_sessions_waiting 5",
            "palmares_sessions_open 2",
            "palmares_viewers 3",
            "palmares_relays_open 1",
            "palmares_verification_queue 4",
            "palmares_verification_oldest_seconds 2.5",
            "palmares_verification_stuck 5",
            "palmares_uploads_waiting 6",
            "palmares_data_free_bytes 7",
            "palmares_data_size_bytes 9",
            "palmares_upload_failures_total 1",
            "palmares_verification_inconclusive_total{reason=\"missing_file\"} 1",
            "# EOF",
        ] {
            assert!(text.lines().any(|have| have == line), "no `{line}` in\n{text}");
        }
    }

    #[test]
    fn dashboards_and_alerts_use_metrics_that_exist_and_every_alert_is_explained() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let read = |path: &str| std::fs::read_to_string(root.join(path)).expect(path);
        let metrics = Metrics::new();
        metrics.refused(Code::BadAction);
        let text = metrics.text(Gauges::default());
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
