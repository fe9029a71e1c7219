//! An organizer's command to the session: `http::admin::sessions::act`. The database comes first.

use crate::state::{Command, Organizer, Process, Run, RunRow, Session, State};

impl State {
    /// `forward::to_owner`: the request is answered by the owner, if there is one, otherwise by any host. Then `Store::pause_session`
    /// or `Store::order_end`. A pause is followed by its end.
    pub(crate) fn order(&mut self, host: usize) -> Option<()> {
        let command = match self.organizer {
            Organizer::Plans(command) => command,
            Organizer::Done(Command::Pause(true)) => Command::Pause(false),
            _ => return None,
        };
        let elsewhere = self.db.is_owned() && self.db.owner != Some(host);
        let passed_on = elsewhere && self.hosts[host].session.is_none();
        if !self.hosts[host].works() || passed_on || self.db.locked_by.is_some() {
            return None;
        }
        match command {
            Command::Pause(paused) => self.db.paused = paused,
            Command::End => self.db.open = false,
            Command::Release | Command::Follow => return None,
        }
        self.organizer = Organizer::Stored(command, host);
        Some(())
    }

    /// `Registry::command`. Without an open session the database alone is enough.
    pub(crate) fn deliver(&mut self, host: usize) -> Option<()> {
        let Organizer::Stored(command, at) = self.organizer else { return None };
        if at != host || self.hosts[host].process != Process::Up {
            return None;
        }
        self.organizer = match &mut self.hosts[host].session {
            // It waits in the queue.
            Some(Session { command: Some(_), .. }) => return None,
            Some(session) => {
                session.command = Some(command);
                Organizer::Sent(command, host)
            }
            None => Organizer::Done(command),
        };
        Some(())
    }

    /// `Session::execute`.
    pub(crate) fn obey(&mut self, host: usize) -> Option<()> {
        let (paused, open, works) = (self.db.paused, self.db.open, self.hosts[host].works());
        let session = self.session_at(host).filter(|session| session.is_idle())?;
        let command = session.command.take()?;
        let mut ends = false;
        match command {
            Command::Pause(paused) => session.paused = paused,
            Command::End => ends = true,
            Command::Release => {
                session.leaving = true;
                if let Run::Playing(world) = &mut session.run {
                    world.reported = world.tick;
                }
            }
            // Without the database another beat tries again.
            Command::Follow if works => (session.paused, ends) = (paused, !open),
            Command::Follow => {}
        }
        if ends {
            match &mut session.run {
                Run::Playing(_) => session.close_run(true)?,
                Run::Ended { last, .. } => *last = true,
                Run::None | Run::Stored { .. } => self.hosts[host].session = None,
            }
        }
        if self.organizer == Organizer::Sent(command, host) {
            self.organizer = Organizer::Done(command);
        }
        Some(())
    }

    /// Whether the run has ended for good.
    pub(crate) fn run_has_ended(&self) -> bool {
        self.db.run != RunRow::Open
    }
}
