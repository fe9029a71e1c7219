//! Free closure: simulates a hand without objects while its motors close, until it rests, and compares with the prediction.

use crate::describe::short;
use crate::progress::Progress;
use palmares_models::Pose;
use palmares_models::hand::{Hand, Linkage};
use palmares_sim::Push;
use palmares_sim::model::ModelError;
use palmares_sim::state::MotorState;
use palmares_sim::statics::band::{Band, band_wound, solve_held};
use palmares_sim::statics::drives::wound_in;
use palmares_sim::statics::prediction::largest_difference;
use palmares_sim::statics::rest::{Equilibrium, Method, NoPrediction};
use palmares_sim::{BaseCommand, Command, Config, Fault, Model, Owner, State, World};
use serde::{Serialize, Serializer};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Newton's tolerance, tighter than in a run, since it limits the comparison.
const TOLERANCE: f64 = 1e-12;
/// Duration of the motors' ramp, s, if they are fast enough.
pub(crate) const RAMP_S: f64 = 1.0;
/// Joint speed below which a joint is at rest, rad/s.
pub(crate) const REST_SPEED: f64 = 1e-10;
/// Speed of σ below which a motor has stopped, 1/s.
const STOPPED_SPEED: f64 = 1e-10;
/// Joint speed below which no motion is visible, rad/s.
pub(crate) const VISIBLE_SPEED: f64 = 2e-3;
/// Time that all joints must stay below that speed, s.
const STILL_S: f64 = 0.1;
/// Limit excess above which a joint gets a warning, rad or m.
const WARN_EXCESS: f64 = 0.05;
/// Limit excess above which the hand is unusable, rad or m.
const MAX_EXCESS: f64 = 0.5;
/// Gap of a pin above which the hand is unusable, m: a thousand newtons at the default stiffness.
const MAX_GAP: f64 = 1e-3;
/// Maximum simulated time until the hand rests, s.
const MAX_SETTLE_S: f64 = 60.0;
/// Compute budget of all closures of a hand, in the unit of [`palmares_sim::bounds`]: about a minute.
/// The SoftHand's closures take 0.1 s.
pub(crate) const CLOSING_BUDGET: u64 = 50_000_000_000;
/// Largest difference of simulation and prediction in a coordinate, rad or m: the solver's tolerance with a margin.
pub(crate) const AGREEMENT: f64 = 1e-6;

/// One closing, from the open hand to rest.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Closure {
    /// Target of each motor.
    pub(crate) sigma: Vec<f64>,
    /// Time at which the hand came to rest, s; None if it did not.
    pub(crate) rest_s: Option<f64>,
    /// Coordinates at the end.
    pub(crate) q: Vec<f64>,
    /// Tension of every tendon at the end.
    pub(crate) tension: Vec<f64>,
    /// Method of the prediction; None without a prediction.
    #[serde(serialize_with = "law_name")]
    pub(crate) law: Option<Method>,
    /// Reasons why the closed form does not apply; empty if it does.
    pub(crate) beyond_closed_form: Vec<String>,
    /// Predicted coordinates.
    pub(crate) predicted_q: Option<Vec<f64>>,
    /// Predicted tensions.
    pub(crate) predicted_tension: Option<Vec<f64>>,
    /// Limits between which a hand that rubs rests: the prediction has its present friction, and is one of the equilibria between them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) band: Option<Limits>,
    /// Largest |q − predicted|.
    pub(crate) error: Option<f64>,
    /// Coordinate with that difference.
    pub(crate) worst: Option<String>,
    /// Largest unbalanced joint torque with the simulation's own contact forces, N·m: the statics
    /// Rᵀ f − E (q − q₀) + Jᵀ w + limits. None for a hand without gravity compensation.
    pub(crate) unbalanced_nm: Option<f64>,
    /// Reasons why no prediction applies, such as self-contact; empty if one does.
    pub(crate) beyond: Vec<String>,
    /// The fastest joint at the end, its speed per second, and the unit of its coordinate.
    pub(crate) fastest: Option<(String, f64, &'static str)>,
    /// The joint with the largest limit excess during the motion, the excess, and its unit.
    pub(crate) outside: Option<(String, f64, &'static str)>,
    /// The pin that is open most at the end, with its gap, m; None without pins.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) gap: Option<(String, f64)>,
    /// Reason why the simulation ended before the hand came to rest; None if it did not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) broken_off: Option<BrokenOff>,
}

/// The limits between which a hand that rubs rests.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Limits {
    /// Coordinates and tensions where it comes to rest while it closes, and while it opens.
    pub(crate) closing_q: Vec<f64>,
    pub(crate) closing_tension: Vec<f64>,
    pub(crate) opening_q: Vec<f64>,
    pub(crate) opening_tension: Vec<f64>,
}

