//! Refunds: for waits for the database, and for runs that were voided after their end: exactly once, even if the server crashes.
//!
//! The cost of a run is stored with its result. While the cost is stored and the run is void, a refund is pending. One transaction
//! gives the time back and deletes the cost: through the session if it is open, otherwise in the database alone.

use super::failure::store_failed;
use super::session::{Session, Sessions};
use crate::clock::{ClockState, SessionClock, Spent};
use crate::rules::CompetitionPhase;
use crate::store::{ClockRow, RefundedClock, RunCost, StoreError};
use palmares_protocol::Refusal;
use std::time::{Duration, Instant};

/// Longest time that the database may take for a request. A wait that is longer costs the session nothing; a healthy database takes
/// milliseconds.
const PROMPT: Duration = Duration::from_secs(1);

fn spent(cost: &RunCost) -> Spent {
    Spent { wall_s: cost.wall_s, simulated_s: cost.simulated_s }
}

impl Session {
    /// Waits for the database. The session gets the time back if the wait is longer than [`PROMPT`].
    pub(super) async fn stored<T, E: From<StoreError>>(
        &mut self,
        storing: impl Future<Output = Result<T, E>>,
    ) -> Result<T, E> {
        let (before, begun) = (self.machine.clock().spent(self.now()), Instant::now());
        let store = self.shared.store.clone();
        let done = store.answered(storing).await;
        if begun.elapsed() > PROMPT {
            self.machine.refund_since(before, self.now());
            self.show_clock();
        }
        done
    }

    /// Refunds the void runs of this session.
    pub(super) async fn refund_void_runs(&mut self) -> Result<(), Refusal> {
        let pending = self.shared.store.pending_refunds(&self.session_id).await;
        let now = self.now();
        for cost in pending.map_err(store_failed("the refund"))? {
            if !self.refunded_runs.contains(&cost.run_id) {
                self.machine.refund_run(spent(&cost), now);
                self.refunded_runs.push(cost.run_id);
            }
        }
        self.save(true).await;
        Ok(())
    }
}

/// A stopped clock after its pending refunds.
fn refunded(limit_s: Option<f64>, row: &ClockRow, pending: &[RunCost]) -> RefundedClock {
    let now = Duration::ZERO;
    let mut clock = SessionClock::restored(limit_s, &ClockState::of(row), false, now);
    let was_over = clock.is_over(now);
    for cost in pending {
        clock.refund(spent(cost), now);
    }
    RefundedClock { clock: clock.state(now).row(), revived: was_over && !clock.is_over(now) }
}

impl Sessions {
    /// Gives pending refunds to a session that is not open here. If its time was spent and the competition is not over, it opens
    /// again.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn refund(&self, session_id: &str) -> Result<(), StoreError> {
        let reopen = self.competition.rules.phase() != CompetitionPhase::Revealed;
        self.store
            .refund(session_id, reopen, |limit_s, clock, pending| refunded(limit_s, &clock, pending))
            .await
    }

    /// Gives all pending refunds, at the server's start: a crash may have prevented them.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn refund_all(&self) -> Result<(), StoreError> {
        for session_id in self.store.sessions_with_pending_refunds().await? {
            tracing::warn!(
                session = session_id,
                "refunds that were pending when the server stopped are given now"
            );
            self.refund(&session_id).await?;
        }
        Ok(())
    }
}
