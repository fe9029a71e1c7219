//! Reads a replay without trusting a byte of it.
//!
//! The file may come from anybody: sizes are checked before memory is allocated, counts are bounded, and the
//! signature is checked over every byte before a tick is simulated.

use crate::chain::Chain;
use crate::format::{
    ACTION, EVENT, HAND_FILES, HASH, POSES, RESULT_RECORD, RUN_RECORD, SCENE, SIGNATURE_DIGITS,
    SIGNATURE_RECORD, TELEMETRY,
};
use crate::header::Header;
use crate::messages::{ActionMessage, HashMessage, PushMessage, StateHash};
use crate::records::{self, Frame};
use crate::signature::PublicKey;
use crate::verify_error::VerifyError;
use mcap::records::{Metadata, Record, op};
use palmares_tasks::{Action, Event, Outcome};
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::panic::catch_unwind;

/// Largest number of ticks; the task's time limit is checked before the simulation.
const MAX_TICKS: usize = 1 << 20;
/// Largest number of events.
const MAX_EVENTS: usize = 1 << 20;

/// A tick of a replay.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedTick {
    /// The action as applied.
    pub action: Action,
    /// Digest of the state after the tick, if it was recorded.
    pub state: Option<StateHash>,
    /// External wrenches that begin with this tick.
    pub pushes: Vec<PushMessage>,
}

/// A replay whose chain and signature are valid; [`crate::verify`] checks it by simulation.
#[derive(Debug)]
pub struct Replay {
    /// Identity of the run, and everything that its bits depend on.
    pub header: Header,
    /// Every tick.
    pub actions: Vec<RecordedTick>,
    /// Events of the referee.
    pub events: Vec<Event>,
    /// Hashes of the state, by tick.
    pub hashes: Vec<(u64, StateHash)>,
    /// Outcome of the run.
    pub outcome: Outcome,
    /// The hand's archive, if the hand is not built in.
    pub hand_files: Option<Vec<u8>>,
    /// Key of the signature.
    pub key: PublicKey,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Size of the file.
    pub bytes: usize,
    /// Messages with poses.
    pub pose_messages: u64,
    /// Messages with telemetry; early files have none.
    pub telemetry: u64,
}

impl Replay {
    /// Number of ticks whose state was recorded.
    pub fn states(&self) -> usize {
        let recorded =
            self.actions.iter().zip(1..).filter(|(tick, _)| tick.state.is_some()).map(|(_, tick)| tick);
        self.hashes.iter().map(|(tick, _)| *tick).chain(recorded).collect::<BTreeSet<u64>>().len()
    }

    /// Checks that the expected key signed it; without one, any key is accepted.
    pub fn signed_by(&self, expected: Option<&PublicKey>) -> Result<(), VerifyError> {
        match expected {
            Some(expected) if *expected != self.key => {
                Err(VerifyError::BadSignature(format!("signed by {}, not by {expected}", self.key)))
            }
            _ => Ok(()),
        }
    }
}

/// The range of the signature's digits in a file.
pub(crate) fn find_signature(bytes: &[u8]) -> Result<Range<usize>, VerifyError> {
    let mut found = None;
    for frame in records::frames(bytes)? {
        let Some(metadata) = metadata(&frame)? else { continue };
        if metadata.name != SIGNATURE_RECORD {
            continue;
        }
        // Keys are written in order of name, so that the signature is the last of the record.
        let end = frame.start + frame.body.len();
        let place = end.saturating_sub(SIGNATURE_DIGITS)..end;
        let digits = metadata.metadata.get("signature");
        if digits.map(String::as_bytes) != bytes.get(place.clone()) || found.replace(place).is_some() {
            return Err(damaged(frame.start, "the signature is not where it should be"));
        }
    }
    found.ok_or_else(|| {
        VerifyError::Truncated("it has no signature: the run was cut off, or is still going on".into())
    })
}

/// Reads a replay and checks its chain and its signature.
pub fn read(bytes: &[u8]) -> Result<Replay, VerifyError> {
    // The bounds should prevent a panic of a library; if one happens all the same, only this file is refused.
    catch_unwind(|| read_all(bytes))
        .unwrap_or_else(|_| Err(VerifyError::ChainBroken("a damaged record made the reader fail".into())))
}

