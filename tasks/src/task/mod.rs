//! A task as data: furniture, containers, objects, how they are placed, and what counts.

mod action_errors;
mod arm;
mod furniture;
mod given;
mod objects;
mod placing;
mod rules;
mod training;
mod variation;

pub(crate) use objects::DrawableObject;
pub(crate) use rules::REST_SPEED;
pub(crate) use variation::Variation;

use crate::referee::{ObjectSnapshot, RunStart};
use objects::ObjectError;

pub use action_errors::{ActionErrors, MAX_DELAY};
pub use arm::Carrier;
pub use furniture::{Furniture, Ground, OpenBox, Side, Slab, Space, Start};
pub use given::Given;
pub use objects::{Equal, Objects};
pub use placing::{Fixed, Placing, Pour, Scatter};
pub use rules::{
    Aim, AnyReferee, Arrange, Collect, Destination, Goal, GoalInfo, Hold, HoldPoints, RefereeState, RuleKind,
    Rules, Within,
};
pub use training::{
    Distance, HandPoses, Lift, ObjectPoses, Quantity, Ranges, Rewards, Touching, Training, Transport,
};

use palmares_models::Vec3;
use palmares_models::camera::Camera;
use palmares_models::content::ContentHash;
use palmares_models::error::LoadWarning;
use palmares_models::read::{Files, Limits};
use placing::plain_name;
use serde::Deserialize;
use std::path::{Path, PathBuf};
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
    /// Initial pose of the hand.
    pub hand: Start,
    /// The arm that carries it; without one it flies freely.
    #[serde(default)]
    pub arm: Option<Carrier>,
    /// The ground, a plane below everything.
    pub ground: Ground,
    /// Fixed bodies made of boxes.
    #[serde(default)]
    pub furniture: Vec<Furniture>,
    /// Containers with one open side. Their inner volumes are regions.
    #[serde(default)]
    pub boxes: Vec<OpenBox>,
    /// Further regions.
    #[serde(default)]
    pub regions: Vec<Space>,
    /// Fixed cameras.
    #[serde(default)]
    pub cameras: Vec<Camera>,
    /// The objects to move.
    pub objects: Objects,
    /// Their initial placement.
    pub place: Placing,
    /// The rules.
    pub rules: Rules,
    /// For learners; not part of the content hash.
    #[serde(default)]
    pub training: Training,
    /// See [`Task::content_hash`].
    #[serde(skip)]
    content_hash: String,
    /// See [`Task::finer`].
    #[serde(skip)]
    finer: Option<Finer>,
    /// In what a learner's run differs; none in every other.
    #[serde(skip)]
    variation: Option<Arc<Variation>>,
}

/// The step and the hash that a task with longer steps had with its own.
#[derive(Clone, Debug)]
pub(crate) struct Finer {
    pub(crate) content_hash: String,
    pub(crate) step_s: f64,
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

/// A task from a folder, with warnings for its author.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The task.
    pub task: Task,
    /// Warnings about the files that it names.
    pub warnings: Vec<LoadWarning>,
}

impl TaskError {
    /// One of the task's file, or of one that it names.
    fn of(file: &str, error: &ObjectError) -> TaskError {
        let text = error.to_string();
        let (file, message) = match error {
            ObjectError::Field(_) => (file, text.as_str()),
            ObjectError::File(found) => match text.strip_prefix(&format!("{file}: ")) {
                Some(message) => (file, message),
                None => (found.file().unwrap_or(file), text.as_str()),
            },
        };
        let message = message.strip_prefix(&format!("{file}: ")).unwrap_or(message);
        TaskError { file: file.to_owned(), message: message.to_owned() }
    }
}

/// Name and `task.toml` of every task that comes with the program.
const BUILTIN: [(&str, &str); 5] = [
    ("balls", include_str!("../../balls/task.toml")),
    ("shelf", include_str!("../../shelf/task.toml")),
    ("grasp", include_str!("../../grasp/task.toml")),
    ("pan", include_str!("../../pan/task.toml")),
    ("peg", include_str!("../../peg/task.toml")),
];

