//! Hands that teams send in: checked, kept under their hash, loaded when they are played with.

use crate::auth::{random_hex, sha256_hex};
use crate::compute::{Background, Level};
use crate::names;
use palmares_tasks::inspect::{self, FigureRow, join_reasons};

use crate::store::{HandRow, NewHand, Store, StoreError};
use crate::transport::Received;
use palmares_models::builtin::builtin_hands;
use palmares_models::hand::Hand;
use palmares_models::hand::describe::HandDescription;
use palmares_models::measure::HandLimits;
use palmares_models::read::{self, Files, Limits, LoadOptions, Loaded, Visual};
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use palmares_tasks::Task;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::Semaphore;

/// Hands that a team may have sent in, replaced ones included.
const PER_TEAM: usize = 32;
/// Hands that are kept ready, all teams together.
const READY: usize = 64;

/// Where the archives lie, and the hands that were loaded.
#[derive(Debug)]
pub(crate) struct OwnHands {
    folder: PathBuf,
    /// How far a hand may go.
    limits: Arc<HandLimits>,
    /// What is played, and what a hand must fit into.
    tasks: Vec<Arc<Task>>,
    ready: Mutex<BTreeMap<String, Arc<Hand>>>,
    /// One check at a time: a check may take seconds and megabytes.
    checking: Semaphore,
}

/// The largest archive, bytes.
pub(crate) fn largest() -> usize {
    usize::try_from(Limits::default().archive_bytes).unwrap_or(usize::MAX)
}

fn failed(what: &str, error: &dyn std::fmt::Display) -> Refusal {
    tracing::error!(%error, "{what}");
    Refusal::new(Code::Internal, format!("{what}; try again")).retry_after(5.0)
}

fn store_failed(error: StoreError) -> Refusal {
    failed("the database does not answer", &error)
}

/// Reads an archive as a hand.
fn read(bytes: &[u8]) -> Result<Loaded, String> {
    let options = LoadOptions::default();
    let files = Files::archive(Path::new("hand.zip"), bytes, &options.limits).map_err(|e| e.to_string())?;
    read::from_files(files, None, &options).map_err(|e| e.to_string())
}

/// Reads an archive as a hand that is within the limits.
fn read_within(bytes: &[u8], limits: &HandLimits) -> Result<Loaded, String> {
    let loaded = read(bytes)?;
    let beyond = inspect::beyond_limits(&loaded.hand, &loaded.sources, limits);
    if beyond.is_empty() { Ok(loaded) } else { Err(join_reasons(&beyond)) }
}

/// Reads an archive as a hand that may be played, and tells what is odd about it, for its team and for who decides:
/// oddities of its files, and its figures beside those of the program's hands.
fn examine(bytes: &[u8], limits: &HandLimits, tasks: &[Arc<Task>]) -> Result<Examined, Refusal> {
    let within = read_within(bytes, limits).map_err(|why| Refusal::new(Code::BadRequest, why));
    let Loaded { hand, sources, warnings } = within?;
    let hand = Arc::new(hand);
    let in_the_way = inspect::in_the_way(&hand, tasks);
    if !in_the_way.is_empty() {
        return Err(Refusal::new(Code::HandInTheWay, join_reasons(&in_the_way)));
    }
    let mut odd: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    let figures = inspect::figures(&hand, &sources, limits);
    let beyond = figures.iter().filter(|row| row.beyond_others);
    odd.extend(beyond.map(|row| format!("beyond the program's hands: {}", row.in_words())));
    Ok(Examined { hand, warnings: odd, figures })
}

/// A hand that may be played, and what is to be told of it.
struct Examined {
    hand: Arc<Hand>,
    warnings: Vec<String>,
    figures: Vec<FigureRow>,
}

/// What a team is told of a hand that it sent in.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "SubmittedHand")]
pub(crate) struct Submitted {
    /// The hand as it is kept.
    #[serde(flatten)]
    pub(crate) row: HandRow,
    /// Beside the hands of the program and the limits.
    pub(crate) figures: Vec<FigureRow>,
}

/// What an organizer looks at before deciding.
#[derive(Debug)]
pub(crate) struct Inspection {
    /// Beside the hands of the program and the limits.
    pub(crate) figures: Vec<FigureRow>,
    /// What the hand would touch where it starts; with the tasks of this server.
    pub(crate) in_the_way: Vec<String>,
    /// The hand in full.
    pub(crate) description: HandDescription,
}

