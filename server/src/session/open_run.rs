//! The open run of a session: what it has from its `reset` until its result is stored.

use super::finished::FinishedRun;
use crate::archive::Recording;
use palmares_tasks::run::Exposure;
use palmares_worlds::world::backlog::Gate;
use palmares_worlds::world::realtime::RealtimeWorld;
use palmares_worlds::world::run::World;
use std::sync::Arc;
use std::time::Duration;

/// The open run.
#[derive(Debug)]
pub(super) struct OpenRun {
    pub(super) stage: Stage,
    /// Bounds the ticks that a failure of this host takes back; None if no other host can continue the run.
    pub(super) gate: Option<Gate>,
}

/// The stage of an open run.
#[derive(Debug)]
pub(super) enum Stage {
    /// It is played. The recording is its replay; None on a server that does not record.
    Played(PlayedWorld, Option<Recording>),
    /// It has ended, and its result is made or stored now.
    Closing,
    /// Its result could not be stored: `stop` tries again, and the session by itself at this time.
    Unstored(Box<FinishedRun>, Duration),
}

/// The world of a run that is played.
#[derive(Debug)]
pub(super) enum PlayedWorld {
    /// It waits for steps.
    Lockstep(Box<LockstepRun>),
    /// It follows the clock.
    Realtime(Arc<RealtimeWorld>),
}

/// A lockstep run that is played.
#[derive(Debug)]
pub(super) struct LockstepRun {
    pub(super) world: World,
    /// Images that the controller will probably ask for next.
    pub(super) upcoming: Vec<Arc<Exposure>>,
    /// Whether another host has begun the run and no step was made here yet.
    pub(super) taken_over: bool,
}

impl LockstepRun {
    /// A run of this server, or one that it has taken over.
    pub(super) fn new(world: World, taken_over: bool) -> Box<Self> {
        Box::new(LockstepRun { world, upcoming: Vec::new(), taken_over })
    }
}

/// The observations of a realtime world. They outlast its run: the client may still have to read some.
#[derive(Debug)]
pub(super) struct Stream {
    pub(super) live: Arc<RealtimeWorld>,
    /// Whether the run has gone back to its last stored tick since the last observation.
    pub(super) went_back: bool,
}

impl OpenRun {
    /// A lockstep run that is played.
    pub(super) fn lockstep(&mut self) -> Option<&mut LockstepRun> {
        match &mut self.stage {
            Stage::Played(PlayedWorld::Lockstep(run), _) => Some(run),
            _ => None,
        }
    }

    /// A realtime world that is played.
    pub(super) fn realtime(&self) -> Option<&Arc<RealtimeWorld>> {
        match &self.stage {
            Stage::Played(PlayedWorld::Realtime(live), _) => Some(live),
            _ => None,
        }
    }

    /// Does something with the world, if the run is played.
    pub(super) fn with_world<T>(&mut self, work: impl FnOnce(&mut World) -> T) -> Option<T> {
        match &mut self.stage {
            Stage::Played(PlayedWorld::Lockstep(run), _) => Some(work(&mut run.world)),
            Stage::Played(PlayedWorld::Realtime(live), _) => live.with_world(work),
            Stage::Closing | Stage::Unstored(..) => None,
        }
    }

    /// The run has ended: returns its stage until now.
    pub(super) fn close(&mut self) -> Stage {
        std::mem::replace(&mut self.stage, Stage::Closing)
    }
}
