//! A task as data: furniture, boxes, objects, how they are poured, and what counts.

use palmares_models::content::ContentHash;
use palmares_models::shape::Shape;
use serde::Deserialize;
use std::sync::Arc;

/// A task as read from its `task.toml`. A new task of the same kind needs no code.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Identifier: `balls`.
    pub name: String,
    /// One sentence for people.
    pub description: String,
    /// Length of a tick, s.
    pub tick_s: f64,
    /// Length of a physics step, s; a whole number of them makes a tick.
    pub step_s: f64,
    /// The longest run, s of simulated time.
    pub time_limit_s: f64,
    /// Where the hand starts.
    pub hand: Start,
    /// Fixed bodies made of boxes.
    #[serde(default)]
    pub furniture: Vec<Furniture>,
    /// Open boxes.
    pub boxes: Vec<OpenBox>,
    /// The objects to move.
    pub objects: Objects,
    /// How they get into their box.
    pub pour: Pour,
    /// What counts.
    pub rules: Rules,
    /// See [`Task::content_hash`].
    #[serde(skip)]
    content_hash: String,
}

/// Pose of the hand's base at tick 0.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// m
    pub position: [f64; 3],
    /// x, y, z, w
    pub quat_xyzw: [f64; 4],
}

/// A fixed body.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Furniture {
    /// Unique name.
    pub name: String,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// sRGB
    pub color: [f64; 3],
    /// Axis-aligned boxes.
    pub parts: Vec<Slab>,
}

/// An axis-aligned box.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slab {
    /// Centre, m.
    pub position: [f64; 3],
    /// m
    pub half_extents: [f64; 3],
}

/// A box without a lid. Its inner floor is at z = 0.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpenBox {
    /// Unique name; also the name of its inner volume.
    pub name: String,
    /// x, y, m
    pub center: [f64; 2],
    /// Inner width, depth and height, m.
    pub inner: [f64; 3],
    /// Thickness of walls and floor, m.
    pub wall: f64,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// sRGB
    pub color: [f64; 3],
}

impl OpenBox {
    /// Lowest and highest corner of the inner volume, m.
    pub fn inner_volume(&self) -> ([f64; 3], [f64; 3]) {
        let ([x, y], [w, d, h]) = (self.center, self.inner);
        ([x - 0.5 * w, y - 0.5 * d, 0.0], [x + 0.5 * w, y + 0.5 * d, h])
    }

    /// Floor and four walls.
    pub fn slabs(&self) -> Vec<Slab> {
        let ([x, y], [w, d, h], t) = (self.center, self.inner, 0.5 * self.wall);
        let (w, d, h) = (0.5 * w, 0.5 * d, 0.5 * h);
        let slab = |position, half_extents| Slab { position, half_extents };
        vec![
            slab([x, y, -t], [w + 2.0 * t, d + 2.0 * t, t]),
            slab([x + w + t, y, h], [t, d + 2.0 * t, h]),
            slab([x - w - t, y, h], [t, d + 2.0 * t, h]),
            slab([x, y + d + t, h], [w, t, h]),
            slab([x, y - d - t, h], [w, t, h]),
        ]
    }
}

/// Equal objects.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Objects {
    /// Name; a number is appended.
    pub name: String,
    /// How many.
    pub count: usize,
    /// Geometry.
    pub shape: Shape,
    /// kg
    pub mass: f64,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// Lever of rolling resistance, m.
    pub rolling_friction: f64,
    /// sRGB
    pub color: [f64; 3],
}

/// Layers of a jittered grid, dropped into a box.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pour {
    /// Name of the box.
    pub into: String,
    /// Part of the box's width the grid spans.
    pub spread: f64,
    /// Most objects in a layer.
    pub layer: usize,
    /// Largest shift in x and y, m.
    pub jitter: f64,
    /// Height of the lowest layer, m.
    pub first_height: f64,
    /// Distance of layers, m.
    pub layer_height: f64,
}

/// Points and when they are counted.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rules {
    /// The box the objects should end in.
    pub goal: String,
    /// The box they come from.
    pub start: String,
    /// Points per object in the goal.
    pub in_goal: f64,
    /// Points per object in neither box.
    pub outside: f64,
    /// Longest settling after a run, with the hand frozen, s.
    pub settle_s: f64,
}

/// A task that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{file}: {message}")]
pub struct TaskError {
    /// The file.
    pub file: String,
    /// Element and what would be valid.
    pub message: String,
}