impl Task {
    /// Reads a task of one's own: a folder with a `task.toml` and the meshes and URDFs that it names, or that file.
    ///
    /// # Errors
    /// The first thing found wrong, with file, field and what would be valid.
    pub fn load(path: &Path) -> Result<Loaded, TaskError> {
        let (folder, name) = match path.is_dir() {
            true => (path.to_owned(), PathBuf::from(Self::FILE)),
            false => {
                let folder = path.parent().unwrap_or(Path::new("")).to_owned();
                (folder, path.file_name().map_or_else(|| Self::FILE.into(), PathBuf::from))
            }
        };
        let files = Files::Folder(folder);
        let file = files.display(&name).display().to_string();
        let read = files.read(&name, "task", Limits::default().text_bytes);
        let bytes = read.map_err(|error| TaskError::of(&file, &ObjectError::File(error)))?;
        let text = String::from_utf8(bytes)
            .map_err(|e| TaskError { file: file.clone(), message: format!("not valid UTF-8: {e}") })?;
        let loaded = Task::read(&file, &text, Some(&files))?;
        loaded.task.check_own_name().map_err(|message| TaskError { file, message })?;
        Ok(loaded)
    }

    /// File name of a task.
    pub const FILE: &str = "task.toml";

    /// Reads and checks a `task.toml` that names no other file.
    ///
    /// # Errors
    /// The same as of [`Task::load`].
    pub fn parse(file: &str, text: &str) -> Result<Task, TaskError> {
        Ok(Task::read(file, text, None)?.task)
    }

    fn read(file: &str, text: &str, files: Option<&Files>) -> Result<Loaded, TaskError> {
        let error = |message: String| TaskError { file: file.to_owned(), message };
        let mut task: Task =
            toml::from_str(text).map_err(|e| error(rules::place_of_error(text).unwrap_or(e).to_string()))?;
        plain_name("name", &task.name).map_err(error)?;
        if !(task.tick_s > 0.0 && task.tick_s <= 1.0) {
            return Err(error(format!("tick_s = {} must be in (0, 1]", task.tick_s)));
        }
        let steps = task.tick_s / task.step_s;
        let whole = (steps - steps.round()).abs() < 1e-9 && steps >= 0.5;
        if !(task.step_s > 0.0 && task.step_s <= 0.01 && whole) {
            return Err(error(format!(
                "step_s = {} must be in (0, 0.01] and divide tick_s = {}",
                task.step_s, task.tick_s
            )));
        }
        if !(task.time_limit_s > 0.0 && task.time_limit_s <= 86_400.0) {
            return Err(error(format!("time_limit_s = {} must be in (0, 86400]", task.time_limit_s)));
        }
        let mut warnings =
            task.objects.resolve(Path::new(file), files).map_err(|e| TaskError::of(file, &e))?;
        task.hand.check().map_err(error)?;
        if let Some(arm) = &mut task.arm {
            arm.resolve(files).map_err(|e| TaskError::of(file, &e))?;
        }
        task.rules.check().map_err(error)?;
        task.ground.check().map_err(error)?;
        task.check_furniture().map_err(error)?;
        task.check_regions().map_err(error)?;
        task.place.check(task.objects.certain().as_deref()).map_err(error)?;
        task.check_cameras().map_err(error)?;
        if let Some(arm) = &task.arm {
            let middle =
                |(min, max): ([f64; 3], [f64; 3])| (Vec3::from_array(min) + Vec3::from_array(max)) * 0.5;
            let named = task.regions().filter(|(name, _)| task.rules.role(name).is_some());
            let regions = named.map(|(name, corners)| (name, middle(corners)));
            warnings.extend(arm.check_reach(Path::new(file), task.hand.pose(), regions).map_err(error)?);
        }
        task.training.check(task.rules.has_destination(&task.objects), &task.place).map_err(error)?;
        let mut table: toml::Table = toml::from_str(text).map_err(|e| error(e.to_string()))?;
        table.remove("training");
        let mut hash = ContentHash::of("palmares task 1");
        digest(&mut hash, &toml::Value::Table(table));
        task.objects.digest(&mut hash);
        if let Some(arm) = &task.arm {
            arm.arm().digest(&mut hash);
        }
        task.content_hash = hash.to_hex();
        Ok(Loaded { task, warnings })
    }

    /// Its name is not that of a built-in task, unless it is that task.
    fn check_own_name(&self) -> Result<(), String> {
        match Task::builtin().iter().find(|task| task.name == self.name) {
            Some(known) if known.content_hash != self.content_hash => {
                Err(format!("name = \"{}\" is that of a task of the program; give it another one", self.name))
            }
            _ => Ok(()),
        }
    }

