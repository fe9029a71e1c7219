//! The server's key for signatures.

use crate::lower_hex::from_hex;
use ed25519_dalek::{Signature, Signer as _, SigningKey, VerifyingKey};
use std::fmt::{self, Display, Formatter};
use std::fs::OpenOptions;
use std::io::Write;
#[cfg(unix)]
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Prefix of every signed message, so that a signature of something else never fits a replay.
const CONTEXT: &[u8] = b"palmares replay 1\0";

/// Reason why there is no key.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// The file cannot be created.
    #[error("signing key {}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Not a key.
    #[error("expected 64 lower-case hexadecimal digits")]
    Content,
    /// The system has no randomness.
    #[error("no randomness for a signing key: {0}")]
    Randomness(#[from] getrandom::Error),
}

/// Signs replays.
#[derive(Clone)]
pub struct Signer(SigningKey);

impl fmt::Debug for Signer {
    /// Shows only the public key.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "Signer({})", self.public())
    }
}

impl Signer {
    /// Writes a new key to a new file, readable by its owner only.
    ///
    /// # Errors
    /// The file exists or cannot be written.
    pub fn create(path: &Path) -> Result<Self, KeyError> {
        let failed = |source| KeyError::File { path: path.to_owned(), source };
        let signer = Signer::random()?;
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        options.mode(0o600);
        let mut file = options.open(path).map_err(failed)?;
        let written = writeln!(file, "{}", hex::encode(signer.0.as_bytes())).and_then(|()| file.sync_all());
        if let Err(source) = written {
            // A part of a key would keep the next start from making a whole one.
            let _ = std::fs::remove_file(path);
            return Err(failed(source));
        }
        Ok(signer)
    }

    /// A new key.
    pub fn random() -> Result<Self, KeyError> {
        let mut secret = [0; 32];
        getrandom::fill(&mut secret)?;
        Ok(Signer(SigningKey::from_bytes(&secret)))
    }

    /// The public key.
    pub fn public(&self) -> PublicKey {
        PublicKey(self.0.verifying_key())
    }

    /// 128 hexadecimal digits.
    pub(crate) fn sign(&self, digest: &[u8; 32]) -> String {
        hex::encode(self.0.sign(&message(digest)).to_bytes())
    }
}

impl FromStr for Signer {
    type Err = KeyError;
    /// The key with this text, that of its file.
    fn from_str(text: &str) -> Result<Self, KeyError> {
        let secret = from_hex::<32>(text.trim_end()).ok_or(KeyError::Content)?;
        Ok(Signer(SigningKey::from_bytes(&secret)))
    }
}

/// The key that a signature is checked with; its text is 64 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PublicKey(VerifyingKey);

impl PublicKey {
    /// Whether this key signed a file with this digest.
    pub(crate) fn signed(&self, digest: &[u8; 32], signature: &str) -> bool {
        let Some(bytes) = from_hex::<64>(signature) else { return false };
        // Strict: each signature has one form, and weak keys are refused.
        self.0.verify_strict(&message(digest), &Signature::from_bytes(&bytes)).is_ok()
    }
}

impl Display for PublicKey {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&hex::encode(self.0.as_bytes()))
    }
}

impl FromStr for PublicKey {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let bytes = from_hex::<32>(text).ok_or("expected 64 lower-case hexadecimal digits")?;
        VerifyingKey::from_bytes(&bytes).map(PublicKey).map_err(|_| "this is no ed25519 public key".into())
    }
}

fn message(digest: &[u8; 32]) -> Vec<u8> {
    [CONTEXT, digest].concat()
}