impl Task {
    /// Reads and checks a `task.toml`.
    pub fn parse(file: &str, text: &str) -> Result<Task, TaskError> {
        let error = |message: String| TaskError { file: file.to_owned(), message };
        let mut task: Task = toml::from_str(text).map_err(|e| error(e.to_string()))?;
        let table: toml::Table = toml::from_str(text).map_err(|e| error(e.to_string()))?;
        let mut hash = ContentHash::of("palmares task 1");
        digest(&mut hash, &toml::Value::Table(table));
        task.content_hash = hash.to_hex();
        let steps = task.tick_s / task.step_s;
        let whole = (steps - steps.round()).abs() < 1e-9 && steps >= 0.5;
        if !(task.step_s > 0.0 && task.step_s <= 0.01 && whole) {
            return Err(error(format!(
                "step_s = {} must be in (0, 0.01] and divide tick_s = {}",
                task.step_s, task.tick_s
            )));
        }
        for (field, name) in [
            ("pour.into", &task.pour.into),
            ("rules.goal", &task.rules.goal),
            ("rules.start", &task.rules.start),
        ] {
            if !task.boxes.iter().any(|b| &b.name == name) {
                let known: Vec<&str> = task.boxes.iter().map(|b| b.name.as_str()).collect();
                return Err(error(format!("{field} = \"{name}\" is no box; boxes: {}", known.join(", "))));
            }
        }
        if task.objects.count == 0 || task.objects.count > 200 || task.pour.layer == 0 {
            return Err(error("objects.count must be in 1..=200 and pour.layer at least 1".to_owned()));
        }
        Ok(task)
    }

    /// The tasks that come with the program.
    pub fn builtin() -> Vec<Arc<Task>> {
        let parse = |file: &str, text: &str| {
            Arc::new(Task::parse(file, text).expect("tasks that come with the program are valid"))
        };
        vec![parse("balls/task.toml", include_str!("../balls/task.toml"))]
    }

    /// SHA-256 of everything the file says, without comments and layout, 64 hexadecimal digits.
    pub fn content_hash(&self) -> &str {
        &self.content_hash
    }

    /// The box of a name.
    pub fn open_box(&self, name: &str) -> Option<&OpenBox> {
        self.boxes.iter().find(|b| b.name == name)
    }

    /// Physics steps in a tick.
    pub fn steps_per_tick(&self) -> u64 {
        (self.tick_s / self.step_s).round() as u64
    }
}

/// Takes in a TOML value; tables are sorted by key.
fn digest(hash: &mut ContentHash, value: &toml::Value) {
    hash.text(value.type_str());
    match value {
        toml::Value::Array(items) => hash.list(items, digest),
        toml::Value::Table(table) => {
            let mut entries: Vec<_> = table.iter().collect();
            entries.sort_by_key(|(key, _)| *key);
            hash.list(&entries, |h, (key, value)| {
                h.text(key);
                digest(h, value);
            });
        }
        toml::Value::Float(x) => hash.float(*x),
        other => hash.text(&other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_tasks_are_valid() {
        let tasks = Task::builtin();
        assert_eq!(tasks[0].name, "balls");
        assert_eq!(tasks[0].steps_per_tick(), 10);
    }

    #[test]
    fn a_wrong_box_name_is_named() {
        let text = include_str!("../balls/task.toml").replace("goal = \"box_b\"", "goal = \"box_c\"");
        let error = Task::parse("x.toml", &text).expect_err("box_c does not exist");
        assert!(error.to_string().contains("rules.goal = \"box_c\" is no box; boxes: box_a, box_b"));
    }

    #[test]
    fn the_hash_is_of_the_content() {
        let text = include_str!("../balls/task.toml");
        let hash = |text: &str| Task::parse("x.toml", text).expect("valid").content_hash().to_owned();
        assert_eq!(hash(text), hash(&format!("# A comment.\n{text}")));
        assert_ne!(hash(text), hash(&text.replace("mass = 1.0", "mass = 1.1")));
    }

    #[test]
    fn a_step_that_does_not_divide_the_tick_is_refused() {
        let text = include_str!("../balls/task.toml").replace("step_s = 0.001", "step_s = 0.003");
        assert!(Task::parse("x.toml", &text).expect_err("3 ms").message.contains("divide tick_s"));
    }
}