/// Whether a team may play a hand: in official sessions an approved one; a rejected one never.
fn usable(row: &HandRow, official: bool) -> bool {
    match row.status.as_str() {
        "approved" => true,
        "pending" => !official,
        _ => false,
    }
}

impl OwnHands {
    /// Hands in this data directory.
    pub(crate) fn new(data_dir: &Path, limits: HandLimits, tasks: Vec<Arc<Task>>) -> Self {
        let folder = data_dir.join("hands");
        let (ready, checking) = (Mutex::default(), Semaphore::new(1));
        OwnHands { folder, limits: Arc::new(limits), tasks, ready, checking }
    }

    fn path(&self, sha256: &str) -> PathBuf {
        self.folder.join(format!("{sha256}.zip"))
    }

    /// Checks and keeps a hand; it waits for approval.
    pub(crate) async fn submit(
        &self,
        store: &Store,
        background: &Background,
        team: &str,
        received: Received,
    ) -> Result<Submitted, Refusal> {
        let _turn = self.checking.try_acquire().map_err(|_| {
            Refusal::new(Code::Capacity, "another hand is being checked; try again").retry_after(2.0)
        })?;
        let had = store.hands(Some(team)).await.map_err(store_failed)?;
        if had.len() >= PER_TEAM {
            let message = format!("team {} has sent in {PER_TEAM} hands; no more are taken", shortened(team));
            return Err(Refusal::new(Code::Capacity, message));
        }
        let received = Arc::new(received);
        let checked = {
            let (received, limits, tasks) = (received.clone(), self.limits.clone(), self.tasks.clone());
            background.run(Level::Awaited, move || examine(&received.bytes, &limits, &tasks)).await
        };
        let bytes = &received.bytes;
        let Examined { hand, warnings, figures } =
            checked.map_err(|error| failed("the hand could not be checked", &error))??;
        names::hand(&hand.name).map_err(|error| error.of("name in hand.toml"))?;
        if let Some(known) = names::like(&hand.name, builtin_hands().iter().map(|known| known.name.as_str()))
        {
            let message = format!(
                "name in hand.toml: `{}` looks like `{known}`, which comes with the program; choose another",
                hand.name
            );
            return Err(Refusal::new(Code::BadRequest, message));
        }
        let sha256 = sha256_hex(bytes);
        if let Some(row) = had.into_iter().find(|row| row.sha256 == sha256) {
            // The same again changes nothing.
            return Ok(Submitted { row, figures });
        }
        self.keep(&sha256, bytes).map_err(|error| failed("the hand could not be stored", &error))?;
        let hand_id = random_hex(8).map_err(|error| failed("no randomness", &error))?;
        let hand_id = format!("hand_{hand_id}");
        let warnings_json = serde_json::to_string(&warnings).unwrap_or_else(|_| "[]".into());
        let row = NewHand {
            hand_id: &hand_id,
            team,
            name: &hand.name,
            sha256: &sha256,
            bytes: bytes.len() as u64,
            warnings: &warnings_json,
        };
        store.add_hand(&row).await.map_err(store_failed)?;
        let row = store.hand(&hand_id).await.map_err(store_failed)?;
        let row = row.ok_or_else(|| failed("the hand could not be stored", &"it is not there"))?;
        tracing::info!(team, hand = row.name, hand_id, bytes = bytes.len(), "hand sent in");
        Ok(Submitted { row, figures })
    }

