//! Grips of other hands: a split cylinder pinched between the fingertips or wrapped, pulled out along its axis, and poses
//! at rest in air.

use super::outcome::Effort;
use anyhow::{Context, Result};
use palmares_bench::cases::ends_of_steps;
use palmares_bench::cases::instrument::{Closing, Held, body, weightless};
use palmares_bench::measured::Measured;
use palmares_bench::recorder::Recorder;
use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_models::{Mat3, Pose, Rotation, Vec3};
use palmares_sim::{Command, Model, State};
use std::sync::Arc;

/// Where a hand grips, in the frame of its base: as the recipes of `palmares.skills` have it, whose sources are the hands'
/// READMEs.
pub(super) struct Grip {
    pub(super) hand: &'static str,
    /// From the wrist to the fingertips, and along the closing fingers.
    approach: Vec3,
    across: Vec3,
    /// A point on the line of approach, m.
    centre: Vec3,
    /// Distances along `approach` from the base to the palm and to the fingertips, m.
    palm_m: f64,
    reach_m: f64,
    opened: &'static [f64],
    closed: &'static [f64],
}

const fn grip(
    hand: &'static str,
    across: Vec3,
    centre: Vec3,
    (palm_m, reach_m): (f64, f64),
    opened: &'static [f64],
    closed: &'static [f64],
) -> Grip {
    Grip { hand, approach: Vec3::Z, across, centre, palm_m, reach_m, opened, closed }
}

pub(super) const REFLEX: Grip = grip(
    "reflex",
    Vec3::X,
    Vec3::new(0.01, 0.0, 0.0),
    (0.084, 0.19),
    &[0.35, 0.35, 0.35, 0.3],
    &[1.0, 1.0, 1.0, 0.3],
);
pub(super) const T42: Grip = grip("yale_t42", Vec3::Y, Vec3::ZERO, (0.1, 0.208), &[0.1, 0.1], &[1.0, 1.0]);
pub(super) const MODEL_O: Grip =
    grip("yale_model_o", Vec3::X, Vec3::ZERO, (0.1, 0.205), &[0.25, 0.25, 0.25, 0.3], &[1.0, 1.0, 1.0, 0.3]);
pub(super) const BARRETT: Grip = grip(
    "barrett_bh282",
    Vec3::NEG_X,
    Vec3::new(0.005, -0.009, 0.0),
    (0.09, 0.21),
    &[0.26, 0.36, 0.22, 0.0],
    &[1.0, 1.0, 1.0, 0.0],
);
pub(super) const ROBOTIQ_3F: Grip =
    grip("robotiq_3f", Vec3::X, Vec3::ZERO, (0.085, 0.235), &[0.1, 0.1, 0.1, 0.5], &[1.0, 1.0, 1.0, 0.5]);
pub(super) const ROBOTIQ_2F: Grip = grip("robotiq_2f85", Vec3::Y, Vec3::ZERO, (0.105, 0.168), &[0.0], &[1.0]);

/// Grips of the standard protocols: the shell of NIST's and ASTM's artefact for a Mini45 sensor has this radius, m; its
/// length and friction are guesses.
const RADIUS_M: f64 = 0.026;
const HALF_LENGTH_M: f64 = 0.06;
const FRICTION: f64 = 0.8;
/// A cylinder pinched in the studies of motion has its axis this far before the fingertips' end, m.
const TIP_M: f64 = 0.015;
/// A person who measures a pinch puts the axis as near to the fingertips' end as the hand keeps it, m; of a wrap, the
/// cylinder as near to the palm.
const TIPS_M: [f64; 7] = [0.015, 0.02, 0.025, 0.03, 0.035, 0.04, 0.045];
const GAPS_M: [f64; 5] = [0.001, 0.005, 0.01, 0.015, 0.02];
/// A pull grows by this, N/s, until the cylinder has moved by this, m, or to this, N.
const PULL: (f64, f64, f64) = (20.0, 0.01, 300.0);
/// A small motion of a motor, in σ.
const NUDGE: f64 = 0.02;
/// Shifts along the approach and along the cylinder, mm.
const SHIFTS: [(f64, f64); 5] = [(0.0, 0.0), (-5.0, 0.0), (3.0, 0.0), (0.0, 8.0), (0.0, -8.0)];

