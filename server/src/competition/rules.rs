//! The rules of the competition, and its state.

use anyhow::{Context, bail};
use palmares_net::auth::sha256_hex;
use palmares_net::config::{CompetitionMode, Config};
use palmares_protocol::{Code, Refusal};
pub(crate) use palmares_store::CompetitionPhase;
use palmares_store::files::private_files;
use palmares_store::{CompetitionChange, CompetitionState, NewAuditEntry, Store};
use palmares_tasks::{Scenes, Seed};
use parking_lot::Mutex;
use std::fmt;
use std::path::Path;

/// Setting: SHA-256 of the secret, as published at the first start.
const SECRET_HASH: &str = "seed_secret_sha256";
/// Setting: whose scene run k of a task has.
const SCENES: &str = "scenes";
/// Length of the secret, bytes.
const SECRET_BYTES: usize = 32;

/// The secret from which official seeds are derived.
#[derive(Clone)]
pub(crate) struct SeedSecret([u8; SECRET_BYTES]);

impl fmt::Debug for SeedSecret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SeedSecret(…)")
    }
}

impl SeedSecret {
    /// Reads the secret from a file; None if the file is missing.
    fn read(path: &Path) -> anyhow::Result<Option<Self>> {
        let what = || format!("seed secret {}", path.display());
        let Some(text) = private_files::read_secret(path).with_context(what)? else { return Ok(None) };
        let mut bytes = [0; SECRET_BYTES];
        hex::decode_to_slice(text.trim_end(), &mut bytes)
            .with_context(|| format!("{}: expected 64 hexadecimal digits", what()))?;
        Ok(Some(SeedSecret(bytes)))
    }

    /// Writes a new secret to a new file, readable by its owner only.
    pub(crate) fn create(path: &Path) -> anyhow::Result<Self> {
        let mut bytes = [0; SECRET_BYTES];
        getrandom::fill(&mut bytes).context("no randomness for the seed secret")?;
        private_files::write_secret(path, &hex::encode(bytes))
            .with_context(|| format!("seed secret {}", path.display()))?;
        Ok(SeedSecret(bytes))
    }

    /// Reads the secret that the database expects; creates it with a new database.
    async fn open(path: &Path, store: &Store) -> anyhow::Result<Self> {
        let what = || format!("seed secret {}", path.display());
        let secret = match (Self::read(path)?, store.setting(SECRET_HASH).await?) {
            (Some(secret), _) => secret,
            (None, Some(published)) => bail!(
                "{}: the file is missing, and this database was begun with the one whose SHA-256 is {published}; put that file \
                 back, from a backup or from another server of this competition",
                what()
            ),
            (None, None) => Self::create(path)?,
        };
        let published = store.pin_setting(SECRET_HASH, &secret.sha256()).await?;
        if published != secret.sha256() {
            bail!(
                "{}: not the one this database was begun with, whose SHA-256 is {published}; put that file back",
                what()
            );
        }
        Ok(secret)
    }

    /// The hash that is published before the competition.
    pub(crate) fn sha256(&self) -> String {
        sha256_hex(&self.0)
    }
}

/// The rules and the state.
#[derive(Debug)]
pub(crate) struct Rules {
    /// The competition's name, for people.
    pub(crate) name: String,
    /// Practice or official.
    pub(crate) mode: CompetitionMode,
    /// Length of a session, s.
    pub(crate) session_s: Option<f64>,
    /// Number of sessions of a team.
    pub(crate) sessions_per_team: u32,
    /// Cost of a reset, s.
    pub(crate) reset_cost_s: f64,
    /// Whose scene run k of a task has, in the official mode.
    pub(crate) scenes: Scenes,
    /// Set in the official mode.
    secret: Option<SeedSecret>,
    /// The state as the database last had it.
    state: Mutex<CompetitionState>,
}