    /// Fixed bodies have unique names and valid sizes.
    fn check_furniture(&self) -> Result<(), String> {
        let mut names: Vec<&str> = vec![Ground::NAME];
        let bodies =
            self.furniture.iter().map(|f| f.name.as_str()).chain(self.boxes.iter().map(|b| b.name.as_str()));
        for name in bodies {
            plain_name("name of a piece of furniture or a box", name)?;
            if names.contains(&name) {
                return Err(format!(
                    "two pieces of furniture or boxes are called `{name}`; each needs a name of its own"
                ));
            }
            names.push(name);
        }
        for name in self.objects.certain().iter().flatten() {
            if names.contains(&name.as_str()) {
                return Err(format!("an object and a piece of furniture are both called `{name}`"));
            }
        }
        self.furniture.iter().try_for_each(Furniture::check)?;
        self.boxes.iter().try_for_each(OpenBox::check)
    }

    fn check_cameras(&self) -> Result<(), String> {
        const MOST: usize = 16;
        if self.cameras.len() > MOST {
            return Err(format!("cameras: {} of them; the limit is {MOST}", self.cameras.len()));
        }
        for (k, camera) in self.cameras.iter().enumerate() {
            camera.check().map_err(|problem| format!("cameras: {problem}"))?;
            if self.cameras[..k].iter().any(|other| other.name == camera.name) {
                return Err(format!(
                    "two cameras are called `{}`; each needs a name of its own",
                    camera.name
                ));
            }
            if let Some(link) = &camera.link {
                return Err(format!(
                    "camera `{}`: link = \"{link}\": a task's cameras stand still; leave it out",
                    camera.name
                ));
            }
        }
        Ok(())
    }

    /// Every named region exists once and has a size.
    fn check_regions(&self) -> Result<(), String> {
        let mut names: Vec<&str> = Vec::new();
        for (name, (min, max)) in self.regions() {
            if names.contains(&name) {
                return Err(format!(
                    "two boxes or regions are called `{name}`; each needs a name of its own"
                ));
            }
            if !(0..3).all(|k| min[k].is_finite() && max[k].is_finite() && min[k] < max[k]) {
                return Err(format!("region `{name}` from {min:?} to {max:?} has no size"));
            }
            names.push(name);
        }
        let known = names.join(", ");
        let mut named: Vec<(&str, &str)> =
            self.place.into_region().into_iter().map(|region| ("place.*.into", region)).collect();
        self.rules.check_objects(&self.objects)?;
        named.extend(self.rules.regions());
        for (field, name) in named {
            if !names.contains(&name) {
                return Err(format!("{field} = \"{name}\" is no region; regions: {known}"));
            }
        }
        Ok(())
    }

    /// The tasks that come with the program.
    pub fn builtin() -> Vec<Arc<Task>> {
        let parse = |(name, text): &(&str, &str)| {
            let file = format!("{name}/task.toml");
            Arc::new(Task::parse(&file, text).expect("tasks that come with the program are valid"))
        };
        BUILTIN.iter().map(parse).collect()
    }

