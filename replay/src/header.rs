//! The header of a replay: identity of the run, and everything that its bits depend on.

use crate::format::RUN_RECORD;
use crate::lower_hex::from_hex;
use crate::verify_error::VerifyError;
use palmares_models::hand::Hand;
use palmares_tasks::identity;
use palmares_tasks::{HandDraw, Noise, Seed, Sensing, Task};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Version of the format.
const FORMAT: u32 = 1;

/// The mode of the competition that a run belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CompetitionMode {
    /// A run of a practice session.
    Practice,
    /// A run of an official session.
    Official,
}

/// Pace of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pacing {
    /// The world waits for every step.
    Lockstep,
    /// The world ticks at wall-clock rate.
    Realtime,
}

/// Identity of a run, and everything that its bits depend on.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Identifies the run.
    pub run_id: String,
    /// Name on the leaderboard.
    pub team: String,
    /// Practice or official.
    pub mode: CompetitionMode,
    /// Pace of the world.
    pub pacing: Pacing,
    /// Part of the state that the observations had.
    pub sensing: Sensing,
    /// The errors of the sensors.
    pub noise: Noise,
    /// Name of the task.
    pub task: String,
    /// [`Task::content_hash`]
    pub task_hash: String,
    /// Length of a tick, s.
    pub tick_s: f64,
    /// Name of the hand.
    pub hand: String,
    /// [`Hand::content_hash`]
    pub hand_hash: String,
    /// Whether the hand's files are attached; otherwise the hand is built in.
    pub hand_attached: bool,
    /// [`Hand::uncertain_hash`], if the hand's numbers were drawn by the seed.
    pub hand_drawn: Option<String>,
    /// [`identity::physics_hash`]
    pub physics_hash: String,
    /// [`identity::engine`]
    pub engine: String,
    /// Version of the server.
    pub server_version: String,
    /// Commit the server was built from.
    pub build_hash: String,
    /// Determines the scene.
    pub seed: Seed,
    /// The number of the seed, in practice.
    pub seed_number: Option<u64>,
    /// Number of the run among the team's runs of the task, in official sessions.
    pub k: Option<u64>,
    /// Start, ms since 1970 UTC.
    pub started_unix_ms: u64,
}

impl Header {
    /// The header of a practice run in lockstep that starts at `started_unix_ms`; the caller changes the fields that
    /// differ.
    pub fn new(run_id: &str, team: &str, task: &Task, hand: &Hand, seed: Seed, started_unix_ms: u64) -> Self {
        Header {
            run_id: run_id.into(),
            team: team.into(),
            mode: CompetitionMode::Practice,
            pacing: Pacing::Lockstep,
            sensing: Sensing::Truth,
            noise: Noise::None,
            task: task.name.clone(),
            task_hash: task.content_hash().to_owned(),
            tick_s: task.tick_s,
            hand: hand.name.clone(),
            hand_hash: hand.content_hash(),
            hand_attached: false,
            hand_drawn: None,
            physics_hash: identity::physics_hash(task),
            engine: identity::engine(),
            server_version: env!("CARGO_PKG_VERSION").into(),
            build_hash: "unknown".into(),
            seed,
            seed_number: None,
            k: None,
            started_unix_ms,
        }
    }

    /// The hand of the run: `hand`, the one with [`Header::hand_hash`], or that with the numbers that the seed draws.
    ///
    /// # Errors
    /// It has other ranges than the recorded hand.
    pub fn hand_of_run(&self, hand: Arc<Hand>) -> Result<Arc<Hand>, VerifyError> {
        let Some(ranges) = &self.hand_drawn else { return Ok(hand) };
        if *ranges != hand.uncertain_hash() {
            let message = format!("the hand `{}` has other ranges in [uncertain] here", self.hand);
            return Err(VerifyError::OtherHand(message));
        }
        HandDraw::All.apply(&hand, self.seed).map_err(VerifyError::OtherHand)
    }

