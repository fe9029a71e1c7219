//! A database expects its keys: they are never made anew.

use crate::harness::{Official, RULES, Server, bearer, get, program, send};
use serde_json::json;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

/// The message of a start that is refused, with the rules in the data directory.
fn refused(folder: &Path) -> String {
    let config = folder.join("competition.toml");
    refused_with(&["--config", config.to_str().expect("a path")], folder)
}

fn refused_with(arguments: &[&str], folder: &Path) -> String {
    let mut command = Command::new(program());
    command.args(["serve", "--listen", "127.0.0.1:0", "--data-dir"]).arg(folder);
    command.args(arguments).env_remove("DATABASE_URL");
    let output = command.output().expect("palmares runs");
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    String::from_utf8(output.stderr).expect("UTF-8")
}

#[tokio::test]
async fn a_missing_key_is_not_made_anew() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let (mut client, _, obs) = cup.playing(&token).await;
    client.goes_on(0).await;
    client.ask(json!({"op": "stop"})).await;
    cup.verified(&obs["run_id"]).await;
    let competition = get(&cup.server, "/v1/competition").json();
    let (folder, _) = cup.killed();
    for (name, public) in [("signing.key", "replay_key"), ("seed.secret", "seed_secret_sha256")] {
        let (path, kept) = (folder.path().join(name), folder.path().join("kept"));
        std::fs::rename(&path, &kept).expect("renamed");
        let message = refused(folder.path());
        for part in [name, "is missing", competition[public].as_str().expect("public"), "from a backup"] {
            assert!(message.contains(part), "'{part}' is not in:\n{message}");
        }
        assert!(!path.exists(), "{name} was made anew");
        std::fs::rename(&kept, &path).expect("put back");
    }

    // On demand another key signs; replays of the earlier one are still accepted.
    std::fs::remove_file(folder.path().join("signing.key")).expect("removed");
    let cup = Official::start_with(folder, RULES, None, &["--replace-signing-key"]);
    let after = get(&cup.server, "/v1/competition").json();
    assert_ne!(after["replay_key"], competition["replay_key"]);
    assert_eq!(after["earlier_replay_keys"], json!([competition["replay_key"]]));
    cup.order("run/reverify", json!({"run_id": obs["run_id"], "reason": "the key was lost"}));
    cup.verified(&obs["run_id"]).await;
    let run = cup.get(&format!("/v1/runs/{}", obs["run_id"].as_str().expect("an id")), &cup.organizer).json();
    assert_eq!(run["status"], "verified", "{run}");
}

#[test]
fn keys_are_made_before_the_first_start_and_the_organizer_outlives_a_data_directory() {
    let place = tempfile::TempDir::new().expect("folder");
    let keys = place.path().join("secrets");
    let make = || Command::new(program()).arg("keys").arg(&keys).output().expect("palmares runs");
    let made = make();
    assert!(made.status.success(), "{made:?}");
    let public: serde_json::Value = serde_json::from_slice(&made.stdout).expect("JSON");
    let mut names: Vec<_> =
        std::fs::read_dir(&keys).expect("made").map(|file| file.expect("a file").file_name()).collect();
    names.sort();
    assert_eq!(names, ["organizer.token", "seed.secret", "signing.key"]);
    for name in &names {
        let mode = std::fs::metadata(keys.join(name)).expect("made").permissions().mode() & 0o777;
        assert_eq!(mode, 0o600, "{}", name.display());
    }
    // Nothing is written over.
    let again = make();
    let said = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(!again.status.success() && said.contains("expected a new or empty folder"), "{said}");

    let token = std::fs::read_to_string(keys.join("organizer.token")).expect("made").trim().to_owned();
    let rules = format!(
        "{RULES}database_url = \"sqlite://{}\"\nseed_secret = \"{secrets}/seed.secret\"\n\
         signing_key = \"{secrets}/signing.key\"\norganizer_token = \"{secrets}/organizer.token\"\n",
        place.path().join("cup.sqlite").display(),
        secrets = keys.display()
    );
    let config = place.path().join("competition.toml");
    std::fs::write(&config, rules).expect("written");
    let config = config.to_str().expect("a path");
    // Two data directories, as a pod's that is gone, and the next one's.
    for start in 1..=2 {
        let server = Server::start_with(&["--config", config]);
        assert!(!server.folder().join("organizer.token").exists());
        let competition = get(&server, "/v1/competition").json();
        assert_eq!(competition["seed_secret_sha256"], public["seed_secret_sha256"]);
        assert_eq!(competition["replay_key"], public["replay_key"]);
        let tokens = send(&server, "GET", "/v1/admin/tokens", &bearer(&token), b"").json();
        assert_eq!(tokens["tokens"].as_array().map(Vec::len), Some(1), "start {start}: {tokens}");
        server.signal("TERM");
        let (status, log, _) = server.wait();
        assert!(status.success(), "{log}");
    }
    // A file with something else is not ignored.
    std::fs::write(keys.join("organizer.token"), "open sesame").expect("written");
    let refused = refused_with(&["--config", config], place.path());
    assert!(refused.contains("organizer.token: expected a token, plm_…"), "{refused}");
}
