//! Options of a learner.

use crate::hand_draw::HandDraw;
use crate::seed::Seed;
use crate::task::{ActionErrors, Given, Placing, Quantity, Ranges, Task};
use palmares_models::hand::Hand;
use std::sync::Arc;

/// Longest step of the integration, s: as for a `task.toml`.
const LONGEST_STEP_S: f64 = 0.01;
/// Name of all uncertain numbers of a hand.
const HAND: &str = "hand";
/// Begin of the name of one of them.
const ONE_OF_HAND: &str = "hand_";

/// In what runs differ from those of their task.
#[derive(Clone, Debug)]
pub struct TrainingOptions {
    /// The task's ranges of what is drawn.
    pub(super) ranges: Ranges,
    /// The hand.
    pub(super) hand: HandDraw,
    /// Number of objects.
    pub(super) count: usize,
    /// Length of a step of the integration, s.
    pub(super) step_s: f64,
    /// Numbers that are given rather than drawn.
    pub(super) given: Given,
    pub(super) actions: ActionErrors,
    /// Number of objects of the task, its step and its tick, s.
    whole: usize,
    own_step_s: f64,
    tick_s: f64,
    /// Name of the task, if it names its objects one by one.
    needs_all: Option<String>,
}

impl TrainingOptions {
    /// Nothing differs.
    pub fn none(task: &Task) -> Self {
        let count = task.objects.count;
        let named = task.rules.in_order() || matches!(task.place, Placing::Fixed(_));
        let needs_all = named.then(|| task.name.clone());
        TrainingOptions {
            ranges: Ranges::default(),
            hand: HandDraw::Own,
            count,
            step_s: task.step_s,
            given: Given::default(),
            actions: ActionErrors::default(),
            whole: count,
            own_step_s: task.step_s,
            tick_s: task.tick_s,
            needs_all,
        }
    }

    /// Draws everything that the task declares.
    ///
    /// # Errors
    /// The task declares the hand, and the hand no range.
    pub fn randomise_all(self, task: &Task, hand: &Hand) -> Result<Self, String> {
        let ranges = task.training.randomise.clone();
        let drawn = if ranges.hand { HandDraw::All } else { HandDraw::Own };
        TrainingOptions { ranges, ..self }.draw_hand(hand, drawn)
    }

    /// Draws what is named: `hand` is all that is uncertain in the hand, `hand_NAME` one entry.
    ///
    /// # Errors
    /// Task or hand declare no range for a name.
    pub fn randomise<S: AsRef<str>>(self, task: &Task, hand: &Hand, names: &[S]) -> Result<Self, String> {
        let is_of_hand = |name: &&str| {
            (*name == HAND || name.starts_with(ONE_OF_HAND)) && *name != Quantity::HandPose.name()
        };
        let (of_hand, names): (Vec<&str>, Vec<&str>) = names.iter().map(AsRef::as_ref).partition(is_of_hand);
        let entries: Vec<String> =
            of_hand.iter().filter_map(|name| name.strip_prefix(ONE_OF_HAND)).map(str::to_owned).collect();
        let drawn = match of_hand.len() {
            0 => HandDraw::Own,
            all if entries.len() < all => HandDraw::All,
            _ => HandDraw::Named(entries),
        };
        let declared = &task.training.randomise;
        let known: Vec<Quantity> = Quantity::ALL.into_iter().filter(|it| it.declared(declared)).collect();
        for name in &names {
            if known.iter().all(|quantity| quantity.name() != *name) {
                let known = known.iter().map(|quantity| quantity.name()).collect::<Vec<_>>().join(", ");
                let known = if known.is_empty() { "nothing".to_owned() } else { known };
                return Err(format!(
                    "randomise: found {:?}; task `{}` declares in [training.randomise]: {known}",
                    name, task.name
                ));
            }
        }
        let wanted = |quantity: Quantity| names.contains(&quantity.name());
        let ranges = Ranges {
            mass: declared.mass.filter(|_| wanted(Quantity::Mass)),
            friction: declared.friction.filter(|_| wanted(Quantity::Friction)),
            size: declared.size.filter(|_| wanted(Quantity::Size)),
            sensor_noise: declared.sensor_noise.filter(|_| wanted(Quantity::SensorNoise)),
            hand_pose: declared.hand_pose.filter(|_| wanted(Quantity::HandPose)),
            object_poses: declared.object_poses.filter(|_| wanted(Quantity::ObjectPoses)),
            hand: declared.hand,
        };
        TrainingOptions { ranges, ..self }.draw_hand(hand, drawn)
    }

