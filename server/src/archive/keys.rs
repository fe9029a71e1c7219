//! The keys of the replays: the key that signs, and the public keys that the database accepts.
//!
//! The database expects one signing key, which its first server made. Another key would make every stored replay look forged. So a
//! server whose file is missing or holds another key does not start.

use anyhow::{Context, bail};
use palmares_replay::{PublicKey, Signer};
use palmares_store::files::private_files;
use palmares_store::{NewAuditEntry, Store};
use std::path::Path;

/// Setting: the public key of the key that signs.
const EXPECTED: &str = "signing_key";
/// Setting: public keys that signed earlier, separated by spaces.
const EARLIER: &str = "earlier_signing_keys";

/// The keys of the replays.
#[derive(Clone, Debug)]
pub(crate) struct Keys {
    /// Signs.
    pub(super) signer: Signer,
    /// Signed earlier, oldest first.
    pub(super) earlier: Vec<PublicKey>,
}

impl Keys {
    /// A new key for a test.
    #[cfg(test)]
    pub(crate) fn random() -> Self {
        Keys { signer: Signer::random().expect("randomness"), earlier: Vec::new() }
    }

    /// Reads the key that the database expects; creates it with a new database. With `replace`, the file's key, or a new one if the
    /// file is missing, becomes the expected one, and the previous key stays valid for its replays.
    ///
    /// # Errors
    /// The file is missing, cannot be read, or has another key than the database expects.
    pub(crate) async fn open(path: &Path, store: &Store, replace: bool) -> anyhow::Result<Self> {
        let what = || format!("signing key {}", path.display());
        let advice = "put the expected file back, from a backup or from another server of this competition. If it is lost for good, \
                      start once with --replace-signing-key: another key signs from then on, and earlier replays stay valid";
        let expected = store.setting(EXPECTED).await?;
        let signer = match (private_files::read_secret(path).with_context(what)?, &expected) {
            (Some(text), _) => text.parse::<Signer>().with_context(what)?,
            (None, Some(expected)) if !replace => {
                bail!(
                    "{}: the file is missing, and this database expects the key {expected}; {advice}",
                    what()
                )
            }
            (None, None) if !replace && store.has_official_replays().await? => {
                bail!("{}: the file is missing, and this database has official replays; {advice}", what())
            }
            (None, _) => Signer::create(path)?,
        };
        let found = signer.public().to_string();
        let pinned = store.pin_setting(EXPECTED, &found).await?;
        if pinned != found {
            if !replace {
                bail!("{}: its public key is {found}, and this database expects {pinned}; {advice}", what());
            }
            let mut earlier = store.setting(EARLIER).await?.unwrap_or_default();
            if !earlier.is_empty() {
                earlier.push(' ');
            }
            earlier.push_str(&pinned);
            let entry = NewAuditEntry {
                actor: "server",
                action: "key.replace",
                subject: &found,
                reason: Some("--replace-signing-key"),
            };
            store.change_settings(&[(EXPECTED, &found), (EARLIER, &earlier)], &entry).await?;
            tracing::warn!(key = found, earlier = pinned, "another key signs from now on");
        }
        let earlier = store.setting(EARLIER).await?.unwrap_or_default();
        let earlier = earlier
            .split_whitespace()
            .map(|key| key.parse().map_err(|error| anyhow::anyhow!("database: setting {EARLIER}: {error}")));
        Ok(Keys { signer, earlier: earlier.collect::<anyhow::Result<_>>()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_store::{Host, Location};

    #[tokio::test]
    async fn an_expected_key_is_never_made_anew() {
        let folder = tempfile::tempdir().expect("folder");
        let store =
            Store::open(&Location::DataDir(folder.path().to_owned()), &Host::alone()).await.expect("store");
        let path = folder.path().join("signing.key");
        let first = Keys::open(&path, &store, false).await.expect("made").signer.public();
        assert_eq!(Keys::open(&path, &store, false).await.expect("read").signer.public(), first);

        let kept = folder.path().join("kept");
        std::fs::rename(&path, &kept).expect("renamed");
        let refused = Keys::open(&path, &store, false).await.expect_err("missing").to_string();
        for part in ["is missing", &first.to_string(), "from a backup", "--replace-signing-key"] {
            assert!(refused.contains(part), "'{part}' is not in: {refused}");
        }
        assert!(!path.exists());

        let other = Signer::create(&path).expect("another").public();
        let refused = Keys::open(&path, &store, false).await.expect_err("another key").to_string();
        for key in [first, other] {
            assert!(refused.contains(&key.to_string()), "{refused}");
        }
        let keys = Keys::open(&path, &store, true).await.expect("replaced");
        assert_eq!((keys.signer.public(), keys.earlier), (other, vec![first]));
        // From now on without the option; with it nothing changes any more.
        for replace in [false, true] {
            let keys = Keys::open(&path, &store, replace).await.expect("expected");
            assert_eq!((keys.signer.public(), keys.earlier), (other, vec![first]));
        }
        let audit = store.audit(0, 10).await.expect("query");
        let replaced: Vec<_> = audit.iter().filter(|entry| entry.action == "key.replace").collect();
        assert_eq!(
            replaced.iter().map(|entry| entry.subject.clone()).collect::<Vec<_>>(),
            [other.to_string()]
        );

        // A lost file: a new key, on demand only.
        std::fs::remove_file(&path).expect("removed");
        let keys = Keys::open(&path, &store, true).await.expect("made");
        assert_eq!(keys.earlier, [first, other]);
        let written: Signer = std::fs::read_to_string(&path).expect("reads").parse().expect("a key");
        assert_eq!(written.public(), keys.signer.public());
    }

    #[tokio::test]
    async fn of_two_first_servers_one_key_remains() {
        let folder = tempfile::tempdir().expect("folder");
        let store =
            Store::open(&Location::DataDir(folder.path().to_owned()), &Host::alone()).await.expect("store");
        let paths = ["a.key", "b.key"].map(|name| folder.path().join(name));
        let [a, b] = [&paths[0], &paths[1]].map(|path| Keys::open(path, &store, false));
        let (a, b) = tokio::join!(a, b);
        assert_ne!(a.is_ok(), b.is_ok(), "{a:?} {b:?}");
    }
}