    /// The `task.toml` of the task of this name that comes with the program.
    pub fn builtin_toml(name: &str) -> Option<&'static str> {
        BUILTIN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
    }

    /// SHA-256 of everything the file says, without comments, layout and `[training]`, 64 hexadecimal digits.
    pub fn content_hash(&self) -> &str {
        &self.content_hash
    }

    /// Whether runs of it differ from those of the task of this name: a learner's are no scored play.
    pub fn is_varied(&self) -> bool {
        self.variation.is_some()
    }

    pub(crate) fn variation(&self) -> Option<&Variation> {
        self.variation.as_deref()
    }

    /// The task that differs from this one only by shorter steps, its own.
    pub(crate) fn finer(&self) -> Option<&Finer> {
        self.finer.as_ref()
    }

    pub(crate) fn vary(&mut self, variation: Variation, content_hash: String, finer: Option<Finer>) {
        self.variation = Some(Arc::new(variation));
        (self.content_hash, self.finer) = (content_hash, finer);
    }

    /// The box of a name.
    pub fn open_box(&self, name: &str) -> Option<&OpenBox> {
        self.boxes.iter().find(|b| b.name == name)
    }

    /// Every region by name with its lowest and highest corner, m: inner volumes of containers first.
    pub fn regions(&self) -> impl Iterator<Item = (&str, ([f64; 3], [f64; 3]))> {
        let inner = self.boxes.iter().map(|b| (b.name.as_str(), b.inner_volume()));
        inner.chain(self.regions.iter().map(|r| (r.name.as_str(), (r.min, r.max))))
    }

    /// The region of a name. Regions that the task's own fields name are there.
    pub fn region(&self, name: &str) -> Option<([f64; 3], [f64; 3])> {
        self.regions().find(|(known, _)| *known == name).map(|(_, corners)| corners)
    }

    /// The referee of a run at tick 0, with the objects at these poses.
    pub fn referee(&self, objects: &[ObjectSnapshot]) -> AnyReferee {
        AnyReferee::new(&self.rules, &self.at_start(objects))
    }

    /// A run at tick 0, as a referee gets it.
    fn at_start<'a>(&'a self, objects: &'a [ObjectSnapshot]) -> RunStart<'a> {
        RunStart {
            tick_s: self.tick_s,
            regions: self.regions().collect(),
            names: self.objects.certain().unwrap_or_default(),
            objects,
        }
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
        assert_eq!(
            tasks.iter().map(|t| t.name.as_str()).collect::<Vec<_>>(),
            ["balls", "shelf", "grasp", "pan", "peg"]
        );
        assert_eq!(tasks[0].steps_per_tick(), 10);
    }

    #[test]
    fn a_wrong_box_name_is_named() {
        let text = include_str!("../../balls/task.toml").replace("goal = \"box_b\"", "goal = \"box_c\"");
        let error = Task::parse("x.toml", &text).expect_err("box_c does not exist");
        assert!(error.to_string().contains("rules.goal = \"box_c\" is no region; regions: box_a, box_b"));
    }

    #[test]
    fn the_hash_is_of_the_content() {
        let text = include_str!("../../balls/task.toml");
        let hash = |text: &str| Task::parse("x.toml", text).expect("valid").content_hash().to_owned();
        assert_eq!(hash(text), hash(&format!("# A comment.\n{text}")));
        assert_ne!(hash(text), hash(&text.replace("mass = 0.216", "mass = 0.217")));
    }

    #[test]
    fn what_is_wrong_with_a_task_is_named() {
        let shelf = include_str!("../../shelf/task.toml");
        let grasp = include_str!("../../grasp/task.toml");
        let balls = include_str!("../../balls/task.toml");
        let cases = [
            (shelf.replace("\"011_banana\"", "\"011_bananas\""), "no object `011_bananas`"),
            (shelf.replace("\"011_banana\"", "\"025_mug\""), "names `025_mug` twice"),
            (
                shelf.replace("count = 10", "count = 40"),
                "objects.count = 40, but objects.from and objects.own name 36",
            ),
            (shelf.replace("count = 10", "count = 0"), "1 to 200"),
            (shelf.replace("into = \"shelf\"", "into = \"cupboard\""), "regions: shelf, box"),
            (shelf.replace("name = \"box\"", "name = \"shelf\""), "each needs a name of its own"),
            (shelf.replace("open = \"-y\"", "open = \"down\""), "down"),
            (shelf.replace("settle_s = 3.0", "settle_s = nan"), "rules.settle_s"),
            (
                balls.replace("count = 10", "count = 10\nfrom = [\"025_mug\"]"),
                "either `equal` or a list `from`",
            ),
            (balls.replace("mass = 0.216", "mass = -1.0"), "objects.equal"),
            (balls.replace("layer = 16", "layer = 0"), "layer must be at least 1"),
            (grasp.replace("count = 1", "count = 2"), "need objects.count = 1"),
            (grasp.replace("height = -0.74", "height = nan"), "ground: height"),
            (shelf.replace("[ground]", "[floor]"), "floor"),
            (grasp.replace("hold_s = 2.0", "hold_s = 0.0"), "rules.hold_s = 0"),
            (grasp.replace("slip_m = 0.03", "slip_m = 0.03\ncolour = 1"), "colour"),
            (grasp.replace("max = [0.12, 0.12, 0.4]", "max = [-0.2, 0.12, 0.4]"), "has no size"),
        ];
        for (text, expected) in cases {
            let error = Task::parse("x.toml", &text).expect_err(expected).to_string();
            assert!(error.starts_with("x.toml: ") && error.contains(expected), "{error}, not {expected}");
        }
    }

    #[test]
    fn a_step_that_does_not_divide_the_tick_is_refused() {
        let text = include_str!("../../balls/task.toml").replace("step_s = 0.001", "step_s = 0.003");
        assert!(Task::parse("x.toml", &text).expect_err("3 ms").message.contains("divide tick_s"));
    }
}
