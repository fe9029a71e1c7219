//! A copy of a run's state at one tick, taken on the thread that steps the world. Other threads derive frames from it.

use palmares_models::Pose;
use palmares_tasks::Run;
use palmares_tasks::run::{Evidence, RunSample};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The data that a viewer gets in addition to the poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Overlays {
    /// Motors, tendons, joints, and the predicted equilibrium of the hand.
    pub(super) telemetry: bool,
    /// Contacts.
    pub(super) contacts: bool,
    /// Reason why objects count or do not.
    pub(super) verdicts: bool,
}

impl Overlays {
    /// All overlays.
    pub(super) const ALL: Overlays = Overlays { telemetry: true, contacts: true, verdicts: true };
}

/// The number of viewers of a run for each overlay.
#[derive(Debug, Default)]
pub(super) struct OverlayCounts {
    telemetry: AtomicUsize,
    contacts: AtomicUsize,
    verdicts: AtomicUsize,
}

impl OverlayCounts {
    fn each(&self, overlays: Overlays, change: impl Fn(&AtomicUsize)) {
        let Overlays { telemetry, contacts, verdicts } = overlays;
        for (wanted, count) in
            [(telemetry, &self.telemetry), (contacts, &self.contacts), (verdicts, &self.verdicts)]
        {
            if wanted {
                change(count);
            }
        }
    }

    /// A viewer comes.
    pub(super) fn add(&self, overlays: Overlays) {
        self.each(overlays, |count| _ = count.fetch_add(1, Ordering::Relaxed));
    }

    /// A viewer goes.
    pub(super) fn remove(&self, overlays: Overlays) {
        self.each(overlays, |count| _ = count.fetch_sub(1, Ordering::Relaxed));
    }

    /// The overlays that at least one viewer has.
    pub(super) fn any(&self) -> Overlays {
        let some = |count: &AtomicUsize| count.load(Ordering::Relaxed) > 0;
        Overlays {
            telemetry: some(&self.telemetry),
            contacts: some(&self.contacts),
            verdicts: some(&self.verdicts),
        }
    }
}

/// The state of a run at one tick.
#[derive(Debug)]
pub(super) struct WatchSample {
    /// Ticks since reset.
    pub(super) tick: u64,
    /// s since reset.
    pub(super) sim_time_s: f64,
    /// The run's score if it ended now.
    pub(super) score: f64,
    /// Pose of the hand's base.
    pub(super) base: Pose,
    /// The hand's coordinates.
    pub(super) q: Vec<f64>,
    /// Poses of the free objects.
    pub(super) objects: Vec<Pose>,
    /// Motors, tendons and contacts, for overlays that need them.
    pub(super) run_sample: Option<RunSample>,
    /// The referee's data, for the overlay that explains it.
    pub(super) evidence: Option<Evidence>,
    /// Largest delay of a tick of a realtime run in the last second, s.
    pub(super) late_s: Option<f64>,
}

impl WatchSample {
    /// Copies the state of a run.
    pub(super) fn of(run: &Run, overlays: Overlays, late_s: Option<f64>) -> Self {
        let (model, state) = (run.world().model(), run.world().state());
        WatchSample {
            tick: run.tick(),
            sim_time_s: run.sim_time_s(),
            score: run.score(),
            base: state.base,
            q: state.q.clone(),
            objects: (0..state.objects.len()).map(|k| state.object_pose(model, k)).collect(),
            run_sample: (overlays.telemetry || overlays.contacts).then(|| run.sample()),
            evidence: overlays.verdicts.then(|| run.evidence()),
            late_s,
        }
    }
}
