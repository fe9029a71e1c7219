//! The places of a competition: who plays, who waits, and when a place is free at the latest.

use crate::http::state::AppState;
use crate::schedule::{Forecast, PlayingSession};
use palmares_store::{PlayingClock, Slot, StoreError, unix_ms};
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

/// The worlds and the queues of all hosts of the competition.
pub(super) struct AllWorlds {
    /// Number of worlds that can be open at once.
    pub(super) total: usize,
    /// Number of open worlds that are not idle.
    pub(super) busy: usize,
    /// Number of idle worlds.
    pub(super) idle: usize,
    /// The sessions that wait for a world: of each host in the order of its queue.
    pub(super) waiting: Vec<String>,
}

/// The worlds now. Those of other hosts are as this host read them with its last beat.
pub(super) fn all_worlds(app: &AppState) -> AllWorlds {
    let open = app.compute.admission.open();
    let mut all = AllWorlds {
        total: if app.lifecycle.is_stopping() { 0 } else { app.compute.max_worlds() },
        busy: open.all(),
        idle: open.idle,
        waiting: app.compute.admission.waiting(),
    };
    let number = |number: i64| usize::try_from(number).unwrap_or_default();
    for (places, busy, idle, waiting) in app.host_rows.each(|host| {
        let places = if host.state == "up" { host.places } else { 0 };
        (places, host.taken, host.idle, host.waiting().map(str::to_owned).collect::<Vec<_>>())
    }) {
        all.total += number(places);
        all.busy += number(busy);
        all.idle += number(idle);
        all.waiting.extend(waiting);
    }
    all
}

/// The places of an official competition now.
pub(super) async fn places(app: &AppState, worlds: &AllWorlds) -> Result<Places, StoreError> {
    let total = worlds.total;
    // The length of a session bounds the time of one whose clock has not started.
    let mut waiting = vec![app.competition.rules.session_s; worlds.waiting.len()];
    let mut playing = Vec::new();
    for stored in app.store.playing_clocks().await? {
        let session = session_now(&stored, app);
        match worlds.waiting.iter().position(|waiting| *waiting == stored.session_id) {
            Some(place) => waiting[place] = session.left_s,
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
