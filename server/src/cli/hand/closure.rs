//! Free closure: the hand alone in the air, its motors wound up, until it rests.

use super::predict::{Equilibrium, largest_difference, settled};
use palmares_models::Pose;
use palmares_models::hand::Hand;
use palmares_sim::actuation::equilibrium::NoClosedForm;
use palmares_sim::model::ModelError;
use palmares_sim::world::Push;
use palmares_sim::{BaseCommand, Command, Config, Model, Owner, State, World};
use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Newton's tolerance, tighter than in a run: here it is what limits the comparison.
const TOLERANCE: f64 = 1e-12;
/// The motors are ramped up over this time, s, if they are fast enough.
pub(super) const RAMP_S: f64 = 1.0;
/// A joint slower than this rests, rad/s.
pub(super) const AT_REST: f64 = 1e-10;
/// A joint slower than this does not move to the eye, rad/s.
pub(super) const AT_SIGHT: f64 = 2e-3;
/// How long all of them must be that slow, s.
const STILL_S: f64 = 0.1;
/// A hand that moves longer than this is left alone, s.
const PATIENCE_S: f64 = 60.0;
/// Simulation and closed form agree when no coordinate differs by more, rad or m: the solver's tolerance with some
/// room.
pub(super) const AGREEMENT: f64 = 1e-6;

/// One closing, from the open hand to rest.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Closure {
    /// Where the motors went.
    pub(super) sigma: Vec<f64>,
    /// When the hand came to rest, s; none when it did not.
    pub(super) rest_s: Option<f64>,
    /// Coordinates at the end.
    pub(super) q: Vec<f64>,
    /// Tension of every tendon at the end.
    pub(super) tension: Vec<f64>,
    /// What the closed form predicts; none where it has no answer.
    pub(super) predicted_q: Option<Vec<f64>>,
    /// Its tensions.
    pub(super) predicted_tension: Option<Vec<f64>>,
    /// Largest |q − predicted|.
    pub(super) error: Option<f64>,
    /// The coordinate where it is.
    pub(super) worst: Option<String>,
    /// Why the closed form does not apply here; empty when it does.
    pub(super) beyond: Vec<String>,
}

impl Closure {
    /// Whether the closed form applies and the simulation does something else.
    pub(super) fn disagrees(&self) -> bool {
        self.beyond.is_empty() && self.error.is_none_or(|error| error.is_nan() || error > AGREEMENT)
    }
}

/// A hand alone in the air, to be stepped.
pub(super) struct Alone {
    world: World,
    command: Command,
    hand: Arc<Hand>,
}

impl Alone {
    /// The open hand at the origin.
    pub(super) fn new(hand: &Arc<Hand>) -> Result<Self, ModelError> {
        let model =
            Arc::new(Model::new(Config { tolerance: TOLERANCE, ..Config::default() }, Some(hand.clone()))?);
        let state = State::at_rest(&model, Pose::IDENTITY, &[]);
        let mut command = Command::stay(&model, Pose::IDENTITY);
        command.base = BaseCommand::stay(Pose::IDENTITY);
        Ok(Alone { world: World::new(model, state), command, hand: hand.clone() })
    }

    /// One step with the motors on their way to `sigma`.
    fn step(&mut self, sigma: &[f64]) {
        let share = smooth((self.time_s() + self.world.model().config().step_s) / RAMP_S);
        for (command, target) in self.command.sigma.iter_mut().zip(sigma) {
            *command = share * target;
        }
        self.world.step(&self.command);
    }

    /// The state.
    pub(super) fn state(&self) -> &State {
        self.world.state()
    }

    /// s since the beginning.
    pub(super) fn time_s(&self) -> f64 {
        self.state().time_s(self.world.model())
    }

    /// What pushes the hand from now on.
    pub(super) fn set_pushes(&mut self, pushes: &[Push]) {
        self.command.pushes = pushes.to_vec();
    }

    /// Back to a state it was in.
    pub(super) fn restore(&mut self, state: State) {
        self.world.restore(state);
    }

    /// Largest joint speed, rad/s.
    fn speed(&self) -> f64 {
        self.state().v[6..].iter().fold(0.0, |most, v| v.abs().max(most))
    }