impl From<Band> for Limits {
    fn from(Band { closing, opening }: Band) -> Self {
        Limits {
            closing_q: closing.q,
            closing_tension: closing.tension,
            opening_q: opening.q,
            opening_tension: opening.tension,
        }
    }
}

fn law_name<S: Serializer>(law: &Option<Method>, serializer: S) -> Result<S::Ok, S::Error> {
    let name = law.map(|law| match law {
        Method::ClosedForm => "closed_form",
        Method::Newton => "newton",
    });
    name.serialize(serializer)
}

/// When and why a simulation ended early.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct BrokenOff {
    /// Fault of the world; None if the compute budget was spent.
    pub(crate) fault: Option<Fault>,
    /// Number of the step.
    pub(crate) step: u64,
    /// Simulated time, s.
    pub(crate) time_s: f64,
}

impl std::fmt::Display for BrokenOff {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let BrokenOff { fault, step, time_s } = self;
        let at = format!("at step {step}, {} s", short(*time_s));
        match fault {
            Some(fault) => write!(f, "the world failed ({}) {at}: {}", fault.code(), fault.in_words()),
            None => write!(
                f,
                "the simulation ended {at}: closing this hand needs more computing than its budget; try fewer links and \
                 shapes, or fewer σ"
            ),
        }
    }
}

/// Reason why a hand did not come to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum NotSettled {
    /// It still moves.
    Moves,
    /// The simulation ended early.
    BrokenOff(BrokenOff),
}

impl std::fmt::Display for NotSettled {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            NotSettled::Moves => write!(f, "the hand still moves after {MAX_SETTLE_S} s"),
            NotSettled::BrokenOff(why) => why.fmt(f),
        }
    }
}

/// A problem of a closure.
pub(crate) enum Problem {
    /// The hand cannot be used.
    Unusable(String),
    /// The hand can be used, but the motion is probably not intended.
    Unusual { joint: String, why: String },
}

impl Closure {
    /// Problems of this closure.
    pub(crate) fn problems(&self) -> Vec<Problem> {
        let mut out = Vec::new();
        if let Some(why) = &self.broken_off {
            let moving =
                self.fastest.as_ref().filter(|(_, speed, _)| why.fault.is_some() && *speed > VISIBLE_SPEED);
            let moving = moving.map_or(String::new(), |(joint, speed, unit)| {
                format!("; fastest was joint '{joint}' with {} {unit}/s", short(*speed))
            });
            return vec![Problem::Unusable(format!("{why}{moving}"))];
        }
        if let (None, Some((joint, speed, unit))) = (self.rest_s, &self.fastest) {
            let touching = self.beyond.iter().filter(|why| why.contains(" touches "));
            let touching: Vec<&str> = touching.take(3).map(String::as_str).collect();
            let because = if touching.is_empty() {
                "too little or far too much damping: check damping, stiffness and mass of its links"
                    .to_owned()
            } else {
                format!("parts push each other: {}", touching.join(", "))
            };
            if *speed > VISIBLE_SPEED {
                out.push(Problem::Unusable(format!(
                    "joint '{joint}' still moves after {MAX_SETTLE_S} s, with {speed:.3} {unit}/s; {because}"
                )));
            } else {
                let why = format!("still creeps after {MAX_SETTLE_S} s; {because}");
                out.push(Problem::Unusual { joint: joint.clone(), why });
            }
        }
        if let Some((pin, gap)) = self.gap.as_ref().filter(|(_, gap)| *gap > MAX_GAP) {
            out.push(Problem::Unusable(format!(
                "[linkages.{pin}]: its points are {gap:.2e} m apart; the links cannot reach each other, or the tendons are too strong \
                 for the stiffness of the pin"
            )));
        }
        if let Some((joint, by, unit)) = self.outside.clone() {
            if by > MAX_EXCESS {
                out.push(Problem::Unusable(format!(
                    "joint '{joint}' goes {by:.3} {unit} beyond its limit: its tendons are too strong, or its links too light"
                )));
            } else if by > WARN_EXCESS {
                let why = format!("goes {by:.3} {unit} beyond its limit; are its tendons too strong?");
                out.push(Problem::Unusual { joint, why });
            }
        }
        out
    }

