//! Hands that teams upload: checked, stored by their hash, loaded when they are played.

use palmares_models::builtin::builtin_hands;
use palmares_models::hand::Hand;
use palmares_models::hand::describe::HandDescription;
use palmares_models::measure::HandLimits;
use palmares_models::read::{self, Files, Limits, LoadOptions, Loaded, Visual};
use palmares_net::auth::{random_hex, sha256_hex};
use palmares_net::transport::Received;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use palmares_store::files::blocking::{assert_may_block, blocking};
use palmares_store::files::objects::{Objects, hand_key, write_whole};
use palmares_store::files::stored_path::{self, HANDS, checked};
use palmares_store::names;
use palmares_store::{HandRow, NewHand, Store, StoreError};
use palmares_tasks::Task;
use palmares_tasks::inspect::{self, FigureRow, join_reasons};
use palmares_worlds::compute::{Background, JobPriority};
use parking_lot::Mutex;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio::sync::Semaphore;

/// Most hands that a team may upload, replaced ones included.
const MAX_PER_TEAM: usize = 32;
/// Most hands in memory, of all teams.
const MAX_LOADED: usize = 64;

/// The archives of uploaded hands, and the hands that are loaded.
#[derive(Debug)]
pub(crate) struct OwnHands {
    archives: Archives,
    /// Limits on hands.
    limits: Arc<HandLimits>,
    /// The tasks that a hand must fit into.
    tasks: Vec<Arc<Task>>,
    loaded: Mutex<BTreeMap<String, Arc<Hand>>>,
    /// One check at a time, since a check may take seconds and much memory.
    checking: Semaphore,
}

