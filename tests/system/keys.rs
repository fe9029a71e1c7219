//! A database expects its keys: they are never made anew.

use crate::harness::{Official, RULES, get, program};
use serde_json::json;
use std::path::Path;
use std::process::Command;

/// The message of a start that is refused.
fn refused(folder: &Path) -> String {
    let mut command = Command::new(program());
    command.args(["serve", "--listen", "127.0.0.1:0", "--data-dir"]).arg(folder);
    command.arg("--config").arg(folder.join("competition.toml")).env_remove("DATABASE_URL");
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
    let run = get(&cup.server, &format!("/v1/runs/{}", obs["run_id"].as_str().expect("an id"))).json();
    assert_eq!(run["status"], "verified", "{run}");
}
