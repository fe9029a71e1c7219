//! Options of a learner.

use crate::hand_draw::HandDraw;
use crate::task::{Placing, Quantity, Ranges, Task};
use palmares_models::hand::Hand;

/// Name of all uncertain numbers of a hand.
const HAND: &str = "hand";
/// Begin of the name of one of them.
const ONE_OF_HAND: &str = "hand_";

/// In what runs differ from those of their task.
#[derive(Clone, Debug)]
pub struct Options {
    /// The task's ranges of what is drawn.
    pub(super) ranges: Ranges,
    /// The hand.
    pub(super) hand: HandDraw,
    /// Number of objects.
    pub(super) count: usize,
    /// Number of objects of the task.
    whole: usize,
    /// Name of the task, if it names its objects one by one.
    needs_all: Option<String>,
}

impl Options {
    /// Nothing differs.
    pub fn none(task: &Task) -> Self {
        let count = task.objects.count;
        let named = task.rules.in_order() || matches!(task.place, Placing::Fixed(_));
        let needs_all = named.then(|| task.name.clone());
        Options { ranges: Ranges::default(), hand: HandDraw::Own, count, whole: count, needs_all }
    }

    /// Draws everything that the task declares.
    ///
    /// # Errors
    /// The task declares the hand, and the hand no range.
    pub fn randomise_all(self, task: &Task, hand: &Hand) -> Result<Self, String> {
        let ranges = task.training.randomise.clone();
        let drawn = if ranges.hand { HandDraw::All } else { HandDraw::Own };
        Options { ranges, ..self }.draw_hand(hand, drawn)
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
        Options { ranges, ..self }.draw_hand(hand, drawn)
    }

    /// Draws numbers of the hand.
    ///
    /// # Errors
    /// The hand has none, or not these.
    pub fn draw_hand(self, hand: &Hand, drawn: HandDraw) -> Result<Self, String> {
        drawn.check(hand).map_err(|problem| format!("randomise: {problem}"))?;
        Ok(Options { hand: drawn, ..self })
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
        Ok(Options { count, ..self })
    }

    /// Whether a run with these is the task's own.
    pub fn vary_nothing(&self) -> bool {
        self.hand.is_own()
            && self.count == self.whole
            && Quantity::ALL.iter().all(|quantity| !quantity.declared(&self.ranges))
    }
}