/// As [`read`], but panics are not caught.
pub(crate) fn read_all(bytes: &[u8]) -> Result<Replay, VerifyError> {
    let mut reading = Reading::default();
    let mut unpacked = 0;
    for frame in records::frames(bytes)? {
        match frame.opcode {
            op::METADATA => reading.metadata(&frame)?,
            op::ATTACHMENT => reading.attachment(&frame)?,
            op::CHUNK => {
                unpacked +=
                    records::each_of_chunk(&frame, &mut |record| reading.record(frame.start, record))?;
                if unpacked > records::UNPACKED_BYTES {
                    return Err(damaged(frame.start, "the chunks together are too large"));
                }
            }
            op::MESSAGE | op::CHANNEL if reading.header.is_some() && !reading.summary => {
                let record = mcap::parse_record(frame.opcode, frame.body);
                reading.record(frame.start, record.map_err(|error| damaged(frame.start, error))?)?;
            }
            op::DATA_END => reading.summary = true,
            // The summary repeats earlier records; the signature covers it.
            _ => {}
        }
    }
    reading.end(bytes)
}

/// Calls `see` with the time and the bytes of every `foxglove.FrameTransforms`.
pub fn each_pose_message(bytes: &[u8], see: &mut dyn FnMut(u64, &[u8])) -> Result<(), VerifyError> {
    each_message(bytes, POSES, see)
}

/// Calls `see` with every message of a topic and its time.
pub(crate) fn each_message(
    bytes: &[u8],
    wanted: &str,
    see: &mut dyn FnMut(u64, &[u8]),
) -> Result<(), VerifyError> {
    let mut channels = BTreeMap::new();
    for frame in records::frames(bytes)?.iter().filter(|frame| frame.opcode == op::CHUNK) {
        records::each_of_chunk(frame, &mut |record| {
            match record {
                Record::Channel(channel) => {
                    channels.insert(channel.id, channel.topic);
                }
                Record::Message { header, data }
                    if channels.get(&header.channel_id).is_some_and(|topic| topic == wanted) =>
                {
                    see(header.log_time, &data);
                }
                _ => {}
            }
            Ok(())
        })?;
    }
    Ok(())
}

fn damaged(at: usize, what: impl ToString) -> VerifyError {
    VerifyError::ChainBroken(format!("the record at byte {at} is damaged: {}", what.to_string()))
}

fn metadata(frame: &Frame<'_>) -> Result<Option<Metadata>, VerifyError> {
    if frame.opcode != op::METADATA {
        return Ok(None);
    }
    match mcap::parse_record(frame.opcode, frame.body) {
        Ok(Record::Metadata(metadata)) => Ok(Some(metadata)),
        Ok(_) => Ok(None),
        Err(error) => Err(damaged(frame.start, error)),
    }
}

/// The part of a file that has been read.
#[derive(Default)]
struct Reading {
    header: Option<Header>,
    chain: Option<Chain>,
    channels: BTreeMap<u16, String>,
    actions: Vec<RecordedTick>,
    events: Vec<Event>,
    hashes: Vec<(u64, StateHash)>,
    outcome: Option<Outcome>,
    hand_files: Option<Vec<u8>>,
    signature: Option<BTreeMap<String, String>>,
    pose_messages: u64,
    telemetry: u64,
    summary: bool,
}

impl Reading {
    fn metadata(&mut self, frame: &Frame<'_>) -> Result<(), VerifyError> {
        let Some(Metadata { name, metadata }) = metadata(frame)? else { return Ok(()) };
        let twice = || Err(damaged(frame.start, format!("{name} appears twice or in the wrong place")));
        match name.as_str() {
            RUN_RECORD => {
                if self.header.is_some() {
                    return twice();
                }
                self.header = Some(Header::from_map(&metadata)?);
                self.chain = Some(Chain::start(metadata.iter()));
            }
            RESULT_RECORD => {
                let (Some(chain), None) = (&mut self.chain, &self.outcome) else { return twice() };
                let text = metadata.get("outcome").map_or("", String::as_str);
                chain.extend(RESULT_RECORD, text.as_bytes());
                self.outcome = Some(parse(frame.start, text.as_bytes())?);
            }
            SIGNATURE_RECORD => {
                if self.outcome.is_none() || self.signature.is_some() {
                    return twice();
                }
                self.signature = Some(metadata);
            }
            _ => {}
        }
        Ok(())
    }

    fn attachment(&mut self, frame: &Frame<'_>) -> Result<(), VerifyError> {
        let (name, data) = records::attachment(frame)?;
        if name == HAND_FILES && self.hand_files.replace(data.to_vec()).is_some() {
            return Err(damaged(frame.start, format!("{HAND_FILES} appears twice")));
        }
        Ok(())
    }