    /// Draws numbers of the hand.
    ///
    /// # Errors
    /// The hand has none, or not these.
    pub fn draw_hand(self, hand: &Hand, drawn: HandDraw) -> Result<Self, String> {
        drawn.check(hand).map_err(|problem| format!("randomise: {problem}"))?;
        Ok(TrainingOptions { hand: drawn, ..self })
    }

    /// How the numbers of the hand are drawn.
    pub fn hand(&self) -> &HandDraw {
        &self.hand
    }

    /// Leaves this part of the task's objects, in (0, 1], rounded to a whole number and at least one.
    ///
    /// # Errors
    /// The part is out of range, or the task needs all of its objects.
    pub fn fraction(self, part: f64) -> Result<Self, String> {
        if !(part > 0.0 && part <= 1.0) {
            return Err(format!("fraction: found {part}; wanted a number above 0 and at most 1"));
        }
        let count = ((part * self.whole as f64).round() as usize).max(1);
        if let Some(task) = self.needs_all.as_ref().filter(|_| count < self.whole) {
            return Err(format!(
                "fraction: found {part}; task `{task}` speaks of its objects one by one and needs all of them: wanted 1"
            ));
        }
        Ok(TrainingOptions { count, ..self })
    }

    /// Divides the tick into the fewest equal steps that are no longer than this, s.
    ///
    /// # Errors
    /// It is longer than a task may have it, or shorter than the task's own.
    pub fn longest_step(self, step_s: f64) -> Result<Self, String> {
        let longest = self.tick_s.min(LONGEST_STEP_S);
        if !(step_s >= self.own_step_s && step_s <= longest) {
            return Err(format!(
                "step_ms: found {}; wanted {} to {}",
                1e3 * step_s,
                1e3 * self.own_step_s,
                1e3 * longest
            ));
        }
        let step_s = self.tick_s / (self.tick_s / step_s - 1e-9).ceil();
        Ok(TrainingOptions { step_s, ..self })
    }

    /// Lets actions arrive late and with errors.
    ///
    /// # Errors
    /// A number is out of bounds.
    pub fn action_errors(self, actions: ActionErrors) -> Result<Self, String> {
        actions.check()?;
        Ok(TrainingOptions { actions, ..self })
    }

    /// Length of a step, s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Takes numbers rather than draw them.
    ///
    /// # Errors
    /// A number is out of bounds, or the hand has none of this name.
    pub fn give(self, hand: &Hand, given: Given) -> Result<Self, String> {
        given.check(hand)?;
        Ok(TrainingOptions { given, ..self })
    }

    /// The given numbers.
    pub fn given(&self) -> &Given {
        &self.given
    }

    /// The given or drawn value of each uncertain number of the hand, if it has one.
    pub fn hand_numbers(&self, hand: &Hand, seed: Seed) -> Vec<Option<f64>> {
        let mut numbers = self.hand.each(hand, seed);
        for (number, entry) in numbers.iter_mut().zip(&hand.uncertain) {
            *number = self.given.hand.get(&entry.name).copied().or(*number);
        }
        numbers
    }

    /// The hand of a run.
    ///
    /// # Errors
    /// It is not valid with these numbers.
    pub fn hand_of(&self, hand: &Arc<Hand>, seed: Seed) -> Result<Arc<Hand>, String> {
        let Given { hand: numbers, link_mass, .. } = &self.given;
        if self.hand.is_own() && numbers.is_empty() && link_mass.is_none() {
            return Ok(Arc::clone(hand));
        }
        let mut drawn = hand.drawn(&self.hand_numbers(hand, seed)).map_err(|error| error.to_string())?;
        for (link, factor) in drawn.links.iter_mut().zip(link_mass.iter().flatten()) {
            link.inertia.mass *= factor;
            link.inertia.about_com *= *factor;
        }
        Ok(Arc::new(drawn))
    }

    /// Whether a run with these is the task's own.
    pub fn vary_nothing(&self) -> bool {
        self.hand.is_own()
            && self.given == Given::default()
            && self.actions == ActionErrors::default()
            && self.step_s == self.own_step_s
            && self.count == self.whole
            && Quantity::ALL.iter().all(|quantity| !quantity.declared(&self.ranges))
    }
}
