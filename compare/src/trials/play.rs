//! One grasp in one engine: close, lift, hold, shake; kept or lost, judged from poses alone.

use super::family::{HandKind, Trial};
use super::scene::scene;
use anyhow::Result;
use palmares_bench::cases::grasp_scene::GraspStart;
use palmares_bench::cases::{Setup, ends_of_steps, moved, ramp};
use palmares_bench::engine::Engine;
use palmares_bench::engine::limit::{NotFinished, StepFailed};
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Command, Model, Owner, State};
use parry3d_f64::query;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The hand is lifted by this, m; the object must be higher than it was by that.
const LIFT_M: f64 = 0.1;
const LIFTED_M: f64 = 0.05;
/// From the end of the settling on the object may move in the palm by less than this, m.
pub const MOVED_M: f64 = 0.03;
/// From the end of the settling on it may overlap the hand by at most this, m: a tenth of the held object.
pub const OVERLAP_M: f64 = 0.005;
/// An object this far from where it started in the palm is lost, m: no need to watch it fall.
const GONE_M: f64 = 0.15;
/// Interval of the overlap checks, s.
const LOOK_S: f64 = 0.02;
/// The shaking: amplitude, m, frequency, Hz, and time of its onset, s.
const SHAKE_M: f64 = 0.03;
const SHAKE_HZ: f64 = 3.0;
const ONSET_S: f64 = 0.1;

/// Times, s: the fingers close from `close` to `closed`, the hand rises until `lifted`; from `settled` on the
/// object must not move in the hand; it is shaken from `shaken` until `end`.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    close: f64,
    closed: f64,
    lifted: f64,
    settled: f64,
    shaken: f64,
    /// End of the run, s.
    pub end: f64,
}

impl Schedule {
    /// The SoftHand's is that of the grasp cases. The ReFlex spreads its fingers first, and its motors are slower.
    pub fn of(hand: HandKind) -> Self {
        match hand {
            HandKind::SoftHand => {
                Schedule { close: 0.0, closed: 0.5, lifted: 2.0, settled: 2.5, shaken: 4.0, end: 6.0 }
            }
            HandKind::ReFlex => {
                Schedule { close: 0.4, closed: 1.8, lifted: 3.3, settled: 3.8, shaken: 5.3, end: 7.3 }
            }
        }
    }

    /// Sets the command for the step that ends at `t`.
    fn instruct(&self, command: &mut Command, trial: &Trial, start: Pose, t: f64) {
        let closed = trial.sigma * ramp((t - self.close) / (self.closed - self.close)).0;
        match trial.hand {
            HandKind::SoftHand => command.sigma[0] = closed,
            HandKind::ReFlex => {
                command.sigma[..3].fill(closed);
                command.sigma[3] = trial.preshape * ramp(t / self.close).0;
            }
        }
        let rise_s = self.lifted - self.closed;
        let (rise, rate) = ramp((t - self.closed) / rise_s);
        let mut offset = Vec3::new(0.0, 0.0, LIFT_M * rise);
        let mut linear = Vec3::new(0.0, 0.0, LIFT_M * rate / rise_s);
        if t > self.shaken {
            let omega = 2.0 * PI * SHAKE_HZ;
            let (onset, setting_in) = ramp((t - self.shaken) / ONSET_S);
            let (sin, cos) = libm::sincos(omega * (t - self.shaken));
            offset.y += SHAKE_M * onset * sin;
            linear.y += SHAKE_M * (onset * omega * cos + setting_in / ONSET_S * sin);
        }
        command.base = moved(start, offset, linear);
    }
}

/// The ending of a grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// Lifted, held and shaken, and still there.
    Kept,
    /// Still there, but deeper in the hand than surfaces may be.
    Overlapping,
    /// Not lifted, or lost before it had settled.
    NotLifted,
    /// Lost while the hand did not move.
    LostHeld,
    /// Lost while it was shaken.
    LostShaken,
    /// A step did not converge, or something was not finite.
    Diverged,
    /// The engine took too long.
    NotFinished,
    /// The engine's adapter does not pass on what the object needs.
    NotPlayed,
}

/// The motion and the bounds by which a grasp is judged: others make other outcomes.
pub fn rules(hand: HandKind) -> String {
    let bounds_m = [LIFT_M, LIFTED_M, MOVED_M, OVERLAP_M, GONE_M, SHAKE_M];
    format!("{:?}, {bounds_m:?} m, {SHAKE_HZ} Hz, {ONSET_S} s, {LOOK_S} s", Schedule::of(hand))
}

/// The outcome of a grasp.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fate {
    /// The ending.
    pub ending: Ending,
    /// Time of the ending, s.
    pub end_s: f64,
    /// Deepest overlap of the object and the hand after it had settled, mm.
    pub overlap_mm: f64,
    /// Displacement of the object's centre in the palm after it had settled, mm.
    pub moved_mm: f64,
}

impl Fate {
    /// That of a run of which nothing was seen: it did not end in its time, or was not played.
    pub fn unseen(ending: Ending) -> Self {
        Fate { ending, end_s: 0.0, overlap_mm: 0.0, moved_mm: 0.0 }
    }
}

