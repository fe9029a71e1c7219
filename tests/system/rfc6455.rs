//! Frames, fragments, text and closing of both sockets as RFC 6455 defines them: the substance of the groups 1 to 7 and 10 of
//! Autobahn's test suite. The sockets do not echo, so a case looks at replies, pongs and close codes.

use crate::harness::raw::{BINARY, CLOSE, CONTINUATION, Frame, Got, PING, PONG, RawSocket, TEXT, answer_to};
use crate::harness::{Client, Server};
use serde_json::{Value, json};
use std::borrow::Cow;

/// A socket and an encoding of its messages.
#[derive(Clone, Copy, Debug)]
struct SocketKind {
    path: &'static str,
    subprotocol: &'static str,
    /// A request that is always answered.
    op: &'static str,
    opcode: u8,
}

const KINDS: [SocketKind; 4] = [
    SocketKind { path: "/v1/control", subprotocol: "palmares.v1.json", op: "time", opcode: TEXT },
    SocketKind { path: "/v1/control", subprotocol: "palmares.v1.msgpack", op: "time", opcode: BINARY },
    SocketKind { path: "/v1/watch", subprotocol: "palmares.v1.json", op: "list", opcode: TEXT },
    SocketKind { path: "/v1/watch", subprotocol: "palmares.v1.bin", op: "list", opcode: TEXT },
];

impl SocketKind {
    /// A request with an id.
    fn request(self, id: u64) -> Vec<u8> {
        let request = json!({"op": self.op, "id": id});
        if self.opcode == TEXT {
            request.to_string().into_bytes()
        } else {
            rmp_serde::to_vec_named(&request).expect("encodes")
        }
    }

    /// The request in one frame.
    fn whole(self, id: u64) -> Frame {
        Frame::new(self.opcode, self.request(id))
    }

    /// The request in fragments of this many bytes.
    fn fragments(self, id: u64, bytes: usize) -> Vec<Frame> {
        fragments(self.opcode, &self.request(id), bytes)
    }
}

fn fragments(opcode: u8, message: &[u8], bytes: usize) -> Vec<Frame> {
    let count = message.len().div_ceil(bytes);
    let frame = |(k, piece): (usize, &[u8])| {
        let frame = Frame::new(if k == 0 { opcode } else { CONTINUATION }, piece);
        if k + 1 == count { frame } else { frame.unfinished() }
    };
    message.chunks(bytes).enumerate().map(frame).collect()
}

/// The message that must come from the server.
#[derive(Clone, Debug)]
enum Expected {
    /// A message with this id.
    Reply(u64),
    /// An error with this code; whether it is fatal.
    Error(&'static str, bool),
    Pong(Vec<u8>),
    /// A close frame with this code, or without one; then the end of the stream, without a reset.
    Close(Option<u16>),
}

use Expected::{Close, Error, Pong, Reply};

/// A case: its name, the bytes that are sent, piece by piece, and the answers. Without a close frame among the answers, the client
/// closes with 1000 and expects the same.
struct Case {
    name: Cow<'static, str>,
    sent: Vec<Vec<u8>>,
    expected: Vec<Expected>,
}

#[derive(Default)]
struct Cases(Vec<Case>);

impl Cases {
    fn add(&mut self, name: impl Into<Cow<'static, str>>, frames: &[Frame], expected: &[Expected]) {
        let sent = vec![frames.iter().flat_map(Frame::bytes).collect()];
        self.0.push(Case { name: name.into(), sent, expected: expected.to_vec() });
    }

