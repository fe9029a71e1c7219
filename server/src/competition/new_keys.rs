//! `palmares keys`: the secrets of a competition, made before its first start.

use crate::competition::rules::SeedSecret;
use anyhow::{Context, bail};
use palmares_net::auth::Token;
use palmares_net::config::{ORGANIZER_TOKEN_FILE, SEED_SECRET_FILE, SIGNING_KEY_FILE};
use palmares_replay::Signer;
use palmares_store::files::private_files::{make_folder, write_secret};
use std::fs;
use std::os::unix::fs::chown;
use std::path::{Path, PathBuf};

/// The halves of the new secrets that are public.
#[derive(Clone, Debug, serde::Serialize)]
pub struct NewKeys {
    /// SHA-256 of the source of the seeds.
    pub seed_secret_sha256: String,
    /// The public half of the key that signs replays.
    pub replay_key: String,
}

/// Makes `seed.secret`, `signing.key` and `organizer.token` in a new or empty folder. The owner of folder and files is this account, or
/// the one of `owner`.
///
/// # Errors
/// The folder has files already, or cannot be written; this account cannot give files away.
pub fn new_keys(folder: &Path, owner: Option<u32>) -> anyhow::Result<NewKeys> {
    let place = || format!("{}", folder.display());
    make_folder(folder).with_context(place)?;
    if let Some(found) = fs::read_dir(folder).with_context(place)?.next() {
        let name = found.with_context(place)?.file_name();
        bail!("{}: there is {} already; expected a new or empty folder", place(), name.display());
    }
    let path = |name: &str| -> PathBuf { folder.join(name) };
    let secret = SeedSecret::create(&path(SEED_SECRET_FILE))?;
    let signer = Signer::create(&path(SIGNING_KEY_FILE))?;
    let token = Token::random().context("no randomness for a token")?;
    write_secret(&path(ORGANIZER_TOKEN_FILE), &token.reveal()).with_context(place)?;
    if let Some(owner) = owner {
        let files = [SEED_SECRET_FILE, SIGNING_KEY_FILE, ORGANIZER_TOKEN_FILE].map(path);
        for given in files.iter().map(PathBuf::as_path).chain([folder]) {
            chown(given, Some(owner), None)
                .with_context(|| format!("{}: cannot be given to account {owner}", given.display()))?;
        }
    }
    Ok(NewKeys { seed_secret_sha256: secret.sha256(), replay_key: signer.public().to_string() })
}
