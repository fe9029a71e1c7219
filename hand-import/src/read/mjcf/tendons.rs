//! Actuators and tendons of a document as motors, cables and springs of a hand.
//!
//! MuJoCo's force acts along the length L of a joint or tendon; a cable of a hand is wound in, s = L₀ − L, and only pulls.

use std::f64::consts::PI;

use palmares_models::hand::{SpringNumbers, StatedTendon};
use palmares_models::measure::HandLimits;

use super::actuator::ActuatorSpec;
use super::frames::Frames;
use super::length::{Fit, fit};
use super::model::{Actuator, ActuatorTarget, JointKind, Model, Path, Row, Tendon};
use super::motions::{Motion, Motions, value};
use crate::decision::{At, Log};
use crate::draft::{self, Control, Draft, Drive, Spring, TendonPath, Tie};
use crate::read::element::Notes;

/// Stiffness at a joint of the cable that stands for a tendon's limit, N·m/rad: 1 N·m takes it 6° beyond.
const LIMIT_STIFFNESS: f64 = 10.0;
/// Largest force of a passive cable, in terms of its largest force between the joints' limits.
const MARGIN: f64 = 2.0;

/// Position that a command sets, in the coordinate of the motor's joint or the wound length of its tendon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Command {
    /// Index of the actuator in the document.
    pub(crate) actuator: usize,
    pub(crate) at_0: f64,
    pub(crate) per_unit: f64,
}

/// Adds actuators, tendons and springs to a draft that has the links and joints; returns what commands of its motors mean.
pub(crate) fn map(model: &Model, frames: &Frames, draft: &mut Draft, log: &mut Log) -> Vec<Command> {
    let motions = Motions::of(model, frames);
    let mut mapper = Mapper { model, frames, motions: &motions, draft, log, commands: Vec::new() };
    for actuator in &model.actuators {
        if let ActuatorTarget::Joint(joint) = actuator.target {
            mapper.servo(actuator, joint);
        }
    }
    for (index, tendon) in model.tendons.iter().enumerate() {
        mapper.tendon(index, tendon);
    }
    for row in &model.rows {
        mapper.row(row);
    }
    mapper.commands
}

struct Mapper<'a> {
    model: &'a Model,
    frames: &'a Frames,
    motions: &'a Motions,
    draft: &'a mut Draft,
    log: &'a mut Log,
    commands: Vec<Command>,
}

/// An actuator's law without its gear: `f = K (s_ref − s) − b ṡ` at the joint or the tendon.
struct Drawn {
    control: Control,
    stiffness: Option<f64>,
    damping: Option<f64>,
    /// s_ref at the ends of the control's range.
    range: Option<[f64; 2]>,
    /// s_ref at the control 0, and per unit of it.
    target: [f64; 2],
    /// Least and largest force.
    force: Option<[f64; 2]>,
    speed: Option<f64>,
}

impl Drawn {
    fn of(spec: &ActuatorSpec) -> Drawn {
        let [b0, b1, b2] = spec.bias();
        let gear = if spec.gear == 0.0 { 1.0 } else { spec.gear };
        let ordered = |[a, b]: [f64; 2]| [a.min(b), a.max(b)];
        let force = spec.force_range.map(|range| ordered(range.map(|f| f * gear)));
        let damping = (b2 < 0.0).then_some(-b2 * gear * gear);
        if b1 < 0.0 {
            let target = [b0, spec.gain].map(|x| x / (-b1 * gear));
            let commands = if spec.kind == "intvelocity" { spec.act_range } else { spec.ctrl_range };
            let fastest = |[a, b]: [f64; 2]| a.abs().max(b.abs()) / gear.abs();
            return Drawn {
                control: Control::Position,
                stiffness: Some(-b1 * gear * gear),
                damping,
                range: commands.map(|range| ordered(range.map(|ctrl| target[0] + target[1] * ctrl))),
                target,
                force,
                speed: spec.slew.or(spec.ctrl_range.filter(|_| spec.kind == "intvelocity").map(fastest)),
            };
        }
        if spec.velocity {
            let speed = spec.ctrl_range.map(|[a, b]| a.abs().max(b.abs()) / gear.abs());
            let control = Control::Velocity;
            return Drawn { control, stiffness: None, damping, range: None, target: [0.0; 2], force, speed };
        }
        // A force: the control's range limits it.
        let by_control =
            spec.ctrl_range.map(|range| ordered(range.map(|ctrl| (spec.gain * ctrl + b0) * gear)));
        let force = match (force, by_control) {
            (Some(a), Some(b)) => Some([a[0].max(b[0]), a[1].min(b[1])]),
            (one, other) => one.or(other),
        };
        Drawn {
            control: Control::Force,
            stiffness: None,
            damping: None,
            range: None,
            target: [0.0; 2],
            force,
            speed: None,
        }
    }
}

