//! Paths of files as the database stores them, relative to the data directory. A restored database may contain any text, so all
//! such paths pass this check before they are used.

use std::io;

/// Folder of the replays.
pub const REPLAYS: &str = "replays";
/// Folder of the uploaded hands.
pub const HANDS: &str = "hands";

/// Checks a stored path: `folder/name`, with a plain name.
///
/// # Errors
/// It has another form, and could lead out of the folder.
pub fn checked<'a>(folder: &str, stored: &'a str) -> io::Result<&'a str> {
    let name = stored.strip_prefix(folder).and_then(|rest| rest.strip_prefix('/')).unwrap_or_default();
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    if name.is_empty() || name.len() > 200 || name.starts_with('.') || !name.chars().all(plain) {
        let message = format!("stored path {stored:?}: expected {folder}/ and a plain file name");
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    Ok(stored)
}

/// The path of an uploaded hand, by the SHA-256 of its archive.
pub fn hand(sha256: &str) -> String {
    format!("{HANDS}/{sha256}.zip")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_names_in_the_folder_pass() {
        for good in ["replays/run_6d4d22a422b88774.mcap", "replays/a-b.C"] {
            assert_eq!(checked(REPLAYS, good).expect("valid"), good);
        }
        for wrong in [
            "",
            "replays",
            "replays/",
            "/etc/passwd",
            "../../etc/passwd",
            "replays/../seed.secret",
            "replays/..",
            "replays/.hidden",
            "replays//etc/passwd",
            "replays/a/b",
            "replays/a\\b",
            "replays/a\0b",
            "hands/a.zip",
            "seed.secret",
            &format!("replays/{}", "a".repeat(201)),
        ] {
            assert!(checked(REPLAYS, wrong).is_err(), "{wrong:?}");
        }
        assert!(checked(HANDS, &hand("../../etc/passwd")).is_err());
        assert!(checked(HANDS, &hand(&"0".repeat(64))).is_ok());
    }
}
