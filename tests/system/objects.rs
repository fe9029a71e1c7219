//! Replays in a bucket: uploaded when the storage answers, and read where they are missing. The S3 server is moto.

use crate::harness::{Official, RULES, Server, get, official_reset};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

/// Serves the bucket `cup` until its input ends.
const MOTO: &str = "\
import sys
from moto.server import ThreadedMotoServer
import boto3
server = ThreadedMotoServer('127.0.0.1', int(sys.argv[1]), verbose=False)
server.start()
boto3.client('s3', endpoint_url=f'http://127.0.0.1:{sys.argv[1]}', region_name='us-east-1',
             aws_access_key_id='key', aws_secret_access_key='secret').create_bucket(Bucket='cup')
print('ready', flush=True)
sys.stdin.read()
";

/// A Python with moto: that of PALMARES_MOTO_PYTHON, or of client-py.
pub(crate) fn python() -> Option<String> {
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../client-py/.venv/bin/python").to_owned();
    let python = std::env::var("PALMARES_MOTO_PYTHON").unwrap_or(own);
    let has = Command::new(&python).args(["-c", "import moto.server, boto3"]).stderr(Stdio::null()).status();
    if has.is_ok_and(|status| status.success()) {
        return Some(python);
    }
    println!("SKIP the object storage: {python} has no moto (pip install 'moto[server]')");
    None
}

pub(crate) fn moto(python: &str, port: u16) -> Child {
    let mut command = Command::new(python);
    command.args(["-c", MOTO, &port.to_string()]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.stderr(Stdio::null()).spawn().expect("moto starts");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("piped")).read_line(&mut line).expect("reads");
    assert_eq!(line.trim(), "ready");
    child
}

/// A competition with its files in the bucket.
fn cup(folder: TempDir, port: u16, database: &str) -> Official {
    let file = folder.path().join("competition.toml");
    std::fs::write(&file, format!("{RULES}storage = \"s3://cup/2026\"\n")).expect("rules");
    let token = folder.path().join("organizer.token");
    let endpoint = format!("http://127.0.0.1:{port}");
    let environment = [
        ("AWS_ENDPOINT_URL", endpoint.as_str()),
        ("AWS_ACCESS_KEY_ID", "key"),
        ("AWS_SECRET_ACCESS_KEY", "secret"),
    ];
    let arguments = ["--config", file.to_str().expect("a path"), "--database-url", database];
    let server = Server::start_in_environment(folder, &arguments, &environment);
    let organizer = std::fs::read_to_string(token).expect("a token").trim().to_owned();
    Official { server, organizer, database_url: None }
}

async fn until_metric(cup: &Official, line: &str) {
    while !get(&cup.server, "/metrics").body.lines().any(|have| have == line) {
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}

/// The replay of a run, fetched by an organizer.
fn fetched(cup: &Official, run_id: &Value, to: &Path) -> Vec<u8> {
    let output =
        cup.admin(&["run", "replay", run_id.as_str().expect("an id"), "-o", to.to_str().expect("a path")]);
    assert!(output.status.success(), "{output:?}");
    std::fs::read(to).expect("file")
}

#[tokio::test]
async fn a_replay_is_in_the_bucket_as_soon_as_it_answers_and_is_read_from_there() {
    let Some(python) = python() else { return };
    let port = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr()).expect("a port").port();
    let (shared, first) = (TempDir::new().expect("folder"), TempDir::new().expect("folder"));
    let database = format!("sqlite://{}", shared.path().join("cup.sqlite").display());
    let keys = TempDir::new().expect("folder");
    let copy = |from: &Path, to: &Path| {
        for name in ["signing.key", "seed.secret", "organizer.token"] {
            std::fs::copy(from.join(name), to.join(name)).expect("copied");
        }
    };

    // The bucket does not answer yet: the run counts all the same, and its replay waits.
    let server = cup(first, port, &database);
    let token = server.team("crabs");
    server.open();
    let (mut client, _) = server.greet(&token).await;
    let obs = client.ask(official_reset()).await;
    client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 20})).await;
    client.ask(json!({"op": "stop"})).await;
    server.verified(&obs["run_id"]).await;
    until_metric(&server, "palmares_uploads_waiting 1").await;
    let mut bucket = moto(&python, port);
    until_metric(&server, "palmares_uploads_waiting 0").await;
    assert!(!get(&server.server, "/metrics").body.contains("palmares_upload_failures_total 0"));
    let replay = fetched(&server, &obs["run_id"], &shared.path().join("first.mcap"));
    copy(server.server.folder(), keys.path());

    // Another data directory: the same file comes from the bucket, and is verified.
    drop(server.killed());
    let second = TempDir::new().expect("folder");
    copy(keys.path(), second.path());
    let server = cup(second, port, &database);
    assert!(fetched(&server, &obs["run_id"], &shared.path().join("second.mcap")) == replay);
    server.order("run/reverify", json!({"run_id": obs["run_id"], "reason": "another host"}));
    server.verified(&obs["run_id"]).await;
    let _ = bucket.kill();
    let _ = bucket.wait();
}
