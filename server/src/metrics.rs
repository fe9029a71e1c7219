//! What the server counts about itself, for `GET /metrics`. One set for the process: whoever has something to count
//! need not be handed it.

use palmares_protocol::Code;
use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use prometheus_client::registry::{Registry, Unit};
use std::sync::LazyLock;
use std::time::Duration;

/// The process's counters.
pub(crate) static METRICS: LazyLock<Metrics> = LazyLock::new(Metrics::new);

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct CodeLabel {
    code: &'static str,
}

/// What is counted.
#[derive(Debug)]
pub(crate) struct Metrics {
    registry: Registry,
    ticks: Counter,
    tick_compute: Histogram,
    lateness: Histogram,
    permit_wait: Histogram,
    missed_ticks: Counter,
    refusals: Family<CodeLabel, Counter>,
    worlds: Gauge,
    sessions: Gauge,
    viewers: Gauge,
    unverified: Gauge,
}

/// What the server knows when it is asked, rather than counts as it goes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Levels {
    /// Worlds that are open.
    pub(crate) worlds: usize,
    /// Sessions that are open.
    pub(crate) sessions: usize,
    /// Viewers that are connected.
    pub(crate) viewers: usize,
    /// Runs that wait for their verification.
    pub(crate) unverified: usize,
}

fn level(value: usize) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}

impl Metrics {
    fn new() -> Self {
        // 50 µs to 1.6 s: a tick takes some 100 µs, and is due every 10 ms.
        let histogram = || Histogram::new(exponential_buckets(5e-5, 2.0, 16));
        let mut metrics = Metrics {
            registry: Registry::default(),
            ticks: Counter::default(),
            tick_compute: histogram(),
            lateness: histogram(),
            permit_wait: histogram(),
            missed_ticks: Counter::default(),
            refusals: Family::default(),
            worlds: Gauge::default(),
            sessions: Gauge::default(),
            viewers: Gauge::default(),
            unverified: Gauge::default(),
        };
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
        registry.register("refusals", "Requests refused, by code", metrics.refusals.clone());
        registry.register("worlds_open", "Worlds that are open", metrics.worlds.clone());
        registry.register("sessions_open", "Sessions that are open", metrics.sessions.clone());
        registry.register("viewers", "Viewers that are connected", metrics.viewers.clone());
        let unverified = "Runs that wait for their verification";
        registry.register("verification_queue", unverified, metrics.unverified.clone());
        metrics.registry = registry;
        metrics
    }

    /// A tick was stepped and recorded, which took so long.
    pub(crate) fn ticked(&self, took: Duration) {
        self.ticks.inc();
        self.tick_compute.observe(took.as_secs_f64());
    }

    /// A tick of a realtime run began so much after it was due, with a new action or without.
    pub(crate) fn began(&self, late: Duration, fresh: bool) {
        self.lateness.observe(late.as_secs_f64());
        if !fresh {
            self.missed_ticks.inc();
        }
    }

    /// A tick waited for its permit.
    pub(crate) fn waited(&self, wait: Duration) {
        self.permit_wait.observe(wait.as_secs_f64());
    }

    /// A request was refused.
    pub(crate) fn refused(&self, code: Code) {
        self.refusals.get_or_create(&CodeLabel { code: code.name() }).inc();
    }

    /// Everything in the text format of OpenMetrics.
    pub(crate) fn text(&self, levels: Levels) -> String {
        self.worlds.set(level(levels.worlds));
        self.sessions.set(level(levels.sessions));
        self.viewers.set(level(levels.viewers));
        self.unverified.set(level(levels.unverified));
        let mut text = String::new();
        // Writing into a string cannot fail.
        let _ = prometheus_client::encoding::text::encode(&mut text, &self.registry);
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_counted_is_told() {
        let metrics = Metrics::new();
        metrics.ticked(Duration::from_micros(70));
        metrics.began(Duration::from_millis(3), false);
        metrics.began(Duration::from_micros(5), true);
        metrics.waited(Duration::from_micros(10));
        metrics.refused(Code::BadAction);
        metrics.refused(Code::BadAction);
        let text = metrics.text(Levels { worlds: 1, sessions: 2, viewers: 3, unverified: 4 });
        for line in [
            "palmares_ticks_total 1",
            "palmares_tick_compute_seconds_count 1",
            "palmares_tick_compute_seconds_bucket{le=\"0.0001\"} 1",
            "palmares_tick_lateness_seconds_count 2",
            "palmares_tick_lateness_seconds_bucket{le=\"0.0032\"} 2",
            "palmares_missed_ticks_total 1",
            "palmares_permit_wait_seconds_bucket{le=\"0.00005\"} 1",
            "palmares_refusals_total{code=\"bad_action\"} 2",
            "palmares_worlds_open 1",
            "palmares_sessions_open 2",
            "palmares_viewers 3",
            "palmares_verification_queue 4",
            "# EOF",
        ] {
            assert!(text.lines().any(|have| have == line), "no `{line}` in\n{text}");
        }
    }
}
