//! Who owns the session: leases, take-over, hand-over.

use crate::fleet::Fleet;
use crate::guards::Guard;
use crate::state::{Adopting, Command, Database, Process, Run, RunRow, SNAPSHOT_AT, Session, State, World};

impl Database {
    /// Whether the owner's row has a valid lease: the join in `Store::take_sessions`.
    pub(crate) fn is_owned(&self) -> bool {
        let owner = self.owner.zip(self.incarnation);
        owner.is_some_and(|(owner, (host, incarnation))| {
            owner == host && self.hosts[host].incarnation == incarnation && self.hosts[host].leased
        })
    }

    /// Whether this process was the last owner.
    fn was_of(&self, host: usize, incarnation: u8) -> bool {
        self.incarnation == Some((host, incarnation))
    }
}

impl State {
    /// `beat`, `once`, `Sessions::follow_owners`: renews the lease; ends the session here if it has another owner; gives it to the
    /// host that wants it; follows the orders in its row.
    pub(crate) fn beat(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let here = &mut self.hosts[host];
        if !here.works() {
            return None;
        }
        self.db.hosts[host].incarnation = here.incarnation;
        self.db.hosts[host].leased = true;
        if let Some(session) = &mut here.session {
            // `Session::release`: not while a client is here.
            let wanted = self.db.wanted_by.is_some_and(|by| by != host) && self.client.at != Some(host);
            let ordered = session.paused != self.db.paused || !self.db.open;
            if session.epoch != self.db.epoch {
                session.lost = true;
            } else if session.command.is_some() || session.lost || session.leaving {
                // It is busy; another beat will do it.
            } else if ordered && fleet.keeps(Guard::OrdersAreFollowed) {
                session.command = Some(Command::Follow);
            } else if wanted {
                session.command = Some(Command::Release);
            }
        }
        Some(())
    }

    /// `beat`, `GIVE_UP`: the lease has ended for a while.
    pub(crate) fn give_up(&mut self, host: usize) -> Option<()> {
        let here = &mut self.hosts[host];
        if here.process != Process::Up || here.linked || self.db.hosts[host].leased {
            return None;
        }
        let session = here.session.as_mut().filter(|session| !session.lost)?;
        session.lost = true;
        here.incarnation += 1;
        Some(())
    }

    /// `Store::take_sessions`, by `Sessions::adopt` and `Sessions::revive`.
    pub(crate) fn take(&mut self, fleet: &Fleet, host: usize, answered: bool) -> Option<()> {
        let here = &self.hosts[host];
        let (row, own) = (&self.db.hosts[host], self.db.was_of(host, here.incarnation));
        let free = self.db.open && self.db.locked_by.is_none() && here.adopting.is_none();
        if !here.works() || !row.leased || row.incarnation != here.incarnation || !free {
            return None;
        }
        if here.session.is_some() && (own || fleet.keeps(Guard::EndsBeforeItReturns)) {
            return None;
        }
        if self.db.is_owned() && !(own && self.client.at == Some(host)) {
            return None;
        }
        if self.db.wanted_by.is_some_and(|by| by != host && self.db.hosts[by].leased) {
            return None;
        }
        let incarnation = here.incarnation;
        if !answered {
            self.fault()?;
            self.hosts[host].linked = false;
        }
        self.db.epoch += 1;
        (self.db.owner, self.db.incarnation, self.db.wanted_by) =
            (Some(host), Some((host, incarnation)), None);
        if answered {
            self.hosts[host].adopting = Some(Adopting::Taken(self.db.epoch));
        }
        Some(())
    }

    /// `Sessions::adopt`, `Store::own_sessions`: this process owns the session and does not have it.
    pub(crate) fn give_back(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let here = &self.hosts[host];
        let free = self.db.open && self.db.locked_by.is_none() && self.db.hosts[host].leased;
        let own = self.db.owner == Some(host) && self.db.was_of(host, here.incarnation);
        let away = here.session.is_none() && here.adopting.is_none();
        if !fleet.keeps(Guard::OwnSessionsAreFound) || !here.works() || !free || !own || !away {
            return None;
        }
        (self.db.owner, self.db.incarnation) = (None, None);
        Some(())
    }

    /// `Store::interrupted_run`, `resumable_session`, `shipped_run`, `ContinuedRun::build`; without an open session
    /// `Store::abort_open_runs`.
    pub(crate) fn read(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let Some(Adopting::Taken(epoch)) = self.hosts[host].adopting else { return None };
        if !self.hosts[host].works() || self.db.locked_by.is_some() {
            return None;
        }
        self.hosts[host].adopting = None;
        if epoch != self.db.epoch {
            return Some(());
        }
        if !self.db.open {
            self.abort_run(epoch);
            return Some(());
        }
        let stored = self.db.stored();
        let snapshot = if fleet.keeps(Guard::SnapshotAfterTicks) { 0 } else { self.db.snapshot };
        let tick = stored.max(snapshot);
        let world = World {
            tick,
            reported: tick,
            confirmed: tick,
            sent: None,
            snapshot: 0,
            whole: tick == stored,
            replying: false,
        };
        let run = match self.db.run {
            RunRow::Open => Run::Playing(world),
            _ => Run::None,
        };
        self.hosts[host].adopting = Some(Adopting::Built(Session {
            epoch,
            lost: false,
            held: false,
            paused: self.db.paused,
            standing: true,
            leaving: false,
            command: None,
            run,
        }));
        Some(())
    }