    /// Goes on until no joint has been faster than `speed` for a while; `see` looks at every step. Returns when that
    /// began.
    pub(super) fn settle(&mut self, sigma: &[f64], speed: f64, mut see: impl FnMut(&Alone)) -> Option<f64> {
        let (step_s, begin) = (self.world.model().config().step_s, self.time_s());
        let mut still = 0.0;
        while self.time_s() - begin < PATIENCE_S && self.state().is_finite() {
            self.step(sigma);
            see(self);
            let moving = self.time_s() < RAMP_S || self.speed() > speed;
            still = if moving { 0.0 } else { still + step_s };
            if still >= STILL_S {
                return Some(self.time_s() - still);
            }
        }
        None
    }

    /// The closed form's prediction for the present base pose.
    pub(super) fn predict(&self, sigma: &[f64]) -> Result<Option<Equilibrium>, NoClosedForm> {
        settled(self.world.model(), &self.hand, self.state().base, sigma, &self.command.pushes)
    }

    /// Why the closed form does not apply to the state at rest: it knows no limits and no contacts.
    pub(super) fn beyond(&self, predicted: &Equilibrium) -> Vec<String> {
        let (hand, state) = (&self.hand, self.state());
        let mut out = Vec::new();
        for ((t, &f), &p) in hand.tendons.iter().zip(&state.tension).zip(&predicted.tension) {
            if f.abs().max(p.abs()) >= t.force_limit * (1.0 - 1e-9) {
                out.push(format!(
                    "tendon '{}' is at its limit of {}; without it {p:.4}",
                    t.name, t.force_limit
                ));
            } else if !t.both_ways && (f.min(p) < 0.0 || (f <= 0.0 && p > 0.0)) {
                out.push(format!("tendon '{}' is slack; it would have to push with {:.4}", t.name, -p));
            }
        }
        let mut pairs = BTreeSet::new();
        for contact in self.world.contact_forces() {
            if let (Owner::Link(a), Owner::Link(b)) = (contact.a, contact.b) {
                pairs.insert((a.min(b), a.max(b)));
            }
        }
        for (a, b) in pairs {
            out.push(format!("'{}' touches '{}'", hand.links[a].name, hand.links[b].name));
        }
        for ((c, &q), &p) in hand.coordinates.iter().zip(&state.q).zip(&predicted.q) {
            for (side, bound, outside) in
                [("lower", c.lower, q.min(p) <= c.lower), ("upper", c.upper, q.max(p) >= c.upper)]
            {
                if outside {
                    out.push(format!(
                        "joint '{}' is at its {side} limit {bound:.4}; the closed form has {p:.4}",
                        c.name
                    ));
                }
            }
        }
        out
    }
}

/// Closes a hand to σ (one per motor) and compares.
pub(super) fn close(hand: &Arc<Hand>, sigma: &[f64]) -> Result<Closure, ModelError> {
    let mut alone = Alone::new(hand)?;
    let rest_s = alone.settle(sigma, AT_REST, |_| {});
    let predicted = alone.predict(sigma);
    let state = alone.state();
    let mut closure = Closure {
        sigma: sigma.to_vec(),
        rest_s,
        q: state.q.clone(),
        tension: state.tension.clone(),
        predicted_q: None,
        predicted_tension: None,
        error: None,
        worst: None,
        beyond: Vec::new(),
    };
    match predicted {
        Err(no_form) => closure.beyond.push(no_form.to_string()),
        Ok(None) => {
            closure.beyond.push("the hand's own weight leaves it no equilibrium to iterate to".into())
        }
        Ok(Some(predicted)) => {
            closure.beyond = alone.beyond(&predicted);
            if rest_s.is_none() {
                closure.beyond.push(format!("the hand still moves after {PATIENCE_S} s"));
            }
            closure.error = Some(largest_difference(&state.q, &predicted.q));
            let distance = |&i: &usize| (state.q[i] - predicted.q[i]).abs();
            let worst = (0..state.q.len()).max_by(|a, b| distance(a).total_cmp(&distance(b)));
            closure.worst = worst.map(|i| hand.coordinates[i].name.clone());
            closure.predicted_q = Some(predicted.q);
            closure.predicted_tension = Some(predicted.tension);
        }
    }
    Ok(closure)
}

/// Quintic from 0 to 1 over x in [0, 1].
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
}