    /// A record of a chunk.
    fn record(&mut self, at: usize, record: Record<'_>) -> Result<(), VerifyError> {
        match record {
            Record::Channel(channel) => {
                let known = self.channels.insert(channel.id, channel.topic.clone());
                if known.is_some_and(|known| known != channel.topic) {
                    return Err(damaged(at, "a channel changes its topic"));
                }
                Ok(())
            }
            Record::Message { header, data } => {
                let Some(topic) = self.channels.get(&header.channel_id) else {
                    return Err(damaged(at, "a message without a channel"));
                };
                match topic.as_str() {
                    ACTION => self.action(at, &data),
                    EVENT => self.event(at, &data),
                    HASH => self.hash(at, &data),
                    POSES => {
                        self.pose_messages += 1;
                        Ok(())
                    }
                    TELEMETRY => {
                        self.telemetry += 1;
                        Ok(())
                    }
                    SCENE => Ok(()),
                    _ => Err(damaged(at, "an unknown topic")),
                }
            }
            _ => Ok(()),
        }
    }

    /// The chain, which starts with the header.
    fn chain(&mut self) -> Result<&mut Chain, VerifyError> {
        if self.outcome.is_some() {
            return Err(VerifyError::ChainBroken("there are messages after the result".into()));
        }
        let missing = || VerifyError::NotAReplay(format!("it does not begin with {RUN_RECORD}"));
        self.chain.as_mut().ok_or_else(missing)
    }

    fn action(&mut self, at: usize, data: &[u8]) -> Result<(), VerifyError> {
        self.chain()?.extend(ACTION, data);
        let ActionMessage { tick, action, state, pushes } = parse(at, data)?;
        if tick != self.actions.len() as u64 || self.actions.len() == MAX_TICKS {
            let expected = self.actions.len();
            return Err(VerifyError::ChainBroken(format!(
                "expected the action of tick {expected}, found that of tick {tick}"
            )));
        }
        self.actions.push(RecordedTick { action, state, pushes });
        Ok(())
    }

    fn event(&mut self, at: usize, data: &[u8]) -> Result<(), VerifyError> {
        self.chain()?.extend(EVENT, data);
        if self.events.len() == MAX_EVENTS {
            return Err(damaged(at, "too many events"));
        }
        self.events.push(parse(at, data)?);
        Ok(())
    }

    fn hash(&mut self, at: usize, data: &[u8]) -> Result<(), VerifyError> {
        let before = self.chain()?.to_hex();
        let HashMessage { tick, state, chain } = parse(at, data)?;
        if chain != before {
            return Err(VerifyError::ChainBroken(format!(
                "the data before the hash of tick {tick} was changed"
            )));
        }
        if tick != self.actions.len() as u64 || self.hashes.len() > MAX_TICKS {
            return Err(VerifyError::ChainBroken(format!("the hash of tick {tick} is in the wrong place")));
        }
        self.chain()?.extend(HASH, data);
        self.hashes.push((tick, state));
        Ok(())
    }

    fn end(self, bytes: &[u8]) -> Result<Replay, VerifyError> {
        let (Some(header), Some(chain)) = (self.header, self.chain) else {
            return Err(VerifyError::NotAReplay(format!("an MCAP file, but without a {RUN_RECORD} record")));
        };
        // After the chain, whose errors say more exactly what was changed.
        let place = find_signature(bytes)?;
        let (Some(outcome), Some(signature)) = (self.outcome, self.signature) else {
            return Err(VerifyError::Truncated("it has no result".into()));
        };
        let field = |name: &str| signature.get(name).map_or("", String::as_str);
        if field("chain") != chain.to_hex() {
            return Err(VerifyError::ChainBroken("the data before the signature was changed".into()));
        }
        if field("algorithm") != "ed25519" {
            return Err(VerifyError::BadSignature("its algorithm is not ed25519".into()));
        }
        let key: PublicKey = field("public_key")
            .parse()
            .map_err(|why| VerifyError::BadSignature(format!("its public key cannot be read: {why}")))?;
        let mut hash = Sha256::new();
        hash.update(&bytes[..place.start]);
        hash.update([b'0'; SIGNATURE_DIGITS]);
        hash.update(&bytes[place.end..]);
        if !key.signed(&hash.finalize().into(), field("signature")) {
            return Err(VerifyError::BadSignature(format!("the signature of {key} does not fit the file")));
        }
        Ok(Replay {
            header,
            actions: self.actions,
            events: self.events,
            hashes: self.hashes,
            outcome,
            hand_files: self.hand_files,
            key,
            sha256: hex::encode(Sha256::digest(bytes)),
            bytes: bytes.len(),
            pose_messages: self.pose_messages,
            telemetry: self.telemetry,
        })
    }
}

fn parse<T: DeserializeOwned>(at: usize, data: &[u8]) -> Result<T, VerifyError> {
    serde_json::from_slice(data).map_err(|error| damaged(at, error))
}
