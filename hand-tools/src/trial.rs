//! Short runs of a hand in each task, by a script that ignores the task: a hand that scores in them scores by its build.

use crate::progress::Progress;
use clap::ValueEnum;
use palmares_models::Vec3;
use palmares_models::hand::Hand;
use palmares_tasks::run::{Failure, Reason};
use palmares_tasks::start::start_pose;
use palmares_tasks::{Action, BaseTarget, Fault, Run, SceneError, Seed, Task};
use serde::Serialize;
use std::sync::Arc;

/// Seed of the scenes: an arbitrary number, the same for every hand.
const SEED: u64 = 1;
/// Compute budget of a trial, in the unit of [`palmares_sim::bounds`]: about half a minute. The SoftHand's trials take an
/// eighth of a second.
const TRIAL_BUDGET: u64 = 20_000_000_000;
/// Duration of the idle script, s.
const IDLE_S: f64 = 5.0;

/// The script of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Script {
    /// Does nothing.
    Idle,
    /// Reaches out closed and sweeps back, opens, closes, lifts, sweeps to both sides, opens.
    Sweep,
}

/// Result of a trial.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Trial {
    /// Name of the task.
    pub(crate) task: String,
    /// The script.
    pub(crate) script: Script,
    /// Points, after the objects have settled.
    pub(crate) score: f64,
    /// The world failed.
    pub(crate) fault: bool,
    /// The fault; None if the world did not fail.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) fault_code: Option<Fault>,
    /// The trial ended because its compute budget was spent.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(crate) ended_early: bool,
    /// s of simulated time.
    pub(crate) sim_time_s: f64,
    /// Largest excess of a joint over a limit, rad or m.
    pub(crate) limit_excess: f64,
    /// The joint of `limit_excess`.
    pub(crate) joint: Option<String>,
    /// Work of the motors, the sum of |f ds|, J.
    pub(crate) motor_work_j: f64,
    /// Remarks for an organizer.
    pub(crate) flags: Vec<String>,
}

/// A segment of a script: duration, velocity of the base along the fingers (its z axis) and along the world's axes, and σ of
/// all motors.
struct Segment {
    seconds: f64,
    along_fingers: f64,
    world: Vec3,
    sigma: f64,
}

fn segments(script: Script) -> Vec<Segment> {
    let still = |seconds: f64, sigma: f64| Segment { seconds, along_fingers: 0.0, world: Vec3::ZERO, sigma };
    let reach =
        |seconds: f64, speed: f64, sigma: f64| Segment { along_fingers: speed, ..still(seconds, sigma) };
    let go = |seconds: f64, x: f64, y: f64, z: f64, sigma: f64| Segment {
        world: Vec3::new(x, y, z),
        ..still(seconds, sigma)
    };
    match script {
        Script::Idle => Vec::new(),
        Script::Sweep => vec![
            // Out with the open hand, and back with the closed one.
            reach(1.0, 0.25, 0.0),
            still(1.0, 1.0),
            reach(2.5, -0.25, 1.0),
            still(1.0, 0.0),
            reach(1.5, 0.25, 0.0),
            still(1.0, 1.0),
            go(1.0, 0.0, 0.0, 0.2, 1.0),
            go(1.5, 0.3, 0.0, 0.0, 1.0),
            go(3.0, -0.3, 0.0, 0.0, 1.0),
            go(1.5, 0.3, 0.3, 0.0, 1.0),
            go(3.0, 0.0, -0.3, 0.0, 1.0),
            still(1.0, 0.0),
        ],
    }
}

/// The actions of a script, one per tick.
pub fn script(script: Script, task: &Task, motors: usize) -> Vec<Action> {
    let fingers = start_pose(task).rotation * Vec3::Z;
    let ticks = |seconds: f64| (seconds / task.tick_s).round() as usize;
    if script == Script::Idle {
        return vec![Action::default(); ticks(IDLE_S)];
    }
    let segment = |segment: Segment| {
        let linear = fingers * segment.along_fingers + segment.world;
        let action = Action {
            base: Some(BaseTarget::Twist { linear: linear.to_array(), angular: [0.0; 3] }),
            hand: Some(vec![segment.sigma; motors]),
            effort: None,
        };
        std::iter::repeat_n(action, ticks(segment.seconds))
    };
    segments(script).into_iter().flat_map(segment).collect()
}

/// Limit excess above which a trial gets a remark, rad or m: a limit is a stiff spring, so a small excess is normal.
const WARN_EXCESS: f64 = 0.05;

