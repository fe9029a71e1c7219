//! What is stored of the run: its ticks, its snapshot, its result.

use crate::fleet::Fleet;
use crate::guards::Guard;
use crate::state::{Database, Process, Run, RunRow, State, World};

impl Database {
    /// `Store::fenced`, for a write in one statement.
    pub(crate) fn accepts(&mut self, fleet: &Fleet, epoch: u8) -> bool {
        let accepted = epoch == self.epoch || !fleet.keeps(Guard::EpochIsChecked);
        self.stale_accepted |= accepted && epoch != self.epoch;
        accepted
    }

    /// The row of a statement with ticks, inserted or replaced.
    pub(crate) fn store_ticks(&mut self, epoch: u8, from: u8, through: u8) {
        self.stale_accepted |= epoch != self.epoch;
        self.rows.retain(|row| row.0 != from);
        self.rows.push((from, through));
        self.rows.sort_unstable();
    }

    /// The run's status for good.
    pub(crate) fn end_run(&mut self, end: RunRow) {
        self.run = end;
        self.first_end.get_or_insert(end);
        if let RunRow::Provisional { .. } = end {
            self.counted += 1;
        }
    }
}

impl World {
    /// `Backlog::take`: the row to send now.
    fn take(&mut self, fleet: &Fleet) -> Option<(u8, u8)> {
        let through = match self.sent {
            Some(through) if fleet.keeps(Guard::RowsAreSentAgain) => through,
            _ => self.reported,
        };
        (through > self.confirmed).then(|| {
            self.sent = Some(through);
            (self.confirmed, through)
        })
    }
}

impl State {
    fn world_at(&mut self, host: usize) -> Option<(u8, &mut World)> {
        let session = self.session_at(host)?;
        match &mut session.run {
            Run::Playing(world) | Run::Ended { world, .. } => Some((session.epoch, world)),
            Run::None | Run::Stored { .. } => None,
        }
    }

    /// `Rounds::round`, `ShippingConnection::store_ticks`.
    pub(crate) fn ship(&mut self, fleet: &Fleet, host: usize, answered: bool) -> Option<()> {
        if !self.hosts[host].works() || self.db.locked_by.is_some() {
            return None;
        }
        let (epoch, world) = self.world_at(host)?;
        let (from, through) = world.take(fleet)?;
        let accepted = epoch == self.db.epoch || !fleet.keeps(Guard::TicksAreFenced);
        if accepted {
            self.db.store_ticks(epoch, from, through);
        }
        if !answered {
            self.fault()?;
            self.hosts[host].linked = false;
        } else if accepted {
            let (_, world) = self.world_at(host)?;
            (world.confirmed, world.sent) = (through, None);
        } else {
            self.session_at(host)?.lost = true;
        }
        Some(())
    }

    /// The statement is given up while it waits.
    pub(crate) fn ship_late(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        if !self.hosts[host].works() || self.db.late.is_some() {
            return None;
        }
        let (epoch, world) = self.world_at(host)?;
        let (from, through) = world.take(fleet)?;
        self.fault()?;
        self.db.late = Some((epoch, from, through));
        self.hosts[host].linked = false;
        Some(())
    }

    /// `Rounds::send_snapshots`, `ShippingConnection::store_snapshots`.
    pub(crate) fn send_snapshot(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        if !self.hosts[host].works() || self.db.locked_by.is_some() {
            return None;
        }
        let (epoch, world) = self.world_at(host)?;
        let early = world.snapshot > world.confirmed && fleet.keeps(Guard::SnapshotAfterTicks);
        if world.snapshot == 0 || early {
            return None;
        }
        let tick = std::mem::take(&mut world.snapshot);
        if epoch == self.db.epoch {
            self.db.snapshot = tick;
        }
        Some(())
    }

    /// `Session::store`, the begin of `Store::finish_run`: `Store::fenced`.
    pub(crate) fn begin_result(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        if !self.hosts[host].works() || self.db.locked_by.is_some() {
            return None;
        }
        let current = self.db.epoch;
        let session = self.session_at(host).filter(|session| session.held && !session.leaving)?;
        let Run::Ended { writing, .. } = &mut session.run else { return None };
        if *writing {
            return None;
        }
        if session.epoch != current && fleet.keeps(Guard::EpochIsChecked) {
            session.lost = true;
            return Some(());
        }
        *writing = true;
        if fleet.keeps(Guard::CheckLocksTheRow) {
            self.db.locked_by = Some(host);
        }
        Some(())
    }

    /// The rest of `Store::finish_run`; `Session::finish` then deletes the ticks.
    pub(crate) fn store_result(&mut self, fleet: &Fleet, host: usize, answered: bool) -> Option<()> {
        if !self.hosts[host].works() {
            return None;
        }
        let locked = self.db.locked_by == Some(host);
        let session = self.session_at(host)?;
        let epoch = session.epoch;
        let Run::Ended { world, writing: writing @ true, last } = &mut session.run else { return None };
        *writing = false;
        if !locked && fleet.keeps(Guard::CheckLocksTheRow) {
            // The database has ended the transaction.
            return answered.then_some(());
        }
        let (ticks, whole, last) = (world.tick, world.whole, *last);
        if answered {
            session.run = Run::Stored { ticks, last };
        }
        if locked {
            self.db.locked_by = None;
        }
        self.db.stale_accepted |= epoch != self.db.epoch;
        if self.db.run == RunRow::Open || !fleet.keeps(Guard::OnlyOpenRunsFinish) {
            self.db.end_run(RunRow::Provisional { ticks, whole });
        }
        if answered {
            self.db.rows.clear();
            self.end_session(host);
        } else {
            self.fault()?;
            self.hosts[host].linked = false;
        }
        Some(())
    }

    /// The result could not be stored.
    pub(crate) fn result_fails(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        if self.hosts[host].linked {
            return None;
        }
        let session = self.session_at(host)?;
        let Run::Ended { writing, .. } = &mut session.run else { return None };
        if fleet.keeps(Guard::ResultIsKept) {
            *writing = false;
        } else {
            session.run = Run::None;
        }
        Some(())
    }

    /// The reply to `stop`, or to the observation with which the run is over.
    pub(crate) fn send_result(&mut self, fleet: &Fleet, host: usize) -> Option<()> {
        if self.client.at != Some(host) {
            return None;
        }
        let session = self.session_at(host)?;
        let ticks = match &session.run {
            Run::Stored { ticks, .. } => *ticks,
            Run::Ended { world, .. } if !fleet.keeps(Guard::StoredBeforeSent) => world.tick,
            _ => return None,
        };
        self.client.result = Some(ticks);
        Some(())
    }

    /// `Session::end` after an organizer's command.
    fn end_session(&mut self, host: usize) {
        let ends = |run: &Run| matches!(run, Run::Stored { last: true, .. });
        if self.hosts[host].session.as_ref().is_some_and(|session| ends(&session.run)) {
            self.hosts[host].session = None;
            self.answer_for(host);
        }
    }

    /// `Session::end`: the result of a session that an organizer has ended could not be stored.
    pub(crate) fn end_unstored(&mut self, host: usize) -> Option<()> {
        let here = &mut self.hosts[host];
        if here.linked || here.process != Process::Up {
            return None;
        }
        let ended = |run: &Run| matches!(run, Run::Ended { last: true, .. });
        here.session.take_if(|session| session.held && ended(&session.run))?;
        self.answer_for(host);
        Some(())
    }
}
