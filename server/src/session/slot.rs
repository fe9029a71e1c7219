//! The time slots of teams: which team may begin a session now, and how long the session lasts.

use super::failure::store_failed;
use super::session::{Session, Sessions};
use crate::schedule::Timetable;
use palmares_protocol::{Code, Refusal};
use palmares_store::unix_ms;
use palmares_worlds::compute::queue::WAIT;

impl Sessions {
    /// The end of the team's slot, ms since 1970 UTC; None without a schedule.
    ///
    /// # Errors
    /// There is a schedule, and the team has no slot now.
    pub(super) async fn slot_now(&self, team: &str) -> Result<Option<i64>, Refusal> {
        let Some(slots) = self.store.slots_of(team).await.map_err(store_failed("the schedule"))? else {
            return Ok(None);
        };
        let paused = self.competition.rules.state().paused_unix_ms;
        Timetable { slots: &slots, now: unix_ms(), paused }.admit().map(Some)
    }
}

impl Session {
    /// The length of an official session in its team's slot, before its clock has started: at most the rest of the slot, and time that
    /// organizers granted. None without a schedule.
    ///
    /// # Errors
    /// The slot is over.
    pub(super) async fn length_in_slot(&mut self) -> Result<Option<f64>, Refusal> {
        let clock = self.machine.clock();
        let (Some(limit_s), Some(regular_s)) = (clock.limit_s(), self.shared.competition.rules.session_s)
        else {
            return Ok(None);
        };
        if !self.official || clock.is_started() {
            return Ok(None);
        }
        let granted_s = (limit_s - regular_s).max(0.0);
        let rest_s = match self.shared.slot_now(&self.team).await {
            Ok(None) => return Ok(None),
            Ok(Some(ends)) => (ends - unix_ms()) as f64 / 1000.0,
            Err(refusal) if refusal.code == Code::NotScheduled && granted_s > 0.0 => 0.0,
            Err(refusal) => return Err(refusal),
        };
        Ok(Some(limit_s.min(rest_s + granted_s)))
    }

    /// The session waits for a place before its first run. Its clock starts, and is stopped as long as the session is in the queue: so it
    /// keeps the rest of its slot.
    pub(super) async fn wait_in_slot(&mut self, length_s: f64) -> Result<(), Refusal> {
        self.shorten(length_s).await?;
        let now = self.now();
        self.machine.start(now);
        self.machine.hold(now + WAIT, now);
        self.save(true).await;
        Ok(())
    }

    /// Makes the session shorter, if it is not as short already.
    pub(super) async fn shorten(&mut self, length_s: f64) -> Result<(), Refusal> {
        if self.machine.clock().limit_s().is_some_and(|limit_s| limit_s <= length_s) {
            return Ok(());
        }
        let stored = self.shared.store.shorten_session(&self.held, length_s).await;
        stored.map_err(store_failed("the session"))?;
        self.machine.shorten(length_s, self.now());
        Ok(())
    }
}
