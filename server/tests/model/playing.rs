//! The client and its requests.

use crate::fleet::Fleet;
use crate::guards::Guard;
use crate::state::{GATE, Process, Run, Session, State};

impl Session {
    /// Whether its holder does something now: no reply waits at the gate.
    pub(crate) fn is_idle(&self) -> bool {
        let replying = match &self.run {
            Run::Playing(world) | Run::Ended { world, .. } => world.replying,
            Run::None | Run::Stored { .. } => false,
        };
        self.held && !self.lost && !self.leaving && !replying
    }

    /// `Session::close`: the observers get the last tick; the world is gone. Its result is to be stored.
    pub(crate) fn close_run(&mut self, last: bool) -> Option<()> {
        let Run::Playing(world) = &self.run else { return None };
        let mut world = world.clone();
        world.reported = world.tick;
        self.run = Run::Ended { world, writing: false, last };
        Some(())
    }
}

impl State {
    /// The session at a host that runs.
    pub(crate) fn session_at(&mut self, host: usize) -> Option<&mut Session> {
        let here = &mut self.hosts[host];
        here.session.as_mut().filter(|_| here.process == Process::Up)
    }

    /// The session at the client's host.
    fn connected(&mut self) -> Option<&mut Session> {
        let host = self.client.at?;
        self.session_at(host)
    }

    /// A new connection, through the proxy: to a host that is ready.
    pub(crate) fn connect(&mut self, host: usize) -> Option<()> {
        let ready = self.client.at.is_none() && !self.client.gone && self.client.result.is_none();
        if !ready || !self.hosts[host].works() {
            return None;
        }
        self.client.at = Some(host);
        Some(())
    }

    /// The connection is lost: with the host, or on the way.
    pub(crate) fn disconnect(&mut self) -> Option<()> {
        let host = self.client.at?;
        if self.hosts[host].works() {
            self.fault()?;
        }
        self.client.at = None;
        self.reply_lost(host);
        Some(())
    }

    /// The client goes for good.
    pub(crate) fn leave(&mut self) -> Option<()> {
        if self.client.gone {
            return None;
        }
        self.fault()?;
        self.client.gone = true;
        if let Some(host) = self.client.at.take() {
            self.reply_lost(host);
        }
        Some(())
    }

    fn reply_lost(&mut self, host: usize) {
        if let Some(session) = &mut self.hosts[host].session
            && let Run::Playing(world) | Run::Ended { world, .. } = &mut session.run
        {
            world.replying = false;
            if let Run::Playing(world) = &mut session.run {
                world.reported = world.tick;
            }
        }
    }

    /// `Sessions::fetch`: asks the owner for the session.
    pub(crate) fn want(&mut self, host: usize) -> Option<()> {
        let here = &self.hosts[host];
        // Its beat comes first.
        let away = here.session.is_none() && here.adopting.is_none() && self.db.hosts[host].leased;
        if self.client.at != Some(host)
            || !here.works()
            || !away
            || !self.db.open
            || self.db.owner == Some(host)
        {
            return None;
        }
        self.db.wanted_by = Some(host);
        Some(())
    }

    /// `Sessions::resume`, `Session::go_on`.
    pub(crate) fn resume(&mut self, host: usize) -> Option<()> {
        if self.client.at != Some(host) {
            return None;
        }
        let session = self.session_at(host).filter(|session| session.is_idle())?;
        session.standing = false;
        Some(())
    }

    /// `Session::step`: of one tick or more. A run that is over is closed. The reply waits: [`State::reply`].
    pub(crate) fn step(&mut self, fleet: &Fleet, ticks: u8) -> Option<()> {
        let session = self.connected().filter(|session| session.is_idle())?;
        if session.paused || session.standing {
            return None;
        }
        let Run::Playing(world) = &mut session.run else { return None };
        if world.tick < fleet.ticks {
            world.tick = (world.tick + ticks).min(fleet.ticks);
            // The observers get the last tick after the reply.
            world.reported = world.tick - 1;
            world.replying = true;
        }
        if world.tick == fleet.ticks {
            session.close_run(false)?;
            self.forget_early(fleet);
        }
        Some(())
    }

    /// `Session::pass_gate`, then the reply; after it the observers get the last tick.
    pub(crate) fn reply(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        if self.client.at != Some(host) {
            return None;
        }
        let linked = self.hosts[host].linked;
        let session = self.session_at(host)?;
        let (over, world) = match &mut session.run {
            Run::Playing(world) => (false, world),
            Run::Ended { world, .. } => (true, world),
            Run::None | Run::Stored { .. } => return None,
        };
        let open = !fleet.keeps(Guard::GateBoundsTicks) || world.tick <= world.confirmed + GATE;
        // The result could not be stored.
        let open = open || (over && !linked && !fleet.keeps(Guard::GateAtTheEnd));
        if !world.replying || !open {
            return None;
        }
        (world.replying, world.reported) = (false, world.tick);
        if State::snapshot_due(world) {
            world.snapshot = world.tick;
        }
        let tick = world.tick;
        self.client.seen = self.client.seen.max(tick);
        Some(())
    }

    /// `Session::stop`.
    pub(crate) fn stop_run(&mut self, fleet: &Fleet) -> Option<()> {
        if self.client.seen == 0 {
            return None;
        }
        let session = self.connected().filter(|session| session.is_idle())?;
        session.close_run(false)?;
        self.forget_early(fleet);
        Some(())
    }

    /// `keep`: the client has been away for too long.
    pub(crate) fn grace(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        if !self.client.gone {
            return None;
        }
        let session = self.session_at(host).filter(|session| session.is_idle())?;
        session.close_run(false)?;
        self.forget_early(fleet);
        Some(())
    }

    fn forget_early(&mut self, fleet: &Fleet) {
        if !fleet.keeps(Guard::TicksOutliveTheRun) {
            self.db.rows.clear();
        }
    }
}
