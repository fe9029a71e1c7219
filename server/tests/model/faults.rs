//! Faults, and their ends.

use crate::fleet::Fleet;
use crate::guards::Guard;
use crate::state::{Organizer, Process, Run, State};

impl State {
    /// Uses up a fault.
    pub(crate) fn fault(&mut self) -> Option<()> {
        self.faults = self.faults.checked_sub(1)?;
        Some(())
    }

    /// The process ends, and with it the memory.
    pub(crate) fn kill(&mut self, host: usize) -> Option<()> {
        if self.hosts[host].process == Process::Dead {
            return None;
        }
        self.fault()?;
        let killed = &mut self.hosts[host];
        (killed.process, killed.session, killed.adopting) = (Process::Dead, None, None);
        self.client.at.take_if(|at| *at == host);
        self.answer_for(host);
        Some(())
    }

    /// `Store::enter`: waits until the lease of the earlier process has ended.
    pub(crate) fn restart(&mut self, host: usize) -> Option<()> {
        let dead = &mut self.hosts[host];
        if dead.process != Process::Dead || self.db.hosts[host].leased {
            return None;
        }
        (dead.process, dead.linked) = (Process::Up, true);
        dead.incarnation += 1;
        self.db.hosts[host].incarnation = dead.incarnation;
        self.db.hosts[host].leased = true;
        Some(())
    }

    /// SIGSTOP, or a machine that sleeps.
    pub(crate) fn stop(&mut self, host: usize) -> Option<()> {
        if self.hosts[host].process != Process::Up {
            return None;
        }
        self.fault()?;
        self.hosts[host].process = Process::Stopped;
        Some(())
    }

    pub(crate) fn go_on(&mut self, host: usize) -> Option<()> {
        let stopped = &mut self.hosts[host].process;
        (*stopped == Process::Stopped).then(|| *stopped = Process::Up)
    }

    /// The network between host and database.
    pub(crate) fn cut(&mut self, host: usize) -> Option<()> {
        if !self.hosts[host].works() {
            return None;
        }
        self.fault()?;
        self.hosts[host].linked = false;
        Some(())
    }

    pub(crate) fn heal(&mut self, host: usize) -> Option<()> {
        self.hosts[host].linked = true;
        Some(())
    }

    /// `hosts.lease_until`. It may end too early: a lease is only a hint.
    pub(crate) fn lease_ends(&mut self, host: usize) -> Option<()> {
        if self.hosts[host].works() && self.db.hosts[host].leased {
            self.fault()?;
        }
        self.db.hosts[host].leased = false;
        Some(())
    }

    /// Postgres ends and starts again: transactions end, the table of snapshots may be empty.
    pub(crate) fn database_crashes(&mut self) -> Option<()> {
        self.fault()?;
        (self.db.locked_by, self.db.late, self.db.snapshot) = (None, None, 0);
        Some(())
    }

    /// `idle_in_transaction_session_timeout`, or the end of the connection.
    pub(crate) fn transaction_ends(&mut self) -> Option<()> {
        let host = self.db.locked_by?;
        let session = self.hosts[host].session.as_ref();
        let writing = session.is_some_and(|session| matches!(session.run, Run::Ended { writing: true, .. }));
        if self.hosts[host].works() && writing {
            return None;
        }
        self.db.locked_by = None;
        Some(())
    }

    /// A statement that its host has given up is executed after all.
    pub(crate) fn late_statement(&mut self, fleet: &Fleet) -> Option<()> {
        if self.db.locked_by.is_some() {
            return None;
        }
        let (epoch, from, through) = self.db.late.take()?;
        if epoch == self.db.epoch || !fleet.keeps(Guard::TicksAreFenced) {
            self.db.store_ticks(epoch, from, through);
        }
        Some(())
    }

    /// A command to a session that has gone is answered: the database alone is enough.
    pub(crate) fn answer_for(&mut self, host: usize) {
        if let Organizer::Stored(command, to) | Organizer::Sent(command, to) = self.organizer
            && to == host
        {
            self.organizer = Organizer::Done(command);
        }
    }
}