    /// The same, sent byte by byte.
    fn add_chopped(&mut self, name: &'static str, frames: &[Frame], expected: &[Expected]) {
        let sent = frames.iter().flat_map(Frame::bytes).map(|byte| vec![byte]).collect();
        self.0.push(Case { name: name.into(), sent, expected: expected.to_vec() });
    }
}

/// Group 1: lengths of messages.
fn framing(kind: SocketKind, cases: &mut Cases) {
    cases.add("1 whole", &[kind.whole(1)], &[Reply(1)]);
    cases.add_chopped("1 byte by byte", &[kind.whole(1)], &[Reply(1)]);
    cases.add("1 two in a row", &[kind.whole(1), kind.whole(2)], &[Reply(1), Reply(2)]);
    cases.add("1 length in two bytes", &[kind.whole(1).length_bytes(2)], &[Reply(1)]);
    cases.add("1 length in eight bytes", &[kind.whole(1).length_bytes(8)], &[Reply(1)]);
    cases.add("1 empty", &[Frame::new(kind.opcode, b"")], &[Error("bad_json", false)]);
    let too_large = [Error("too_large", true), Close(Some(4413))];
    for length in [1 << 30, 1 << 62, 1 << 63, u64::MAX] {
        let announced = [Frame::new(kind.opcode, b"x").stating(length).length_bytes(8)];
        cases.add(format!("1 {length} bytes announced"), &announced, &too_large);
    }
    if kind.opcode == TEXT {
        for bytes in [125, 126, 127, 128, 4096, 65535, 65536] {
            cases.add(format!("1 {bytes} bytes"), &[Frame::new(TEXT, padded(kind, bytes))], &[Reply(1)]);
        }
        cases.add("1 65537 bytes", &[Frame::new(TEXT, padded(kind, 65537))], &too_large);
        let mut wrong_type = vec![Frame::new(BINARY, kind.request(1)), kind.whole(2)];
        wrong_type.push(Frame::new(PING, b"x"));
        cases.add("1 binary", &wrong_type, &[Error("bad_json", false), Reply(2), Pong(b"x".to_vec())]);
    }
    let violation = [Close(Some(1002))];
    cases.add("1 unmasked", &[kind.whole(1).unmasked()], &violation);
    cases.add("1 unmasked ping", &[Frame::new(PING, b"x").unmasked()], &violation);
    cases.add("1 unmasked close", &[Frame::close(1000, b"").unmasked()], &violation);
}

/// A request of this many bytes: JSON allows white space at the end.
fn padded(kind: SocketKind, bytes: usize) -> Vec<u8> {
    let mut request = kind.request(1);
    request.resize(bytes, b' ');
    request
}

/// Group 2: pings and pongs.
fn pings(kind: SocketKind, cases: &mut Cases) {
    let all: Vec<u8> = (0..125).map(|k| 255 - k).collect();
    for payload in [&b""[..], b"Hello", &[0, 255, 254, 253], &all] {
        let frames = [Frame::new(PING, payload)];
        cases.add(format!("2 ping of {} bytes", payload.len()), &frames, &[Pong(payload.to_vec())]);
    }
    cases.add("2 ping of 126 bytes", &[Frame::new(PING, [0; 126])], &[Close(Some(1002))]);
    cases.add_chopped("2 ping byte by byte", &[Frame::new(PING, b"Hello")], &[Pong(b"Hello".to_vec())]);
    cases.add("2 unsolicited pong", &[Frame::new(PONG, b""), kind.whole(1)], &[Reply(1)]);
    let frames = [Frame::new(PONG, b"mine"), Frame::new(PING, b"yours")];
    cases.add("2 unsolicited pong, then ping", &frames, &[Pong(b"yours".to_vec())]);
    let ten: Vec<Frame> = (0..10).map(|k| Frame::new(PING, [k])).collect();
    let pongs: Vec<Expected> = (0..10).map(|k| Pong(vec![k])).collect();
    cases.add("2 ten pings", &ten, &pongs);
    cases.add_chopped("2 ten pings byte by byte", &ten, &pongs);
}

/// Groups 3 and 4: reserved bits and opcodes.
fn reserved(kind: SocketKind, cases: &mut Cases) {
    let then = |frame: Frame| [kind.whole(1), frame, Frame::new(PING, b"late")];
    for bits in 1..8 {
        let expected = [Reply(1), Close(Some(1002))];
        cases.add(format!("3 bits {bits}"), &then(kind.whole(2).reserved(bits)), &expected);
        cases.add(format!("3 bits {bits} of a ping"), &then(Frame::new(PING, b"").reserved(bits)), &expected);
        cases.add(
            format!("3 bits {bits} of a close"),
            &then(Frame::close(1000, b"").reserved(bits)),
            &expected,
        );
    }
    for opcode in (3..8).chain(11..16) {
        for payload in [&b""[..], b"x"] {
            let frames = then(Frame::new(opcode, payload));
            cases.add(
                format!("4 opcode {opcode} with {} bytes", payload.len()),
                &frames,
                &[Reply(1), Close(Some(1002))],
            );
        }
    }
}

/// Groups 5 and 10: fragments.
fn fragmentation(kind: SocketKind, cases: &mut Cases) {
    let violation = [Close(Some(1002))];
    cases.add("5 unfinished ping", &[Frame::new(PING, b"x").unfinished()], &violation);
    cases.add("5 unfinished pong", &[Frame::new(PONG, b"x").unfinished()], &violation);
    cases.add("5 unfinished close", &[Frame::close(1000, b"").unfinished()], &violation);
    for bytes in [1, 2, 7] {
        cases.add(format!("5 fragments of {bytes} bytes"), &kind.fragments(1, bytes), &[Reply(1)]);
    }
    cases.add_chopped("5 fragments byte by byte", &kind.fragments(1, 3), &[Reply(1)]);
    let (mut with_pings, mut answers) = (Vec::new(), Vec::new());
    for (k, frame) in (0..).zip(kind.fragments(1, 5)) {
        if k > 0 {
            with_pings.push(Frame::new(PING, [k]));
            answers.push(Pong(vec![k]));
        }
        with_pings.push(frame);
    }
    answers.push(Reply(1));
    cases.add("5 pings between fragments", &with_pings, &answers);
    cases.add_chopped("5 pings between fragments byte by byte", &with_pings, &answers);
    let empty = Frame::new(CONTINUATION, b"").unfinished();
    let mut hollow = vec![Frame::new(kind.opcode, b"").unfinished()];
    hollow.extend(vec![empty; 10_000]);
    hollow.push(Frame::new(CONTINUATION, kind.request(1)));
    cases.add("5 empty fragments", &hollow, &[Reply(1)]);
    let lone = Frame::new(CONTINUATION, b"x");
    cases.add("5 nothing to continue", std::slice::from_ref(&lone), &violation);
    cases.add("5 nothing to continue, unfinished", &[lone.clone().unfinished()], &violation);
    cases.add("5 nothing left to continue", &[kind.whole(1), lone], &[Reply(1), Close(Some(1002))]);
    for opcode in [TEXT, BINARY] {
        let frames = [kind.whole(1).unfinished(), Frame::new(opcode, b"{}")];
        cases.add(format!("5 opcode {opcode} within fragments"), &frames, &violation);
    }
    if kind.opcode == TEXT {
        let largest = fragments(TEXT, &padded(kind, 65536), 1300);
        cases.add("10 the largest message in fragments", &largest, &[Reply(1)]);
        let larger = fragments(TEXT, &padded(kind, 80_000), 10_000);
        cases.add("10 fragments of a larger one", &larger, &[Error("too_large", true), Close(Some(4413))]);
    }
}

/// Group 6: text.
fn text(kind: SocketKind, cases: &mut Cases) {
    if kind.opcode != TEXT {
        return;
    }
    let named = |name: &str| format!("{{\"op\":\"{name}\",\"id\":1}}").into_bytes();
    // ASCII, two to four bytes, the first and last of each length, and characters that mean nothing.
    for name in [
        "Hello",
        "κόσμε",
        "\u{80}\u{7ff}",
        "\u{800}\u{ffff}",
        "\u{10000}\u{10ffff}",
        "\u{d7ff}\u{e000}",
        "\u{fffd}\u{fffe}",
    ] {
        let message = named(name);
        cases.add(format!("6 {name:?}"), &[Frame::new(TEXT, &message)], &[Reply(1)]);
        cases.add(format!("6 {name:?} in fragments"), &fragments(TEXT, &message, 1), &[Reply(1)]);
    }
    let wrong: [&[u8]; 16] = [
        b"\xff",
        b"\xfe",
        b"\x80",
        b"\xbf",
        b"\xc3",
        b"\xc3(",
        b"\xe2\x82",
        b"\xf0\x9f\x98",
        b"\xc0\x80",
        b"\xc1\xbf",
        b"\xe0\x80\xaf",
        b"\xf0\x80\x80\xaf",
        b"\xed\xa0\x80",
        b"\xed\xbf\xbf",
        b"\xf4\x90\x80\x80",
        b"\xf8\x88\x80\x80\x80",
    ];
    for bytes in wrong {
        let message = [b"{\"op\":\"", bytes, b"\",\"id\":1}"].concat();
        let expected = [Close(Some(1007))];
        cases.add(format!("6 {bytes:x?}"), &[Frame::new(TEXT, &message)], &expected);
        cases.add(format!("6 {bytes:x?} in fragments"), &fragments(TEXT, &message, 1), &expected);
        cases.add(format!("6 {bytes:x?} at the end"), &[Frame::new(TEXT, bytes)], &expected);
    }
    let early = [Frame::new(TEXT, b"\xce\xba\xe1\xbd\xb9\xed\xa0\x80").unfinished()];
    cases.add("6 wrong before the end", &early, &[Close(Some(1007))]);
}

/// Group 7: closing.
fn closing(kind: SocketKind, cases: &mut Cases) {
    let normal = || Frame::close(1000, b"");
    let closed = Close(Some(1000));
    cases.add("7 after a request", &[kind.whole(1), normal()], &[Reply(1), closed.clone()]);
    cases.add("7 two closes", &[normal(), normal()], std::slice::from_ref(&closed));
    cases.add("7 ping after close", &[normal(), Frame::new(PING, b"x")], std::slice::from_ref(&closed));
    cases.add("7 request after close", &[normal(), kind.whole(1)], std::slice::from_ref(&closed));
    let flood = vec![kind.whole(1); 2000];
    cases.add(
        "7 many requests after close",
        &[vec![normal()], flood].concat(),
        std::slice::from_ref(&closed),
    );
    cases.add("7 within fragments", &[kind.whole(1).unfinished(), normal()], std::slice::from_ref(&closed));
    cases.add("7 empty", &[Frame::new(CLOSE, b"")], &[Close(None)]);
    cases.add("7 one byte", &[Frame::new(CLOSE, b"\x03")], &[Close(Some(1002))]);
    cases.add("7 reason", &[Frame::close(1000, b"Hello")], std::slice::from_ref(&closed));
    cases.add("7 longest reason", &[Frame::close(1000, &[b'*'; 123])], &[closed]);
    cases.add("7 too long a reason", &[Frame::close(1000, &[b'*'; 124])], &[Close(Some(1002))]);
    cases.add(
        "7 reason that is not UTF-8",
        &[Frame::close(1000, b"\xce\xba\xed\xa0\x80")],
        &[Close(Some(1007))],
    );
    for code in [1001, 1002, 1003, 1007, 1008, 1009, 1010, 1011, 3000, 3999, 4000, 4999] {
        cases.add(format!("7 code {code}"), &[Frame::close(code, b"")], &[Close(Some(code))]);
    }
    for code in [0, 999, 1004, 1005, 1006, 1015, 1016, 1100, 2000, 2999, 5000, 65535] {
        cases.add(format!("7 invalid code {code}"), &[Frame::close(code, b"")], &[Close(Some(1002))]);
    }
}

fn message(kind: SocketKind, got: &Got) -> Option<Value> {
    match got {
        Got::Text(text) if kind.opcode == TEXT => serde_json::from_str(text).ok(),
        Got::Binary(bytes) if kind.opcode == BINARY => rmp_serde::from_slice(bytes).ok(),
        _ => None,
    }
}

/// Whether the socket does what is expected; otherwise what it did.
fn check(server: &Server, kind: SocketKind, case: &Case) -> Result<(), String> {
    let mut socket = RawSocket::open(server, kind.path, kind.subprotocol);
    for piece in &case.sent {
        socket.send(piece);
    }
    let mut expected = case.expected.clone();
    if !matches!(expected.last(), Some(Close(_))) {
        expected.push(Close(Some(1000)));
    }
    for (k, expected) in expected.iter().enumerate() {
        if k == case.expected.len() {
            socket.send(&Frame::close(1000, b"").bytes());
        }
        let got = socket.next();
        let message = message(kind, &got);
        let same = match expected {
            Reply(id) => message.is_some_and(|message| message["id"] == *id),
            Error(code, fatal) => message.is_some_and(|message| {
                message["op"] == "error" && message["code"] == *code && message["fatal"] == *fatal
            }),
            Pong(payload) => got == Got::Pong(payload.clone()),
            Close(code) => matches!(&got, Got::Close(sent, _) if sent == code),
        };
        if !same {
            return Err(format!("expected {expected:?}, got {got:?}"));
        }
        if let Close(_) = expected {
            // The answer, which a server that has begun to close waits for.
            socket.send(&Frame::close(1000, b"").bytes());
            let end = socket.next();
            if end != Got::End {
                return Err(format!("expected the end after the close frame, got {end:?}"));
            }
        }
    }
    Ok(())
}

#[test]
fn every_frame_is_answered_as_the_rfc_says() {
    let server = Server::start();
    let mut wrong = Vec::new();
    let mut count = 0;
    for kind in KINDS {
        let mut cases = Cases::default();
        for group in [framing, pings, reserved, fragmentation, text, closing] {
            group(kind, &mut cases);
        }
        for case in &cases.0 {
            count += 1;
            if let Err(why) = check(&server, kind, case) {
                wrong.push(format!("{} {}: {}: {why}", kind.path, kind.subprotocol, case.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {count} cases:\n{}", wrong.len(), wrong.join("\n"));
    assert!(count > 400, "{count}");
}

#[tokio::test]
async fn a_violation_ends_the_connection_but_not_the_session() {
    let server = Server::start();
    let mut socket = RawSocket::open(&server, "/v1/control", "palmares.v1.json");
    socket.send(&Frame::new(TEXT, r#"{"op":"hello","id":1,"client":"raw"}"#).bytes());
    let Got::Text(welcome) = socket.next() else { panic!("no welcome") };
    let welcome: Value = serde_json::from_str(&welcome).expect("JSON");
    // Sent in one piece with the end of the connection, so that unread bytes are left when the server closes.
    let bytes = [Frame::new(TEXT, b"\xff").bytes(), vec![0x81; 100_000]].concat();
    socket.send(&bytes);
    assert!(matches!(socket.next(), Got::Close(Some(1007), _)));
    assert_eq!(socket.next(), Got::End);
    let (mut again, back) = Client::resume(&server, &welcome["resume_token"]).await;
    assert_eq!(back["session_id"], welcome["session_id"], "{back}");
    again.ask(json!({"op": "time"})).await;
}

#[test]
fn an_upgrade_that_is_not_valid_is_refused() {
    let server = Server::start();
    let host = server.address();
    let valid = format!(
        "GET PATH HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
         Sec-WebSocket-Protocol: palmares.v1.json\r\n\r\n"
    );
    let key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let changes = [
        ("Version: 13", "Version: 8", 426),
        ("Version: 13", "Version: 14", 426),
        ("Version: 13", "Version: 13, 8", 426),
        ("Version: 13", "Version: x", 426),
        ("Sec-WebSocket-Version: 13\r\n", "", 426),
        (key, "", 400),
        (key, "Sec-WebSocket-Key: abc\r\n", 400),
        (key, "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25j\r\n", 400),
        ("Upgrade: websocket", "Upgrade: h2c", 400),
        ("Connection: Upgrade", "Connection: keep-alive", 400),
        ("palmares.v1.json", "chat", 400),
        ("HTTP/1.1", "HTTP/1.0", 400),
        ("GET", "POST", 405),
    ];
    for path in ["/v1/control", "/v1/watch"] {
        for (from, to, status) in changes {
            let head = valid.replace("PATH", path).replace(from, to);
            let (_stream, answer) = answer_to(&server, &head);
            assert_eq!(
                answer.split(' ').nth(1),
                Some(status.to_string().as_str()),
                "{path} {from} → {to}: {answer}"
            );
            assert_eq!(answer.contains("sec-websocket-version: 13\r\n"), status == 426, "{answer}");
            assert!(answer.contains("content-type: application/problem+json"), "{answer}");
        }
        let extended = valid.replace("PATH", path).replace(
            "Sec-WebSocket-Version",
            "Sec-WebSocket-Extensions: permessage-deflate; client_max_window_bits\r\nSec-WebSocket-Version",
        );
        let (_stream, answer) = answer_to(&server, &extended);
        assert!(answer.starts_with("http/1.1 101 ") && !answer.contains("extensions"), "{answer}");
    }
}
