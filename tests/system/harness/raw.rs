//! A WebSocket client that sends any bytes (RFC 6455), without a WebSocket library.

use super::Server;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// A test that waits longer than this hangs.
const PATIENCE: Duration = Duration::from_secs(60);
/// The mask of all frames; any is as good.
const MASK: [u8; 4] = [0x37, 0xfa, 0x21, 0x3d];

pub(crate) const CONTINUATION: u8 = 0;
pub(crate) const TEXT: u8 = 1;
pub(crate) const BINARY: u8 = 2;
pub(crate) const CLOSE: u8 = 8;
pub(crate) const PING: u8 = 9;
pub(crate) const PONG: u8 = 10;

/// A frame to send, with everything that can be wrong about it.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    last: bool,
    reserved: u8,
    opcode: u8,
    masked: bool,
    /// The length that the header states; None for the payload's.
    length: Option<u64>,
    /// Bytes of the length: 0 (in seven bits), 2 or 8; None for the shortest form.
    length_bytes: Option<u8>,
    payload: Vec<u8>,
}

impl Frame {
    pub(crate) fn new(opcode: u8, payload: impl AsRef<[u8]>) -> Self {
        let payload = payload.as_ref().to_vec();
        Frame { last: true, reserved: 0, opcode, masked: true, length: None, length_bytes: None, payload }
    }

    /// A close frame with a code.
    pub(crate) fn close(code: u16, reason: &[u8]) -> Self {
        Frame::new(CLOSE, [&code.to_be_bytes(), reason].concat())
    }

    /// More fragments follow.
    pub(crate) fn unfinished(self) -> Self {
        Frame { last: false, ..self }
    }

    pub(crate) fn reserved(self, bits: u8) -> Self {
        Frame { reserved: bits, ..self }
    }

    pub(crate) fn unmasked(self) -> Self {
        Frame { masked: false, ..self }
    }

    /// States another length than that of the payload.
    pub(crate) fn stating(self, length: u64) -> Self {
        Frame { length: Some(length), ..self }
    }

    pub(crate) fn length_bytes(self, bytes: u8) -> Self {
        Frame { length_bytes: Some(bytes), ..self }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let length = self.length.unwrap_or(self.payload.len() as u64);
        let shortest = match length {
            0..126 => 0,
            126..65536 => 2,
            _ => 8,
        };
        let masked = u8::from(self.masked) << 7;
        let mut bytes = vec![u8::from(self.last) << 7 | self.reserved << 4 | self.opcode];
        match self.length_bytes.unwrap_or(shortest) {
            0 => bytes.push(masked | length.to_le_bytes()[0]),
            2 => {
                bytes.push(masked | 126);
                bytes.extend(&length.to_be_bytes()[6..]);
            }
            _ => {
                bytes.push(masked | 127);
                bytes.extend(length.to_be_bytes());
            }
        }
        if self.masked {
            bytes.extend(MASK);
            bytes.extend(self.payload.iter().zip(MASK.iter().cycle()).map(|(byte, mask)| byte ^ mask));
        } else {
            bytes.extend(&self.payload);
        }
        bytes
    }
}

/// A message from the server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Got {
    Text(String),
    Binary(Vec<u8>),
    Pong(Vec<u8>),
    /// Code and reason; no code for an empty payload.
    Close(Option<u16>, String),
    /// The end of the stream, in order.
    End,
    /// The connection was reset.
    Reset,
}

/// An open socket.
pub(crate) struct RawSocket {
    stream: TcpStream,
    unread: Vec<u8>,
}

