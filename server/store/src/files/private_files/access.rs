//! Who may read a secret's file. The server refuses a file that too many can read.
//!
//! Nobody but the owner may write it, and nobody outside of its group may access it. Its group may read it on one condition: the
//! file is root's, and the server, another account, is in the group. Kubernetes makes secrets so for a pod with `fsGroup`: root and
//! the group, mode 0440. Any other file can be made its owner's alone, mode 0600.

use anyhow::{Context, bail};
use rustix::process::{getegid, geteuid, getgroups};
use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// The account of root.
const ROOT: u32 = 0;

/// The owner, the group and the permissions of a file.
#[derive(Clone, Copy, Debug)]
struct Access {
    owner: u32,
    group: u32,
    /// The nine bits of reading, writing and executing.
    mode: u32,
}

/// An account and its groups.
#[derive(Clone, Debug)]
struct Account {
    user: u32,
    groups: Vec<u32>,
}

impl Access {
    fn of(facts: &fs::Metadata) -> Self {
        Access { owner: facts.uid(), group: facts.gid(), mode: facts.mode() & 0o777 }
    }

    /// The reason why this account must not use a secret with this access; None if it may.
    fn refused(self, account: &Account) -> Option<String> {
        let Access { owner, group, mode } = self;
        let chmod = "do `chmod 600`";
        if mode & 0o007 != 0 {
            return Some(format!("its mode is {mode:o}, others may access it; {chmod}"));
        }
        if mode & 0o030 != 0 {
            return Some(format!("its mode is {mode:o}, its group may do more than read it; {chmod}"));
        }
        if mode & 0o040 == 0 {
            return None;
        }
        if owner == account.user {
            return Some(format!("its mode is {mode:o}, its group may read it; {chmod}"));
        }
        if owner != ROOT || !account.groups.contains(&group) {
            return Some(format!(
                "its mode is {mode:o}, its owner is account {owner} and its group {group}: expected mode 600 and the server's \
                 account {}, or mode 440, the owner root and a group of the server's account",
                account.user
            ));
        }
        None
    }
}

impl Account {
    /// The account of this process.
    fn own() -> anyhow::Result<Self> {
        let mut groups = vec![getegid().as_raw()];
        groups.extend(getgroups().context("the groups of this process")?.iter().map(|group| group.as_raw()));
        Ok(Account { user: geteuid().as_raw(), groups })
    }
}

/// Reads a secret; None if the file is missing.
///
/// # Errors
/// The file cannot be read, or too many can.
pub fn read_secret(path: &Path) -> anyhow::Result<Option<String>> {
    let account = Account::own()?;
    let mut file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) if error.kind() == ErrorKind::PermissionDenied => match fs::metadata(path) {
            Ok(facts) => {
                let Access { owner, mode, .. } = Access::of(&facts);
                bail!(
                    "its mode is {mode:o} and its owner account {owner}, so the server's account {user} cannot read it; \
                     do `chown {user}` and `chmod 600`",
                    user = account.user
                )
            }
            Err(_) => return Err(error).context("cannot be read"),
        },
        Err(error) => return Err(error).context("cannot be read"),
    };
    // Of the open file: a file that replaces it meanwhile is not read.
    let facts = file.metadata().context("cannot be read")?;
    if let Some(why) = Access::of(&facts).refused(&account) {
        bail!("{why}");
    }
    let mut text = String::new();
    file.read_to_string(&mut text).context("cannot be read")?;
    Ok(Some(text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    /// A server in a container: its account, its group, a further group.
    fn server() -> Account {
        Account { user: 10_001, groups: vec![10_001, 2000] }
    }

    #[test]
    fn each_mode_is_accepted_or_refused() {
        let accepted = |owner, group| {
            let every = (0..=0o777).map(|mode| Access { owner, group, mode });
            every
                .filter(|access| access.refused(&server()).is_none())
                .map(|access| access.mode)
                .collect::<Vec<_>>()
        };
        let of_the_owner: Vec<u32> = (0..8).map(|bits| bits << 6).collect();
        let also_of_the_group: Vec<u32> = (0..8).flat_map(|bits| [bits << 6, bits << 6 | 0o040]).collect();
        // Its own files: for the owner alone, whichever group they have.
        assert_eq!(accepted(10_001, 10_001), of_the_owner);
        assert_eq!(accepted(10_001, 5), of_the_owner);
        // Those of root, as in a pod: the server's groups may read them.
        assert_eq!(accepted(ROOT, 10_001), also_of_the_group);
        assert_eq!(accepted(ROOT, 2000), also_of_the_group);
        // Those of another group or owner.
        assert_eq!(accepted(ROOT, 5), of_the_owner);
        assert_eq!(accepted(1000, 10_001), of_the_owner);
    }

    #[test]
    fn root_has_its_files_alone() {
        let root = Account { user: ROOT, groups: vec![0] };
        let access = |mode| Access { owner: ROOT, group: 0, mode };
        assert!(access(0o600).refused(&root).is_none() && access(0o400).refused(&root).is_none());
        let why = access(0o440).refused(&root).expect("refused");
        assert!(why.contains("its mode is 440") && why.contains("chmod 600"), "{why}");
    }

    #[test]
    fn a_refusal_says_what_would_be_accepted() {
        let why = |owner, group, mode| Access { owner, group, mode }.refused(&server()).expect("refused");
        assert_eq!(why(10_001, 10_001, 0o644), "its mode is 644, others may access it; do `chmod 600`");
        assert_eq!(why(ROOT, 10_001, 0o444), "its mode is 444, others may access it; do `chmod 600`");
        assert_eq!(
            why(ROOT, 10_001, 0o460),
            "its mode is 460, its group may do more than read it; do `chmod 600`"
        );
        let stranger = why(1000, 10_001, 0o440);
        for part in ["account 1000", "account 10001", "mode 600", "mode 440, the owner root"] {
            assert!(stranger.contains(part), "{stranger}");
        }
    }

    #[test]
    fn a_secret_is_read_unless_others_can() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("seed.secret");
        assert!(read_secret(&path).expect("no file").is_none());
        fs::write(&path, "secret").expect("written");
        for (mode, readable) in [(0o600, true), (0o400, true), (0o644, false), (0o640, false), (0o604, false)]
        {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).expect("chmod");
            let read = read_secret(&path);
            assert_eq!(read.is_ok(), readable, "{mode:o}: {read:?}");
        }
    }
}