    /// The archive on the disk, whole or not at all.
    fn keep(&self, sha256: &str, bytes: &[u8]) -> std::io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let (path, draft) = (self.path(sha256), self.folder.join(format!("{sha256}.draft")));
        let mut file = File::create(&draft)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&draft, &path)
    }

    /// A team's own hand of that name, and the SHA-256 of its archive: the newest one, in official sessions the newest
    /// approved one. Rejected hands are nobody's.
    pub(crate) async fn find(
        &self,
        store: &Store,
        background: &Background,
        team: &str,
        name: &str,
        official: bool,
    ) -> Result<Option<(Arc<Hand>, String)>, Refusal> {
        let rows = store.hands(Some(team)).await.map_err(store_failed)?;
        let newest = rows.into_iter().rev().find(|row| row.name == name && usable(row, official));
        match newest {
            Some(row) => Ok(Some((self.load(background, &row).await?, row.sha256))),
            None => Ok(None),
        }
    }

    /// All that [`OwnHands::find`] finds for a team, by name. One that cannot be loaded is left out.
    pub(crate) async fn all(
        &self,
        store: &Store,
        background: &Background,
        team: &str,
        official: bool,
    ) -> Result<Vec<Arc<Hand>>, Refusal> {
        let rows = store.hands(Some(team)).await.map_err(store_failed)?;
        // The oldest first: the newest of a name stays.
        let by_name: BTreeMap<&str, &HandRow> =
            rows.iter().filter(|row| usable(row, official)).map(|row| (row.name.as_str(), row)).collect();
        let mut hands = Vec::new();
        for row in by_name.into_values() {
            hands.extend(self.load(background, row).await.ok());
        }
        Ok(hands)
    }

    async fn load(&self, background: &Background, row: &HandRow) -> Result<Arc<Hand>, Refusal> {
        if let Some(hand) = self.ready().get(&row.sha256) {
            return Ok(hand.clone());
        }
        let (bytes, limits) = (self.stored(row), self.limits.clone());
        let loaded = background.run(Level::Awaited, move || Ok(read_within(&bytes?, &limits)));
        let loaded = loaded.await.map_err(|error| failed("the hand could not be loaded", &error))?;
        let within = loaded.map_err(|error: String| failed("the hand could not be loaded", &error))?;
        // It was within the limits when it was sent in: the organizer has set others since.
        let hand = within.map_err(|why| {
            Refusal::new(Code::UnknownHand, format!("hand `{}` cannot be played any more: {why}", row.name))
        })?;
        let hand = Arc::new(hand.hand);
        let mut ready = self.ready();
        if ready.len() >= READY {
            ready.clear();
        }
        ready.insert(row.sha256.clone(), hand.clone());
        Ok(hand)
    }

    /// What is stored of a hand, if it is what was sent in.
    fn stored(&self, row: &HandRow) -> Result<Vec<u8>, String> {
        let bytes = fs::read(self.path(&row.sha256)).map_err(|error| error.to_string())?;
        if sha256_hex(&bytes) == row.sha256 { Ok(bytes) } else { Err("the file was changed".to_owned()) }
    }

    /// What an organizer looks at before deciding on a hand; also of one that is beyond the limits by now.
    pub(crate) async fn inspect(
        &self,
        background: &Background,
        row: &HandRow,
    ) -> Result<Inspection, Refusal> {
        let (bytes, limits, tasks) = (self.stored(row), self.limits.clone(), self.tasks.clone());
        let inspected = background.run(Level::Awaited, move || {
            let Loaded { hand, sources, .. } = read(&bytes?)?;
            let hand = Arc::new(hand);
            let figures = inspect::figures(&hand, &sources, &limits);
            let (in_the_way, description) = (inspect::in_the_way(&hand, &tasks), hand.describe());
            Ok(Inspection { figures, in_the_way, description })
        });
        inspected
            .await
            .map_err(|error| failed("the hand could not be looked at", &error))?
            .map_err(|error: String| failed("the hand could not be looked at", &error))
    }

    /// How the links of a team's own hand look, of the one that [`OwnHands::find`] finds; nothing of no such hand.
    pub(crate) async fn visuals(
        &self,
        store: &Store,
        background: &Background,
        team: &str,
        name: &str,
    ) -> Result<Vec<Visual>, Refusal> {
        let Some((_, sha256)) = self.find(store, background, team, name, false).await? else {
            return Ok(Vec::new());
        };
        let path = self.path(&sha256);
        let seen = background.run(Level::Awaited, move || {
            let options = LoadOptions::default();
            let bytes = fs::read(path).map_err(|error| error.to_string())?;
            let files = Files::archive(Path::new("hand.zip"), &bytes, &options.limits);
            files.and_then(|files| read::visuals(files, &options)).map_err(|error| error.to_string())
        });
        seen.await
            .map_err(|error| failed("the hand could not be looked at", &error))?
            .map_err(|error: String| failed("the hand could not be looked at", &error))
    }

    /// The archive of a hand, for what must stand on its own.
    pub(crate) fn archive(&self, sha256: &str) -> std::io::Result<Vec<u8>> {
        fs::read(self.path(sha256))
    }

    fn ready(&self) -> std::sync::MutexGuard<'_, BTreeMap<String, Arc<Hand>>> {
        self.ready.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
