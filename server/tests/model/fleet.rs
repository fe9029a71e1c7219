//! The model: its actions, each with the code that it stands for.

use crate::guards::Guard;
use crate::properties;
use crate::state::{Organizer, State};
use stateright::{Model, Property};

/// Two hosts that share a database. One rule of the code may be broken.
pub(crate) struct Fleet {
    pub(crate) broken: Option<Guard>,
    /// Ticks of the run.
    pub(crate) ticks: u8,
    /// Faults in a path.
    pub(crate) faults: u8,
    /// Whether the session's host has failed before.
    pub(crate) failed: bool,
    pub(crate) organizer: Organizer,
}

impl Fleet {
    pub(crate) fn keeps(&self, guard: Guard) -> bool {
        self.broken != Some(guard)
    }
}

/// A step of the model; the number is the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Action {
    // Faults, and their ends: `faults.rs`.
    Kill(usize),
    Restart(usize),
    Stop(usize),
    Continue(usize),
    Cut(usize),
    Heal(usize),
    LeaseEnds(usize),
    DatabaseCrashes,
    TransactionEnds,
    LateStatement,
    // Who owns the session: `ownership.rs`.
    Beat(usize),
    GiveUp(usize),
    Take(usize),
    TakeUnanswered(usize),
    GiveBack(usize),
    Read(usize),
    List(usize),
    Hold(usize),
    AdoptFails(usize),
    Part(usize),
    HandOver(usize),
    Sweep(usize),
    // The client's requests: `playing.rs`.
    Connect(usize),
    Disconnect,
    Leave,
    Want(usize),
    Resume(usize),
    Step(u8),
    Reply(usize),
    StopRun,
    Grace(usize),
    // What is stored of the run: `storing.rs`.
    Ship(usize),
    ShipUnanswered(usize),
    ShipLate(usize),
    SendSnapshot(usize),
    BeginResult(usize),
    StoreResult(usize),
    StoreResultUnanswered(usize),
    ResultFails(usize),
    SendResult(usize),
    // An organizer's command: `organizing.rs`.
    Order(usize),
    Deliver(usize),
    Obey(usize),
    EndUnstored(usize),
}

impl Model for Fleet {
    type State = State;
    type Action = Action;

    fn init_states(&self) -> Vec<State> {
        let first = State::first(self.faults, self.organizer);
        vec![if self.failed { first.without_its_host() } else { first }]
    }

    fn actions(&self, state: &State, actions: &mut Vec<Action>) {
        use Action::*;
        actions.extend([TransactionEnds, LateStatement, Disconnect, Step(1), Step(2), StopRun]);
        let of_hosts = [
            Restart, Continue, Heal, LeaseEnds, Beat, Take, GiveBack, Read, List, Hold, AdoptFails, Sweep,
            Connect, Want, Order, Deliver,
        ];
        let of_sessions = [
            GiveUp,
            Part,
            HandOver,
            Resume,
            Reply,
            Grace,
            Ship,
            SendSnapshot,
            BeginResult,
            StoreResult,
            ResultFails,
            SendResult,
            Obey,
            EndUnstored,
        ];
        let of_faults = [Kill, Stop, Cut, TakeUnanswered, ShipUnanswered, ShipLate, StoreResultUnanswered];
        if state.faults > 0 {
            actions.extend([DatabaseCrashes, Leave]);
        }
        for (host, here) in state.hosts.iter().enumerate() {
            actions.extend(of_hosts.map(|action| action(host)));
            if here.session.is_some() {
                actions.extend(of_sessions.map(|action| action(host)));
            }
            if state.faults > 0 {
                actions.extend(of_faults.map(|action| action(host)));
            }
        }
    }

    fn next_state(&self, state: &State, action: Action) -> Option<State> {
        use Action::*;
        let mut next = state.clone();
        match action {
            Kill(host) => next.kill(host),
            Restart(host) => next.restart(host),
            Stop(host) => next.stop(host),
            Continue(host) => next.go_on(host),
            Cut(host) => next.cut(host),
            Heal(host) => next.heal(host),
            LeaseEnds(host) => next.lease_ends(host),
            DatabaseCrashes => next.database_crashes(),
            TransactionEnds => next.transaction_ends(),
            LateStatement => next.late_statement(self),
            Beat(host) => next.beat(self, host),
            GiveUp(host) => next.give_up(host),
            Take(host) => next.take(host, true),
            TakeUnanswered(host) => next.take(host, false),
            GiveBack(host) => next.give_back(self, host),
            Read(host) => next.read(self, host),
            List(host) => next.list(self, host),
            Hold(host) => next.hold(self, host),
            AdoptFails(host) => next.adopt_fails(self, host),
            Part(host) => next.part(host),
            HandOver(host) => next.hand_over(self, host),
            Sweep(host) => next.sweep(self, host),
            Connect(host) => next.connect(host),
            Disconnect => next.disconnect(),
            Leave => next.leave(),
            Want(host) => next.want(host),
            Resume(host) => next.resume(host),
            Step(ticks) => next.step(self, ticks),
            Reply(host) => next.reply(self, host),
            StopRun => next.stop_run(self),
            Grace(host) => next.grace(self, host),
            Ship(host) => next.ship(self, host, true),
            ShipUnanswered(host) => next.ship(self, host, false),
            ShipLate(host) => next.ship_late(self, host),
            SendSnapshot(host) => next.send_snapshot(self, host),
            BeginResult(host) => next.begin_result(self, host),
            StoreResult(host) => next.store_result(self, host, true),
            StoreResultUnanswered(host) => next.store_result(self, host, false),
            ResultFails(host) => next.result_fails(self, host),
            SendResult(host) => next.send_result(self, host),
            Order(host) => next.order(host),
            Deliver(host) => next.deliver(host),
            Obey(host) => next.obey(host),
            EndUnstored(host) => next.end_unstored(host),
        }?;
        // A step that changes nothing is none.
        (next != *state).then_some(next)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        properties::all()
    }
}
