//! A backup taken while the server runs, restored elsewhere, also from one kind of database to the other.

use crate::harness::{Client, Official, Server, get, get_bytes, postgres_database, program};
use serde_json::json;
use sqlx::ConnectOptions;
use sqlx::sqlite::SqliteConnectOptions;
use std::io::{Cursor, Read, Write};
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

fn restore(archive: &Path, folder: &Path, database_url: Option<&str>) -> Output {
    let mut command = Command::new(program());
    command.args(["admin", "restore"]).arg(archive).arg("--data-dir").arg(folder).env_remove("DATABASE_URL");
    if let Some(url) = database_url {
        command.args(["--database-url", url]);
    }
    command.output().expect("palmares runs")
}

#[tokio::test]
async fn a_competition_is_restored_whole() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, welcome, _) = cup.playing(&token).await;
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 50})).await;
        let result = client.ask(json!({"op": "stop"})).await;
        cup.verified(&result["run_id"]).await;
        let out = TempDir::new().expect("temporary directory");
        let archive = out.path().join("cup.zip");
        let output = cup.admin(&["backup", archive.to_str().expect("a path")]);
        assert!(output.status.success(), "{output:?}");
        let again = cup.admin(&["backup", archive.to_str().expect("a path")]);
        assert!(!again.status.success(), "a backup is not written over");
        let rows = get(&cup.server, "/v1/leaderboard").json()["rows"].clone();
        let runs = cup.get("/v1/admin/export/runs", &cup.organizer).json();

        // Back into both kinds.
        let mut places = vec![None];
        places.extend(postgres_database().await.map(Some));
        for database_url in places {
            let folder = TempDir::new().expect("temporary directory");
            let output = restore(&archive, folder.path(), database_url.as_deref());
            assert!(output.status.success(), "{output:?}");
            let twice = restore(&archive, folder.path(), database_url.as_deref());
            assert!(String::from_utf8_lossy(&twice.stderr).contains("not empty"), "{twice:?}");
            let secret = |folder: &Path| std::fs::read(folder.join("seed.secret")).expect("secret");
            assert_eq!(secret(folder.path()), secret(&cup.folder()));
            // The first organizer's token is not in the backup, but it is still valid.
            std::fs::write(folder.path().join("organizer.token"), &cup.organizer).expect("writes");
            let copy = Official::start_on(folder, "mode = \"official\"\nsession_s = 600\n", database_url);
            assert_eq!(get(&copy.server, "/v1/leaderboard").json()["rows"], rows);
            assert_eq!(copy.get("/v1/admin/export/runs", &cup.organizer).json(), runs);
            assert_eq!(get(&copy.server, "/v1/competition").json()["phase"], "open");
            let (_, back) = copy.greet(&token).await;
            assert_eq!(back["session_id"], welcome["session_id"], "{back}");
        }
    }
}

#[tokio::test]
async fn what_is_no_backup_restores_nothing() {
    let out = TempDir::new().expect("temporary directory");
    let (archive, folder) = (out.path().join("no.zip"), out.path().join("data"));
    std::fs::write(&archive, b"PK nonsense").expect("writes");
    let output = restore(&archive, &folder, None);
    assert!(!output.status.success(), "{output:?}");
    assert!(!folder.join("seed.secret").exists());
}

type Entries = Vec<(String, Vec<u8>)>;

fn entries(archive: &Path) -> Entries {
    let mut zip = ZipArchive::new(Cursor::new(std::fs::read(archive).expect("written"))).expect("a ZIP");
    let count = zip.len();
    let read = |i| {
        let mut entry = zip.by_index(i).expect("an entry");
        let (name, mut bytes) = (entry.name().expect("text").into_owned(), Vec::new());
        entry.read_to_end(&mut bytes).expect("readable");
        (name, bytes)
    };
    (0..count).map(read).collect()
}

/// A change of a backup's entries.
type Change = fn(&mut Entries);

fn runs_with(entries: &mut Entries, from: &str, to: &str) {
    let (_, runs) = entries.iter_mut().find(|(name, _)| name == "tables/runs.jsonl").expect("runs");
    let text = String::from_utf8(std::mem::take(runs)).expect("text");
    assert!(text.contains(from), "{text}");
    *runs = text.replace(from, to).into_bytes();
}

