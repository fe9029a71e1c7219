//! Admission: no client can keep the others out, or fill the server's memory.

use crate::harness::{Client, Official, Server, assert_error, bearer, get};
use serde_json::json;
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;
use tempfile::TempDir;
use tokio_tungstenite::connect_async;

#[tokio::test]
async fn silent_sockets_of_one_team_do_not_keep_another_out() {
    let cup = Official::start();
    let (hostile, innocent) = (cup.team("crabs"), cup.team("eels"));
    cup.open();
    let (mut silent, mut refused) = (Vec::new(), 0);
    for _ in 0..300 {
        match connect_async(cup.handshake("/v1/control", &hostile)).await {
            Ok((socket, _)) => silent.push(socket),
            Err(_) => refused += 1,
        }
    }
    assert!((1..=16).contains(&silent.len()) && refused > 0, "{} of 300 were let in", silent.len());
    let (mut client, _) = cup.greet(&innocent).await;
    assert_eq!(client.ask(crate::harness::official_reset()).await["op"], "obs");
    client.goes_on(0).await;
}

#[tokio::test]
async fn a_client_without_hello_is_disconnected() {
    let server = Server::start_with(&["--hello-timeout-s", "1"]);
    let mut silent = Client::connect(&server).await;
    assert_error(&silent.next().await, "too_slow", true);
    assert_eq!(silent.closed().await, (4408, "too_slow".to_owned()));
    let mut unknown = Client::connect(&server).await;
    let resume =
        json!({"op": "hello", "id": 1, "client": {"name": "late", "version": "1"}, "resume_token": "gone"});
    let refused = unknown.ask(resume).await;
    let (code, why) = (refused["code"].clone(), refused["message"].as_str().expect("a reason").to_owned());
    let late = unknown.next().await;
    assert_error(&late, code.as_str().expect("a code"), true);
    assert!(
        late["message"].as_str().is_some_and(|said| said == format!("no session within 1 s: {why}")),
        "{late}"
    );
    let (mut client, welcome) = Client::playing(&server, "polite").await;
    assert_eq!(welcome["limits"]["hello_timeout_s"], 1.0);
    client.listen_for(Duration::from_millis(1500)).await;
    client.goes_on(0).await;
}

/// Sends the head of an upload and as much of its body as the server takes, and does not end it.
fn upload(server: &Server, path: &str, headers: &str, bytes: usize) -> TcpStream {
    let mut stream = TcpStream::connect(server.address()).expect("connects");
    stream.set_write_timeout(Some(Duration::from_secs(20))).expect("a timeout");
    let length = 32 << 20;
    let host = server.address();
    write!(stream, "POST {path} HTTP/1.1\r\nHost: {host}\r\n{headers}Content-Length: {length}\r\n\r\n")
        .expect("sent");
    // A server that refuses does not take it.
    let _ = stream.write_all(&vec![0; bytes]);
    stream
}

fn status(mut stream: TcpStream) -> u16 {
    stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a timeout");
    let mut head = [0; 12];
    stream.read_exact(&mut head).expect("an answer");
    String::from_utf8_lossy(&head[9..]).parse().expect("a status")
}

#[test]
fn a_token_is_looked_at_before_the_body_comes() {
    let cup = Official::start();
    for (headers, expected) in [
        (String::new(), 401),
        (bearer(&format!("plm_{}_{}", "0".repeat(16), "0".repeat(64))), 401),
        (bearer(&cup.organizer), 403),
    ] {
        // Not a byte of the body is sent: a server that waits for it would not answer.
        assert_eq!(status(upload(&cup.server, "/v1/hands", &headers, 0)), expected);
    }
}

#[test]
fn bodies_that_are_held_back_have_a_bound_all_together() {
    let server = Server::start();
    let before = server.most_memory_mib();
    let held: Vec<TcpStream> =
        (0..24).map(|_| upload(&server, "/v1/hands?team=crabs", "", (32 << 20) - 1)).collect();
    // Two of them fill the share of an address; all others are refused.
    let mut refused = 0;
    for mut stream in held.into_iter().rev() {
        let mut head = [0; 12];
        stream.set_read_timeout(Some(Duration::from_secs(5))).expect("a timeout");
        // Held uploads have no answer yet, or the answer that they are too slow.
        refused += usize::from(stream.read_exact(&mut head).is_ok() && head.ends_with(b"503"));
    }
    assert!(refused >= 21, "only {refused} of 24 were refused");
    assert_eq!(get(&server, "/healthz").status, 200);
    match before.zip(server.most_memory_mib()) {
        // The share of an address is 64 MiB, in buffers that grow by doubling.
        Some((before, after)) => assert!(after - before < 160, "{before} MiB grew to {after}"),
        None => println!("LEFT OUT: this system does not report a process's memory in /proc"),
    }
}

#[tokio::test]
async fn a_server_without_descriptors_recovers() {
    let server = Server::start_limited("ulimit -n 96");
    let mut held = Vec::new();
    for _ in 0..120 {
        // The system takes connections that the program cannot.
        held.extend(TcpStream::connect(server.address()));
    }
    assert!(held.len() > 96);
    drop(held);
    let (mut client, _) = Client::playing(&server, "patient").await;
    client.goes_on(0).await;
    assert_eq!(get(&server, "/readyz").status, 200);
}

/// With four controllers' places there are 516 sockets for all. The connections of controllers and viewers are among
/// them: an upgrade does not make their sockets uncounted.
#[tokio::test]
async fn sockets_count_on_after_their_upgrade() {
    let folder = TempDir::new().expect("temporary directory");
    let file = folder.path().join("competition.toml");
    fs::write(&file, "name = \"Practice\"\nmode = \"practice\"\nmax_connections = 4\n").expect("rules");
    let server = Server::start_in(folder, &["--config", file.to_str().expect("a path")]);
    let mut upgraded = Vec::new();
    for path in ["/v1/control", "/v1/watch"].repeat(3) {
        upgraded.push(Client::connect_to(&server, path).await);
    }
    let (all, more) = (516 - upgraded.len(), 20);
    let sockets: Vec<TcpStream> =
        (0..all + more).map(|_| TcpStream::connect(server.address()).expect("connects")).collect();
    // Accepted in their order: the last ones are refused at once, those before them have no answer yet.
    let refused = sockets.into_iter().rev().take_while(|mut stream| {
        stream.set_read_timeout(Some(Duration::from_secs(2))).expect("a timeout");
        let mut head = [0; 12];
        stream.read_exact(&mut head).is_ok() && head.ends_with(b"503")
    });
    let refused = refused.count();
    assert!(
        refused >= more,
        "{refused} refused: {} sockets beside {} upgraded",
        all + more - refused,
        upgraded.len()
    );
}

#[tokio::test]
async fn of_many_hellos_at_once_one_begins_and_the_others_hear_that_it_is_taken() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let mut clients = Vec::new();
    for _ in 0..16 {
        clients.push(cup.connect(&token).await);
    }
    let pending = clients.into_iter().map(|mut client| {
        tokio::spawn(async move {
            let reply = client.ask(json!({"op": "hello", "client": "test"})).await;
            (client, reply)
        })
    });
    let pending: Vec<_> = pending.collect();
    let mut begun = 0;
    let mut kept = Vec::new();
    for answer in pending {
        let (client, reply) = answer.await.expect("an answer");
        match reply["op"].as_str() {
            Some("welcome") => begun += 1,
            _ => assert_error(&reply, "session_taken", false),
        }
        kept.push(client);
    }
    assert_eq!(begun, 1);
}
