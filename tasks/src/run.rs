//! A run: one world, one task, one hand, from tick 0 to its score.

use crate::action::{Action, ActionError, ActionLimits, BaseTarget};
use crate::build::{SceneError, build, start_pose};
use crate::observation::{
    ActuatorObservation, BodyState, ContactObservation, Event, HandObservation, Joints, ObjectObservation,
    Observation, Sensing, Truth, Wrench,
};
use crate::referee::{Referee, Sighting};
use crate::scene::Scene;
use crate::score::{Count, score};
use crate::seed::Seed;
use crate::task::Task;
use palmares_models::hand::Hand;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::actuation::base::{bounded, shortest_turn};
use palmares_sim::actuation::equilibrium::{ClosedForm, rest};
use palmares_sim::actuation::motor::wound;
use palmares_sim::{BaseCommand, Command, World};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Slower than this an object counts as at rest, m/s; carried objects move with the hand.
const REST_SPEED: f64 = 5e-3;

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The team stopped it.
    Stopped,
    /// The session's time was up.
    SessionOver,
    /// The client went away and did not come back.
    Disconnected,
    /// The run's own time limit.
    TimeLimit,
    /// A fault of the simulation.
    WorldFault,
    /// An organizer voided it.
    Voided,
}

/// What a finished run is worth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outcome {
    /// Points.
    pub score: f64,
    /// Objects in the goal box.
    pub in_goal: u32,
    /// Objects outside both boxes.
    pub outside: u32,
    /// Why the run ended.
    pub reason: Reason,
    /// Ticks played, without the settling.
    pub ticks: u64,
    /// s of simulated time played, without the settling.
    pub sim_time_s: f64,
    /// Everything the referee noted.
    pub events: Vec<Event>,
    /// Hash of the final state, 16 hexadecimal digits.
    pub state_hash: String,
}

/// One world, one task, one hand.
pub struct Run {
    task: Arc<Task>,
    hand: Arc<Hand>,
    scene: Scene,
    body_names: Vec<String>,
    world: World,
    closed_form: Option<ClosedForm>,
    referee: Referee,
    tick: u64,
    target: Target,
    applied: Action,
    news: Vec<Event>,
    events: Vec<Event>,
}

/// What the base is doing between two commands.
#[derive(Clone, Copy, Debug)]
enum Target {
    /// Go from one pose to the next during the tick, then stay.
    Pose { from: Pose, to: Pose },
    /// Keep a velocity.
    Twist { linear: Vec3, angular: Vec3 },
}

impl Run {
    /// Builds the scene and puts the world at tick 0. Takes up to a second of computing.
    pub fn new(task: Arc<Task>, hand: Arc<Hand>, seed: Seed) -> Result<Self, SceneError> {
        let built = build(&task, Some(Arc::clone(&hand)), seed)?;
        let base = start_pose(&task);
        let applied = Action {
            base: Some(BaseTarget::Pose {
                position: base.translation.to_array(),
                quat_xyzw: base.rotation.to_array(),
            }),
            hand: Some(vec![0.0; hand.motors.len()]),
        };
        Ok(Run {
            referee: Referee::new(&task),
            closed_form: ClosedForm::new(&hand).ok(),
            scene: built.scene,
            body_names: built.body_names,
            world: built.world,
            tick: 0,
            target: Target::Pose { from: base, to: base },
            applied,
            news: Vec::new(),
            events: Vec::new(),
            task,
            hand,
        })
    }

    /// What stands in the world at tick 0.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The task.
    pub fn task(&self) -> &Arc<Task> {
        &self.task
    }

    /// The hand.
    pub fn hand(&self) -> &Arc<Hand> {
        &self.hand
    }

    /// The world, for those who measure.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Ticks since reset.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// s since reset.
    pub fn sim_time_s(&self) -> f64 {
        self.tick as f64 * self.task.tick_s
    }

    /// Whether [`Run::step`] would take this action.
    pub fn check(&self, action: &Action) -> Result<(), ActionError> {
        let finite = |field: &str, values: &[f64]| match values.iter().position(|x| !x.is_finite()) {
            Some(k) => Err(ActionError::NotFinite { field: format!("{field}[{k}]") }),
            None => Ok(()),
        };
        match &action.base {
            Some(BaseTarget::Pose { position, quat_xyzw }) => {
                finite("base.position", position)?;
                finite("base.quat_xyzw", quat_xyzw)?;
                if quat_xyzw.iter().map(|x| x * x).sum::<f64>() < 1e-12 {
                    return Err(ActionError::ZeroQuaternion);
                }
            }
            Some(BaseTarget::Twist { linear, angular }) => {
                finite("base.linear", linear)?;
                finite("base.angular", angular)?;
            }
            None => {}
        }
        if let Some(sigma) = &action.hand {
            finite("hand", sigma)?;
            if sigma.len() != self.hand.motors.len() {
                return Err(ActionError::WrongLength {
                    hand: self.hand.name.clone(),
                    got: sigma.len(),
                    expected: self.hand.motors.len(),
                });
            }
        }
        Ok(())
    }

