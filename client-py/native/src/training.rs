//! A learner's options for a world: `palmares.sim.Training`.

use crate::lookup;
use palmares_models::hand::{Hand, Uncertain};
use palmares_tasks::training::{ActionErrors, Quantity, Shaper, TrainingOptions};
use palmares_tasks::{HandDraw, Noise, Outcome, Reason, Run, Seed, Task};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The options as Python passes them.
#[derive(FromPyObject)]
pub(crate) struct TrainingRequest {
    shaping: bool,
    discount: Option<f64>,
    randomise: Randomise,
    fraction: f64,
    /// Index and count of a sample of the hand.
    hand_sample: Option<(u32, u32)>,
    /// Longest step, ms.
    step_ms: Option<f64>,
    /// Least and most ticks by which actions arrive late; deviation of their errors.
    action_delay: (u32, u32),
    action_noise: f64,
}

/// Everything, nothing, or the named quantities.
#[derive(FromPyObject)]
enum Randomise {
    All(bool),
    Names(Vec<String>),
}

/// The options as runs use them.
pub(crate) struct Training {
    pub(crate) options: TrainingOptions,
    shaping: bool,
    discount: Option<f64>,
}

impl Training {
    /// The chosen options, checked for a task, a hand and sensors.
    pub(crate) fn of(
        request: Option<TrainingRequest>,
        task: &Task,
        hand: &Hand,
        noise: Noise,
    ) -> PyResult<Self> {
        let options = TrainingOptions::none(task);
        let Some(request) = request else {
            return Ok(Training { options, shaping: false, discount: None });
        };
        let TrainingRequest { shaping, discount, randomise, fraction, hand_sample, .. } = request;
        if shaping && task.training.rewards.is_none() {
            let message = format!("shaping: task `{}` has no [training.rewards] in its task.toml", task.name);
            return Err(PyValueError::new_err(message));
        }
        if let Some(discount) = discount.filter(|discount| !(0.0..=1.0).contains(discount)) {
            return Err(PyValueError::new_err(format!("discount: found {discount}; wanted 0 to 1")));
        }
        let options = match &randomise {
            Randomise::All(false) => Ok(options),
            Randomise::All(true) => options.randomise_all(task, hand),
            Randomise::Names(names) => {
                let noise_named = names.iter().any(|name| name == Quantity::SensorNoise.name());
                if noise_named && noise == Noise::None {
                    let message = "randomise: \"sensor_noise\" needs sensors that have some: noise=\"real\"";
                    return Err(PyValueError::new_err(message));
                }
                options.randomise(task, hand, names)
            }
        };
        let options = options.and_then(|options| options.fraction(fraction)).and_then(|options| {
            let Some((index, count)) = hand_sample else { return Ok(options) };
            options.draw_hand(hand, HandDraw::Sample { index, count })
        });
        let options = options.and_then(|options| match request.step_ms {
            Some(step_ms) => options.longest_step(1e-3 * step_ms),
            None => Ok(options),
        });
        let (low, high) = request.action_delay;
        let actions = ActionErrors { delay: [low, high], noise: request.action_noise };
        let options = options.and_then(|options| options.action_errors(actions));
        Ok(Training { options: options.map_err(PyValueError::new_err)?, shaping, discount })
    }

    /// Names of the numbers of a hand that are drawn.
    pub(crate) fn drawn_names(&self, hand: &Hand) -> Vec<String> {
        self.options.hand().entries(hand).iter().map(|entry| entry.name.clone()).collect()
    }

    /// Shapes the rewards of a run, if this is chosen.
    pub(crate) fn shaper(&self, run: &Run) -> Option<Shaper> {
        if self.shaping { Shaper::new(run, self.discount) } else { None }
    }

    /// Whether rewards are shaped.
    pub(crate) fn shapes(&self) -> bool {
        self.shaping
    }

    /// Leaves another part of the objects in later runs.
    pub(crate) fn set_fraction(&mut self, fraction: f64) -> PyResult<()> {
        self.options = self.options.clone().fraction(fraction).map_err(PyValueError::new_err)?;
        Ok(())
    }
}

/// The numbers of a hand that these options draw, or what is given in their place, in the run of a seed.
pub(crate) fn drawn_of(options: &TrainingOptions, hand: &Hand, seed: Seed) -> Vec<f64> {
    let given = |entry: &&Uncertain| options.given().hand.get(&entry.name).copied();
    let drawn = options.hand().numbers(hand, seed).into_iter();
    let entries = options.hand().entries(hand);
    entries.iter().zip(drawn).map(|(entry, drawn)| given(entry).unwrap_or(drawn)).collect()
}

/// Names of the numbers of a hand that these options draw for each run of a task.
#[pyfunction]
pub(crate) fn hand_numbers(task: &str, hand: &str, training: TrainingRequest) -> PyResult<Vec<String>> {
    let (task, hand) = (lookup::task(task)?, lookup::hand(hand)?);
    Ok(Training::of(Some(training), &task, &hand, Noise::Real)?.drawn_names(&hand))
}

/// The status of a run that is over: runs that differ from the task's are for learners alone.
pub(crate) fn status(outcome: &Outcome, varied: bool) -> &'static str {
    match (outcome.reason, varied) {
        (Reason::WorldFault, _) => "voided",
        (_, true) => "training",
        (_, false) => "practice",
    }
}