/// Plays one script.
fn play(task: &Arc<Task>, hand: &Arc<Hand>, what: Script) -> Result<Trial, SceneError> {
    let mut run = Run::new(task.clone(), hand.clone(), Seed::from_u64(SEED))?;
    let mut statistics = Statistics::default();
    let name = what.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned());
    let mut progress = Progress::of(format!("{} in task {}, {name}", hand.name, task.name));
    let actions = script(what, task, hand.motors.len());
    let mut ended_early = false;
    for action in &actions {
        if !statistics.step(&mut run, action) {
            break;
        }
        ended_early = statistics.computed > TRIAL_BUDGET;
        if ended_early {
            break;
        }
        progress.at(|| {
            format!("{:.1} of {:.1} s simulated", run.sim_time_s(), actions.len() as f64 * task.tick_s)
        });
    }
    let sim_time_s = run.sim_time_s();
    let reason = if run.healthy() { Reason::Stopped } else { Reason::WorldFault };
    let score = run.finish(reason).score;
    let failure = run.failure();
    let mut flags = Vec::new();
    if what == Script::Idle && score > 0.0 {
        flags.push("it scores while the hand does nothing".to_owned());
    }
    flags.extend(failure.as_ref().map(Failure::to_string));
    if ended_early {
        flags
            .push(format!("it ended after {sim_time_s:.2} s: it needs more computing than a trial's budget"));
    }
    if statistics.limit_excess > WARN_EXCESS {
        flags.push("a joint exceeds its limits".to_owned());
    }
    Ok(Trial {
        task: task.name.clone(),
        script: what,
        score,
        fault: failure.is_some(),
        fault_code: failure.map(|failure| failure.fault),
        ended_early,
        sim_time_s,
        limit_excess: statistics.limit_excess,
        joint: statistics.joint.map(|c| hand.coordinates[c].name.clone()),
        motor_work_j: statistics.motor_work_j,
        flags,
    })
}

/// Statistics of a trial.
#[derive(Default)]
struct Statistics {
    limit_excess: f64,
    joint: Option<usize>,
    motor_work_j: f64,
    /// In the unit of [`palmares_sim::bounds`].
    computed: u64,
}

impl Statistics {
    /// Steps one tick; returns false if the run is over.
    fn step(&mut self, run: &mut Run, action: &Action) -> bool {
        let before: Vec<f64> = run.world().state().motors.iter().map(|m| m.position).collect();
        if run.step(action).is_err() || !run.healthy() {
            return false;
        }
        self.computed += run.computed();
        let (state, hand) = (run.world().state(), run.hand());
        for (c, (q, coordinate)) in state.q.iter().zip(&hand.coordinates).enumerate() {
            let beyond = (q - coordinate.upper).max(coordinate.lower - q);
            if beyond > self.limit_excess {
                (self.limit_excess, self.joint) = (beyond, Some(c));
            }
        }
        for (tendon, f) in hand.tendons.iter().zip(&state.tension) {
            for &(motor, weight) in &tendon.motors {
                let moved = state.motors[motor].position - before[motor];
                self.motor_work_j += (f * weight * hand.motors[motor].scaling * moved).abs();
            }
        }
        run.over().is_none()
    }
}

/// Plays each script in each task. Returns the trials, and an error for each task into which the hand does not fit.
pub(crate) fn trials(tasks: &[Arc<Task>], hand: &Arc<Hand>) -> (Vec<Trial>, Vec<String>) {
    let (mut played, mut refused) = (Vec::new(), Vec::new());
    for task in tasks {
        for script in [Script::Idle, Script::Sweep] {
            match play(task, hand, script) {
                Ok(trial) => played.push(trial),
                Err(error) => {
                    refused.push(error.to_string());
                    break;
                }
            }
        }
    }
    (played, refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_world_ends_its_trial_with_its_fault() {
        let mut hand = Hand::clone(&Hand::builtin("pinch").expect("it is built in"));
        for tendon in &mut hand.tendons {
            (tendon.stiffness, tendon.force_limit) = (1e9, 1e9);
            tendon.moment_arms.iter_mut().for_each(|(_, arm)| *arm = 1e9);
        }
        hand.motors.iter_mut().for_each(|motor| (motor.scaling, motor.speed_limit) = (1e9, 1e9));
        // The tendons are slack at the start.
        hand.coordinates.iter_mut().for_each(|c| c.rest = 0.0);
        let task = Task::builtin().into_iter().find(|task| task.name == "grasp").expect("it is built in");
        let trial = play(&task, &Arc::new(hand), Script::Sweep).expect("at rest it is sound");
        let code = trial.fault_code.expect("no such hand can be computed").code();
        assert!(trial.fault && !trial.ended_early && trial.score == 0.0, "{trial:?}");
        let says = |flag: &String| flag.starts_with(&format!("the world failed ({code}) in tick "));
        assert!(trial.flags.iter().any(says), "{trial:?}");
        assert_eq!(serde_json::to_value(&trial).expect("JSON")["fault_code"], code);
    }

    #[test]
    fn a_built_in_hand_does_not_score_by_doing_nothing() {
        let tasks = Task::builtin();
        let hand = Hand::builtin("pinch").expect("it is built in");
        let (played, refused) = trials(&tasks, &hand);
        assert_eq!(refused, Vec::<String>::new());
        assert_eq!(played.len(), 2 * tasks.len());
        for trial in &played {
            assert_eq!(trial.flags, Vec::<String>::new(), "{trial:?}");
            assert!(!trial.fault && trial.sim_time_s > 4.9, "{trial:?}");
        }
        let work = |script: Script| -> f64 {
            played.iter().filter(|trial| trial.script == script).map(|trial| trial.motor_work_j).sum()
        };
        assert!(work(Script::Sweep) > 0.1 && work(Script::Idle) < 1e-6, "{played:?}");
    }
}