/// Sends the head of a request; returns the stream and the answer's head in lower case.
pub(crate) fn answer_to(server: &Server, head: &str) -> (TcpStream, String) {
    let mut stream = TcpStream::connect(server.address()).expect("connects");
    stream.set_read_timeout(Some(PATIENCE)).expect("possible");
    stream.set_nodelay(true).expect("possible");
    stream.write_all(head.as_bytes()).expect("open");
    let mut answer = Vec::new();
    let mut byte = [0];
    while !answer.ends_with(b"\r\n\r\n") {
        match stream.read(&mut byte) {
            Ok(1) => answer.push(byte[0]),
            end => panic!("no whole head, but {end:?} after {}", String::from_utf8_lossy(&answer)),
        }
    }
    (stream, String::from_utf8(answer).expect("text").to_lowercase())
}

impl RawSocket {
    /// Opens a socket with a subprotocol.
    pub(crate) fn open(server: &Server, path: &str, subprotocol: &str) -> Self {
        Self::open_with(server, path, subprotocol, "")
    }

    /// The same with more header lines.
    pub(crate) fn open_with(server: &Server, path: &str, subprotocol: &str, headers: &str) -> Self {
        let host = server.address();
        let head = format!(
            "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
             Sec-WebSocket-Protocol: {subprotocol}\r\n{headers}\r\n"
        );
        let (stream, answer) = answer_to(server, &head);
        assert!(answer.starts_with("http/1.1 101 "), "{answer}");
        // The example of RFC 6455, section 1.3.
        assert!(answer.contains("sec-websocket-accept: s3pplmbitxaq9kygzzhzrbk+xoo=\r\n"), "{answer}");
        RawSocket { stream, unread: Vec::new() }
    }

    /// Sends bytes to a server that may have closed already.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        let _ = self.stream.write_all(bytes);
    }

    /// Fills the buffer up to `count` bytes; returns how the stream ended, if it did.
    fn fill(&mut self, count: usize) -> Result<(), Got> {
        let mut piece = [0; 4096];
        while self.unread.len() < count {
            match self.stream.read(&mut piece) {
                Ok(0) => return Err(Got::End),
                Ok(length) => self.unread.extend(&piece[..length]),
                Err(error) if matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe) => {
                    return Err(Got::Reset);
                }
                Err(error) => panic!("nothing came: {error}"),
            }
        }
        Ok(())
    }

    /// The next frame that is no ping, or the end.
    pub(crate) fn next(&mut self) -> Got {
        loop {
            match self.frame() {
                Err(end) => return end,
                Ok((PING, payload)) => self.send(&Frame::new(PONG, payload).bytes()),
                Ok((opcode, payload)) => {
                    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
                    return match opcode {
                        TEXT => Got::Text(text(&payload)),
                        BINARY => Got::Binary(payload),
                        PONG => Got::Pong(payload),
                        CLOSE => match payload.split_first_chunk() {
                            Some((code, reason)) => Got::Close(Some(u16::from_be_bytes(*code)), text(reason)),
                            None => Got::Close(None, text(&payload)),
                        },
                        other => panic!("opcode {other} with {payload:?}"),
                    };
                }
            }
        }
    }

    /// Opcode and payload of the next frame, whose form is checked.
    fn frame(&mut self) -> Result<(u8, Vec<u8>), Got> {
        self.fill(2)?;
        assert_eq!(self.unread[0] & 0xf0, 0x80, "the server sends whole messages without extensions");
        assert_eq!(self.unread[1] & 0x80, 0, "a server does not mask");
        let (header, length) = match self.unread[1] {
            126 => {
                self.fill(4)?;
                (4, usize::from(u16::from_be_bytes([self.unread[2], self.unread[3]])))
            }
            127 => {
                self.fill(10)?;
                let length: [u8; 8] = self.unread[2..10].try_into().expect("eight bytes");
                (10, usize::try_from(u64::from_be_bytes(length)).expect("fits"))
            }
            length => (2, usize::from(length)),
        };
        self.fill(header + length)?;
        let opcode = self.unread[0] & 0x0f;
        let payload = self.unread[header..header + length].to_vec();
        self.unread.drain(..header + length);
        Ok((opcode, payload))
    }
}
