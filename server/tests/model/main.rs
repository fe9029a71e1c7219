//! A model of one official session with one run on two hosts that share a database, for the model checker stateright. The checker explores
//! every order of the steps in `server/tests/model/fleet.rs`, with a number of faults anywhere.
//!
//! A step names the functions of the server that it stands for: whoever changes a function changes the step. The model holds with all rules
//! of the code ([`guards::Guard`]). The test switches each of them off, and fails unless the checker finds a counterexample: so each rule is
//! needed, and the model would notice its loss.
//!
//! | explored with one fault | states |
//! |---|---|
//! | a run of three ticks | 109,372 |
//! | a run after the loss of a host | 57,324 |
//! | an organizer who pauses | 262,534 |
//! | an organizer who ends the session | 141,361 |
//!
//! A fault is the loss of a process, SIGSTOP, a cut from the database before, during or after a statement, a lease that ends too early, a
//! crash of the database, or a client that disconnects or leaves (`server/tests/model/faults.rs`).
//!
//! It proves for these states (`server/tests/model/properties.rs`): only the owner of an epoch writes in it; an acknowledged result is
//! stored, and counts once; a client is ahead of the stored ticks by no more than the gate; an ended run stays as it is; a replay has all
//! ticks; a pause holds from the next beat on; a session changes hosts a bounded number of times; and each run ends with a result.
//!
//! It leaves out: physics and the contents of ticks, durations (a lease can end at any time, so no bound in seconds follows), realtime
//! pacing, clocks and refunds, verification, the object store, other sessions and the places of a host, and statements of Postgres in
//! smaller parts than a locked row.

mod faults;
mod fleet;
mod guards;
mod organizing;
mod ownership;
mod playing;
mod properties;
mod state;
mod storing;

use fleet::Fleet;
use guards::Guard;
use properties::{ACKNOWLEDGED, BOUNDED, COUNTED_ONCE, ENDS, FEW_MOVES, ONE_WRITER, PAUSED, WHOLE};
use state::{Command, Organizer};
use stateright::{Checker, CheckerBuilder, HasDiscoveries, Model};
use strum::IntoEnumIterator;

/// An organizer without a command.
const IDLE: Organizer = Organizer::Idle;
/// An organizer who pauses the session once, and resumes it.
const PAUSES: Organizer = Organizer::Plans(Command::Pause(true));
/// An organizer who ends the session.
const ENDS_IT: Organizer = Organizer::Plans(Command::End);

/// A model with all rules.
const WHOLE_FLEET: Fleet = Fleet { broken: None, ticks: 1, faults: 1, failed: false, organizer: IDLE };

fn checker(fleet: Fleet) -> CheckerBuilder<Fleet> {
    fleet.checker().threads(2).finish_when(HasDiscoveries::AnyFailures)
}

/// Explores all states.
fn holds(name: &str, fleet: Fleet) {
    let more = std::env::var("PALMARES_MODEL_FAULTS").ok().and_then(|faults| faults.parse().ok());
    let faults = more.unwrap_or(fleet.faults);
    let explored = checker(Fleet { faults, ..fleet }).spawn_bfs().join();
    let found = explored.discoveries();
    assert!(found.is_empty(), "{name}: {found:?}");
    println!("{name}, {faults} faults: {} states, all of them", explored.unique_state_count());
}

#[test]
fn the_model_holds_with_a_fault_in_a_run() {
    holds("a run", Fleet { ticks: 3, ..WHOLE_FLEET });
    holds("a host that has failed", Fleet { failed: true, ..WHOLE_FLEET });
}

#[test]
fn the_model_holds_with_an_organizer() {
    holds("an organizer who pauses", Fleet { organizer: PAUSES, ..WHOLE_FLEET });
    holds("an organizer who ends the session", Fleet { organizer: ENDS_IT, ..WHOLE_FLEET });
}

/// A small model in which the loss of a rule is found, and the property that it breaks.
fn needed(guard: Guard) -> (Fleet, &'static str) {
    let short = Fleet { broken: Some(guard), ..WHOLE_FLEET };
    let long = Fleet { broken: Some(guard), ticks: 3, ..WHOLE_FLEET };
    match guard {
        Guard::EpochIsChecked | Guard::CheckLocksTheRow | Guard::TicksAreFenced => (short, ONE_WRITER),
        Guard::OnlyOpenRunsFinish => (short, COUNTED_ONCE),
        Guard::StoredBeforeSent => (Fleet { faults: 0, ..short }, ACKNOWLEDGED),
        Guard::ResultIsKept => (short, ENDS),
        Guard::GateBoundsTicks => (Fleet { faults: 0, ..long }, BOUNDED),
        Guard::TicksOutliveTheRun | Guard::GateAtTheEnd | Guard::RowsAreSentAgain => (long, BOUNDED),
        Guard::SnapshotAfterTicks => (long, WHOLE),
        Guard::OrphansAreGivenUp | Guard::WholeBeforeRegistry => (Fleet { failed: true, ..short }, ENDS),
        Guard::LostIsReplaced => (short, FEW_MOVES),
        Guard::OrdersAreFollowed => (Fleet { organizer: PAUSES, ..short }, PAUSED),
        Guard::EndedSessionsAreSwept => (Fleet { organizer: ENDS_IT, ..short }, ENDS),
    }
}

#[test]
fn without_any_one_of_its_rules_the_model_fails() {
    for guard in Guard::iter() {
        let (fleet, property) = needed(guard);
        let explored = checker(fleet).spawn_bfs().join();
        let found = explored.discoveries();
        assert!(found.contains_key(property), "without {guard:?} still so: {property}; {found:?}");
        println!("{guard:?}: {} steps", found[property].clone().into_actions().len());
    }
}
