//! Refunds: for waits for the database, and for runs that were voided after their end: exactly once, even if the server crashes.
//!
//! The cost of a run is stored with its result. While the cost is stored and the run is void, a refund is pending. One transaction
//! gives the time back and deletes the cost: through the session if it is open, otherwise in the database alone.

use super::clock_rows::{self, saved_row};
use super::failure::store_failed;
use super::session::{Session, Sessions};
use crate::competition::rules::CompetitionPhase;
use palmares_protocol::{Code, Refusal};
use palmares_store::{ClockRow, NewAuditEntry, RefundedClock, RunCost, StoreError};
use palmares_worlds::clock::{SessionClock, Spent};
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
        let pending = self.shared.store.pending_refunds(&self.held.session_id).await;
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

impl Session {
    /// Makes a void run of this session count again.
    pub(super) async fn unvoid_run(
        &mut self,
        run_id: &str,
        actor: &str,
        reason: &str,
    ) -> Result<(), Refusal> {
        // Refunds that are not stored yet.
        self.save(true).await;
        if !self.refunded_runs.is_empty() {
            return Err(
                Refusal::new(Code::Internal, "a refund is not stored yet; try again").retry_after(1.0)
            );
        }
        let entry = NewAuditEntry { actor, action: UNVOID, subject: run_id, reason: Some(reason) };
        let (shared, held, now) = (self.shared.clone(), self.held.clone(), self.now());
        let _saving = shared.saving.lock().await;
        let (machine, mut taken) = (&mut self.machine, None);
        let take = |_, _, cost: &RunCost| {
            machine.take_again(spent(cost), now).map_err(too_little_left)?;
            taken = Some(spent(cost));
            Ok(saved_row(machine.saved(now), machine.playing().is_some()))
        };
        let done = shared.store.unvoid_run(Some(&held), run_id, &entry, take).await;
        if let (Err(_), Some(cost)) = (&done, taken) {
            self.machine.refund_run(cost, now);
        }
        self.show_clock();
        done.map_err(store_failed("the run"))?.map_err(cannot_be_undone)
    }
}

/// The action in the audit.
const UNVOID: &str = "run.unvoid";

fn too_little_left(missing_s: f64) -> String {
    format!(
        "the time that was given back for it has been used: {missing_s:.1} s are missing. Grant them first: \
         session grant ID --seconds {:.0}",
        missing_s.ceil()
    )
}

fn cannot_be_undone(why: String) -> Refusal {
    Refusal::new(Code::WrongState, format!("the run stays as it is: {why}"))
}

/// A stopped clock after the time of a run was taken again.
fn taken_again(limit_s: Option<f64>, row: &ClockRow, cost: &RunCost) -> Result<ClockRow, String> {
    let now = Duration::ZERO;
    let mut clock = SessionClock::restored(limit_s, &clock_rows::state(row), false, now);
    clock.take_again(spent(cost), now).map_err(too_little_left)?;
    Ok(clock_rows::row(clock.state(now)))
}

/// A stopped clock after its pending refunds.
fn refunded(limit_s: Option<f64>, row: &ClockRow, pending: &[RunCost]) -> RefundedClock {
    let now = Duration::ZERO;
    let mut clock = SessionClock::restored(limit_s, &clock_rows::state(row), false, now);
    let was_over = clock.is_over(now);
    for cost in pending {
        clock.refund(spent(cost), now);
    }
    RefundedClock { clock: clock_rows::row(clock.state(now)), revived: was_over && !clock.is_over(now) }
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

    /// Makes a void run count again whose session is not open here.
    ///
    /// # Errors
    /// Reason why it cannot.
    pub(crate) async fn unvoid(&self, run_id: &str, actor: &str, reason: &str) -> Result<(), Refusal> {
        let entry = NewAuditEntry { actor, action: UNVOID, subject: run_id, reason: Some(reason) };
        let take = |limit_s, clock, cost: &RunCost| taken_again(limit_s, &clock, cost);
        let done = self.store.unvoid_run(None, run_id, &entry, take).await;
        done.map_err(store_failed("the run"))?.map_err(cannot_be_undone)
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