    /// `Store::count_move`, then `Registry::insert`.
    pub(crate) fn list(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let Some(Adopting::Built(session)) = self.hosts[host].adopting.clone() else { return None };
        let whole = fleet.keeps(Guard::WholeBeforeRegistry);
        if !self.hosts[host].works() || self.db.locked_by.is_some() {
            return None;
        }
        if self.hosts[host].session.is_some() {
            // `adopt_one` takes the refusal of the registry for a run that cannot be continued.
            self.hosts[host].adopting = None;
            self.abort_run(session.epoch);
        } else if whole && session.epoch != self.db.epoch {
            self.hosts[host].adopting = None;
        } else {
            self.hosts[host].session = Some(session);
            self.hosts[host].adopting = Some(Adopting::Listed);
        }
        Some(())
    }

    /// `Session::wait`.
    pub(crate) fn hold(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let epoch = self.db.epoch;
        let here = &mut self.hosts[host];
        if here.adopting != Some(Adopting::Listed) || !here.works() {
            return None;
        }
        here.adopting = None;
        let session = here.session.as_mut()?;
        if !fleet.keeps(Guard::WholeBeforeRegistry) && session.epoch != epoch {
            // The session is dropped; the registry keeps its entry.
            return Some(());
        }
        session.held = true;
        Some(())
    }

    /// `Sessions::adopt_or_release`: the database cannot be reached; the host stays the owner.
    pub(crate) fn adopt_fails(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let here = &mut self.hosts[host];
        if here.process != Process::Up || here.linked {
            return None;
        }
        if here.adopting.take()? == Adopting::Listed && fleet.keeps(Guard::WholeBeforeRegistry) {
            here.session = None;
            self.answer_for(host);
        }
        Some(())
    }

    /// `Session::part`: the connection or the waiting task has noticed the loss.
    pub(crate) fn part(&mut self, host: usize) -> Option<()> {
        let here = &mut self.hosts[host];
        if here.process != Process::Up
            || !here.session.as_ref().is_some_and(|session| session.lost && session.held)
        {
            return None;
        }
        here.session = None;
        self.answer_for(host);
        if self.client.at == Some(host) {
            self.client.at = None;
        }
        Some(())
    }

    /// `Session::give_away`: the ticks are stored, then `Store::release_session`.
    pub(crate) fn hand_over(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let here = &mut self.hosts[host];
        let works = here.works();
        if here.process != Process::Up {
            return None;
        }
        let session = here.session.as_mut().filter(|session| session.leaving)?;
        if !works {
            // Another beat tries again.
            session.leaving = false;
            return Some(());
        }
        if self.db.locked_by.is_some() {
            return None;
        }
        if let Run::Playing(world) | Run::Ended { world, .. } = &session.run
            && world.confirmed < world.reported
        {
            return None;
        }
        let epoch = session.epoch;
        (session.lost, session.leaving) = (true, false);
        if self.db.accepts(fleet, epoch) {
            (self.db.owner, self.db.incarnation) = (None, None);
        }
        Some(())
    }

    /// `Store::end_lost_runs`: the session was ended, and its host is gone or has it no more.
    pub(crate) fn sweep(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let here = &self.hosts[host];
        let leased = self.db.hosts[host].leased && self.db.locked_by.is_none();
        if !fleet.keeps(Guard::EndedSessionsAreSwept) || !here.works() || !leased {
            return None;
        }
        let here_still = here.session.is_some() || here.adopting.is_some();
        let held = self.db.incarnation.is_some_and(|(owner, incarnation)| {
            let alive = self.db.hosts[owner].leased && self.db.hosts[owner].incarnation == incarnation;
            alive && (owner != host || here_still)
        });
        if self.db.open || self.db.run != RunRow::Open || held {
            return None;
        }
        self.db.epoch += 1;
        self.abort_run(self.db.epoch);
        Some(())
    }

    /// `Store::abort_open_runs`.
    fn abort_run(&mut self, epoch: u8) {
        if epoch == self.db.epoch && self.db.run == RunRow::Open {
            self.db.end_run(RunRow::Aborted);
        }
    }

    /// The tick at which a world takes a snapshot.
    pub(crate) fn snapshot_due(world: &World) -> bool {
        world.reported >= SNAPSHOT_AT && world.tick == SNAPSHOT_AT
    }
}
