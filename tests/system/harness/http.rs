//! A GET by hand: one connection, one answer.

use super::Server;
use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;

/// An answer of the server.
pub(crate) struct Response {
    /// 200, 404, …
    pub(crate) status: u16,
    /// Lower-case header lines.
    pub(crate) head: String,
    /// The rest.
    pub(crate) body: String,
}

impl Response {
    /// The body as JSON.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.body).expect("JSON")
    }

    /// Checks that this is a problem with a code.
    pub(crate) fn assert_problem(&self, status: u16, code: &str) {
        assert_eq!(self.status, status, "{}", self.body);
        assert!(self.head.contains("content-type: application/problem+json"), "{}", self.head);
        assert_eq!(self.json()["code"], code, "{}", self.body);
        assert_eq!(self.json()["status"], status, "{}", self.body);
    }
}

/// GETs a path.
pub(crate) fn get(server: &Server, path: &str) -> Response {
    request(server, "GET", path)
}

/// GETs a file: status and content.
pub(crate) fn get_bytes(server: &Server, path: &str) -> (u16, Vec<u8>) {
    let (status, _, body) = exchange(server, "GET", path, "", b"");
    (status, body)
}

/// Any request without a body.
pub(crate) fn request(server: &Server, method: &str, path: &str) -> Response {
    send(server, method, path, "", b"")
}

/// Any request, with more header lines and a body; its answer is text.
pub(crate) fn send(server: &Server, method: &str, path: &str, headers: &str, body: &[u8]) -> Response {
    let (status, head, body) = exchange(server, method, path, headers, body);
    Response { status, head: head.to_lowercase(), body: String::from_utf8(body).expect("text") }
}

/// Status, head and body of the answer to any request.
pub(crate) fn exchange(
    server: &Server,
    method: &str,
    path: &str,
    headers: &str,
    body: &[u8],
) -> (u16, String, Vec<u8>) {
    let mut stream = TcpStream::connect(server.address()).expect("connects");
    let (host, length) = (server.address(), body.len());
    // HTTP/1.0: the answer ends where the connection does.
    let head =
        format!("{method} {path} HTTP/1.0\r\nHost: {host}\r\n{headers}Content-Length: {length}\r\n\r\n");
    // A server that refuses may not read the body to its end.
    let _ = stream.write_all(&[head.as_bytes(), body].concat());
    // It may also close the connection with unread bytes.
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let split = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a head and a body");
    let body = answer.split_off(split + 4);
    let head = String::from_utf8(answer).expect("text");
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
    (status, head, body)
}
