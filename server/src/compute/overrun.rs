//! Ticks that do not end: whoever computes one keeps its thread, and nothing else.

use super::resources::Compute;
use super::scheduler::OVERRUN;
use std::sync::Arc;
use std::time::Instant;
use tokio::time::{MissedTickBehavior, interval};

/// Sees to it that ticks that overran keep neither permits nor the threads of realtime worlds from others. Never ends.
pub(crate) async fn watch_over(compute: Arc<Compute>) {
    let mut look = interval(OVERRUN / 4);
    look.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        look.tick().await;
        let now = Instant::now();
        compute.scheduler.count_out(now);
        compute.pacer.relieve(now);
    }
}