/// The object's pose in the frame of the hand's base.
pub fn in_palm(state: &State) -> Pose {
    state.base.inverse() * state.objects[0]
}

/// Plays a grasp; `watch` sees the engine after every step, with the time.
///
/// # Errors
/// The engine is not there or fails; divergence is no error.
pub fn play(
    setup: &Setup,
    trial: &Trial,
    mut watch: impl FnMut(f64, &mut dyn Engine) -> Result<()>,
) -> Result<Fate> {
    let schedule = Schedule::of(trial.hand);
    let GraspStart { model, state, start } = scene(trial, setup.dt_s)?;
    let mut engine = setup.start(model, state)?;
    let mut command = Command::stay(engine.model(), start);
    let mut judge = Judge::new(trial.hand, engine.state())?;
    for t in ends_of_steps(schedule.end, setup.dt_s) {
        schedule.instruct(&mut command, trial, start, t);
        match engine.step(&command) {
            Ok(_) => {}
            Err(error) if error.is::<NotFinished>() => return Ok(judge.fate(Ending::NotFinished, t)),
            Err(error) if error.is::<StepFailed>() => return Ok(judge.fate(Ending::Diverged, t)),
            Err(error) => return Err(error),
        }
        watch(t, &mut *engine)?;
        if !(engine.state().is_finite() && engine.outcome().converged) {
            return Ok(judge.fate(Ending::Diverged, t));
        }
        if let Some(ending) = judge.look(&schedule, t, setup.dt_s, engine.model(), engine.state()) {
            return Ok(judge.fate(ending, t));
        }
    }
    let deep = judge.overlap_m > OVERLAP_M;
    Ok(judge.fate(if deep { Ending::Overlapping } else { Ending::Kept }, schedule.end))
}

/// Watches the object.
struct Judge {
    hand: std::sync::Arc<Hand>,
    start: Vec3,
    floor_m: f64,
    settled: Option<Vec3>,
    overlap_m: f64,
    moved_m: f64,
}

impl Judge {
    fn new(hand: HandKind, state: &State) -> Result<Self> {
        Ok(Judge {
            hand: hand.model()?,
            start: in_palm(state).translation,
            floor_m: state.objects[0].translation.z,
            settled: None,
            overlap_m: 0.0,
            moved_m: 0.0,
        })
    }

    /// Whether the grasp is decided at the end of the step that ends at `t`.
    fn look(
        &mut self,
        schedule: &Schedule,
        t: f64,
        dt_s: f64,
        model: &Model,
        state: &State,
    ) -> Option<Ending> {
        let at = in_palm(state).translation;
        let Some(settled) = self.settled else {
            if (at - self.start).length() > GONE_M {
                return Some(Ending::NotLifted);
            }
            // In the first step that ends at or after a time; steps need not divide it.
            if t >= schedule.settled - 1e-9 {
                if state.objects[0].translation.z < self.floor_m + LIFTED_M {
                    return Some(Ending::NotLifted);
                }
                self.settled = Some(at);
            }
            return None;
        };
        self.moved_m = self.moved_m.max((at - settled).length());
        let low = state.objects[0].translation.z < self.floor_m + LIFTED_M;
        if self.moved_m >= MOVED_M || low {
            return Some(if t > schedule.shaken { Ending::LostShaken } else { Ending::LostHeld });
        }
        if (t / LOOK_S + 1e-6).floor() > ((t - dt_s) / LOOK_S + 1e-6).floor() {
            self.overlap_m = self.overlap_m.max(overlap(&self.hand, model, state));
        }
        None
    }

    fn fate(&self, ending: Ending, end_s: f64) -> Fate {
        Fate { ending, end_s, overlap_mm: 1e3 * self.overlap_m, moved_mm: 1e3 * self.moved_m }
    }
}

/// Deepest overlap of the object and the hand, m, from poses and shapes alone.
fn overlap(hand: &Hand, model: &Model, state: &State) -> f64 {
    let links = hand.base_from_links(&state.q);
    let placed = |k: usize| {
        let collider = &model.colliders()[k];
        let body = match collider.owner {
            Owner::Link(i) => state.base * links[i],
            Owner::Object(i) => state.objects[i],
            Owner::Static => Pose::IDENTITY,
        };
        (body * collider.body_from_shape, &collider.shape)
    };
    let owners = || model.colliders().iter().map(|collider| collider.owner).enumerate();
    let mut deepest: f64 = 0.0;
    for (a, _) in owners().filter(|(_, owner)| matches!(owner, Owner::Link(_))) {
        let (pose_a, shape_a) = placed(a);
        let bounds = shape_a.compute_aabb(&pose_a);
        for (b, _) in owners().filter(|(_, owner)| matches!(owner, Owner::Object(_))) {
            let (pose_b, shape_b) = placed(b);
            if !parry3d_f64::bounding_volume::BoundingVolume::intersects(
                &bounds,
                &shape_b.compute_aabb(&pose_b),
            ) {
                continue;
            }
            let contact = query::contact(&pose_a, &**shape_a, &pose_b, &**shape_b, 0.0);
            if let Ok(Some(contact)) = contact {
                deepest = deepest.max(-contact.dist);
            }
        }
    }
    deepest
}
