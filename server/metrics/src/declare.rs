//! The form in which metrics are declared, and their kinds.

use prometheus_client::encoding::{EncodeMetric, MetricEncoder};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use std::sync::atomic::AtomicU64;
use std::time::Duration;

/// Makes a struct of metrics, which registers them when it is made. A declaration has field, kind, name without the prefix, unit and help.
macro_rules! metrics {
    (
        $(#[$about:meta])*
        $vis:vis $name:ident, $prefix:literal:
        $($field:ident: $kind:ty = $metric:literal $(in $unit:ident)? $(only on $system:literal)?, $help:literal;)+
    ) => {
        $(#[$about])*
        #[derive(Debug)]
        $vis struct $name {
            registry: prometheus_client::registry::Registry,
            $(#[doc = $help] $vis $field: $kind,)+
        }

        impl $name {
            fn declared() -> Self {
                let mut registry = prometheus_client::registry::Registry::with_prefix($prefix);
                $(
                    let $field = <$kind>::default();
                    if true $(&& cfg!(target_os = $system))? {
                        metrics!(@register registry, $metric, $help, $field $(, $unit)?);
                    }
                )+
                Self { registry, $($field,)+ }
            }
        }
    };
    (@register $registry:ident, $metric:literal, $help:literal, $field:ident) => {
        $registry.register($metric, $help, $field.clone())
    };
    (@register $registry:ident, $metric:literal, $help:literal, $field:ident, $unit:ident) => {
        $registry.register_with_unit($metric, $help, prometheus_client::registry::Unit::$unit, $field.clone())
    };
}

pub(super) use metrics;

/// A number that goes up and down.
pub(super) type Number = Gauge<u64, AtomicU64>;

/// A time that goes up and down, s.
pub(super) type Seconds = Gauge<f64, AtomicU64>;

/// A counter for each value of a label: the label's name and value.
pub(super) type Labelled = Family<[(&'static str, &'static str); 1], Counter>;

/// Durations from 50 µs to 1.6 s: a tick takes about 100 µs and is due every 10 ms.
#[derive(Clone, Debug)]
pub struct Durations(Histogram);

impl Default for Durations {
    fn default() -> Self {
        Durations(Histogram::new(exponential_buckets(5e-5, 2.0, 16)))
    }
}

impl Durations {
    /// Counts a duration.
    pub fn observe(&self, took: Duration) {
        self.0.observe(took.as_secs_f64());
    }
}

impl EncodeMetric for Durations {
    fn encode(&self, encoder: MetricEncoder<'_>) -> std::fmt::Result {
        self.0.encode(encoder)
    }

    fn metric_type(&self) -> MetricType {
        self.0.metric_type()
    }
}
