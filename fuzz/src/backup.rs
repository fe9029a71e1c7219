//! Archives of backups: their entries, tables, and the files that these name. The database is not filled.

use crate::parts::{self, Seeds};
use std::path::Path;
use tempfile::TempDir;

pub(crate) fn run(data: &[u8]) -> bool {
    let Some(archive) = parts::archive(data) else { return false };
    let folder = folder().expect("a folder");
    palmares_server::untrusted::backup(&archive, folder.path())
}

/// A temporary folder, in memory if there is such a place: every unpacked file is synchronised to the disk.
fn folder() -> std::io::Result<TempDir> {
    let memory = Path::new("/dev/shm");
    if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }
}

pub(crate) fn seeds() -> Seeds {
    // SHA-256 of `replay` and of `hand`.
    let replay = "ac203c9843b5bd8c883e07039ff82820c94422010be6108bb82403ca25376a22";
    let hand = "1b001706a418bdfca35361355c643b7918572b8f9b7503f3043a6e23b45dce52";
    let runs = format!(
        "{{\"run_id\":\"run_1\",\"replay_path\":\"replays/run_1.mcap\",\"replay_sha256\":\"{replay}\",\"k\":1,\"hand_sha256\":null}}\n\
         {{\"run_id\":\"run_2\",\"replay_path\":null,\"k\":null}}"
    );
    let hands = format!("{{\"hand_id\":\"hand_1\",\"sha256\":\"{hand}\",\"stored_at\":12.5}}");
    let files = parts::joined(&[
        ("manifest.json", br#"{"format":1,"server_version":"0.2.0","unix_ms":1700000000000}"#),
        ("tables/runs.jsonl", runs.as_bytes()),
        ("tables/hands.jsonl", hands.as_bytes()),
        ("tables/teams.jsonl", b"{\"name\":\"crabs\"}"),
        ("data/replays/run_1.mcap", b"replay"),
        (&format!("data/hands/{hand}.zip"), b"hand"),
        ("data/seed.secret", b"00"),
    ]);
    let zip = parts::archive(&files).map(|zip| ("backup.zip".to_owned(), zip));
    [("backup.txt".to_owned(), files)].into_iter().chain(zip).collect()
}
