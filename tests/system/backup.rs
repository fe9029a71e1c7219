//! A backup taken while the server runs, restored elsewhere, also from one kind of database to the other.

use crate::harness::{Official, get, postgres_database, program};
use serde_json::json;
use std::process::{Command, Output};
use tempfile::TempDir;

fn restore(archive: &std::path::Path, folder: &std::path::Path, database_url: Option<&str>) -> Output {
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
            let secret =
                |folder: &std::path::Path| std::fs::read(folder.join("seed.secret")).expect("secret");
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
