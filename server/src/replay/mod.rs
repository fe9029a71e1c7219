//! Replays: everything needed to play a run again, bit for bit, and to show that nobody touched the record.
//!
//! A [`Recorder`] writes while the run goes on; [`read`] takes a file apart without trusting a byte of it;
//! [`verify`] simulates it again. The format is described in `docs/replays.md`.

mod archive;
mod auditor;
mod chain;
mod foxglove;
mod frames;
mod hands;
mod header;
mod identity;
mod item;
mod key;
mod likeness;
mod messages;
mod pack;
mod poses;
mod reader;
mod recorder;
mod records;
mod retention;
mod schema;
mod signed_file;
mod trajectory;
mod verify;
mod verify_error;
mod writer;

#[cfg(test)]
mod tests;

pub(crate) use archive::{Archive, KEY_FILE, Recording};
pub(crate) use auditor::audit;
pub(crate) use header::{Header, Kind, Pacing, word};
pub(crate) use key::PublicKey;
#[cfg(test)]
pub(crate) use likeness::Mark;
pub(crate) use likeness::{Marks, is_told};
pub(crate) use pack::pack;
pub(crate) use reader::{Replay, each_picture, read};
pub(crate) use recorder::ReplayFile;
pub(crate) use records::FILE_BYTES;
pub(crate) use trajectory::Trajectory;
pub(crate) use verify::{Verified, verify};
pub(crate) use verify_error::VerifyError;

use crate::auth::hex as to_hex;

/// Topic of [`messages::ActionMessage`].
const ACTION: &str = "/action";
/// Topic of the referee's notes.
const EVENT: &str = "/event";
/// Topic of [`messages::HashMessage`].
const HASH: &str = "/hash";
/// Topic of the bodies' shapes.
const SCENE: &str = "/scene";
/// Topic of the bodies' poses.
const POSES: &str = "/tf";

/// Name of the metadata record with the header.
const RUN_RECORD: &str = "palmares.run";
/// Name of the metadata record with the outcome.
const RESULT_RECORD: &str = "palmares.result";
/// Name of the metadata record with the signature.
const SIGNATURE_RECORD: &str = "palmares.signature";
/// Hexadecimal digits of a signature.
const SIGNATURE_DIGITS: usize = 128;
/// Name of the attachment with a hand's files.
const HAND_FILES: &str = "hand.zip";

/// Ticks between two hashes of the state.
const HASH_EVERY: u64 = 100;

/// The bytes of lower-case hexadecimal digits; nothing else is taken, so that every value has one spelling.
fn from_hex<const N: usize>(text: &str) -> Option<[u8; N]> {
    let digit = |c: u8| match c {
        b'0'..=b'9' => Some(c - b'0'),
        b'a'..=b'f' => Some(c - b'a' + 10),
        _ => None,
    };
    let text = text.as_bytes();
    if text.len() != 2 * N {
        return None;
    }
    let mut bytes = [0; N];
    for (byte, pair) in bytes.iter_mut().zip(text.chunks_exact(2)) {
        *byte = digit(pair[0])? << 4 | digit(pair[1])?;
    }
    Some(bytes)
}