fn largest(range: [f64; 2]) -> f64 {
    range[0].abs().max(range[1].abs())
}

impl Mapper<'_> {
    /// Whether the law is one that a hand's motor can have; says so if not.
    fn usable(&mut self, actuator: &Actuator) -> bool {
        if !actuator.spec.is_plain() {
            let text = format!(
                "<{}> has a law of its own, which no motor here has; it is left out",
                actuator.spec.kind
            );
            self.log.lost(At::Hand, &actuator.element, text);
        }
        actuator.spec.is_plain()
    }

    fn explain(&mut self, actuator: &Actuator, drawn: &Drawn, factor: f64) {
        let (at, element) = (At::Motor(actuator.name.clone()), &actuator.element);
        match drawn.control {
            Control::Force => self.log.chose(
                at,
                element,
                "sets a force; taken is a servo with its largest force, which holds a position instead",
            ),
            Control::Velocity => {
                self.log.chose(
                    at,
                    element,
                    "sets a speed; taken is a servo of position with that speed limit",
                );
            }
            Control::Position => {
                if let (Some([low, high]), Some(ctrl)) = (drawn.range, actuator.spec.ctrl_range) {
                    let reversed = drawn.target[1] * factor < 0.0;
                    let [first, last] = if reversed { [ctrl[1], ctrl[0]] } else { ctrl };
                    let [low, high] = if factor < 0.0 { [high, low] } else { [low, high] };
                    let text = format!(
                        "σ from 0 to 1 is ctrl from {first} to {last}: position {low:.6} to {high:.6}"
                    );
                    self.log.kept(at, element, text);
                }
            }
        }
    }

    fn servo(&mut self, actuator: &Actuator, index: usize) {
        if !self.usable(actuator) {
            return;
        }
        let joint = &self.model.joints[index];
        if !self.frames.moves(joint.body) {
            self.log.lost(At::Hand, &actuator.element, "drives a joint outside the hand; it is left out");
            return;
        }
        let drawn = Drawn::of(&actuator.spec);
        self.explain(actuator, &drawn, 1.0);
        let range = drawn.range.map(|range| range.map(|x| x - joint.reference));
        self.command(actuator, &drawn, 1.0, joint.reference);
        let turns = (joint.kind == JointKind::Hinge).then_some([-PI, PI]);
        let moved = self.motions.range(self.model, index).or(turns).or(range).unwrap_or_default();
        let limits = HandLimits::default();
        let most = if joint.kind == JointKind::Slide { limits.slide_force_n } else { limits.joint_torque_nm };
        let limit = drawn.force.map(largest);
        let limit = limit.or_else(|| self.unlimited(actuator, &drawn, range, moved, most));
        if let Some(mapped) = self.draft.joints.iter_mut().find(|mapped| mapped.name == joint.name) {
            mapped.effort = limit.or(mapped.effort);
            mapped.velocity = drawn.speed.or(mapped.velocity);
        }
        self.draft.actuators.push(draft::Actuator {
            name: actuator.name.clone(),
            drive: Drive::Joint(joint.name.clone()),
            gear: 1.0,
            control: Some(drawn.control),
            gain: drawn.stiffness,
            damping: drawn.damping,
            force_limit: limit,
            speed_limit: drawn.speed,
            range,
        });
    }

    fn command(&mut self, actuator: &Actuator, drawn: &Drawn, factor: f64, constant: f64) {
        let index = self.model.actuators.iter().position(|other| other.name == actuator.name);
        if let (Some(actuator), Some(_)) = (index, drawn.range) {
            let [at_0, per_unit] = drawn.target;
            let (at_0, per_unit) = (factor * (at_0 - constant), factor * per_unit);
            self.commands.push(Command { actuator, at_0, per_unit });
        }
    }

    /// Force of an actuator without a limit: its stiffness over the largest error between its commands and what it moves, but
    /// not more than a hand may have.
    fn unlimited(
        &mut self,
        actuator: &Actuator,
        drawn: &Drawn,
        commands: Option<[f64; 2]>,
        moved: [f64; 2],
        most: f64,
    ) -> Option<f64> {
        let ([from, to], stiffness) = (commands?, drawn.stiffness?);
        let error = (to - moved[0]).max(moved[1] - from).max(to - from);
        let force = (stiffness * error).min(most);
        let text = format!("has no forcerange; taken is its stiffness over its largest error, {force:.4}");
        self.log.chose(At::Motor(actuator.name.clone()), &actuator.element, text);
        Some(force)
    }

    fn tendon(&mut self, index: usize, tendon: &Tendon) {
        let fit = fit(self.model, self.motions, tendon);
        let outside = fit.terms.iter().find(|(j, _)| !self.frames.moves(self.model.joints[*j].body));
        if outside.is_some() || fit.terms.is_empty() {
            let text = "passes no joint of the hand, or one outside it; it is left out";
            self.log.lost(At::Hand, &tendon.element, text);
            return;
        }
        let fit = self.exact(tendon, fit);
        // A joint without an arm only matters to a cable with a motor, whose transmission may have the joint's spring.
        let moved = |(_, c): &&(usize, Vec<f64>)| c.iter().any(|c| *c != 0.0);
        let moving = Fit { terms: fit.terms.iter().filter(moved).cloned().collect(), ..fit.clone() };
        let at = At::Tendon(tendon.name.clone());
        let spatial = matches!(tendon.path, Path::Spatial(_));
        if spatial {
            let (error, stroke) = (fit.error * 1e3, fit.stroke * 1e3);
            let kind = if fit.is_linear() { "a constant moment arm" } else { "a polynomial" };
            let text = format!(
                "its length over the joints' ranges changes by {stroke:.3} mm; as {kind} of each joint it is off by at most {error:.4} mm"
            );
            if error > 0.02 * stroke {
                self.log.chose(
                    at.clone(),
                    &tendon.element,
                    text + ": its joints act on each other's moment arms",
                );
            } else {
                self.log.kept(at.clone(), &tendon.element, text);
            }
        }
        self.folded(tendon);
        if tendon.friction != 0.0 {
            self.log.lost(
                at.clone(),
                &tendon.element,
                format!("frictionloss {} has no counterpart", tendon.friction),
            );
        }
        let actuators: Vec<&Actuator> = self
            .model
            .actuators
            .iter()
            .filter(|actuator| actuator.target == ActuatorTarget::Tendon(index))
            .collect();
        let mut names = vec![tendon.name.clone()];
        // The others of an exported tendon wind the same cable.
        let exported = self.model.texts.contains_key(&format!("motors:{}", tendon.name));
        let used = if exported { 1 } else { actuators.len() };
        for actuator in actuators.into_iter().take(used) {
            if self.usable(actuator) {
                let name = names.pop().unwrap_or_else(|| format!("{}_{}", tendon.name, actuator.name));
                self.cable(actuator, tendon, &fit, name, spatial);
            }
        }
        let driven = names.is_empty();
        if tendon.stiffness > 0.0 {
            let name = if driven { format!("{}_spring", tendon.name) } else { tendon.name.clone() };
            // The damping of a driven tendon is in its cable.
            let damping = if driven { 0.0 } else { tendon.damping };
            self.spring(&Tendon { damping, ..tendon.clone() }, &moving, name, spatial);
        } else if tendon.damping > 0.0 && !driven {
            self.log.lost(at, &tendon.element, "a damper across joints without a spring has no counterpart");
        }
        if let Some(range) = tendon.range {
            self.limits(tendon, &moving, range);
        }
    }

    /// Says which joints of a sum follow others.
    fn folded(&mut self, tendon: &Tendon) {
        let Path::Fixed(joints) = &tendon.path else { return };
        for (joint, factor) in joints {
            let name = &self.model.joints[*joint].name;
            let text = match self.motions.joint(*joint) {
                Motion::Follows(leader, law) => format!(
                    "joint '{name}' follows '{}': its part, {factor} times the polynomial {law:?}, counts there",
                    self.model.joints[*leader].name
                ),
                Motion::Held(at) => format!("joint '{name}' is held at {at}: its part is constant"),
                Motion::Own => continue,
            };
            self.log.kept(At::Tendon(tendon.name.clone()), &tendon.element, text);
        }
    }

    /// The constant moment arms of a tendon that this project exported, whose `hand.toml` has its other paths.
    fn exact(&self, tendon: &Tendon, fit: Fit) -> Fit {
        let Some(arms) = self.model.stated(&format!("arms:{}", tendon.name)) else { return fit };
        let terms = arms.into_iter().filter_map(|(joint, arm)| Some((self.model.joint(&joint)?, vec![arm])));
        Fit { terms: terms.collect(), ..fit }
    }

    /// Paths over the joints, in terms of a factor: −1 if the cable is wound in where MuJoCo's length shrinks.
    fn paths(&self, fit: &Fit, factor: f64) -> Vec<(String, TendonPath)> {
        let path = |(joint, coefficients): &(usize, Vec<f64>)| {
            let path = match coefficients.as_slice() {
                [arm] => TendonPath::Arm(factor * arm),
                all => TendonPath::Polynomial(
                    std::iter::once(0.0).chain(all.iter().map(|c| factor * c)).collect(),
                ),
            };
            (self.model.joints[*joint].name.clone(), path)
        };
        fit.terms.iter().map(path).collect()
    }

    fn cable(&mut self, actuator: &Actuator, tendon: &Tendon, fit: &Fit, name: String, spatial: bool) {
        let drawn = Drawn::of(&actuator.spec);
        let only_pulls = drawn.force.is_some_and(|force| force[1] <= 0.0);
        let factor = if spatial || only_pulls { -1.0 } else { 1.0 };
        self.explain(actuator, &drawn, factor);
        let range = drawn.range.map(|range| {
            let [a, b] = range.map(|length| factor * (length - fit.constant));
            [a.min(b), a.max(b)]
        });
        self.command(actuator, &drawn, factor, fit.constant);
        let both_ways = !spatial && drawn.force.is_none_or(|force| force[0] < 0.0 && force[1] > 0.0);
        if spatial && !only_pulls {
            let text = "MuJoCo lets it push the tendon as well; a cable only pulls";
            self.log.chose(At::Tendon(name.clone()), &actuator.element, text);
        }
        let limit = drawn.force.map(|force| match (both_ways, factor < 0.0) {
            (true, _) => largest(force),
            (false, true) => -force[0],
            (false, false) => force[1],
        });
        let lengths = self.lengths(fit).map(|length| factor * (length - fit.constant));
        let moved = [lengths[0].min(lengths[1]), lengths[0].max(lengths[1])];
        let limit = limit.filter(|f| *f > 0.0);
        let limit = limit.or_else(|| self.unlimited(actuator, &drawn, range, moved, f64::INFINITY));
        let damping = drawn.damping.unwrap_or(0.0) + tendon.damping;
        let damping = (damping > 0.0).then_some(damping);
        self.draft.tendons.push(draft::Tendon {
            joints: self.paths(fit, factor),
            motors: self
                .model
                .stated(&format!("motors:{name}"))
                .unwrap_or_else(|| vec![(actuator.name.clone(), 1.0)]),
            stated: StatedTendon {
                stiffness: drawn.stiffness,
                damping,
                force_limit: limit,
                both_ways: Some(both_ways),
                ..StatedTendon::default()
            },
            ..draft::Tendon::of(&name)
        });
        self.draft.actuators.push(draft::Actuator {
            name: actuator.name.clone(),
            drive: Drive::Tendon(name),
            gear: 1.0,
            control: Some(drawn.control),
            gain: drawn.stiffness,
            damping,
            force_limit: limit,
            speed_limit: drawn.speed,
            range,
        });
    }

    /// The elastic part of a tendon: a spring across joints, or a cable that pulls beyond a length.
    fn spring(&mut self, tendon: &Tendon, fit: &Fit, name: String, spatial: bool) {
        // Without a length of its own it rests where all joints are at their springs' rest.
        let slack: Vec<f64> = self.model.joints.iter().map(|joint| joint.rest - joint.reference).collect();
        let slack = super::length::length(self.model, tendon, &slack);
        let [low, high] = tendon.spring_length.unwrap_or([slack, slack]);
        let [shortest, longest] = self.lengths(fit);
        // A spring has no largest force.
        let strong = tendon.stiffness * (longest - low).max(low - shortest) > self.most(fit);
        if low == high && !spatial && !strong && fit.terms.len() > 1 && fit.is_linear() {
            self.draft.springs.push(Spring {
                name,
                joints: fit.terms.iter().map(|(j, c)| (self.model.joints[*j].name.clone(), c[0])).collect(),
                numbers: SpringNumbers {
                    stiffness: tendon.stiffness,
                    damping: tendon.damping,
                    rest: low - fit.constant,
                },
            });
            return;
        }
        let both = low == high;
        let beyond = longest > high || both;
        if beyond {
            self.passive(tendon, fit, &name, -1.0, high, tendon.stiffness, both);
        }
        if !both && shortest < low {
            let name = if beyond { format!("{name}_short") } else { name };
            self.passive(tendon, fit, &name, 1.0, low, tendon.stiffness, false);
        }
    }

    /// A cable without a motor: it pulls where factor · (L − limit) is negative.
    #[allow(clippy::too_many_arguments)]
    fn passive(
        &mut self,
        tendon: &Tendon,
        fit: &Fit,
        name: &str,
        factor: f64,
        at: f64,
        stiffness: f64,
        both: bool,
    ) {
        let [shortest, longest] = self.lengths(fit);
        let most = MARGIN * stiffness * (longest - at).abs().max((shortest - at).abs());
        let most = most.min(self.most(fit));
        self.draft.tendons.push(draft::Tendon {
            joints: self.paths(fit, factor),
            stated: StatedTendon {
                stiffness: Some(stiffness),
                damping: (tendon.damping > 0.0).then_some(tendon.damping),
                force_limit: Some(most.max(1e-3)),
                rest: Some(factor * (at - fit.constant)),
                both_ways: Some(both),
                ..StatedTendon::default()
            },
            ..draft::Tendon::of(name)
        });
    }

    /// Largest force of a passive tendon: what two of them may have together at the joint with the largest arm.
    fn most(&self, fit: &Fit) -> f64 {
        let limits = HandLimits::default();
        let of = |(joint, coefficients): &(usize, Vec<f64>)| {
            let slides = self.model.joints[*joint].kind == JointKind::Slide;
            let most = if slides { limits.slide_force_n } else { limits.joint_torque_nm };
            let [low, high] = self.motions.range(self.model, *joint).unwrap_or([-1.0, 1.0]);
            let slope = |x: f64| {
                let powers = coefficients.iter().enumerate().rev();
                powers.fold(0.0, |sum, (k, c)| sum * x + (k + 1) as f64 * c).abs()
            };
            most / slope(low).max(slope(high)).max(slope(0.5 * (low + high)))
        };
        0.5 * fit.terms.iter().map(of).fold(limits.tendon_force, f64::min)
    }

    /// Joints that are bound together, by a tendon that pulls both ways.
    fn row(&mut self, row: &Row) {
        if row.terms.iter().any(|(joint, _)| !self.frames.moves(self.model.joints[*joint].body)) {
            self.log.lost(At::Hand, &row.element, "binds a joint outside the hand; it is left out");
            return;
        }
        let Some(&(first, largest)) = row.terms.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) else {
            return;
        };
        let arm = |&(joint, w): &(usize, f64)| {
            (self.model.joints[joint].name.clone(), TendonPath::Arm(w / largest))
        };
        let slides = self.model.joints[first].kind == JointKind::Slide;
        let tie = Tie { turns: !slides, rest: row.sum / largest };
        self.draft.tendons.push(tie.tendon(&row.name, row.terms.iter().map(arm).collect()));
        let text = format!("binds {} joints: a stiff tendon that pulls both ways", row.terms.len());
        self.log.kept(At::Tendon(row.name.clone()), &row.element, text);
    }

    /// Shortest and longest length between the joints' limits, by the range of each joint alone.
    fn lengths(&self, fit: &Fit) -> [f64; 2] {
        let mut ends = [fit.constant; 2];
        for (joint, coefficients) in &fit.terms {
            let [low, high] = self.motions.range(self.model, *joint).unwrap_or([-1.0, 1.0]);
            let at = (0..=20).map(|k| low + (high - low) * f64::from(k) / 20.0);
            let at = at.map(|x| x * value(coefficients, x));
            let (least, most) = at.fold((f64::MAX, f64::MIN), |(l, m), x| (l.min(x), m.max(x)));
            ends = [ends[0] + least, ends[1] + most];
        }
        ends
    }

    /// A tendon's limits become slack cables that are stiff beyond them.
    fn limits(&mut self, tendon: &Tendon, fit: &Fit, [low, high]: [f64; 2]) {
        let [shortest, longest] = self.lengths(fit);
        let arm = fit.terms.iter().flat_map(|(_, c)| c.first()).fold(0.0, |most: f64, c| most.max(c.abs()));
        if arm == 0.0 {
            return;
        }
        let stiffness = LIMIT_STIFFNESS / (arm * arm);
        let mut sides = Vec::new();
        if longest > high + 1e-9 {
            self.passive(tendon, fit, &format!("{}_longest", tendon.name), -1.0, high, stiffness, false);
            sides.push("longest");
        }
        if shortest < low - 1e-9 {
            self.passive(tendon, fit, &format!("{}_shortest", tendon.name), 1.0, low, stiffness, false);
            sides.push("shortest");
        }
        let text = if sides.is_empty() {
            format!("its range {low} to {high} is never left between the joints' limits")
        } else {
            format!(
                "its range {low} to {high} becomes a slack cable for its {}, with stiffness {stiffness:.1}",
                sides.join(" and its ")
            )
        };
        self.log.chose(At::Tendon(tendon.name.clone()), &tendon.element, text);
    }
}