    /// Advances the world by one tick under `action`. A refused action changes nothing.
    pub fn step(&mut self, action: &Action) -> Result<(), ActionError> {
        self.check(action)?;
        self.apply(action);
        self.advance();
        self.tick += 1;
        self.news = self.referee.watch(self.tick, &self.sightings());
        self.events.extend(self.news.iter().cloned());
        Ok(())
    }

    /// Clips an action to the spec and makes it the present one; what it leaves out stays.
    fn apply(&mut self, action: &Action) {
        let limits = &self.world.model().config().base;
        if let Some(base) = &action.base {
            let (clipped, target) = match base {
                BaseTarget::Pose { position, quat_xyzw: [x, y, z, w] } => {
                    let position = position.map(|x| x.clamp(-ActionLimits::REACH_M, ActionLimits::REACH_M));
                    let rotation = Rotation::from_xyzw(*x, *y, *z, *w).normalize();
                    let to = Pose::from_parts(Vec3::from_array(position), rotation);
                    let from = self.origin_of(to);
                    let quat_xyzw = rotation.to_array();
                    (BaseTarget::Pose { position, quat_xyzw }, Target::Pose { from, to })
                }
                BaseTarget::Twist { linear, angular } => {
                    let linear = bounded(Vec3::from_array(*linear), limits.speed_limit);
                    let angular = bounded(Vec3::from_array(*angular), limits.angular_speed_limit);
                    let clipped =
                        BaseTarget::Twist { linear: linear.to_array(), angular: angular.to_array() };
                    (clipped, Target::Twist { linear, angular })
                }
            };
            self.target = target;
            self.applied.base = Some(clipped);
        } else if let Target::Pose { to, .. } = self.target {
            self.target = Target::Pose { from: to, to };
        }
        if let Some(sigma) = &action.hand {
            self.applied.hand = Some(sigma.iter().map(|x| x.clamp(0.0, 1.0)).collect());
        }
    }

    /// Where a pose target comes from: a target that moved by less than the speed limits since the last
    /// command is a point of a path and is followed along it; a farther one is a place to go to.
    fn origin_of(&self, to: Pose) -> Pose {
        let limits = &self.world.model().config().base;
        match self.target {
            Target::Pose { to: last, .. } => {
                let tick_s = self.task.tick_s;
                let path = (to.translation - last.translation).length() <= limits.speed_limit * tick_s
                    && shortest_turn(last.rotation, to.rotation).length()
                        <= limits.angular_speed_limit * tick_s;
                if path { last } else { to }
            }
            Target::Twist { .. } => to,
        }
    }

    fn advance(&mut self) {
        let steps = self.task.steps_per_tick();
        let mut command = Command {
            base: BaseCommand::stay(Pose::IDENTITY),
            sigma: self.applied.hand.clone().unwrap_or_default(),
            pushes: Vec::new(),
        };
        for k in 1..=steps {
            command.base = match self.target {
                Target::Pose { from, to } => {
                    let part = k as f64 / steps as f64;
                    let turn = shortest_turn(from.rotation, to.rotation);
                    let travel = to.translation - from.translation;
                    let target = Pose::from_parts(
                        from.translation + travel * part,
                        (Rotation::from_scaled_axis(turn * part) * from.rotation).normalize(),
                    );
                    let rate = 1.0 / self.task.tick_s;
                    BaseCommand::Pose { target, linear: travel * rate, angular: turn * rate }
                }
                Target::Twist { linear, angular } => BaseCommand::Twist { linear, angular },
            };
            self.world.step(&command);
        }
    }

    fn sightings(&self) -> Vec<Sighting> {
        let state = self.world.state();
        (0..state.objects.len())
            .map(|k| {
                let (linear, _) = state.object_velocity(self.world.model(), k);
                Sighting {
                    position: state.objects[k].translation.to_array(),
                    at_rest: state.sleep[k].asleep || linear.length() < REST_SPEED,
                }
            })
            .collect()
    }

    /// What a controller sees now. `events` are those of the last [`Run::step`].
    pub fn observe(&self, sensing: Sensing) -> Observation {
        let truncated = self.sim_time_s() >= self.task.time_limit_s;
        let count = self.referee.count();
        let terminated = count.in_goal as usize == self.task.objects.count;
        let reason = match (terminated, truncated) {
            (true, _) => Some("all objects are in the goal".to_owned()),
            (_, true) => Some("time_limit".to_owned()),
            _ => None,
        };
        Observation {
            tick: self.tick,
            sim_time_s: self.sim_time_s(),
            applied_action: self.applied.clone(),
            hand: self.observe_hand(),
            truth: (sensing == Sensing::Truth).then(|| self.observe_truth()),
            events: self.news.clone(),
            score: score(&self.task.rules, count),
            terminated,
            truncated,
            reason,
        }
    }