/// How the cylinder lies in the hand.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// Between the fingertips.
    Pinch,
    /// Before the palm.
    Wrap,
}

/// The force that is read.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Reading {
    /// The force between the halves: of a pinch, split across the closing direction; of a wrap, the mean over all splits.
    Split,
    /// The force that pulls the cylinder out along its axis.
    Pull,
}

/// A cylinder in the hand, its axis across the closing fingers: `deep_m` from the base along the approach.
fn scene(
    effort: &Effort,
    (grip, hand): (&Grip, &Arc<Hand>),
    radius: f64,
    deep_m: f64,
    along_m: f64,
) -> Result<(Model, State, Pose)> {
    let along = grip.approach.cross(grip.across);
    let upright = Rotation::from_mat3(&Mat3::from_cols(grip.across, -grip.approach, along)).normalize();
    let shape = Shape::Cylinder { radius, half_length: HALF_LENGTH_M };
    let at = grip.centre + grip.approach * deep_m + along * along_m;
    let mut model = Model::new(weightless(effort.setup.dt_s), Some(Arc::clone(hand)))?;
    model.add_object(body(&shape, FRICTION)?)?;
    let state = State::at_rest(&model, Pose::IDENTITY, &[Pose::from_parts(at, upright)]);
    Ok((model, state, Pose::IDENTITY))
}

impl Grip {
    /// The built-in hand.
    pub(super) fn hand(&self) -> Result<Arc<Hand>> {
        Hand::builtin(self.hand).with_context(|| format!("{} is built in", self.hand))
    }

    fn closing(&self) -> Closing {
        Closing { opened: self.opened.to_vec(), closed: self.closed.to_vec() }
    }
}

/// Motions of a cylinder between the fingertips, along the approach and the closing direction, under a small motion of
/// each of two motors, m; none if the hand does not keep it.
pub(super) fn in_fingertips(
    effort: &Effort,
    grip: &Grip,
    radius: f64,
    recorder: &mut Recorder,
) -> Result<Option<[[f64; 2]; 2]>> {
    let setup = &effort.setup;
    let hand = grip.hand()?;
    let mut motions = [[0.0; 2]; 2];
    for (motor, motion) in motions.iter_mut().enumerate() {
        let scene = scene(effort, (grip, &hand), radius, grip.reach_m - TIP_M, 0.0)?;
        let mut held = Held::close(setup, recorder, scene, &grip.closing())?;
        if held.lost()? {
            return Ok(None);
        }
        held.ease(setup, recorder)?;
        let moved = held.moved_by(setup, recorder, motor, -NUDGE)?;
        *motion = [moved.dot(grip.approach) / -NUDGE, moved.dot(grip.across) / -NUDGE];
    }
    Ok(Some(motions))
}

/// The first distance from the base at which the hand keeps the cylinder, m; the very first if there is none.
fn kept(
    effort: &Effort,
    (grip, hand): (&Grip, &Arc<Hand>),
    way: Way,
    recorder: &mut Recorder,
) -> Result<f64> {
    let places: Vec<f64> = match way {
        Way::Pinch => TIPS_M.iter().map(|tip| grip.reach_m - tip).collect(),
        Way::Wrap => GAPS_M.iter().map(|gap| grip.palm_m + RADIUS_M + gap).collect(),
    };
    for &deep_m in &places {
        let scene = scene(effort, (grip, hand), RADIUS_M, deep_m, 0.0)?;
        if !Held::close(&effort.setup, recorder, scene, &grip.closing())?.lost()? {
            return Ok(deep_m);
        }
    }
    Ok(places[0])
}