fn replay(entries: &mut Entries) -> &mut (String, Vec<u8>) {
    entries.iter_mut().find(|(name, _)| name.ends_with(".mcap")).expect("a replay")
}

#[tokio::test]
async fn a_doctored_backup_is_refused_and_leaves_nothing() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let (mut client, _, _) = cup.playing(&token).await;
    client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 50})).await;
    let result = client.ask(json!({"op": "stop"})).await;
    let run_id = result["run_id"].as_str().expect("an id");
    cup.verified(&result["run_id"]).await;
    let out = TempDir::new().expect("temporary directory");
    let archive = out.path().join("cup.zip");
    assert!(cup.admin(&["backup", archive.to_str().expect("a path")]).status.success());
    let original = entries(&archive);
    let changes: [(&str, Change); 9] = [
        ("no such entry", |entries| entries.push(("../pwned".into(), b"x".to_vec()))),
        ("no such entry", |entries| entries.push(("/tmp/pwned".into(), b"x".to_vec()))),
        ("plain file name", |entries| entries.push(("data/replays/../../pwned".into(), b"x".to_vec()))),
        ("plain file name", |entries| entries.push(("data/competition.toml".into(), b"x".to_vec()))),
        ("plain file name", |entries| {
            runs_with(entries, "\"replay_path\":\"replays/", "\"replay_path\":\"replays/../../../etc/");
        }),
        ("SHA-256 differs", |entries| {
            let (_, bytes) = replay(entries);
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
        }),
        ("SHA-256 differs", |entries| replay(entries).1.clear()),
        ("SHA-256 differs", |entries| runs_with(entries, "\"replay_sha256\":\"", "\"replay_sha256\":\"0")),
        ("is missing", |entries| entries.retain(|(name, _)| !name.ends_with(".mcap"))),
    ];
    for (k, (why, change)) in changes.into_iter().enumerate() {
        let mut changed = original.clone();
        change(&mut changed);
        let doctored = out.path().join(format!("{k}.zip"));
        let mut zip = ZipWriter::new(std::fs::File::create(&doctored).expect("made"));
        for (name, bytes) in &changed {
            zip.start_file(name.as_str(), SimpleFileOptions::default()).expect("an entry");
            zip.write_all(bytes).expect("written");
        }
        zip.finish().expect("written");
        // In a folder of its own, so that all that is written beside the data directory is found.
        let place = out.path().join(k.to_string());
        std::fs::create_dir(&place).expect("made");
        let folder = place.join("data");
        let output = restore(&doctored, &folder, None);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && error.contains(why), "{k}: {why}: {output:?}");
        if why.starts_with("SHA") || why.ends_with("missing") {
            assert!(error.contains(run_id), "{error}");
        }
        assert_eq!(std::fs::read_dir(&place).expect("there").count(), 0, "{k}: something was written");
        assert!(!out.path().join("pwned").exists() && !Path::new("/tmp/pwned").exists());
        if why == "is missing" {
            let mut command = Command::new(program());
            command.args(["admin", "restore", "--allow-missing", "--data-dir"]).arg(&folder).arg(&doctored);
            let output = command.env_remove("DATABASE_URL").output().expect("palmares runs");
            let notes = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success() && notes.contains(run_id), "{output:?}");
        }
    }
}

#[tokio::test]
async fn no_path_in_the_database_leads_out_of_the_data_directory() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "crabs").await;
    client.goes_on(0).await;
    let result = client.ask(json!({"op": "stop"})).await;
    let address = format!("/v1/runs/{}/replay", result["run_id"].as_str().expect("an id"));
    assert_eq!(get_bytes(&server, &address).0, 200);
    let key = server.folder().join("signing.key");
    let options = SqliteConnectOptions::new().filename(server.database());
    let mut database = options.connect().await.expect("opens");
    for path in ["signing.key", "replays/../signing.key", "../../../etc/passwd", key.to_str().expect("text")]
    {
        let change = sqlx::query("UPDATE runs SET replay_path = $1").bind(path);
        change.execute(&mut database).await.expect("changes");
        get(&server, &address).assert_problem(404, "not_found");
    }
}