    /// Whether a prediction applies and the simulation differs from it.
    pub(crate) fn disagrees(&self) -> bool {
        self.beyond.is_empty() && self.error.is_none_or(|error| error.is_nan() || error > AGREEMENT)
    }
}

/// A simulation of a hand without objects.
pub(crate) struct FreeHand {
    world: World,
    command: Command,
    hand: Arc<Hand>,
    progress: Progress,
}

impl FreeHand {
    /// The open hand at the origin.
    pub(crate) fn new(hand: &Arc<Hand>) -> Result<Self, ModelError> {
        let model =
            Arc::new(Model::new(Config { tolerance: TOLERANCE, ..Config::default() }, Some(hand.clone()))?);
        let state = State::at_rest(&model, Pose::IDENTITY, &[]);
        let mut command = Command::stay(&model, Pose::IDENTITY);
        command.base = BaseCommand::stay(Pose::IDENTITY);
        let progress = Progress::of(format!("closing {}", hand.name));
        Ok(FreeHand { world: World::new(model, state), command, hand: hand.clone(), progress })
    }

    /// One step with the motors on their ramp to `sigma`; returns its computing, in the unit of the budget.
    fn step(&mut self, sigma: &[f64]) -> u64 {
        let share = smooth((self.time_s() + self.world.model().config().step_s) / RAMP_S);
        for (motor, (command, target)) in self.command.sigma.iter_mut().zip(sigma).enumerate() {
            let from = self.hand.start.sigma_of(motor);
            *command = from + share * (target - from);
        }
        self.world.step(&self.command).work
    }

    /// The state.
    pub(crate) fn state(&self) -> &State {
        self.world.state()
    }

    /// Simulated time, s.
    pub(crate) fn time_s(&self) -> f64 {
        self.state().time_s(self.world.model())
    }

    /// Sets the forces on the hand from now on.
    pub(crate) fn set_pushes(&mut self, pushes: &[Push]) {
        self.command.pushes = pushes.to_vec();
    }

    /// Returns to an earlier state.
    pub(crate) fn restore(&mut self, state: State) {
        self.world.restore(state);
    }

    /// Largest joint speed, rad/s.
    fn speed(&self) -> f64 {
        self.state().v[6..].iter().fold(0.0, |most, v| v.abs().max(most))
    }

    /// Steps until all joints have been slower than `speed` for [`STILL_S`]; calls `observe` after each step. Returns the time
    /// at which they became slow. Its computing is subtracted from the budget `left`.
    ///
    /// # Errors
    /// The hand still moves after [`MAX_SETTLE_S`], its world fails, or the budget is spent.
    pub(crate) fn settle(
        &mut self,
        sigma: &[f64],
        speed: f64,
        left: &mut u64,
        mut observe: impl FnMut(&FreeHand),
    ) -> Result<f64, NotSettled> {
        let step_s = self.world.model().config().step_s;
        let mut still = 0.0;
        // Counted here, since a failed world makes no steps.
        for _ in 0..(MAX_SETTLE_S / step_s).round() as u64 {
            *left = left.saturating_sub(self.step(sigma));
            if self.world.fault().is_some() || *left == 0 {
                let (fault, step, time_s) = (self.world.fault(), self.state().step, self.time_s());
                return Err(NotSettled::BrokenOff(BrokenOff { fault, step, time_s }));
            }
            observe(self);
            self.report_progress(sigma);
            // A motor that its load has stopped stays where it is.
            let arrived = |(motor, s): (&MotorState, &f64)| {
                (motor.position - s).abs() < 1e-12 || motor.velocity.abs() < STOPPED_SPEED
            };
            let winding = !self.state().motors.iter().zip(sigma).all(arrived);
            let moving = self.time_s() < RAMP_S || winding || self.speed() > speed;
            still = if moving { 0.0 } else { still + step_s };
            if still >= STILL_S {
                return Ok(self.time_s() - still);
            }
        }
        Err(NotSettled::Moves)
    }

    fn report_progress(&mut self, sigma: &[f64]) {
        let time_s = self.time_s();
        self.progress.at(|| {
            let sigma = sigma.iter().map(|s| short(*s)).collect::<Vec<_>>().join(" ");
            format!("σ = {sigma}, {time_s:.1} s simulated of at most {MAX_SETTLE_S} s")
        });
    }

    /// Predicts the equilibrium at the base's current pose, with drives that no load turns back where they have stopped, and with the
    /// present forces of friction.
    pub(crate) fn predict(&self) -> Result<Equilibrium, NoPrediction> {
        let (config, state) = (self.world.model().config(), self.state());
        let wound = wound_in(&self.hand, &state.motors, &state.locked);
        solve_held(config, &self.hand, state.base, &wound, &self.command.pushes, &state.friction)
    }

