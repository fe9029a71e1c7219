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

    /// `Store::take_sessions` and `take_released`, by `Sessions::adopt` and `Sessions::revive`.
    pub(crate) fn take(&mut self, host: usize, answered: bool) -> Option<()> {
        let here = &self.hosts[host];
        let (row, own) = (&self.db.hosts[host], self.db.was_of(host, here.incarnation));
        let free = self.db.open && self.db.locked_by.is_none() && here.adopting.is_none();
        let leased = row.leased && row.incarnation == here.incarnation;
        let released = self.db.owner.is_none() && self.client.at == Some(host);
        if !here.works() || !free || !(leased || released) {
            return None;
        }
        // `Registry::knows`.
        if here.session.as_ref().is_some_and(|session| !session.lost) {
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

    /// `Sessions::give_up_orphans`, `Store::own_sessions`: this process owns the session and does not have it.
    pub(crate) fn give_back(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let here = &self.hosts[host];
        let open = self.db.open || self.db.run == RunRow::Open;
        let free = open && self.db.locked_by.is_none() && self.db.hosts[host].leased;
        let own = self.db.owner == Some(host) && self.db.was_of(host, here.incarnation);
        let away = here.session.as_ref().is_none_or(|session| session.lost) && here.adopting.is_none();
        if !fleet.keeps(Guard::OrphansAreGivenUp) || !here.works() || !free || !own || !away {
            return None;
        }
        (self.db.owner, self.db.incarnation) = (None, None);
        Some(())
    }

    /// `Store::resumable_session`, `interrupted_run`, `shipped_run`, `ContinuedRun::build`.
    pub(crate) fn read(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let Some(Adopting::Taken(epoch)) = self.hosts[host].adopting else { return None };
        if !self.hosts[host].works() || self.db.locked_by.is_some() {
            return None;
        }
        self.hosts[host].adopting = None;
        if epoch != self.db.epoch {
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
        let session = Session {
            epoch,
            lost: false,
            held: false,
            paused: self.db.paused,
            standing: true,
            leaving: false,
            command: None,
            run,
        };
        self.hosts[host].adopting = Some(Adopting::Built(session, self.db.open));
        Some(())
    }

    /// `Store::count_move`, then `Registry::insert`.
    pub(crate) fn list(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let Some(Adopting::Built(session, open)) = self.hosts[host].adopting.clone() else { return None };
        let whole = fleet.keeps(Guard::WholeBeforeRegistry);
        if !self.hosts[host].works() || self.db.locked_by.is_some() {
            return None;
        }
        if whole && session.epoch != self.db.epoch {
            self.hosts[host].adopting = None;
        } else if self.hosts[host].session.is_some() && !fleet.keeps(Guard::LostIsReplaced) {
            // `adopt_or_release`: for another attempt.
            self.hosts[host].adopting = None;
            (self.db.owner, self.db.incarnation) = (None, None);
        } else {
            // The holder of a lost session changes nothing any more.
            self.answer_for(host);
            self.hosts[host].session = Some(session);
            self.hosts[host].adopting = Some(Adopting::Listed(open));
        }
        Some(())
    }

    /// `Session::wait`; `Session::end` if the session was ended meanwhile.
    pub(crate) fn hold(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let epoch = self.db.epoch;
        let here = &mut self.hosts[host];
        let Some(Adopting::Listed(open)) = here.adopting else { return None };
        if !here.works() {
            return None;
        }
        here.adopting = None;
        let session = here.session.as_mut()?;
        if !fleet.keeps(Guard::WholeBeforeRegistry) && session.epoch != epoch {
            // The session is dropped; the registry keeps its entry.
            return Some(());
        }
        session.held = true;
        if !open && session.close_run(true).is_none() {
            here.session = None;
        }
        Some(())
    }

    /// `Sessions::adopt_or_release`: the database cannot be reached; the host stays the owner.
    pub(crate) fn adopt_fails(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let here = &mut self.hosts[host];
        if here.process != Process::Up || here.linked {
            return None;
        }
        if matches!(here.adopting.take()?, Adopting::Listed(_)) && fleet.keeps(Guard::WholeBeforeRegistry) {
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

    /// `Sessions::end_lost`, `Store::take_ended_sessions`: the session was ended, and its host is gone.
    pub(crate) fn sweep(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        let here = &self.hosts[host];
        let free = self.db.hosts[host].leased && self.db.locked_by.is_none() && here.adopting.is_none();
        if !fleet.keeps(Guard::EndedSessionsAreSwept) || !here.works() || !free {
            return None;
        }
        if self.db.open || self.db.run != RunRow::Open || self.db.is_owned() {
            return None;
        }
        self.db.epoch += 1;
        (self.db.owner, self.db.incarnation) = (Some(host), Some((host, here.incarnation)));
        self.hosts[host].adopting = Some(Adopting::Taken(self.db.epoch));
        Some(())
    }

    /// The tick at which a world takes a snapshot.
    pub(crate) fn snapshot_due(world: &World) -> bool {
        world.reported >= SNAPSHOT_AT && world.tick == SNAPSHOT_AT
    }
}