    fn observe_hand(&self) -> HandObservation {
        let state = self.world.state();
        let v = |k: usize| [state.v[k], state.v[k + 1], state.v[k + 2]];
        let actuators = self.hand.motors.iter().zip(&state.motors).enumerate();
        let (force, torque) = self.world.servo_wrench();
        HandObservation {
            base: BodyState {
                position: state.base.translation.to_array(),
                quat_xyzw: state.base.rotation.to_array(),
                linear: v(0),
                angular: v(3),
            },
            actuators: actuators
                .map(|(k, (motor, reached))| ActuatorObservation {
                    name: motor.name.clone(),
                    command: reached.command,
                    position: reached.position,
                    velocity: reached.velocity,
                    tension: self
                        .hand
                        .tendons
                        .iter()
                        .zip(&state.tension)
                        .filter(|(tendon, _)| tendon.motor == k)
                        .map(|(_, f)| f)
                        .sum(),
                })
                .collect(),
            wrist: Wrench { force, torque },
        }
    }

    fn observe_truth(&self) -> Truth {
        let (model, state) = (self.world.model(), self.world.state());
        let objects = model.objects().iter().enumerate();
        let n = self.hand.coordinates.len();
        let contacts = self.world.contact_forces().iter();
        Truth {
            objects: objects
                .map(|(id, object)| {
                    let pose = state.object_pose(model, id);
                    let (linear, angular) = state.object_velocity(model, id);
                    let from_com = pose.translation - state.objects[id].translation;
                    ObjectObservation {
                        id,
                        name: object.name.clone(),
                        state: BodyState {
                            position: pose.translation.to_array(),
                            quat_xyzw: pose.rotation.to_array(),
                            linear: (linear + angular.cross(from_com)).to_array(),
                            angular: angular.to_array(),
                        },
                    }
                })
                .collect(),
            joints: Joints { position: state.q.clone(), velocity: state.v[6..6 + n].to_vec() },
            contacts: contacts
                .map(|c| ContactObservation {
                    a: self.body_names[c.colliders.0 as usize].clone(),
                    b: self.body_names[c.colliders.1 as usize].clone(),
                    position: c.position.to_array(),
                    force: c.force.to_array(),
                })
                .collect(),
            predicted_equilibrium: self.predicted_equilibrium(),
        }
    }

    /// Equilibrium of the free hand at the present motor position, kept within the joint limits: the closed form
    /// where there is one.
    fn predicted_equilibrium(&self) -> Vec<f64> {
        let motors = &self.world.state().motors;
        let s: Vec<f64> = self
            .hand
            .tendons
            .iter()
            .map(|tendon| wound(&self.hand.motors[tendon.motor], motors[tendon.motor].position))
            .collect();
        let free = vec![0.0; self.hand.coordinates.len()];
        let q = match &self.closed_form {
            Some(form) => form.solve(&s, &free).0,
            None => {
                let open: Vec<f64> = self.hand.coordinates.iter().map(|c| c.rest).collect();
                match rest(&self.hand, &s, &free, &open) {
                    Ok(rest) => rest.q,
                    Err(_) => return Vec::new(),
                }
            }
        };
        q.iter().zip(&self.hand.coordinates).map(|(q, c)| q.clamp(c.lower, c.upper)).collect()
    }

    /// Hash of the present state, 16 hexadecimal digits.
    pub fn state_hash(&self) -> String {
        format!("{:016x}", self.world.state().hash())
    }

    /// Whether the world is still sound. A run that is not must be voided.
    pub fn healthy(&self) -> bool {
        self.world.state().is_finite()
    }

    /// Ends the run: freezes the hand, lets the objects settle, counts.
    pub fn finish(&mut self, reason: Reason) -> Outcome {
        let (ticks, sim_time_s) = (self.tick, self.sim_time_s());
        let here = self.world.state().reference.pose;
        self.target = Target::Pose { from: here, to: here };
        if reason != Reason::WorldFault {
            for _ in 0..(self.task.rules.settle_s / self.task.tick_s).ceil() as u64 {
                if self.sightings().iter().all(|seen| seen.at_rest) && self.tick > ticks {
                    break;
                }
                self.advance();
                self.tick += 1;
                let news = self.referee.watch(self.tick, &self.sightings());
                self.events.extend(news);
            }
        }
        let count = if reason == Reason::WorldFault {
            Count::default()
        } else {
            self.referee.final_count(&self.sightings())
        };
        Outcome {
            score: score(&self.task.rules, count),
            in_goal: count.in_goal,
            outside: count.outside,
            reason,
            ticks,
            sim_time_s,
            events: self.events.clone(),
            state_hash: self.state_hash(),
        }
    }
}
