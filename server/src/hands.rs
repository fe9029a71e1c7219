//! Hands that teams send in: checked, kept under their hash, loaded when they are played with.

use crate::auth::{random_hex, sha256_hex};
use crate::net::Received;
use crate::protocol::request::shortened;
use crate::protocol::{Code, Refusal};
use crate::session::{Background, Level};
use crate::store::{HandRow, NewHand, Store, StoreError};
use palmares_models::builtin::builtin_hands;
use palmares_models::files::Files;
use palmares_models::hand::Hand;
use palmares_models::limits::Limits;
use palmares_models::load::{self, LoadOptions};
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

fn store_failed(error: &StoreError) -> Refusal {
    failed("the database does not answer", error)
}

/// Reads an archive as a hand.
fn read(bytes: &[u8]) -> Result<(Hand, Vec<String>), String> {
    let options = LoadOptions::default();
    let files = Files::archive(Path::new("hand.zip"), bytes, &options.limits).map_err(|e| e.to_string())?;
    let loaded = load::from_files(files, None, &options).map_err(|e| e.to_string())?;
    Ok((loaded.hand, loaded.warnings.iter().map(ToString::to_string).collect()))
}

/// Whether a team may play a hand: in official sessions an approved one; a rejected one never.
fn usable(row: &HandRow, official: bool) -> bool {
    match row.status.as_str() {
        "approved" => true,
        "pending" => !official,
        _ => false,
    }
}

/// A name that looks the same in a message, a file and an address.
fn plain(name: &str) -> bool {
    (1..=64).contains(&name.len())
        && name.bytes().all(|b| b.is_ascii_alphanumeric() || b"_-.".contains(&b))
        && !name.starts_with('.')
}

impl OwnHands {
    /// Hands in this data directory.
    pub(crate) fn new(data_dir: &Path) -> Self {
        OwnHands { folder: data_dir.join("hands"), ready: Mutex::default(), checking: Semaphore::new(1) }
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
    ) -> Result<HandRow, Refusal> {
        let _turn = self.checking.try_acquire().map_err(|_| {
            Refusal::new(Code::Capacity, "another hand is being checked; try again").retry_after(2.0)
        })?;
        let had = store.hands(Some(team)).await.map_err(|error| store_failed(&error))?;
        if had.len() >= PER_TEAM {
            let message = format!("team {} has sent in {PER_TEAM} hands; no more are taken", shortened(team));
            return Err(Refusal::new(Code::Capacity, message));
        }
        let received = Arc::new(received);
        let checked = {
            let received = received.clone();
            background.run(Level::Awaited, move || read(&received.bytes)).await
        };
        let bytes = &received.bytes;
        let (hand, warnings) = checked
            .map_err(|error| failed("the hand could not be checked", &error))?
            .map_err(|problem| Refusal::new(Code::BadRequest, problem))?;
        if !plain(&hand.name) {
            let message =
                "name in hand.toml: expected 1 to 64 letters, digits, `_`, `-` or `.`, the first no dot";
            return Err(Refusal::new(Code::BadRequest, message));
        }
        if builtin_hands().iter().any(|known| known.name == hand.name) {
            let message = format!("a hand `{}` comes with the program; choose another name", hand.name);
            return Err(Refusal::new(Code::BadRequest, message));
        }
        let sha256 = sha256_hex(bytes);
        if let Some(row) = had.into_iter().find(|row| row.sha256 == sha256) {
            // The same again changes nothing.
            return Ok(row);
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
        store.add_hand(&row).await.map_err(|error| store_failed(&error))?;
        let row = store.hand(&hand_id).await.map_err(|error| store_failed(&error))?;
        let row = row.ok_or_else(|| failed("the hand could not be stored", &"it is not there"))?;
        tracing::info!(team, hand = row.name, hand_id, bytes = bytes.len(), "hand sent in");
        Ok(row)
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
        let rows = store.hands(Some(team)).await.map_err(|error| store_failed(&error))?;
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
        let rows = store.hands(Some(team)).await.map_err(|error| store_failed(&error))?;
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
        let (path, expected) = (self.path(&row.sha256), row.sha256.clone());
        let loaded = background.run(Level::Awaited, move || {
            let bytes = fs::read(&path).map_err(|error| error.to_string())?;
            if sha256_hex(&bytes) != expected {
                return Err("the file was changed".to_owned());
            }
            read(&bytes)
        });
        let (hand, _) = loaded
            .await
            .map_err(|error| failed("the hand could not be loaded", &error))?
            .map_err(|error| failed("the hand could not be loaded", &error))?;
        let hand = Arc::new(hand);
        let mut ready = self.ready();
        if ready.len() >= READY {
            ready.clear();
        }
        ready.insert(row.sha256.clone(), hand.clone());
        Ok(hand)
    }

    /// The archive of a hand, for what must stand on its own.
    pub(crate) fn archive(&self, sha256: &str) -> std::io::Result<Vec<u8>> {
        fs::read(self.path(sha256))
    }

    fn ready(&self) -> std::sync::MutexGuard<'_, BTreeMap<String, Arc<Hand>>> {
        self.ready.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_elsewhere_are_refused() {
        for name in ["claw", "Claw-2.1", "a_b"] {
            assert!(plain(name), "{name}");
        }
        for name in ["", ".", "..", ".hidden", "a/b", "a\\b", "a b", "é", &"x".repeat(65)] {
            assert!(!plain(name), "{name}");
        }
    }
}
