//! A server alone, whose network to the database fails.

use crate::harness::{Official, RULES, postgres_database};
use serde_json::json;
use sqlx::postgres::PgConnectOptions;
use sqlx::{ConnectOptions, Executor};
use std::thread;
use std::time::Duration;
use tempfile::TempDir;
use tokio::io::copy_bidirectional;
use tokio::net::{TcpListener, TcpStream, UnixStream};
use tokio::sync::watch;
use tokio::time::{sleep, timeout};

/// The network, as its connections find it.
#[derive(Clone, Copy, Default)]
struct NetworkState {
    cuts: u32,
    cut: bool,
}

/// A network between server and database. Bytes that are sent in a cut are lost, and a connection from before it stays silent.
struct Network {
    state: watch::Sender<NetworkState>,
    url: String,
}

impl Network {
    /// A network to a database that a socket file leads to.
    fn to(url: &str) -> Self {
        let (host, database) = url.split_once('@').and_then(|(_, rest)| rest.split_once('/')).expect("a URL");
        let socket = format!("{}/.s.PGSQL.5432", host.replace("%2F", "/"));
        let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
        let port = listener.local_addr().expect("bound").port();
        let (state, states) = watch::channel(NetworkState::default());
        // A runtime of its own: tests block theirs.
        thread::spawn(move || {
            let runtime =
                tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
            runtime.block_on(async {
                listener.set_nonblocking(true).expect("it can");
                let listener = TcpListener::from_std(listener).expect("bound");
                while let Ok((connection, _)) = listener.accept().await {
                    tokio::spawn(pass(connection, socket.clone(), states.clone()));
                }
            });
        });
        Network { state, url: format!("postgres://palmares@127.0.0.1:{port}/{database}") }
    }

    fn cut(&self) {
        self.state.send_modify(|state| *state = NetworkState { cuts: state.cuts + 1, cut: true });
    }

    fn heal(&self) {
        self.state.send_modify(|state| state.cut = false);
    }
}

/// Passes on what a connection carries, until the next cut; then nothing, and it stays open.
async fn pass(mut connection: TcpStream, socket: String, mut states: watch::Receiver<NetworkState>) {
    let NetworkState { cuts, cut } = *states.borrow();
    let mut database = UnixStream::connect(socket).await.expect("connects");
    if !cut {
        tokio::select! {
            _ = copy_bidirectional(&mut connection, &mut database) => return,
            _ = states.wait_for(|state| state.cuts != cuts) => {}
        }
    }
    std::future::pending::<()>().await;
}

#[tokio::test]
async fn a_server_alone_goes_on_when_its_network_is_back() {
    let Some(url) = postgres_database().await else { return };
    let network = Network::to(&url);
    let folder = TempDir::new().expect("temporary directory");
    let cup = Official::start_on(folder, RULES, Some(network.url.clone()));
    let team = cup.team("crabs");
    cup.open();
    let (mut client, _, obs) = cup.playing(&team).await;
    client.goes_on(0).await;
    let options: PgConnectOptions = url.parse().expect("a URL");
    let mut holder = options.connect().await.expect("connects");
    holder.execute("BEGIN; SELECT 1 FROM sessions FOR UPDATE").await.expect("locks");
    let healed = async {
        // The result is on its way: its statement waits for the lock.
        let waits = "SELECT COUNT(*) FROM pg_stat_activity WHERE wait_event_type = 'Lock'";
        while sqlx::query_scalar::<_, i64>(waits).fetch_one(&mut holder).await.expect("a number") == 0 {
            sleep(Duration::from_millis(5)).await;
        }
        network.cut();
        holder.execute("ROLLBACK").await.expect("unlocks");
        sleep(Duration::from_secs(4)).await;
        network.heal();
    };
    let stopped = async {
        loop {
            let answer = client.ask(json!({"op": "stop"})).await;
            if answer["code"] != "internal" {
                return answer;
            }
            sleep(Duration::from_millis(100)).await;
        }
    };
    let both = async { tokio::join!(stopped, healed) };
    // TCP would not give the connections up: they stay open.
    let (result, ()) = timeout(Duration::from_secs(60), both).await.expect("it is answered");
    assert_eq!((&result["op"], &result["status"]), (&json!("result"), &json!("provisional")), "{result}");
    cup.verified(&obs["run_id"]).await;
}
