//! The client against servers with certificates: of a test authority, whose key is thrown away, and as `openssl req -x509` makes them.

use crate::admin::client::{Access, Client};
use crate::health::{HealthOptions, health};
use clap::Parser;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ServerConfig, ServerConnection, StreamOwned};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::sync::Arc;

const AUTHORITY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/http/authority.pem");
const LOCALHOST: &[u8] = include_bytes!("localhost.pem");
/// Certificates of `localhost` that are their own authority; the second was valid in 2020.
const SELF_SIGNED: &[u8] = include_bytes!("self_signed.pem");
const EXPIRED: &[u8] = include_bytes!("expired.pem");

#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    access: Access,
}

/// The answer to `GET /` that a client gets, or its error.
fn get(url: &str, ca: Option<&str>) -> Result<String, String> {
    let mut words = vec!["test", "--url", url];
    words.extend(ca.iter().flat_map(|file| ["--ca", file]));
    let access = Arguments::parse_from(words).access;
    let answer = Client::with_token(&access, "plm_test".into()).and_then(|client| client.get("/"));
    answer.map(|value| value.to_string()).map_err(|error| format!("{error:#}"))
}

/// The error of `palmares health`.
fn ill(url: &str) -> String {
    #[derive(Parser)]
    struct Arguments {
        #[command(flatten)]
        options: HealthOptions,
    }
    let options = Arguments::parse_from(["test", "--url", url]).options;
    format!("{:#}", health(&options).expect_err("not healthy"))
}

/// Answers one request on each connection.
fn answer(stream: &mut (impl Read + Write)) {
    let mut reader = BufReader::new(stream);
    let mut line = String::new();
    while reader.read_line(&mut line).is_ok_and(|bytes| bytes > 2) {
        line.clear();
    }
    let _ =
        reader.get_mut().write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 4\r\nConnection: close\r\n\r\ntrue");
    let _ = reader.get_mut().flush();
}

/// A server, with TLS or without; its port.
fn server(secure: bool) -> u16 {
    server_with(LOCALHOST, secure)
}

/// A server with the certificate and the key of a PEM file; its port.
fn server_with(pem: &'static [u8], secure: bool) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let certificates = CertificateDer::pem_slice_iter(pem).map(|one| one.expect("a certificate")).collect();
    let key = PrivateKeyDer::from_pem_slice(pem).expect("a key");
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ServerConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
    let config = config.expect("versions").with_no_client_auth().with_single_cert(certificates, key);
    let config = Arc::new(config.expect("a configuration"));
    std::thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            let connection = ServerConnection::new(config.clone()).expect("a connection");
            if secure {
                answer(&mut StreamOwned::new(connection, stream));
            } else {
                answer(&mut { stream });
            }
        }
    });
    port
}

#[test]
fn a_server_with_a_certificate_of_the_named_authority_is_trusted() {
    let port = server(true);
    assert_eq!(get(&format!("https://localhost:{port}"), Some(AUTHORITY)), Ok("true".into()));
}

/// A PEM file of the tests.
fn file(name: &str) -> String {
    format!("{}/src/http/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_server_with_the_named_certificate_is_trusted() {
    let port = server_with(SELF_SIGNED, true);
    let url = format!("https://localhost:{port}");
    assert_eq!(get(&url, Some(&file("self_signed.pem"))), Ok("true".into()));
    // Not without its name, not by another, and not for another host.
    for (url, ca, part) in [
        (url.clone(), None, "--ca names"),
        (url.clone(), Some(AUTHORITY), "or with the server's own"),
        (url, Some(&*file("expired.pem")), "or with the server's own"),
        (
            format!("https://127.0.0.1:{port}"),
            Some(&*file("self_signed.pem")),
            "another name than that of --url",
        ),
    ] {
        let error = get(&url, ca).expect_err("not trusted");
        assert!(error.contains(part), "{url} {ca:?}: {error}");
    }
    let port = server_with(EXPIRED, true);
    let error = get(&format!("https://localhost:{port}"), Some(&file("expired.pem"))).expect_err("expired");
    assert!(error.contains("a certificate of today"), "{error}");
}

#[test]
fn an_error_says_what_is_wrong_and_what_helps() {
    let (secure, plain) = (server(true), server(false));
    let closed =
        TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("a port").port();
    for (url, ca, parts) in [
        (format!("https://localhost:{secure}"), None, ["UnknownIssuer", "--ca names"]),
        (
            format!("https://127.0.0.1:{secure}"),
            Some(AUTHORITY),
            ["not valid for name", "another name than that of --url"],
        ),
        (format!("https://localhost:{plain}"), Some(AUTHORITY), ["InvalidContentType", "without TLS"]),
        (format!("http://127.0.0.1:{closed}"), None, ["refused", "is the server running?"]),
        (format!("https://localhost:{closed}"), Some(AUTHORITY), ["refused", "is the server running?"]),
        ("http://no-such-host.invalid".into(), None, ["no-such-host", "--url names another"]),
        ("ftp://localhost".into(), None, ["--url ftp://localhost", "https://HOST:PORT"]),
        (
            format!("https://localhost:{secure}"),
            Some("/no/such/file"),
            ["--ca /no/such/file", "No such file"],
        ),
        (
            format!("https://localhost:{secure}"),
            Some(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")),
            ["--ca", "no certificate"],
        ),
    ] {
        let error = get(&url, ca).expect_err(&url);
        assert!(parts.iter().all(|part| error.contains(part)), "{url} {ca:?}: {error}");
    }
    // The check of a server's health asks in the same way.
    let error = ill(&format!("https://localhost:{secure}"));
    assert!(error.contains("UnknownIssuer"), "{error}");
    let error = ill(&format!("http://127.0.0.1:{closed}"));
    assert!(error.contains("is the server running?"), "{error}");
}
