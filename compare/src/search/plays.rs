//! Single plays of a search, kept in a file from which a stopped search goes on.

use crate::child::{Failure, Task};
use crate::engine::{EngineKind, NotPlayed};
use crate::played::Played;
use crate::scene_id::{self, Asked};
use crate::trials::family::{Family, HandKind, Trial};
use crate::trials::play::{Ending, Fate};
use anyhow::{Context, Result};
use palmares_bench::cases;
use palmares_bench::run_log::RunLog;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The name under which the drawn grasps of the SoftHand are a scene of a search.
pub(super) const GRASPS: &str = "grasps";

/// A scene of a search, and how it can be played.
pub(super) struct SearchScene {
    /// Name of a case, or [`GRASPS`].
    pub name: String,
    /// Starts of the case, or drawn grasps.
    plays: Vec<Task>,
    identity: String,
    /// Engines whose adapters do not play it, and why.
    pub refused: BTreeMap<&'static str, NotPlayed>,
}

impl SearchScene {
    /// A case from its first starts, or so many grasps of each drawn family.
    ///
    /// # Errors
    /// There is no such case.
    pub(super) fn new(name: &str, starts: u32, grasps: usize) -> Result<Self> {
        let name = name.to_owned();
        if name == GRASPS {
            let mut hash = Vec::new();
            let mut plays = Vec::new();
            for family in Family::DRAWN {
                for (index, trial) in Trial::of(HandKind::SoftHand, family, grasps)?.iter().enumerate() {
                    let [hand, family] = [HandKind::SoftHand.name(), family.name()].map(str::to_owned);
                    plays.push(Task::Grasp { hand, family, index, aside_um: 0.0 });
                    hash.push(scene_id::of_trial(trial)?);
                }
            }
            let (identity, refused) = (scene_id::of_all(&hash), BTreeMap::new());
            return Ok(SearchScene { name, plays, identity, refused });
        }
        let case = cases::all()
            .find(|case| case.name == name)
            .with_context(|| format!("there is no case `{name}`"))?;
        let play = |start| Task::Case { name: name.clone(), reference_dt_s: None, start };
        let Asked { identity, refused, .. } = scene_id::of_case(case);
        Ok(SearchScene { plays: (0..starts).map(play).collect(), identity, refused, name })
    }

    /// Number of plays at one step.
    pub(super) fn plays(&self) -> usize {
        self.plays.len()
    }
}

/// How a play ended, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum End {
    /// The scene is solved.
    Solved,
    /// It would be, were bodies not too deep in each other.
    Deep,
    /// The object is lost, or a bound is broken.
    Lost,
    /// It did not end in its time.
    Unfinished,
    /// A step failed.
    Failed,
}

/// One play.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Play {
    pub scene: String,
    /// Place among the plays of the scene.
    pub number: usize,
    pub engine: String,
    pub settings: String,
    pub step_ms: f64,
    pub end: End,
    /// Deepest overlap, mm.
    pub overlap_mm: Option<f64>,
}

/// A line of the file: plays are valid for a scene and a version of the engine, whatever the commit.
#[derive(Serialize, Deserialize)]
struct Line {
    identity: String,
    version: String,
    play: Play,
}

type Key = (String, String, String, u64, usize);

fn key(play: &Play) -> Key {
    let Play { scene, engine, settings, step_ms, number, .. } = play;
    (scene.clone(), engine.clone(), settings.clone(), (step_ms * 1e6).round() as u64, *number)
}

/// The plays that are known, and the file that they are in.
pub(super) struct Plays {
    lines: BTreeMap<Key, Line>,
    log: RunLog,
}

impl Plays {
    /// Reads the file.
    ///
    /// # Errors
    /// It cannot be made.
    pub(super) fn open(file: &Path) -> Result<Self> {
        let (log, lines) = RunLog::open::<Line>(file)?;
        let lines = lines.into_iter().map(|line| (key(&line.play), line)).collect();
        Ok(Plays { lines, log })
    }

    pub(super) fn get(&self, wanted: &Wanted) -> Option<Play> {
        let line = self.lines.get(&wanted.key())?;
        let same = line.identity == wanted.scene.identity && line.version == wanted.version;
        same.then(|| line.play.clone())
    }

    pub(super) fn add(&mut self, wanted: &Wanted, play: Play) -> Result<()> {
        let (identity, version) = (wanted.scene.identity.clone(), wanted.version.to_owned());
        let line = Line { identity, version, play };
        self.log.add(&line)?;
        self.lines.insert(key(&line.play), line);
        Ok(())
    }
}

/// A play that a search wants.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    pub scene: &'a SearchScene,
    pub number: usize,
    pub kind: EngineKind,
    pub version: &'a str,
    pub step_ms: f64,
    /// CPU time that it has, s.
    pub limit_s: f64,
}

impl Wanted<'_> {
    fn key(&self) -> Key {
        let step = (self.step_ms * 1e6).round() as u64;
        (self.scene.name.clone(), self.kind.name().into(), self.kind.settings().into(), step, self.number)
    }

    /// Plays it.
    ///
    /// # Errors
    /// The engine cannot be started.
    pub(super) fn play(&self) -> Result<Play> {
        let task = self.scene.plays[self.number].clone();
        let (dt_s, limit_s) = (1e-3 * self.step_ms, self.limit_s);
        let failed = |failure: Failure| match failure.unfinished {
            true => (End::Unfinished, None),
            false => (End::Failed, None),
        };
        let (end, overlap_mm) = match &task {
            Task::Case { .. } => {
                task.play::<Played>(self.kind, dt_s, limit_s)?.map_or_else(failed, |it| of_case(&it))
            }
            Task::Grasp { .. } => task.play::<Fate>(self.kind, dt_s, limit_s)?.map_or_else(failed, of_grasp),
        };
        let (engine, settings) = (self.kind.name().to_owned(), self.kind.settings().to_owned());
        let (scene, number, step_ms) = (self.scene.name.clone(), self.number, self.step_ms);
        Ok(Play { scene, number, engine, settings, step_ms, end, overlap_mm })
    }
}

fn of_case(played: &Played) -> (End, Option<f64>) {
    let invariants = &played.invariants;
    let deep = invariants.overlap_of_bound.is_some_and(|part| part > 1.0);
    let end = match &played.trouble {
        None => End::Solved,
        Some(_) if invariants.newton_unconverged.is_some_and(|n| n > 0) => End::Failed,
        Some(_) if deep && invariants.held != Some(false) => End::Deep,
        Some(_) => End::Lost,
    };
    (end, invariants.max_penetration_mm)
}

fn of_grasp(fate: Fate) -> (End, Option<f64>) {
    let end = match fate.ending {
        Ending::Kept => End::Solved,
        Ending::Overlapping => End::Deep,
        Ending::NotLifted | Ending::LostHeld | Ending::LostShaken => End::Lost,
        Ending::NotFinished => End::Unfinished,
        Ending::Diverged => End::Failed,
    };
    (end, matches!(end, End::Solved | End::Deep).then_some(fate.overlap_mm))
}
