//! How a run is recorded.

use super::driver::Session;
use super::official::Origin;
use crate::protocol::{Mode, Reset};
use crate::replay::{Header, Kind, Pacing, Recording};
use crate::store::unix_ms;
use crate::world::Witness;
use palmares_models::hand::Hand;
use palmares_tasks::{Run, Task};

/// Makes the witness of a run that records it, when the run is there.
type Begin = Box<dyn FnOnce(&Run) -> Box<dyn Witness> + Send>;

impl Session {
    /// Prepares to record a run.
    pub(super) fn record(
        &self,
        run_id: &str,
        task: &Task,
        hand: &Hand,
        origin: &Origin,
        reset: &Reset,
    ) -> (Option<Begin>, Option<Recording>) {
        let Some(archive) = &self.host.replays else { return (None, None) };
        let header = Header {
            kind: if self.official { Kind::Official } else { Kind::Practice },
            pacing: match reset.mode {
                Mode::Lockstep => Pacing::Lockstep,
                Mode::Realtime => Pacing::Realtime,
            },
            sensing: reset.sensing,
            seed_number: origin.number,
            k: origin.k,
            ..Header::new(run_id, &self.team, task, hand, origin.seed, unix_ms().unsigned_abs())
        };
        let (begin, recording) = archive.record(header);
        (Some(Box::new(|run| Box::new(begin(run)))), Some(recording))
    }
}
