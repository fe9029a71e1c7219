//! Options of a learner.

use crate::task::{Placing, Quantity, Ranges, Task};

/// In what runs differ from those of their task.
#[derive(Clone, Debug)]
pub struct Options {
    /// The task's ranges of what is drawn.
    pub(super) ranges: Ranges,
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
        Options { ranges: Ranges::default(), count, whole: count, needs_all }
    }

    /// Draws everything that the task declares.
    #[must_use]
    pub fn randomise_all(self, task: &Task) -> Self {
        Options { ranges: task.training.randomise.clone(), ..self }
    }

    /// Draws what is named.
    ///
    /// # Errors
    /// The task declares no range for a name.
    pub fn randomise<S: AsRef<str>>(self, task: &Task, names: &[S]) -> Result<Self, String> {
        let declared = &task.training.randomise;
        let known: Vec<Quantity> = Quantity::ALL.into_iter().filter(|it| it.declared(declared)).collect();
        for name in names {
            if known.iter().all(|quantity| quantity.name() != name.as_ref()) {
                let known = known.iter().map(|quantity| quantity.name()).collect::<Vec<_>>().join(", ");
                let known = if known.is_empty() { "nothing".to_owned() } else { known };
                return Err(format!(
                    "randomise: found {:?}; task `{}` declares in [training.randomise]: {known}",
                    name.as_ref(),
                    task.name
                ));
            }
        }
        let wanted = |quantity: Quantity| names.iter().any(|name| name.as_ref() == quantity.name());
        let ranges = Ranges {
            mass: declared.mass.filter(|_| wanted(Quantity::Mass)),
            friction: declared.friction.filter(|_| wanted(Quantity::Friction)),
            size: declared.size.filter(|_| wanted(Quantity::Size)),
            sensor_noise: declared.sensor_noise.filter(|_| wanted(Quantity::SensorNoise)),
            hand_pose: declared.hand_pose.filter(|_| wanted(Quantity::HandPose)),
            object_poses: declared.object_poses.filter(|_| wanted(Quantity::ObjectPoses)),
        };
        Ok(Options { ranges, ..self })
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
        self.count == self.whole && Quantity::ALL.iter().all(|quantity| !quantity.declared(&self.ranges))
    }
}
