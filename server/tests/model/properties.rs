//! What must hold in every state, and what must happen in the end.

use crate::fleet::Fleet;
use crate::state::{GATE, Run, RunRow, State};
use stateright::Property;

pub(crate) const ONE_WRITER: &str = "only the owner of an epoch writes in it";
pub(crate) const ACKNOWLEDGED: &str = "an acknowledged result is stored";
pub(crate) const COUNTED_ONCE: &str = "a result counts at most once";
pub(crate) const BOUNDED: &str = "the client is ahead of the stored ticks by no more than the gate";
pub(crate) const FINAL: &str = "a run that has ended stays as it is";
pub(crate) const WHOLE: &str = "the replay of a result has all its ticks";
pub(crate) const PAUSED: &str = "a session is paused as its organizer has ordered";
pub(crate) const FEW_MOVES: &str = "the session moves only with a fault or its client";
pub(crate) const ENDS: &str = "a run ends";

/// A session that is not paused as ordered gets the order with the next beat.
fn holds_pause(fleet: &Fleet, state: &State) -> bool {
    (0..2).filter(|&host| state.hosts[host].works()).all(|host| {
        let mut next = state.clone();
        let beaten = next.beat(fleet, host);
        let session =
            next.hosts[host].session.take().filter(|session| session.is_idle() && session.command.is_none());
        beaten.is_none() || session.is_none_or(|session| session.paused == state.db.paused)
    })
}

fn is_final(state: &State) -> bool {
    let playing = state.hosts.iter().filter_map(|host| host.session.as_ref()).any(|session| {
        let owner = session.held && session.epoch == state.db.epoch;
        owner && matches!(session.run, Run::Playing(_))
    });
    state.db.first_end.is_none_or(|end| end == state.db.run && !playing)
}

/// All of them. The last ones show that the model gets to the states that matter.
pub(crate) fn all() -> Vec<Property<Fleet>> {
    vec![
        Property::always(ONE_WRITER, |_, state: &State| !state.db.stale_accepted),
        Property::always(ACKNOWLEDGED, |_, state: &State| {
            state.client.result.is_none_or(
                |shown| matches!(state.db.run, RunRow::Provisional { ticks, .. } if ticks == shown),
            )
        }),
        Property::always(COUNTED_ONCE, |_, state: &State| state.db.counted <= 1),
        Property::always(BOUNDED, |_, state: &State| {
            state.run_has_ended() || state.client.seen <= state.db.stored() + GATE
        }),
        Property::always(FINAL, |_, state: &State| is_final(state)),
        Property::always(WHOLE, |_, state: &State| {
            !matches!(state.db.run, RunRow::Provisional { whole: false, .. })
        }),
        Property::always(PAUSED, holds_pause),
        Property::always(FEW_MOVES, |fleet, state: &State| state.db.epoch <= 4 + 2 * fleet.faults),
        Property::eventually(ENDS, |_, state: &State| state.run_has_ended()),
    ]
}