    /// The limits between which a hand that rubs rests; None for another hand, or without limits.
    pub(crate) fn band(&self) -> Option<Band> {
        let (config, state) = (self.world.model().config(), self.state());
        let wound = wound_in(&self.hand, &state.motors, &state.locked);
        let band = || band_wound(config, &self.hand, state.base, &wound, &self.command.pushes).ok();
        (self.world.model().friction_rows() > 0).then(band).flatten()
    }

    /// The pin that is open most, with its gap, m.
    fn widest_gap(&self) -> Option<(String, f64)> {
        let gap = |pin: &Linkage| (pin.name.clone(), pin.at(&self.hand, &self.state().q).gap.length());
        self.hand.linkages.iter().map(gap).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Largest unbalanced joint torque with the forces of the last step.
    fn unbalanced_nm(&self) -> f64 {
        self.world.joint_residual().iter().fold(0.0, |most, tau| tau.abs().max(most))
    }

    /// Parts of the hand that touch each other.
    pub(crate) fn touching(&self) -> Vec<String> {
        let mut pairs = BTreeSet::new();
        for contact in self.world.contact_forces() {
            if let (Owner::Link(a), Owner::Link(b)) = (contact.a, contact.b) {
                pairs.insert((a.min(b), a.max(b)));
            }
        }
        let name = |link: usize| &self.hand.links[link].name;
        pairs.iter().map(|&(a, b)| format!("'{}' touches '{}'", name(a), name(b))).collect()
    }
}

/// Comparison of a simulated hand with its prediction.
pub(crate) struct Comparison {
    /// The prediction.
    pub(crate) predicted: Option<Equilibrium>,
    /// Largest |q − predicted|.
    pub(crate) error: Option<f64>,
    /// Reason why the prediction does not apply; empty when it does.
    pub(crate) beyond: Vec<String>,
}

/// Compares the current state with the prediction; `rest` is the result of [`FreeHand::settle`].
pub(crate) fn compare(free: &FreeHand, rest: &Result<f64, NotSettled>) -> Comparison {
    let mut beyond = free.touching();
    if let Err(why) = rest {
        beyond.push(why.to_string());
    }
    match free.predict() {
        Ok(predicted) => {
            let error = Some(largest_difference(&free.state().q, &predicted.q));
            Comparison { predicted: Some(predicted), error, beyond }
        }
        Err(why) => {
            beyond.push(why.to_string());
            Comparison { predicted: None, error: None, beyond }
        }
    }
}

/// Closes a hand to σ (one per motor) and compares. Its computing is subtracted from the budget `left`.
pub(crate) fn close(hand: &Arc<Hand>, sigma: &[f64], left: &mut u64) -> Result<Closure, ModelError> {
    let mut free = FreeHand::new(hand)?;
    let mut outside = vec![0.0; hand.coordinates.len()];
    let rest = free.settle(sigma, REST_SPEED, left, |free| {
        for ((q, c), most) in free.state().q.iter().zip(&hand.coordinates).zip(&mut outside) {
            *most = f64::max(*most, f64::max(q - c.upper, c.lower - q));
        }
    });
    let Comparison { predicted, error, beyond } = compare(&free, &rest);
    let state = free.state();
    let largest = |values: &[f64]| {
        let most = values.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        most.map(|(i, value)| {
            (hand.coordinates[i].name.clone(), value, if hand.slides(i) { "m" } else { "rad" })
        })
    };
    let speeds: Vec<f64> = state.v[6..].iter().map(|v| v.abs()).collect();
    let worst = predicted.as_ref().and_then(|predicted| {
        let distance = |i: usize| (state.q[i] - predicted.q[i]).abs();
        (0..state.q.len()).max_by(|&a, &b| distance(a).total_cmp(&distance(b)))
    });
    Ok(Closure {
        sigma: sigma.to_vec(),
        rest_s: rest.ok(),
        q: state.q.clone(),
        tension: state.tension.clone(),
        law: predicted.as_ref().map(|p| p.method),
        beyond_closed_form: predicted.as_ref().map_or(Vec::new(), |p| p.beyond_closed_form.clone()),
        predicted_q: predicted.as_ref().map(|p| p.q.clone()),
        predicted_tension: predicted.map(|p| p.tension),
        band: free.band().map(Limits::from),
        error,
        unbalanced_nm: hand.gravity_compensation.then(|| free.unbalanced_nm()),
        worst: worst.map(|i| hand.coordinates[i].name.clone()),
        beyond,
        fastest: largest(&speeds),
        outside: largest(&outside).filter(|(_, by, _)| *by > 0.0),
        gap: free.widest_gap(),
        broken_off: match rest {
            Err(NotSettled::BrokenOff(why)) => Some(why),
            _ => None,
        },
    })
}

/// A quintic ramp from 0 to 1 over x in [0, 1].
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pinch(change: impl FnOnce(&mut Hand)) -> Arc<Hand> {
        let mut hand = Hand::clone(&Hand::builtin("pinch").expect("it is built in"));
        change(&mut hand);
        Arc::new(hand)
    }

