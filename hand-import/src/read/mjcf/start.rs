//! The keyframe from which the hand starts: the one that is called `home`, else the first.

use super::frames::Frames;
use super::model::{ActuatorTarget, Key, Model};
use super::motions::{Motion, Motions};
use super::tendons::Command;
use crate::decision::{At, Log};
use crate::draft::{Draft, Start};

/// Name of the keyframe from which the controllers of most models start.
const HOME: &str = "home";
/// Difference of a command from its joint that is rounding, rad or m.
const SAME: f64 = 1e-6;

/// Takes the start of the hand from a keyframe. The draft has its joints and motors.
pub(crate) fn start(model: &Model, frames: &Frames, commands: &[Command], draft: &mut Draft, log: &mut Log) {
    let home = model.keys.iter().position(|key| key.name == HOME).unwrap_or(0);
    for (index, key) in model.keys.iter().enumerate() {
        let element = format!("key '{}'", key.name);
        if index != home {
            let text = format!("a hand has one start; that of key '{}' is taken", model.keys[home].name);
            log.dropped(At::Hand, element, text);
            continue;
        }
        let start = of(model, frames, key, commands, draft);
        let text = match (start.joints.len(), start.motors.len()) {
            (0, 0) => "is the start: all joints at 0 or where their springs rest, as without it".to_owned(),
            (joints, motors) => format!("is the start: {joints} joints and {motors} motors in [start]"),
        };
        log.taken(At::Hand, element, text);
        draft.start = start;
    }
}

fn of(model: &Model, frames: &Frames, key: &Key, commands: &[Command], draft: &Draft) -> Start {
    let motions = Motions::of(model, frames);
    let mut start = Start::default();
    for (index, joint) in model.joints.iter().enumerate() {
        let own = frames.moves(joint.body) && *motions.joint(index) == Motion::Own;
        let drawn = draft.joints.iter().find(|other| other.name == joint.name).filter(|_| own);
        let Some(drawn) = drawn else { continue };
        if key.x[index] != drawn.stated.rest.unwrap_or_default() {
            start.joints.push((joint.name.clone(), key.x[index]));
        }
    }
    // A servo holds its joint; other motors begin where the key's commands put them.
    for command in commands {
        let actuator = &model.actuators[command.actuator];
        let Some(set) = key.commands.as_ref().and_then(|list| list.get(command.actuator)) else { continue };
        let drawn = draft.actuators.iter().find(|other| other.name == actuator.name);
        let Some([from, to]) = drawn.and_then(|drawn| drawn.range) else { continue };
        let wound = command.at_0 + command.per_unit * set;
        let held = match actuator.target {
            ActuatorTarget::Joint(joint) => (wound - key.x[joint]).abs() < SAME,
            ActuatorTarget::Tendon(_) => false,
        };
        let sigma = ((wound - from) / (to - from)).clamp(0.0, 1.0);
        if !held && sigma.is_finite() {
            start.motors.push((actuator.name.clone(), sigma));
        }
    }
    start
}
