//! A world of a batch: its run, and what the last step brought.

use crate::fields::{constant, write};
use crate::training::{Training, drawn_of};
use palmares_models::hand::Hand;
use palmares_sim::SharedScratch;
use palmares_tasks::training::{Given, Shaper, open};
use palmares_tasks::{Action, Noise, Outcome, Reason, Run, Seed, Sensing, Task};
use std::cell::RefCell;
use std::sync::Arc;
use std::time::{Duration, Instant};

thread_local! {
    /// The scratch memory that a thread lends to the world that it steps.
    static WORKSPACE: RefCell<SharedScratch> = RefCell::default();
}

/// A world of the batch, with its results.
pub(crate) struct Slot {
    pub(crate) run: Option<Run>,
    pub(crate) seed: u64,
    /// The observation, and its constant part.
    pub(crate) row: Vec<f64>,
    pub(crate) constant: Vec<f64>,
    /// Drawn numbers of its hand.
    pub(crate) drawn: Vec<f64>,
    /// Numbers that were given rather than drawn.
    pub(crate) given: Given,
    pub(crate) score: f64,
    pub(crate) reward: f64,
    /// Shapes rewards, if they are shaped.
    pub(crate) shaper: Option<Shaper>,
    pub(crate) shaping: f64,
    /// Time spent stepping.
    pub(crate) physics: Duration,
    /// Outcome of a run that is over.
    pub(crate) outcome: Option<Outcome>,
    /// Events of the last step.
    pub(crate) events: Vec<(u64, String, Option<usize>)>,
}

/// A run that is not in a world yet.
pub(crate) struct Opened {
    pub(crate) run: Run,
    pub(crate) constant: Vec<f64>,
    pub(crate) drawn: Vec<f64>,
    pub(crate) given: Given,
    pub(crate) shaper: Option<Shaper>,
}

/// Options of the runs of a batch.
pub(crate) struct How<'a> {
    pub(crate) task: &'a Arc<Task>,
    pub(crate) hand: &'a Arc<Hand>,
    pub(crate) noise: Noise,
    pub(crate) sensing: Sensing,
    pub(crate) training: &'a Training,
}

impl Opened {
    pub(crate) fn of(how: &How<'_>, seed: u64, given: &Given) -> Result<Self, String> {
        let How { task, hand, noise, sensing, training } = *how;
        let options = training.options.clone().give(hand, given.clone())?;
        let run = open(task, hand, Seed::from_u64(seed), noise, &options);
        let run = run.map_err(|error| error.to_string())?;
        let drawn = drawn_of(&options, hand, Seed::from_u64(seed));
        let constant = constant(&run, sensing, task.objects.count, &drawn);
        let shaper = training.shaper(&run);
        Ok(Opened { run, constant, drawn, given: given.clone(), shaper })
    }
}

impl Slot {
    /// A world without a run; its observation has `length` numbers, and its hand `drawn` of them.
    pub(crate) fn empty(length: usize, drawn: usize) -> Self {
        Slot {
            run: None,
            seed: 0,
            row: vec![0.0; length],
            constant: Vec::new(),
            drawn: vec![0.0; drawn],
            given: Given::default(),
            score: 0.0,
            reward: 0.0,
            shaper: None,
            shaping: 0.0,
            physics: Duration::ZERO,
            outcome: None,
            events: Vec::new(),
        }
    }

    pub(crate) fn open(&mut self, how: &How<'_>, seed: u64, given: &Given) -> Result<(), String> {
        self.take(Opened::of(how, seed, given)?, seed);
        self.continued(how.sensing, how.task.objects.count);
        Ok(())
    }

    /// Its run is another.
    pub(crate) fn take(&mut self, Opened { run, constant, drawn, given, shaper }: Opened, seed: u64) {
        (self.constant, self.drawn, self.given, self.shaper) = (constant, drawn, given, shaper);
        (self.run, self.seed) = (Some(run), seed);
    }

    /// Whether it has a run of this seed with what was given.
    pub(crate) fn is_of(&self, seed: u64, given: &Given) -> bool {
        self.run.is_some() && self.seed == seed && self.given == *given
    }

    /// Its run goes on from another state.
    pub(crate) fn continued(&mut self, sensing: Sensing, objects: usize) {
        let Slot { run: Some(run), score, reward, row, constant, shaper, shaping, outcome, events, .. } =
            self
        else {
            return;
        };
        write(run, sensing, objects, constant, row);
        (*score, *reward, *outcome, *shaping) = (run.score(), 0.0, None, 0.0);
        shaper.iter_mut().for_each(|shaper| shaper.restart(run));
        events.clear();
    }

    /// Whether it does not move any more.
    pub(crate) fn is_over(&self) -> bool {
        let ended = |run: &Run| run.over().is_some() || run.fault().is_some();
        self.outcome.is_some() || self.run.as_ref().is_none_or(ended)
    }

    pub(crate) fn begin(&mut self) {
        self.events.clear();
    }

    pub(crate) fn advance(&mut self, action: &Action, ticks: u32, sensing: Sensing) {
        let Slot { run: Some(run), events, outcome: None, physics, .. } = self else { return };
        let begun = Instant::now();
        WORKSPACE.with_borrow_mut(|workspace| run.exchange(workspace));
        for _ in 0..ticks {
            // The action is finite and of the right length.
            if run.over().is_some() || run.fault().is_some() || run.step(action).is_err() {
                break;
            }
            events.extend(run.events().iter().map(|event| {
                let shown = event.redacted_for(sensing);
                (shown.tick, shown.kind, shown.object)
            }));
        }
        WORKSPACE.with_borrow_mut(|workspace| run.exchange(workspace));
        *physics += begun.elapsed();
    }

    /// Observes in the middle of a step.
    pub(crate) fn look(&mut self, sensing: Sensing, objects: usize) {
        let Slot { run: Some(run), outcome: None, row, constant, .. } = self else { return };
        write(run, sensing, objects, constant, row);
    }

    /// Observes, and sets the outcome if the run is over.
    pub(crate) fn end(&mut self, sensing: Sensing, objects: usize) {
        let Slot { run: Some(run), outcome, score, reward, row, constant, shaper, shaping, .. } = self else {
            return;
        };
        if outcome.is_some() {
            return;
        }
        write(run, sensing, objects, constant, row);
        *shaping = shaper.as_mut().map_or(0.0, |shaper| shaper.step(run));
        let reason = if run.fault().is_some() { Some(Reason::WorldFault) } else { run.over() };
        *outcome = reason.map(|reason| run.finish(reason));
        let now = outcome.as_ref().map_or_else(|| run.score(), |outcome| outcome.score);
        *reward = now - *score;
        *score = now;
    }
}
