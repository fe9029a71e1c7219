//! A copy of a run at a moment, taken where the world is stepped. Whatever has to be computed is computed elsewhere.

use palmares_models::Pose;
use palmares_tasks::Run;
use palmares_tasks::run::{Evidence, RunSample};
use std::sync::atomic::{AtomicUsize, Ordering};

/// What a viewer wants to see beside the poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Overlays {
    /// Motors, tendons, joints, and where the hand would rest.
    pub(super) telemetry: bool,
    /// Contacts.
    pub(super) contacts: bool,
    /// Why objects count or do not.
    pub(super) verdicts: bool,
}

impl Overlays {
    /// Everything there is.
    pub(super) const ALL: Overlays = Overlays { telemetry: true, contacts: true, verdicts: true };
}

/// How many viewers of a run want what.
#[derive(Debug, Default)]
pub(super) struct Wanted {
    telemetry: AtomicUsize,
    contacts: AtomicUsize,
    verdicts: AtomicUsize,
}

impl Wanted {
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

    /// What somebody wants.
    pub(super) fn now(&self) -> Overlays {
        let some = |count: &AtomicUsize| count.load(Ordering::Relaxed) > 0;
        Overlays {
            telemetry: some(&self.telemetry),
            contacts: some(&self.contacts),
            verdicts: some(&self.verdicts),
        }
    }
}

/// A run at a moment.
#[derive(Debug)]
pub(super) struct Snapshot {
    /// Ticks since reset.
    pub(super) tick: u64,
    /// s since reset.
    pub(super) sim_time_s: f64,
    /// What the run would be worth if it ended now.
    pub(super) score: f64,
    /// Pose of the hand's base.
    pub(super) base: Pose,
    /// The hand's coordinates.
    pub(super) q: Vec<f64>,
    /// Poses of the free objects.
    pub(super) objects: Vec<Pose>,
    /// Motors, tendons and contacts, if somebody wants them.
    pub(super) sample: Option<RunSample>,
    /// What the referee knows, if somebody wants to know why.
    pub(super) evidence: Option<Evidence>,
    /// How late a tick of a realtime run began, at most in the last second, s.
    pub(super) late_s: Option<f64>,
}

impl Snapshot {
    /// Of a run as it stands.
    pub(super) fn of(run: &Run, overlays: Overlays, late_s: Option<f64>) -> Self {
        let (model, state) = (run.world().model(), run.world().state());
        Snapshot {
            tick: run.tick(),
            sim_time_s: run.sim_time_s(),
            score: run.score(),
            base: state.base,
            q: state.q.clone(),
            objects: (0..state.objects.len()).map(|k| state.object_pose(model, k)).collect(),
            sample: (overlays.telemetry || overlays.contacts).then(|| run.sample()),
            evidence: overlays.verdicts.then(|| run.evidence()),
            late_s,
        }
    }
}
