//! The places of a competition: who plays, who waits, and when a place is free at the latest.

use crate::schedule::{Forecast, PlayingSession};
use crate::state::AppState;
use crate::store::{PlayingClock, Slot, StoreError, unix_ms};
use schemars::JsonSchema;
use serde::Serialize;

/// Places for worlds, as counts and a forecast.
#[derive(Serialize, JsonSchema)]
pub(super) struct Places {
    /// Number of worlds that can be open at once.
    total: usize,
    /// Number of open sessions whose clock has started and has time left, without those that wait for a place.
    playing: usize,
    /// Longest time until a place is free for the next team, s: 0 if one is free, null if nothing bounds it.
    free_within_s: Option<f64>,
}

/// The time slots of all teams, as counts.
#[derive(Serialize, JsonSchema)]
pub(super) struct ScheduleSummary {
    /// Number of slots.
    slots: usize,
    /// Number of slots that run now.
    running: usize,
    /// Begin of the next slot, ms since 1970 UTC.
    next_unix_ms: Option<i64>,
    /// End of the last slot, ms since 1970 UTC.
    ends_unix_ms: i64,
}

/// Number of worlds that can be open at once, on all hosts of the competition.
pub(super) async fn total(app: &AppState) -> Result<usize, StoreError> {
    if app.store.host_name().is_none() {
        return Ok(app.competition.settings.max_worlds);
    }
    let hosts = app.store.hosts().await?;
    let places: i64 = hosts.iter().filter(|host| host.state == "up").map(|host| host.places).sum();
    Ok(usize::try_from(places).unwrap_or_default())
}

/// The places of an official competition now.
pub(super) async fn places(app: &AppState) -> Result<Places, StoreError> {
    let total = total(app).await?;
    let admission = &app.compute.admission;
    // The length of a session bounds the time of one whose clock has not started.
    let mut waiting = vec![app.competition.rules.session_s; admission.waiting()];
    let mut playing = Vec::new();
    for stored in app.store.playing_clocks().await? {
        let session = session_now(&stored, app);
        match admission.place_in_queue(&stored.session_id).and_then(|place| waiting.get_mut(place - 1)) {
            Some(left_s) => *left_s = session.left_s,
            None if session.left_s == Some(0.0) => {}
            None => playing.push(session),
        }
    }
    let paused = app.competition.rules.is_paused();
    let Forecast { playing, free_within_s } = Forecast::new(&playing, &waiting, total, paused);
    Ok(Places { total, playing, free_within_s })
}

/// A session whose clock has started. The clock of this host's sessions is ahead of the database.
fn session_now(stored: &PlayingClock, app: &AppState) -> PlayingSession {
    let elapsed_s = match app.clocks.get(&stored.session_id) {
        Some(clock) => clock.elapsed_s(app.lifecycle.now()),
        None => stored.wall_s.max(stored.simulated_s),
    };
    let left_s = stored.limit_s.map(|limit_s| (limit_s - elapsed_s).max(0.0));
    PlayingSession { left_s, paused: stored.paused_unix_ms.is_some() }
}

/// The schedule as counts; None without one.
pub(super) async fn schedule(app: &AppState) -> Result<Option<ScheduleSummary>, StoreError> {
    let (slots, now) = (app.store.schedule().await?, unix_ms());
    let Some(ends_unix_ms) = slots.iter().map(|slot| slot.ends_unix_ms).max() else { return Ok(None) };
    let running = |slot: &&Slot| slot.begins_unix_ms <= now && now < slot.ends_unix_ms;
    Ok(Some(ScheduleSummary {
        slots: slots.len(),
        running: slots.iter().filter(running).count(),
        next_unix_ms: slots.iter().map(|slot| slot.begins_unix_ms).find(|begin| *begin > now),
        ends_unix_ms,
    }))
}
