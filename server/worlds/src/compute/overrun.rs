//! Ticks that do not end: such a tick keeps its thread, but neither its permit nor its pacer.

use super::resources::Compute;
use super::scheduler::OVERRUN;
use std::sync::Arc;
use std::time::Instant;
use tokio::time::{MissedTickBehavior, interval};

/// Replaces the permits and pacer threads of ticks that have overrun. Never ends.
pub async fn watch_over(compute: Arc<Compute>) {
    let mut look = interval(OVERRUN / 4);
    look.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        look.tick().await;
        let now = Instant::now();
        compute.scheduler.replace_overrun(now);
        compute.pacer.replace_overrun(now);
    }
}
