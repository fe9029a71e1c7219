//! A disk that is full at ten moments: no acknowledged result is lost, and the server works again by itself once there is space.
//!
//! With SQLite the data directory is on the small disk: the database, its log, replays, uploaded hands and keys. With Postgres the
//! cluster is there.

use crate::hands_upload::claw;
use crate::harness::{Client, Official, Postgres, RULES, SmallDisk, bearer, get, program, send};
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longest time from free space to a server that works.
const BACK: Duration = Duration::from_secs(5);

fn reset() -> Value {
    json!({"op": "reset", "task": "grasp", "hand": "pinch"})
}

/// Rules with one task, so that an uploaded hand is checked quickly.
fn rules() -> String {
    format!("tasks = [\"grasp\"]\nhands = [\"pinch\"]\n{RULES}")
}

/// A competition whose database is on a disk that is filled, with a team that plays.
struct Event {
    cup: Official,
    disk: SmallDisk,
    token: String,
    /// Results, as the team got them.
    acknowledged: Vec<Value>,
}

impl Event {
    fn new(folder: TempDir, disk: SmallDisk, database_url: Option<String>) -> Self {
        let cup = Official::start_on(folder, &rules(), database_url);
        let token = cup.team("crabs");
        cup.open();
        Event { cup, disk, token, acknowledged: Vec::new() }
    }

    fn ready(&self) -> (u16, String) {
        let answer = get(&self.cup.server, "/readyz");
        (answer.status, answer.body)
    }

    /// Fills the disk; the server says so.
    async fn fill(&self) {
        self.disk.fill();
        let until = Instant::now() + BACK;
        let (mut status, mut body) = self.ready();
        // A proof holds for a second.
        while status == 200 {
            assert!(Instant::now() < until, "it is ready without space");
            tokio::time::sleep(Duration::from_millis(100)).await;
            (status, body) = self.ready();
        }
        assert_eq!(status, 503, "{body}");
        assert!(body.contains("takes no"), "the reason: {body}");
    }

