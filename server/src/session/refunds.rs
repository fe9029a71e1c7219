//! Time given back for runs that ended before they were voided: once, whatever dies in between.
//!
//! What a run has taken from its session's clock is stored with its result. While it stands there and the run is void,
//! it is owed. Giving it back and taking it away from there is one transaction: of whoever holds the session, or else
//! of the database alone.

use super::failure::store_failed;
use super::session::{Session, Sessions};
use crate::clock::{ClockState, SessionClock, Spent};
use crate::rules::Phase;
use crate::store::{self, Paid, StoreError, Taken};
use palmares_protocol::Refusal;
use std::time::Duration;

impl ClockState {
    /// As stored.
    pub(super) fn row(self) -> store::ClockState {
        store::ClockState {
            started: self.started,
            wall_s: self.spent.wall_s,
            simulated_s: self.spent.simulated_s,
            refunded_s: self.refunded_s,
            run_from_s: None,
        }
    }

    /// As it was stored.
    pub(super) fn of(row: &store::ClockState) -> Self {
        let spent = Spent { wall_s: row.wall_s, simulated_s: row.simulated_s };
        ClockState { started: row.started, spent, refunded_s: row.refunded_s }
    }
}

fn spent(taken: &Taken) -> Spent {
    Spent { wall_s: taken.wall_s, simulated_s: taken.simulated_s }
}

impl Session {
    /// Gives back what void runs of this session have taken.
    pub(super) async fn give_back(&mut self) -> Result<(), Refusal> {
        let owed =
            self.shared.store.owed(&self.session_id).await.map_err(store_failed("the time given back"))?;
        let now = self.now();
        for taken in owed {
            if !self.paid.contains(&taken.run_id) {
                self.machine.give_back(spent(&taken), now);
                self.paid.push(taken.run_id);
            }
        }
        self.save(true).await;
        Ok(())
    }
}

/// A clock at rest with what it was owed.
fn paid(limit_s: Option<f64>, row: &store::ClockState, owed: &[Taken]) -> Paid {
    let now = Duration::ZERO;
    let mut clock = SessionClock::restored(limit_s, &ClockState::of(row), false, now);
    let was_over = clock.is_over(now);
    for taken in owed {
        clock.refund(spent(taken), now);
    }
    Paid { clock: clock.state(now).row(), revived: was_over && !clock.is_over(now) }
}

impl Sessions {
    /// Gives back what is owed to a session that nobody holds. If its time was spent and the competition is not over, it
    /// is open again.
    ///
    /// # Errors
    /// The store's.
    pub(crate) async fn give_back(&self, session_id: &str) -> Result<(), StoreError> {
        let reopen = self.competition.rules.phase() != Phase::Revealed;
        self.store.give_back(session_id, reopen, |limit_s, clock, owed| paid(limit_s, &clock, owed)).await
    }

    /// The same for all sessions, at the start: what a crash came before.
    ///
    /// # Errors
    /// The store's.
    pub(crate) async fn give_back_all(&self) -> Result<(), StoreError> {
        for session_id in self.store.creditors().await? {
            tracing::warn!(
                session = session_id,
                "time of void runs is given back that the server owed when it stopped"
            );
            self.give_back(&session_id).await?;
        }
        Ok(())
    }
}