    fn broken_off(closure: &Closure) -> BrokenOff {
        let why = closure.broken_off.unwrap_or_else(|| panic!("it was closed: {closure:?}"));
        let problems = closure.problems();
        let [Problem::Unusable(text)] = problems.as_slice() else { panic!("one problem") };
        assert!(text.contains(&format!("at step {}", why.step)), "{text}");
        assert!(closure.beyond.iter().any(|beyond| text.starts_with(beyond.as_str())), "{text}");
        why
    }

    #[test]
    fn a_built_in_hand_rests_within_a_hundredth_of_the_budget() {
        let mut left = CLOSING_BUDGET;
        let closure = close(&pinch(|_| ()), &[0.3, 0.3], &mut left).expect("a hand");
        assert!(closure.rest_s.is_some() && closure.broken_off.is_none() && closure.problems().is_empty());
        let json = serde_json::to_value(&closure).expect("JSON");
        assert!(json.get("broken_off").is_none(), "{json}");
        assert!(CLOSING_BUDGET - left < CLOSING_BUDGET / 100, "{}", CLOSING_BUDGET - left);
    }

    #[test]
    fn every_built_in_hand_closes_freely_as_predicted() {
        for hand in palmares_models::builtin::builtin_hands() {
            let mut left = CLOSING_BUDGET;
            let closure = close(hand, &vec![0.1; hand.motors.len()], &mut left).expect("a hand");
            assert!(closure.error.is_some_and(|error| error < 1e-9), "{}: {closure:?}", hand.name);
        }
    }

    #[test]
    fn a_world_that_fails_at_its_first_step_ends_the_closure() {
        // Its rest position is out of bounds.
        let hand = pinch(|hand| hand.coordinates[0].rest = 1e7);
        let mut left = CLOSING_BUDGET;
        let why = broken_off(&close(&hand, &[0.3, 0.3], &mut left).expect("a hand"));
        assert_eq!(why.fault, Some(Fault::OutOfBounds));
        assert!(why.step <= 1, "{why:?}");
    }

    #[test]
    fn absurd_hands_rest_or_end_early() {
        let mut faults = 0;
        for size in [1e-12, 1e-6, 1e6, 1e12, 1e200] {
            let changes: [&dyn Fn(&mut Hand); 5] = [
                &|hand| hand.coordinates.iter_mut().for_each(|c| c.stiffness *= size),
                &|hand| hand.coordinates.iter_mut().for_each(|c| c.damping *= size),
                &|hand| hand.tendons.iter_mut().for_each(|t| t.stiffness *= size),
                &|hand| {
                    hand.tendons.iter_mut().for_each(|t| {
                        t.force_limit *= size;
                        t.moment_arms.iter_mut().for_each(|(_, arm)| *arm *= size);
                    });
                },
                &|hand| {
                    hand.links.iter_mut().for_each(|link| {
                        link.inertia.mass *= size;
                        link.inertia.about_com *= size;
                    });
                },
            ];
            for change in changes {
                let hand = pinch(change);
                // A small budget, since some would take minutes.
                let Ok(closure) = close(&hand, &[0.3, 0.3], &mut 300_000_000) else { continue };
                faults += usize::from(closure.broken_off.is_some_and(|why| why.fault.is_some()));
            }
        }
        assert!(faults > 0, "none of them is absurd");
    }

    #[test]
    fn a_closure_ends_when_its_budget_is_spent() {
        let mut left = 100_000;
        let why = broken_off(&close(&pinch(|_| ()), &[0.3, 0.3], &mut left).expect("a hand"));
        assert_eq!((why.fault, left), (None, 0));
        assert!(why.step > 0 && why.time_s < RAMP_S, "{why:?}");
        assert!(why.to_string().contains("needs more computing than its budget"), "{why}");
    }
}