/// Size of the largest archive, bytes.
pub(crate) fn max_archive_bytes() -> usize {
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

/// Reads an archive as a hand that may be played, with warnings for its team and the organizers: on its files, and on figures beyond
/// those of the built-in hands.
fn examine(bytes: &[u8], limits: &HandLimits, tasks: &[Arc<Task>]) -> Result<Examined, Refusal> {
    assert_may_block();
    let within = read_within(bytes, limits).map_err(|why| Refusal::new(Code::BadRequest, why));
    let Loaded { hand, sources, warnings } = within?;
    let hand = Arc::new(hand);
    let in_the_way = inspect::in_the_way(&hand, tasks);
    if !in_the_way.is_empty() {
        return Err(Refusal::new(Code::HandInTheWay, join_reasons(&in_the_way)));
    }
    let mut warnings_of_check: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    let figures = inspect::figures(&hand, &sources, limits);
    let beyond = figures.iter().filter(|row| row.beyond_others);
    warnings_of_check.extend(beyond.map(|row| format!("beyond the program's hands: {}", row.in_words())));
    Ok(Examined { hand, sha256: sha256_hex(bytes), warnings: warnings_of_check, figures })
}

/// Checks an archive as an upload.
pub(crate) fn check(bytes: &[u8], limits: &HandLimits, tasks: &[Arc<Task>]) -> Result<(), Refusal> {
    examine(bytes, limits, tasks).map(drop)
}

/// A hand that may be played, and the results of its check.
struct Examined {
    hand: Arc<Hand>,
    /// SHA-256 of its archive.
    sha256: String,
    warnings: Vec<String>,
    figures: Vec<FigureRow>,
}

/// The answer to an upload.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "SubmittedHand")]
pub(crate) struct Submitted {
    /// The hand as stored.
    #[serde(flatten)]
    pub(crate) row: HandRow,
    /// Its figures, with those of the built-in hands and the limits.
    pub(crate) figures: Vec<FigureRow>,
}

/// A hand for the organizer's decision.
#[derive(Debug)]
pub(crate) struct Inspection {
    /// Its figures, with those of the built-in hands and the limits.
    pub(crate) figures: Vec<FigureRow>,
    /// Overlaps of the hand where it starts, in the tasks of this server.
    pub(crate) in_the_way: Vec<String>,
    /// Its full description.
    pub(crate) description: HandDescription,
}

/// The files of uploaded hands: in the data directory, and in the storage that servers share.
#[derive(Clone, Debug)]
struct Archives {
    data_dir: PathBuf,
    objects: Option<Arc<Objects>>,
}

impl Archives {
    /// The path of an archive, from the SHA-256 stored with its hand.
    fn path(&self, sha256: &str) -> io::Result<PathBuf> {
        checked(HANDS, &stored_path::hand(sha256)).map(|stored| self.data_dir.join(stored))
    }

    /// Reads an archive, and checks that it is the uploaded one. One of the shared storage is then kept here.
    fn read(&self, sha256: &str) -> Result<Vec<u8>, String> {
        let here = self.read_here(sha256);
        let Some(objects) = self.objects.as_ref().filter(|_| here.is_err()) else { return here };
        match objects.get(&hand_key(sha256)).map_err(|error| error.to_string())? {
            Some(bytes) if sha256_hex(&bytes) == sha256 => {
                if let Err(error) = self.path(sha256).and_then(|path| write_whole(&path, &bytes)) {
                    tracing::warn!(%error, sha256, "a hand of the shared storage is not kept here");
                }
                Ok(bytes)
            }
            _ => here,
        }
    }

    /// Reads an archive of the data directory.
    fn read_here(&self, sha256: &str) -> Result<Vec<u8>, String> {
        assert_may_block();
        let bytes = self.path(sha256).and_then(fs::read).map_err(|error| error.to_string())?;
        if sha256_hex(&bytes) == sha256 { Ok(bytes) } else { Err("the file was changed".to_owned()) }
    }
}

/// Whether a team may play a hand: in official sessions only an approved one, a rejected one never.
fn usable(row: &HandRow, official: bool) -> bool {
    match row.status.as_str() {
        "approved" => true,
        "pending" => !official,
        _ => false,
    }
}

impl OwnHands {
    /// The uploaded hands in a data directory.
    pub(crate) fn new(
        data_dir: &Path,
        limits: HandLimits,
        tasks: Vec<Arc<Task>>,
        objects: Option<Arc<Objects>>,
    ) -> Self {
        let archives = Archives { data_dir: data_dir.to_owned(), objects };
        let (loaded, checking) = (Mutex::default(), Semaphore::new(1));
        OwnHands { archives, limits: Arc::new(limits), tasks, loaded, checking }
    }

    /// Checks and stores a hand; it waits for approval.
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
        let uploaded = store.hands(Some(team)).await.map_err(store_failed)?;
        if uploaded.len() >= MAX_PER_TEAM {
            let message = format!("team {} has uploaded {MAX_PER_TEAM} hands, the maximum", shortened(team));
            return Err(Refusal::new(Code::Capacity, message));
        }
        let received = Arc::new(received);
        let checked = {
            let (received, limits, tasks) = (received.clone(), self.limits.clone(), self.tasks.clone());
            background.run(JobPriority::Awaited, move || examine(&received.bytes, &limits, &tasks)).await
        };
        let Examined { hand, sha256, warnings, figures } =
            checked.map_err(|error| failed("the hand could not be checked", &error))??;
        names::hand(&hand.name).map_err(|error| error.of("name in hand.toml"))?;
        if let Some(known) = names::like(&hand.name, builtin_hands().iter().map(|known| known.name.as_str()))
        {
            let message = format!(
                "name in hand.toml: `{}` looks like `{known}`, which is built in; choose another",
                hand.name
            );
            return Err(Refusal::new(Code::BadRequest, message));
        }
        if let Some(row) = uploaded.into_iter().find(|row| row.sha256 == sha256) {
            // A second upload of the same archive changes nothing.
            return Ok(Submitted { row, figures });
        }
        let bytes = received.bytes.len();
        let written = self.write_archive(&sha256, received).await;
        written.map_err(|error| failed("the hand could not be stored", &error))?;
        let hand_id = random_hex(8).map_err(|error| failed("no randomness", &error))?;
        let hand_id = format!("hand_{hand_id}");
        let warnings_json = serde_json::to_string(&warnings).unwrap_or_else(|_| "[]".into());
        let row = NewHand {
            hand_id: &hand_id,
            team,
            name: &hand.name,
            sha256: &sha256,
            bytes: bytes as u64,
            warnings: &warnings_json,
        };
        store.add_hand(&row).await.map_err(store_failed)?;
        let row = store.hand(&hand_id).await.map_err(store_failed)?;
        let row = row.ok_or_else(|| failed("the hand could not be stored", &"its row is missing"))?;
        tracing::info!(team, hand = row.name, hand_id, bytes, "hand uploaded");
        Ok(Submitted { row, figures })
    }

    /// Writes an archive to the disk, whole or not at all.
    async fn write_archive(&self, sha256: &str, received: Arc<Received>) -> io::Result<()> {
        let path = self.archives.path(sha256)?;
        blocking(move || write_whole(&path, &received.bytes)).await?
    }

    /// A team's uploaded hand of that name, and the SHA-256 of its archive: the newest one, in official sessions the newest approved one.
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

    /// All hands that [`OwnHands::find`] finds for a team, by name. Hands that cannot be loaded are left out.
    pub(crate) async fn all(
        &self,
        store: &Store,
        background: &Background,
        team: &str,
        official: bool,
    ) -> Result<Vec<Arc<Hand>>, Refusal> {
        let rows = store.hands(Some(team)).await.map_err(store_failed)?;
        // Rows are oldest first, so the newest of a name remains.
        let by_name: BTreeMap<&str, &HandRow> =
            rows.iter().filter(|row| usable(row, official)).map(|row| (row.name.as_str(), row)).collect();
        let mut hands = Vec::new();
        for row in by_name.into_values() {
            hands.extend(self.load(background, row).await.ok());
        }
        Ok(hands)
    }

    async fn load(&self, background: &Background, row: &HandRow) -> Result<Arc<Hand>, Refusal> {
        if let Some(hand) = self.loaded.lock().get(&row.sha256) {
            return Ok(hand.clone());
        }
        let (archives, sha256, limits) = (self.archives.clone(), row.sha256.clone(), self.limits.clone());
        let read = move || Ok(read_within(&archives.read(&sha256)?, &limits));
        let loaded = background.run(JobPriority::Awaited, read);
        let loaded = loaded.await.map_err(|error| failed("the hand could not be loaded", &error))?;
        let within = loaded.map_err(|error: String| failed("the hand could not be loaded", &error))?;
        // The organizer may have changed the limits since the upload.
        let hand = within.map_err(|why| {
            Refusal::new(Code::UnknownHand, format!("hand `{}` cannot be played any more: {why}", row.name))
        })?;
        let hand = Arc::new(hand.hand);
        let mut loaded_hands = self.loaded.lock();
        if loaded_hands.len() >= MAX_LOADED {
            loaded_hands.clear();
        }
        loaded_hands.insert(row.sha256.clone(), hand.clone());
        Ok(hand)
    }

    /// A hand for the organizer's decision, even if it is beyond the current limits.
    pub(crate) async fn inspect(
        &self,
        background: &Background,
        row: &HandRow,
    ) -> Result<Inspection, Refusal> {
        let (archives, sha256) = (self.archives.clone(), row.sha256.clone());
        let (limits, tasks) = (self.limits.clone(), self.tasks.clone());
        let inspected = background.run(JobPriority::Awaited, move || {
            let Loaded { hand, sources, .. } = read(&archives.read(&sha256)?)?;
            let hand = Arc::new(hand);
            let figures = inspect::figures(&hand, &sources, &limits);
            let (in_the_way, description) = (inspect::in_the_way(&hand, &tasks), hand.describe());
            Ok(Inspection { figures, in_the_way, description })
        });
        inspected
            .await
            .map_err(|error| failed("the hand could not be read", &error))?
            .map_err(|error: String| failed("the hand could not be read", &error))
    }

    /// The visual shapes of the hand that [`OwnHands::find`] finds; empty without such a hand.
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
        let archives = self.archives.clone();
        let visuals = background.run(JobPriority::Awaited, move || {
            let options = LoadOptions::default();
            let bytes = archives.read(&sha256)?;
            let files = Files::archive(Path::new("hand.zip"), &bytes, &options.limits);
            files.and_then(|files| read::visuals(files, &options)).map_err(|error| error.to_string())
        });
        visuals
            .await
            .map_err(|error| failed("the hand could not be read", &error))?
            .map_err(|error: String| failed("the hand could not be read", &error))
    }

    /// The archive of a hand, for a replay or a download.
    pub(crate) async fn archive(&self, sha256: &str) -> io::Result<Vec<u8>> {
        let (archives, sha256) = (self.archives.clone(), sha256.to_owned());
        blocking(move || archives.read(&sha256).map_err(io::Error::other)).await?
    }

    /// The archive of a hand in the data directory, for an upload.
    pub(crate) async fn local_archive(&self, sha256: &str) -> io::Result<Vec<u8>> {
        let (archives, sha256) = (self.archives.clone(), sha256.to_owned());
        blocking(move || archives.read_here(&sha256).map_err(io::Error::other)).await?
    }
}