impl Rules {
    /// The rules of this configuration, with the state from the database.
    ///
    /// # Errors
    /// The secret cannot be read, or its hash is not the published one.
    pub(crate) async fn open(config: &Config, store: &Store) -> anyhow::Result<Self> {
        let secret = match config.mode {
            CompetitionMode::Practice => {
                if store.setting(SECRET_HASH).await?.is_some() {
                    bail!("this database belongs to an official competition; start it with its --config");
                }
                None
            }
            CompetitionMode::Official => {
                let secret = SeedSecret::open(&config.seed_secret, store).await?;
                keep_scenes(config.scenes, store).await?;
                Some(secret)
            }
        };
        Ok(Rules {
            name: config.name.clone(),
            mode: config.mode,
            session_s: config.session_s,
            sessions_per_team: config.sessions_per_team,
            reset_cost_s: config.reset_cost_s,
            scenes: config.scenes,
            secret,
            state: Mutex::new(store.competition_state().await?),
        })
    }

    /// Whether the competition is official.
    pub(crate) fn official(&self) -> bool {
        self.mode == CompetitionMode::Official
    }

    /// The state of the competition.
    pub(crate) fn state(&self) -> CompetitionState {
        *self.state.lock()
    }

    /// The phase of the competition; a practice server is always open.
    pub(crate) fn phase(&self) -> CompetitionPhase {
        if self.official() { self.state().phase } else { CompetitionPhase::Open }
    }

    /// Whether all sessions are paused.
    pub(crate) fn is_paused(&self) -> bool {
        self.state().paused_unix_ms.is_some()
    }

    /// Takes over the state that the database has now.
    pub(crate) fn adopt(&self, now: CompetitionState) {
        let before = std::mem::replace(&mut *self.state.lock(), now);
        if before != now {
            tracing::info!(?before, ?now, "the state of the competition changes");
        }
    }

    /// Whether seeds are public.
    pub(crate) fn revealed(&self) -> bool {
        !self.official() || self.phase() == CompetitionPhase::Revealed
    }

    /// SHA-256 of the secret.
    pub(crate) fn secret_sha256(&self) -> Option<String> {
        self.secret.as_ref().map(SeedSecret::sha256)
    }

    /// The secret, if it is public.
    pub(crate) fn revealed_secret(&self) -> Option<String> {
        let secret = self.secret.as_ref().filter(|_| self.revealed())?;
        Some(hex::encode(secret.0))
    }

    /// The seed of a team's run `k` of a task, in the official mode.
    pub(crate) fn seed(&self, task: &str, k: u64, team: &str) -> Option<Seed> {
        self.secret.as_ref().map(|secret| Seed::for_run(&secret.0, self.scenes, task, k, team))
    }

    /// Changes the state by an organizer's command. The caller then applies it to the sessions.
    ///
    /// # Errors
    /// The command does not fit the state.
    pub(crate) async fn change(
        &self,
        store: &Store,
        change: CompetitionChange,
        entry: &NewAuditEntry<'_>,
    ) -> Result<(), Refusal> {
        if !self.official() {
            let message =
                "this is a practice server: it is always open, and its sessions are paused and ended singly";
            return Err(Refusal::new(Code::WrongState, message));
        }
        let fits = |state, open| fits(change, state, open).map_err(|why| Refusal::new(Code::WrongState, why));
        store.change_competition(change, entry, fits).await.map_err(|error| {
            tracing::error!(%error, "the database failed");
            Refusal::new(Code::Internal, "the database does not answer; nothing was changed").retry_after(5.0)
        })?
    }
}

/// Stores whose scenes are played; once there are runs, refuses a change: their scores and later ones would not be comparable.
async fn keep_scenes(scenes: Scenes, store: &Store) -> anyhow::Result<()> {
    if !store.has_official_runs().await? {
        return Ok(store.store_setting(SCENES, scenes.word()).await?);
    }
    // Databases of earlier versions have no such setting.
    let begun = store.setting(SCENES).await?.unwrap_or_else(|| Scenes::Shared.word().to_owned());
    if begun != scenes.word() {
        bail!(
            "scenes = \"{}\": the runs of this database were played with scenes = \"{begun}\", and scores of both cannot be \
             compared; put that back, or begin with another data_dir",
            scenes.word()
        );
    }
    Ok(())
}

