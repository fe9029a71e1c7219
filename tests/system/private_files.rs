//! The data directory: other accounts of the machine cannot read what the server keeps there.

use crate::hands_upload::claw;
use crate::harness::{Client, Server, send};
use serde_json::json;
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn mode(path: &Path) -> u32 {
    fs::metadata(path).expect("there").permissions().mode() & 0o777
}

fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).expect("ours");
}

/// A folder and everything in it.
fn all(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let below = entries.flat_map(|path| if path.is_dir() { all(&path) } else { vec![path] });
    std::iter::once(folder.to_owned()).chain(below).collect()
}

/// Files and folders that other accounts can read.
fn readable(folder: &Path) -> Vec<PathBuf> {
    all(folder).into_iter().filter(|path| mode(path) & 0o077 != 0).collect()
}

#[tokio::test]
async fn only_the_servers_account_can_read_its_files() {
    let folder = TempDir::new().expect("temporary directory");
    // As an organizer may have made it.
    set_mode(folder.path(), 0o755);
    let server = Server::start_in(folder, &[]);
    let (mut client, _) = Client::playing(&server, "a").await;
    client.goes_on(0).await;
    client.ask(json!({"op": "stop"})).await;
    let sent = send(&server, "POST", "/v1/hands?team=a", "", &claw("claw"));
    assert_eq!(sent.status, 201, "{}", sent.body);
    // An open run has a recording and a write-ahead log.
    let (mut client, _) = Client::playing(&server, "b").await;
    client.goes_on(0).await;
    let files = all(server.folder());
    for part in ["palmares.sqlite", "palmares.sqlite-wal", "palmares.lock", "signing.key", ".mcap", ".zip"] {
        assert!(files.iter().any(|path| path.to_string_lossy().ends_with(part)), "{part}: {files:?}");
    }
    assert_eq!(readable(server.folder()), Vec::<PathBuf>::new());

    // As an earlier version left them, with files of the organizer.
    let folder = server.kill();
    for path in all(folder.path()) {
        if !path.ends_with("signing.key") {
            set_mode(&path, if path.is_dir() { 0o755 } else { 0o644 });
        }
    }
    let notes = [folder.path().join("notes.txt"), folder.path().join("replays/notes.mcap")];
    for path in &notes {
        fs::write(path, "mine").expect("written");
        set_mode(path, 0o644);
    }
    let server = Server::start_in(folder, &[]);
    let expected = [server.folder().to_owned(), notes[0].clone(), notes[1].clone()];
    let mut found = readable(server.folder());
    found.sort();
    assert_eq!(found, expected);
    server.signal("TERM");
    let (_, log, folder) = server.wait();
    assert!(log.contains("other accounts could read files"), "{log}");
    assert!(log.contains("other accounts can list"), "{log}");

    // Without them the directory is the server's as well.
    for path in &notes {
        fs::remove_file(path).expect("ours");
    }
    let server = Server::start_in(folder, &[]);
    assert_eq!(readable(server.folder()), Vec::<PathBuf>::new());
}
