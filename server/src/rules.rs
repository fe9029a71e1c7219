//! What is played here, by which rules, and how far it is: the competition as its organizer set it up.

use crate::auth::{random_hex, sha256_hex};
use crate::config::{Config, Mode};
use crate::store::{NewAuditEntry, Store};
use anyhow::{Context, bail};
use palmares_protocol::{Code, Refusal};
use palmares_tasks::Seed;
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Setting: how far the competition is.
const PHASE: &str = "phase";
/// Setting: SHA-256 of the secret that was published first.
const SECRET_HASH: &str = "seed_secret_sha256";
/// Bytes of the secret.
const SECRET_BYTES: usize = 32;

/// How far an official competition is.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema, strum::EnumString, strum::IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub(crate) enum Phase {
    /// No session can begin.
    Closed,
    /// Sessions can begin.
    Open,
    /// Over for good: the secret behind the seeds is public.
    Revealed,
}

/// The secret that official seeds are made from.
#[derive(Clone)]
pub(crate) struct SeedSecret([u8; SECRET_BYTES]);

impl fmt::Debug for SeedSecret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SeedSecret(…)")
    }
}

impl SeedSecret {
    /// The secret in this file; made, readable by its owner alone, when there is none.
    fn open(path: &Path) -> anyhow::Result<Self> {
        let what = || format!("seed secret {}", path.display());
        match std::fs::read_to_string(path) {
            Ok(text) => {
                let mode = std::fs::metadata(path).with_context(what)?.permissions().mode() & 0o777;
                if mode & 0o077 != 0 {
                    bail!("{}: its mode is {mode:o}, others may read it; do `chmod 600`", what());
                }
                let mut bytes = [0; SECRET_BYTES];
                hex::decode_to_slice(text.trim_end(), &mut bytes)
                    .with_context(|| format!("{}: expected 64 hexadecimal digits", what()))?;
                Ok(SeedSecret(bytes))
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                let text = random_hex(SECRET_BYTES).context("no randomness for the seed secret")?;
                write_secret(path, &text).with_context(what)?;
                Self::open(path)
            }
            Err(error) => Err(error).with_context(what),
        }
    }

    /// What is published before the competition.
    pub(crate) fn sha256(&self) -> String {
        sha256_hex(&self.0)
    }
}

/// Writes a new file that only its owner may read.
pub(crate) fn write_secret(path: &Path, text: &str) -> std::io::Result<()> {
    let mut file = std::fs::OpenOptions::new().write(true).create_new(true).mode(0o600).open(path)?;
    writeln!(file, "{text}")?;
    file.sync_all()
}

/// The rules.
#[derive(Debug)]
pub(crate) struct Rules {
    /// For people.
    pub(crate) name: String,
    /// What is being played.
    pub(crate) mode: Mode,
    /// Length of a session, s.
    pub(crate) session_s: Option<f64>,
    /// Sessions that a team has.
    pub(crate) sessions_per_team: u32,
    /// What a reset takes from a session, s.
    pub(crate) reset_cost_s: f64,
    /// In the official mode.
    secret: Option<SeedSecret>,
    phase: Mutex<Phase>,
}

impl Rules {
    /// The rules of this configuration; what the database knows of an earlier start goes on.
    ///
    /// # Errors
    /// The secret cannot be read, or is not the one whose hash was published.
    pub(crate) async fn open(config: &Config, store: &Store) -> anyhow::Result<Self> {
        let (secret, phase) = match config.mode {
            Mode::Practice => {
                if store.setting(SECRET_HASH).await?.is_some() {
                    bail!("this database belongs to an official competition; start it with its --config");
                }
                (None, Phase::Open)
            }
            Mode::Official => {
                let secret = SeedSecret::open(&config.seed_secret)?;
                match store.setting(SECRET_HASH).await? {
                    Some(published) if published != secret.sha256() => bail!(
                        "seed secret {}: not the one this database was begun with, whose SHA-256 is {published}; put \
                         that file back",
                        config.seed_secret.display()
                    ),
                    Some(_) => {}
                    None => store.set_setting(SECRET_HASH, &secret.sha256()).await?,
                }
                let phase = store.setting(PHASE).await?.and_then(|word| word.parse().ok());
                (Some(secret), phase.unwrap_or(Phase::Closed))
            }
        };
        Ok(Rules {
            name: config.name.clone(),
            mode: config.mode,
            session_s: config.session_s,
            sessions_per_team: config.sessions_per_team,
            reset_cost_s: config.reset_cost_s,
            secret,
            phase: Mutex::new(phase),
        })
    }

    /// Whether runs count.
    pub(crate) fn official(&self) -> bool {
        self.mode == Mode::Official
    }

    /// How far the competition is.
    pub(crate) fn phase(&self) -> Phase {
        *self.phase.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether seeds may be seen by everybody.
    pub(crate) fn revealed(&self) -> bool {
        !self.official() || self.phase() == Phase::Revealed
    }

    /// SHA-256 of the secret.
    pub(crate) fn secret_sha256(&self) -> Option<String> {
        self.secret.as_ref().map(SeedSecret::sha256)
    }

    /// The secret, once it is public.
    pub(crate) fn revealed_secret(&self) -> Option<String> {
        let secret = self.secret.as_ref().filter(|_| self.revealed())?;
        Some(hex::encode(secret.0))
    }

    /// The seed of run `k` of a task, in the official mode.
    pub(crate) fn seed(&self, task: &str, k: u64) -> Option<Seed> {
        self.secret.as_ref().map(|secret| Seed::for_run(&secret.0, task, k))
    }

    /// Moves the competition on.
    ///
    /// # Errors
    /// The step is not possible from here.
    pub(crate) async fn enter(
        &self,
        store: &Store,
        to: Phase,
        entry: &NewAuditEntry<'_>,
    ) -> Result<(), Refusal> {
        let wrong = |message: &str| Err(Refusal::new(Code::WrongState, message));
        if !self.official() {
            return wrong("this is a practice server: it is always open");
        }
        match (self.phase(), to) {
            (Phase::Revealed, _) => return wrong("the secret is public: the competition is over"),
            (Phase::Open, Phase::Open) => return wrong("the competition is open already"),
            (Phase::Closed, Phase::Closed) => return wrong("the competition is closed already"),
            (Phase::Open, Phase::Revealed) => return wrong("close the competition first"),
            _ => {}
        }
        store.enter_phase(PHASE, to.into(), entry).await.map_err(|error| {
            tracing::error!(%error, "store failed");
            Refusal::new(Code::Internal, "the database does not answer; nothing was changed").retry_after(5.0)
        })?;
        *self.phase.lock().unwrap_or_else(PoisonError::into_inner) = to;
        tracing::info!(phase = ?to, "the competition enters another phase");
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secret_is_made_once_kept_to_its_owner_and_never_shown() {
        let folder =
            std::env::temp_dir().join(format!("palmares-rules-{}", random_hex(8).expect("randomness")));
        std::fs::create_dir(&folder).expect("folder");
        let path = folder.join("seed.secret");
        let secret = SeedSecret::open(&path).expect("made");
        assert_eq!(SeedSecret::open(&path).expect("read").0, secret.0);
        assert!(!format!("{secret:?}").contains(&hex::encode(secret.0)));
        let mode = std::fs::metadata(&path).expect("file").permissions().mode() & 0o777;
        assert_eq!(mode, 0o600);
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o644)).expect("chmod");
        let error = SeedSecret::open(&path).expect_err("open to others").to_string();
        assert!(error.contains("chmod 600"), "{error}");
        std::fs::remove_dir_all(&folder).expect("removes");
    }
}