pub(super) fn measure(
    effort: &Effort,
    grip: &Grip,
    (way, reading): (Way, Reading),
    published: Option<f64>,
) -> Result<Vec<Measured>> {
    let along = grip.approach.cross(grip.across);
    // Fingers that wrap press from all sides.
    let split = |[all, across]: [f64; 2]| if way == Way::Pinch { across } else { all };
    let mut recorder = Recorder::default();
    let hand = grip.hand()?;
    let deep_m = kept(effort, (grip, &hand), way, &mut recorder)?;
    let shifts = &SHIFTS[..if effort.few { 3 } else { SHIFTS.len() }];
    let mut placements = Vec::new();
    for (deep_mm, along_mm) in shifts {
        // A wrapped cylinder cannot lie in the palm.
        let deep_mm = if way == Way::Wrap { deep_mm.abs() } else { *deep_mm };
        let scene = scene(effort, (grip, &hand), RADIUS_M, deep_m + 1e-3 * deep_mm, 1e-3 * along_mm)?;
        let mut held = Held::close(&effort.setup, &mut recorder, scene, &grip.closing())?;
        let value = match reading {
            _ if held.lost()? => None,
            Reading::Split => Some(split(held.split_force(&effort.setup, &mut recorder, grip.across)?)),
            Reading::Pull => Some(held.pulling_force(&effort.setup, &mut recorder, along, PULL)?),
        };
        let place = match way {
            Way::Pinch => format!("{:.0} mm before the tips' end", 1e3 * (grip.reach_m - deep_m) - deep_mm),
            Way::Wrap => format!("{:.0} mm off the palm", 1e3 * (deep_m - grip.palm_m - RADIUS_M) + deep_mm),
        };
        placements.push((format!("{place}, {along_mm} mm aside"), value));
    }
    let quantity = match reading {
        Reading::Split => "force between the halves",
        Reading::Pull => "force that pulls the cylinder out along its axis",
    };
    Ok(vec![Measured {
        quantity: quantity.to_owned(),
        unit: "N".to_owned(),
        hand: grip.hand.to_owned(),
        published,
        placements,
    }])
}

/// Force between the halves of a cylinder pinched as near to the tips as the hand keeps it, N, for a hand with other numbers.
pub(super) fn pinched(effort: &Effort, grip: &Grip, hand: &Arc<Hand>) -> Result<Option<f64>> {
    let mut recorder = Recorder::default();
    let deep_m = kept(effort, (grip, hand), Way::Pinch, &mut recorder)?;
    let scene = scene(effort, (grip, hand), RADIUS_M, deep_m, 0.0)?;
    let mut held = Held::close(&effort.setup, &mut recorder, scene, &grip.closing())?;
    if held.lost()? {
        return Ok(None);
    }
    let [_, across] = held.split_force(&effort.setup, &mut recorder, grip.across)?;
    Ok(Some(across))
}

/// Joint coordinates of a hand at rest in air, its motors at `sigma`.
pub(super) fn rest_of(effort: &Effort, hand: &Arc<Hand>, sigma: &[f64]) -> Result<Vec<f64>> {
    let setup = &effort.setup;
    let model = Model::new(weightless(setup.dt_s), Some(Arc::clone(hand)))?;
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut world = setup.start(model, state)?;
    let mut command = Command::stay(world.model(), Pose::IDENTITY);
    let from = command.sigma.clone();
    for t in ends_of_steps(4.0, setup.dt_s) {
        let part = palmares_bench::cases::ramp(t).0;
        for (k, s) in command.sigma.iter_mut().enumerate() {
            *s = from[k] + part * (sigma[k] - from[k]);
        }
        world.step(&command)?;
    }
    Ok(world.state().q.clone())
}

/// Mass of a hand, kg.
pub(super) fn mass(name: &str, published: f64) -> Result<Vec<Measured>> {
    let hand = Hand::builtin(name).with_context(|| format!("{name} is built in"))?;
    let sum = hand.links.iter().map(|link| link.inertia.mass).sum();
    Ok(vec![Measured {
        quantity: "mass of the hand".to_owned(),
        unit: "kg".to_owned(),
        hand: name.to_owned(),
        published: Some(published),
        placements: vec![("sum of its links".to_owned(), Some(sum))],
    }])
}