/// Whether a command fits the state of a competition with this number of open sessions; the error is the reason.
fn fits(change: CompetitionChange, state: CompetitionState, open: i64) -> Result<(), &'static str> {
    use CompetitionChange::{EndSessions, Enter, Pause, Resume};
    use CompetitionPhase::{Closed, Open, Revealed};
    match (state.phase, change) {
        (Revealed, _) => Err("the secret is public: the competition is over"),
        (Open, Enter(Open)) => Err("the competition is open already"),
        (Closed, Enter(Closed)) => Err("the competition is closed already"),
        (Open, Enter(Revealed)) => Err("close the competition first"),
        (_, Pause) if state.paused_unix_ms.is_some() => Err("the competition is paused already"),
        (_, Resume) if state.paused_unix_ms.is_none() => Err("the competition is not paused"),
        (Closed, EndSessions) if open == 0 => Err("the competition is closed, and no session is open"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_store::{Host, Location};
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_command_fits_the_state_or_says_why_not() {
        use CompetitionChange::{EndSessions, Enter, Pause, Resume};
        use CompetitionPhase::{Closed, Open, Revealed};
        let state = |phase, paused| CompetitionState {
            phase,
            paused_unix_ms: Some(1).filter(|_| paused),
            ended_unix_ms: None,
        };
        for (change, phase, paused, open, fit) in [
            (Enter(Open), Closed, false, 0, true),
            (Enter(Open), Open, false, 0, false),
            (Enter(Closed), Closed, false, 0, false),
            (Enter(Revealed), Open, false, 0, false),
            (Enter(Revealed), Closed, true, 0, true),
            (Pause, Open, false, 0, true),
            (Pause, Closed, false, 0, true),
            (Pause, Open, true, 3, false),
            (Resume, Open, true, 0, true),
            (Resume, Closed, false, 3, false),
            (EndSessions, Open, true, 0, true),
            (EndSessions, Closed, false, 1, true),
            (EndSessions, Closed, false, 0, false),
            (Enter(Open), Revealed, false, 0, false),
            (Pause, Revealed, false, 0, false),
            (Resume, Revealed, true, 0, false),
            (EndSessions, Revealed, false, 1, false),
        ] {
            let answer = fits(change, state(phase, paused), open);
            assert_eq!(
                answer.is_ok(),
                fit,
                "{change:?} {phase:?} paused: {paused}, open: {open}: {answer:?}"
            );
        }
    }

    #[tokio::test]
    async fn a_secret_is_created_once_private_and_never_shown() {
        let folder = tempfile::tempdir().expect("folder");
        let store =
            Store::open(&Location::DataDir(folder.path().to_owned()), &Host::alone()).await.expect("store");
        let path = folder.path().join("seed.secret");
        let secret = SeedSecret::open(&path, &store).await.expect("made");
        assert_eq!(SeedSecret::open(&path, &store).await.expect("read").0, secret.0);
        assert!(!format!("{secret:?}").contains(&hex::encode(secret.0)));
        let mode = std::fs::metadata(&path).expect("file").permissions().mode() & 0o777;
        assert_eq!(mode, 0o600);
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o644)).expect("chmod");
        let error = SeedSecret::open(&path, &store).await.expect_err("open to others");
        let error = format!("{error:#}");
        assert!(error.contains("chmod 600"), "{error}");
        // The database expects this one: it is not made anew.
        std::fs::remove_file(&path).expect("removed");
        let error = SeedSecret::open(&path, &store).await.expect_err("missing").to_string();
        assert!(error.contains("is missing") && error.contains(&secret.sha256()), "{error}");
        assert!(!path.exists());
    }
}