    /// Says hello as often as needed.
    async fn greeted(&self, until: Instant) -> Client {
        loop {
            let mut client = self.cup.connect(&self.token).await;
            let reply = client.ask(json!({"op": "hello", "client": "test"})).await;
            if reply["op"] == "welcome" {
                return client;
            }
            assert!(Instant::now() < until, "no hello in time: {reply}");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    /// Frees the disk. The server must be ready and take a whole run within the time; then it has no open run.
    async fn freed(&mut self, moment: &str) {
        self.disk.free();
        let until = Instant::now() + BACK;
        while self.ready().0 != 200 {
            assert!(Instant::now() < until, "{moment}: not ready in time: {:?}", self.ready());
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        let mut client = self.greeted(until).await;
        // A result that could not be stored is stored by itself, and waits for `stop`.
        let mut obs = client.ask(reset()).await;
        while obs["op"] != "obs" {
            assert!(Instant::now() < until, "{moment}: no run in time: {obs}");
            tokio::time::sleep(Duration::from_millis(100)).await;
            obs = client.ask(reset()).await;
        }
        play(&mut client, 0, 100).await;
        let result = self.stopped(&mut client).await.expect("a result");
        assert_eq!(result["status"], "provisional", "{moment}: {result}");
        println!("{moment}: back");
    }

    /// Stops; keeps the result if there is one.
    async fn stopped(&mut self, client: &mut Client) -> Option<Value> {
        let reply = client.ask(json!({"op": "stop"})).await;
        if reply["op"] != "result" {
            assert_eq!(reply["code"], "internal", "{reply}");
            return None;
        }
        self.acknowledged.push(reply.clone());
        Some(reply)
    }

    /// Stops until there is a result.
    async fn stopped_in_time(&mut self, client: &mut Client) -> Value {
        let until = Instant::now() + BACK;
        loop {
            if let Some(result) = self.stopped(client).await {
                return result;
            }
            assert!(Instant::now() < until, "no result in time");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    /// An open run that has played some ticks.
    async fn playing(&self, ticks: u64) -> Client {
        let (mut client, _) = self.cup.greet(&self.token).await;
        let obs = client.settled(reset()).await;
        assert_eq!(obs["op"], "obs", "{obs}");
        play(&mut client, 0, ticks).await;
        client
    }

    /// Every acknowledged result is in the database as it was acknowledged, or verified since, and no run is left open.
    fn nothing_is_lost(&self) {
        let runs = self.cup.get("/v1/admin/runs?status=open", &self.cup.organizer).json();
        assert_eq!(runs["runs"], json!([]), "{runs}");
        println!("{} results", self.acknowledged.len());
        for result in &self.acknowledged {
            let path = format!("/v1/runs/{}", result["run_id"].as_str().expect("an id"));
            let run = self.cup.get(&path, &self.cup.organizer).json();
            for field in ["score", "ticks", "state_hash", "reason"] {
                assert_eq!(run[field], result[field], "{field}: {run}");
            }
            let (run, result) = (&run["status"], &result["status"]);
            assert!(run == result || (run == "verified" && result == "provisional"), "{run}, {result}");
        }
    }
}

/// Steps from a tick to another.
async fn play(client: &mut Client, from: u64, to: u64) {
    for tick in (from..to).step_by(50) {
        let step = json!({"op": "step", "tick": tick, "action": {}, "repeat": 50});
        let obs = client.ask(step).await;
        assert_eq!(obs["op"], "obs", "{obs}");
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"))
}

/// Plays all moments but the start, which [`begins`] and [`begins_again`] have.
async fn moments(event: &mut Event) {
    let replays_are_safe = event.cup.database_url.is_some();

    event.fill().await;
    let mut client = event.cup.connect(&event.token).await;
    let hello = client.ask(json!({"op": "hello", "client": "test"})).await;
    assert!(hello["op"] == "welcome" || hello["code"] == "internal", "{hello}");
    drop(client);
    event.freed("before the first hello").await;

    let (mut client, _) = event.cup.greet(&event.token).await;
    event.fill().await;
    let refused = client.ask(reset()).await;
    assert!(refused["op"] == "obs" || refused["code"] == "internal", "{refused}");
    if refused["op"] == "obs" {
        event.stopped(&mut client).await;
    }
    drop(client);
    event.freed("at a reset").await;

    // With SQLite the replay is lost: the run is void, and its time is given back.
    let mut client = event.playing(100).await;
    event.fill().await;
    play(&mut client, 100, 1200).await;
    let time = client.ask(json!({"op": "time"})).await;
    let answer = event.stopped(&mut client).await;
    event.disk.free();
    let result = match answer {
        Some(answer) => answer,
        None => event.stopped_in_time(&mut client).await,
    };
    let after = client.ask(json!({"op": "time"})).await;
    if replays_are_safe {
        assert_eq!(result["status"], "provisional", "{result}");
    } else {
        assert_eq!(result["status"], "voided", "{result}");
        let given_back_s = number(&time["simulated_s"]) - number(&after["simulated_s"]);
        assert!((given_back_s - 12.0).abs() < 1e-6, "{time} {after}");
        assert!(number(&after["refunded_s"]) > number(&time["refunded_s"]), "{time} {after}");
    }
    drop(client);
    event.disk.fill();
    event.freed("in the middle of a run").await;

    // The client asks once and goes: the result is stored without it.
    let mut client = event.playing(100).await;
    event.fill().await;
    event.stopped(&mut client).await;
    drop(client);
    event.freed("at a stop, whose client goes away").await;

    // The client waits.
    let mut client = event.playing(100).await;
    event.fill().await;
    let answer = event.stopped(&mut client).await;
    event.disk.free();
    if answer.is_none() {
        event.stopped_in_time(&mut client).await;
    }
    drop(client);
    event.disk.fill();
    event.freed("at a stop, whose client waits").await;

    let mut client = event.playing(100).await;
    event.stopped(&mut client).await.expect("a result");
    event.disk.fill();
    let run_id = event.acknowledged.last().expect("a result")["run_id"].clone();
    event.cup.order_or_not("run/reverify", json!({"run_id": run_id, "reason": "a full disk"}));
    tokio::time::sleep(Duration::from_millis(300)).await;
    drop(client);
    event.freed("in a verification").await;
    event.cup.verified(&run_id).await;

    // The check of a hand takes seconds; its file is in the data directory.
    if !replays_are_safe || std::env::var_os("PALMARES_FULL_DISK").is_some() {
        uploads(event).await;
    } else {
        println!("LEFT OUT: the upload of a hand on Postgres; PALMARES_FULL_DISK=all plays it");
    }

    event.fill().await;
    let text = "a".repeat(400);
    let mut announced = 0;
    for _ in 0..40 {
        announced +=
            u32::from(event.cup.order_or_not("announcement", json!({"text": text, "reason": "lunch"})));
    }
    event.freed("at an organizer's command").await;
    event.cup.order("announcement", json!({"text": "dinner", "reason": "dinner"}));
    let audit = event.cup.get("/v1/admin/audit", &event.cup.organizer).json();
    let lunches = audit["records"].as_array().expect("records").iter();
    let lunches = lunches.filter(|entry| entry["reason"] == "lunch").count();
    assert_eq!(lunches, announced as usize, "each command is in the audit, or was refused");

    event.fill().await;
    event.checkpoint().await;
    event.freed("at a checkpoint").await;
}

/// The moment of an upload.
async fn uploads(event: &mut Event) {
    event.fill().await;
    let upload = || send(&event.cup.server, "POST", "/v1/hands", &bearer(&event.token), &claw("claw"));
    let first = upload().status;
    assert!(first == 201 || first == 500, "{first}");
    event.freed("in an upload of a hand").await;
    let upload = || send(&event.cup.server, "POST", "/v1/hands", &bearer(&event.token), &claw("claw"));
    let hand = upload();
    assert_eq!(hand.status, 201, "{}", hand.body);
    let hands = event.cup.get("/v1/admin/hands", &event.cup.organizer).json();
    assert_eq!(hands["hands"].as_array().map(Vec::len), Some(1), "{hands}");
}

impl Event {
    /// Merges the write-ahead log into the tables, which needs space.
    async fn checkpoint(&self) {
        use sqlx::ConnectOptions;
        let url = match &self.cup.database_url {
            Some(url) => url.clone(),
            None => format!("sqlite://{}", self.cup.server.database().display()),
        };
        let statement = match self.cup.database_url {
            Some(_) => "CHECKPOINT",
            None => "PRAGMA wal_checkpoint(TRUNCATE)",
        };
        sqlx::any::install_default_drivers();
        let options: sqlx::any::AnyConnectOptions = url.parse().expect("a URL");
        let mut connection = options.connect().await.expect("opens");
        // It may fail.
        let done = sqlx::query(statement).execute(&mut connection).await;
        println!("the checkpoint: {done:?}");
    }
}

/// Starts a server without space, and ends it after a while. It ends with an error, unless its few writes find space in the pages that are there.
fn without_space(folder: &Path, database_url: Option<&str>, patience_s: u32) -> (Option<i32>, String) {
    let mut command = Command::new("timeout");
    command
        .arg(patience_s.to_string())
        .arg(program())
        .args(["serve", "--listen", "127.0.0.1:0", "--data-dir"])
        .arg(folder);
    command.arg("--config").arg(folder.join("competition.toml")).env_remove("DATABASE_URL");
    if let Some(url) = database_url {
        command.args(["--database-url", url]);
    }
    let output = command.output().expect("palmares runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    println!("a start without space: {:?}: {said}", output.status);
    (output.status.code(), said)
}

/// After a crash, a start without space, and one with space.
async fn starts_again(event: Event) {
    let Event { cup, disk, token, acknowledged } = event;
    let url = cup.database_url.clone();
    let (folder, rules) = cup.killed();
    disk.fill();
    without_space(folder.path(), url.as_deref(), 3);
    disk.free();
    let cup = Official::start_on(folder, &rules, url);
    let mut event = Event { cup, disk, token, acknowledged };
    event.disk.fill();
    event.freed("at a start after a crash").await;
    event.nothing_is_lost();
}

#[tokio::test]
async fn a_full_disk_of_sqlite_loses_nothing_and_the_server_comes_back() {
    let Some(disk) = SmallDisk::mount(24) else { return };
    // The first start makes keys and a token.
    let folder = TempDir::new_in(disk.path()).expect("a folder");
    std::fs::write(folder.path().join("competition.toml"), rules()).expect("rules");
    disk.fill();
    let (code, said) = without_space(folder.path(), None, 60);
    assert!(
        code == Some(1) && (said.contains("full") || said.contains("space") || said.contains("disk")),
        "{said}"
    );
    disk.free();
    let mut event = Event::new(folder, disk, None);
    moments(&mut event).await;
    event.nothing_is_lost();
    starts_again(event).await;
}

#[tokio::test]
async fn a_full_disk_of_postgres_loses_nothing_and_the_server_comes_back() {
    let Some(disk) = SmallDisk::mount(160) else { return };
    let postgres = match Postgres::start(Some(disk.path())) {
        Ok(postgres) => postgres,
        Err(why) => return println!("SKIP on Postgres: {why}"),
    };
    let url = postgres.database("cup").await;
    let mut event = Event::new(TempDir::new().expect("a folder"), disk, Some(url));
    moments(&mut event).await;
    event.nothing_is_lost();
    starts_again(event).await;
}

/// The keys of a host, whose database is elsewhere, on a full disk: none is made by half.
#[tokio::test]
async fn a_first_start_on_a_full_disk_leaves_no_half_key() {
    let Some(disk) = SmallDisk::mount(4) else { return };
    let elsewhere = TempDir::new().expect("a folder");
    let url = format!("sqlite://{}", elsewhere.path().join("cup.sqlite").display());
    let folder = TempDir::new_in(disk.path()).expect("a folder");
    std::fs::write(folder.path().join("competition.toml"), RULES).expect("rules");
    disk.fill();
    let (code, said) = without_space(folder.path(), Some(&url), 60);
    assert!(code == Some(1) && said.contains("No space left"), "{said}");
    for name in ["seed.secret", "signing.key", "organizer.token"] {
        assert!(!folder.path().join(name).exists(), "{name} is there by half");
    }
    disk.free();
    let cup = Official::start_on(folder, RULES, Some(url));
    cup.open();
    assert_eq!(get(&cup.server, "/readyz").status, 200);
}