    /// The fields of the metadata record: words, and decimal numbers.
    pub(crate) fn to_map(&self) -> BTreeMap<String, String> {
        let mut map = BTreeMap::new();
        let mut put = |key: &str, value: String| map.insert(key.to_owned(), value);
        put("format", FORMAT.to_string());
        put("run_id", self.run_id.clone());
        put("team", self.team.clone());
        put("kind", word(&self.mode));
        put("pacing", word(&self.pacing));
        put("sensing", word(&self.sensing));
        put("noise", word(&self.noise));
        put("task", self.task.clone());
        put("task_hash", self.task_hash.clone());
        put("tick_s", self.tick_s.to_string());
        put("hand", self.hand.clone());
        put("hand_hash", self.hand_hash.clone());
        put("hand_attached", self.hand_attached.to_string());
        put("physics_hash", self.physics_hash.clone());
        put("engine", self.engine.clone());
        put("server_version", self.server_version.clone());
        put("build_hash", self.build_hash.clone());
        put("seed_hex", self.seed.to_hex());
        put("started_unix_ms", self.started_unix_ms.to_string());
        if let Some(ranges) = &self.hand_drawn {
            put("hand_drawn", ranges.clone());
        }
        if let Some(number) = self.seed_number {
            put("seed", number.to_string());
        }
        if let Some(k) = self.k {
            put("k", k.to_string());
        }
        map
    }

    /// The header as a JSON object of the metadata record's fields, for a process that continues the run.
    pub fn to_json(&self) -> String {
        serde_json::to_value(self.to_map()).unwrap_or_default().to_string()
    }

    /// Reads a header that [`Header::to_json`] wrote.
    ///
    /// # Errors
    /// It is another text, or has another format.
    pub fn from_json(text: &str) -> Result<Self, VerifyError> {
        let map = serde_json::from_str(text).map_err(|error| {
            VerifyError::NotAReplay(format!("the header is no JSON object of strings: {error}"))
        })?;
        Header::from_map(&map)
    }

    /// Reads the metadata record.
    pub(crate) fn from_map(map: &BTreeMap<String, String>) -> Result<Self, VerifyError> {
        let fields = Fields(map);
        let format: u32 = fields.number("format")?;
        if format != FORMAT {
            return Err(VerifyError::NotAReplay(format!(
                "its format is {format}; this program reads format {FORMAT}"
            )));
        }
        let seed = from_hex::<32>(fields.text("seed_hex")?).ok_or_else(|| wrong("seed_hex"))?;
        let tick_s: f64 = fields.number("tick_s")?;
        if !(1e-4..=1.0).contains(&tick_s) {
            return Err(wrong("tick_s"));
        }
        Ok(Header {
            run_id: fields.text("run_id")?.into(),
            team: fields.text("team")?.into(),
            mode: fields.word("kind")?,
            pacing: fields.word("pacing")?,
            sensing: fields.word("sensing")?,
            noise: fields.word("noise")?,
            task: fields.text("task")?.into(),
            task_hash: fields.text("task_hash")?.into(),
            tick_s,
            hand: fields.text("hand")?.into(),
            hand_hash: fields.text("hand_hash")?.into(),
            hand_attached: fields.number("hand_attached")?,
            hand_drawn: fields.optional("hand_drawn")?,
            physics_hash: fields.text("physics_hash")?.into(),
            engine: fields.text("engine")?.into(),
            server_version: fields.text("server_version")?.into(),
            build_hash: fields.text("build_hash")?.into(),
            seed: Seed(seed),
            seed_number: fields.optional("seed")?,
            k: fields.optional("k")?,
            started_unix_ms: fields.number("started_unix_ms")?,
        })
    }
}

fn wrong(field: &str) -> VerifyError {
    VerifyError::NotAReplay(format!("{RUN_RECORD}: `{field}` is missing or unreadable"))
}

/// The word that serde writes for a variant without fields.
pub fn word<T: Serialize>(value: &T) -> String {
    let value = serde_json::to_value(value).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}

struct Fields<'a>(&'a BTreeMap<String, String>);

impl Fields<'_> {
    fn text(&self, field: &str) -> Result<&str, VerifyError> {
        self.0.get(field).map(String::as_str).ok_or_else(|| wrong(field))
    }
    fn number<T: std::str::FromStr>(&self, field: &str) -> Result<T, VerifyError> {
        self.text(field)?.parse().map_err(|_| wrong(field))
    }
    fn optional<T: std::str::FromStr>(&self, field: &str) -> Result<Option<T>, VerifyError> {
        if self.0.contains_key(field) { self.number(field).map(Some) } else { Ok(None) }
    }
    fn word<T: DeserializeOwned>(&self, field: &str) -> Result<T, VerifyError> {
        serde_json::from_value(Value::String(self.text(field)?.into())).map_err(|_| wrong(field))
    }
}
