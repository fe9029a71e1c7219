//! The thread that writes a replay.

use crate::chain::Chain;
use crate::descriptors;
use crate::format::{
    ACTION, EVENT, HAND_FILES, HAND_RECORD, HASH, POSES, RESULT_RECORD, RUN_RECORD, SCENE, SCENE_RECORD,
    SIGNATURE_DIGITS, SIGNATURE_RECORD, TELEMETRY,
};
use crate::foxglove::{SceneUpdate, Time, scene};
use crate::frames::{FrameTransforms, Frames};
use crate::header::Header;
use crate::item::Item;
use crate::messages::{ActionMessage, HashMessage};
use crate::poses::{ChangedPoses, PoseFrame};
use crate::schema::channel;
use crate::signature::Signer;
use crate::signed_file::{SignedFile, Written};
use crate::telemetry::{TelemetryFilter, TelemetryMessage};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, WriteOptions};
use palmares_senses::ChannelInfo;
use palmares_tasks::{Event, Outcome, Run};
use prost::Message;
use serde::Serialize;
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Error, Result};
use std::sync::Arc;
use std::sync::mpsc::Receiver;

/// Size of a chunk before compression, bytes: a few seconds of a run, which a crash can lose.
const CHUNK_BYTES: u64 = 256 << 10;
/// Level of zstd. The default level takes twice as long, on a core that steps worlds, and saves no space.
const COMPRESSION_LEVEL: u32 = 1;

/// Everything that the thread of the writer starts with.
pub(crate) struct Plan {
    file: File,
    header: Header,
    scene: SceneUpdate,
    frames: Frames,
    shown: ChangedPoses,
    telemetry: TelemetryFilter,
    about: Vec<Metadata>,
    signer: Arc<Signer>,
    hand_files: Option<Arc<Vec<u8>>>,
}

impl Plan {
    /// Copies what is constant from the run at tick 0.
    pub(crate) fn new(
        file: File,
        header: Header,
        run: &Run,
        signer: Arc<Signer>,
        hand_files: Option<Arc<Vec<u8>>>,
    ) -> Self {
        let start = Time::from_ns(start_ns(&header));
        let shown = ChangedPoses::new(run.hand().clone());
        let (scene, frames) = (scene(run, start), Frames::of(run));
        let telemetry = TelemetryFilter::new(run.telemetry_model().clone());
        Plan { file, scene, frames, shown, telemetry, about: about(run), header, signer, hand_files }
    }
}

/// Records for viewers: the hand's description, regions and names.
fn about(run: &Run) -> Vec<Metadata> {
    // Structs of numbers and strings: serialising them cannot fail.
    let json = |value: serde_json::Result<String>| value.unwrap_or_default();
    let record = |name: &str, fields: &[(&str, String)]| Metadata {
        name: name.into(),
        metadata: fields.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect(),
    };
    let scene = run.scene();
    let bodies = scene.bodies.iter().map(|body| body.name.clone());
    let names: Vec<String> = bodies.chain(run.hand_bodies().into_iter().map(|link| link.name)).collect();
    vec![
        record(
            HAND_RECORD,
            &[
                ("description", json(serde_json::to_string(&run.hand().describe()))),
                ("readings", json(serde_json::to_string(&ChannelInfo::in_readings(run.hand())))),
            ],
        ),
        record(
            SCENE_RECORD,
            &[
                ("regions", json(serde_json::to_string(&scene.regions))),
                ("goals", json(serde_json::to_string(&scene.goal_names()))),
                ("names", json(serde_json::to_string(&names))),
            ],
        ),
    ]
}

fn start_ns(header: &Header) -> u64 {
    header.started_unix_ms.saturating_mul(1_000_000)
}

/// Writes until the outcome comes, then signs. If the channel closes before, the file has no end: the run was cut off.
pub(crate) fn write(plan: Plan, inbox: &Receiver<Vec<Item>>) -> Result<Written> {
    let Plan { file, header, scene, frames, shown, telemetry, about, signer, hand_files } = plan;
    let mut log = Log::begin(file, &header, (frames, shown, telemetry), &about, hand_files)?;
    log.message(SCENE, 0, &scene)?;
    while let Ok(items) = inbox.recv() {
        for item in items {
            match item {
                Item::Action(message) => log.chained(ACTION, message.tick, &message)?,
                Item::Event(event) => log.chained(EVENT, event.tick, &event)?,
                Item::Hash(tick, state) => {
                    let chain = log.chain.to_hex();
                    log.chained(HASH, tick, &HashMessage { tick, state, chain })?;
                }
                Item::Poses(frame) => log.poses(&frame)?,
                Item::Outcome(outcome, ended_unix_ms) => return log.end(&outcome, ended_unix_ms, &signer),
            }
        }
    }
    log.mcap.flush().map_err(Error::other)?;
    Err(Error::other("the run was cut off"))
}

/// An open file.
struct Log {
    mcap: mcap::Writer<NoSeek<SignedFile>>,
    file: SignedFile,
    /// By topic: id, and number of messages.
    channels: BTreeMap<&'static str, (u16, u32)>,
    chain: Chain,
    frames: Frames,
    shown: ChangedPoses,
    telemetry: TelemetryFilter,
    start_ns: u64,
    tick_s: f64,
    buffer: Vec<u8>,
}

impl Log {
    fn begin(
        file: File,
        header: &Header,
        (frames, shown, telemetry): (Frames, ChangedPoses, TelemetryFilter),
        about: &[Metadata],
        hand_files: Option<Arc<Vec<u8>>>,
    ) -> Result<Self> {
        // The signature is filled in at the end, so a checksum of the whole data section would become wrong.
        let options = WriteOptions::new()
            .chunk_size(Some(CHUNK_BYTES))
            .compression_threads(0)
            .compression_level(COMPRESSION_LEVEL)
            .calculate_data_section_crc(false)
            // Written bytes do not change, so they can be hashed at once.
            .disable_seeking(true)
            .library(format!("palmares {}", env!("CARGO_PKG_VERSION")));
        let file = SignedFile::new(file);
        let mut mcap = options.create(NoSeek::new(file.clone())).map_err(Error::other)?;
        let metadata = header.to_map();
        let chain = Chain::start(metadata.iter());
        mcap.write_metadata(&Metadata { name: RUN_RECORD.into(), metadata }).map_err(Error::other)?;
        for record in about {
            mcap.write_metadata(record).map_err(Error::other)?;
        }
        let start_ns = start_ns(header);
        if let Some(files) = hand_files {
            mcap.attach(&Attachment {
                log_time: start_ns,
                create_time: start_ns,
                name: HAND_FILES.into(),
                media_type: "application/zip".into(),
                data: Cow::Borrowed(&files),
            })
            .map_err(Error::other)?;
        }
        let mut channels = BTreeMap::new();
        let mut open = |topic, name: &str, [kind, encoding]: [&str; 2], schema: &[u8]| {
            let schema = mcap.add_schema(name, kind, schema).map_err(Error::other)?;
            let id = mcap.add_channel(schema, topic, encoding, &BTreeMap::new()).map_err(Error::other)?;
            channels.insert(topic, (id, 0));
            Ok::<_, Error>(())
        };
        let json = |topic, name, schema: fn(&str) -> Value| (topic, name, schema(name).to_string());
        for (topic, name, schema) in [
            json(ACTION, "palmares.Action", channel::<ActionMessage>),
            json(EVENT, "palmares.Event", channel::<Event>),
            json(HASH, "palmares.Hash", channel::<HashMessage>),
            json(SCENE, "foxglove.SceneUpdate", channel::<SceneUpdate>),
        ] {
            open(topic, name, ["jsonschema", "json"], schema.as_bytes())?;
        }
        for (topic, name, schema) in [
            (POSES, "foxglove.FrameTransforms", descriptors::schema::<FrameTransforms>()),
            (TELEMETRY, "palmares.Telemetry", descriptors::schema::<TelemetryMessage>()),
        ] {
            open(topic, name, ["protobuf", "protobuf"], &schema)?;
        }
        // After a crash, the file has at least its header.
        mcap.flush().map_err(Error::other)?;
        let tick_s = header.tick_s;
        Ok(Log {
            mcap,
            file,
            channels,
            chain,
            frames,
            shown,
            telemetry,
            start_ns,
            tick_s,
            buffer: Vec::new(),
        })
    }

    fn time_ns(&self, tick: u64) -> u64 {
        self.start_ns + (tick as f64 * self.tick_s * 1e9).round() as u64
    }

    /// Writes a message for viewers.
    fn message(&mut self, topic: &'static str, tick: u64, message: &impl Serialize) -> Result<()> {
        self.buffer.clear();
        serde_json::to_writer(&mut self.buffer, message)?;
        self.write_buffer(topic, tick)
    }

    /// Writes a message that decides the score, and extends the chain.
    fn chained(&mut self, topic: &'static str, tick: u64, message: &impl Serialize) -> Result<()> {
        self.buffer.clear();
        serde_json::to_writer(&mut self.buffer, message)?;
        self.chain.extend(topic, &self.buffer);
        self.write_buffer(topic, tick)
    }

    fn write_buffer(&mut self, topic: &'static str, tick: u64) -> Result<()> {
        let time = self.time_ns(tick);
        let Some((channel_id, sequence)) = self.channels.get_mut(topic) else {
            return Err(Error::other(format!("no channel {topic}")));
        };
        let header = MessageHeader {
            channel_id: *channel_id,
            sequence: *sequence,
            log_time: time,
            publish_time: time,
        };
        *sequence = sequence.wrapping_add(1);
        self.mcap.write_to_known_channel(&header, &self.buffer).map_err(Error::other)
    }

    fn poses(&mut self, frame: &PoseFrame) -> Result<()> {
        let time_ns = self.time_ns(frame.tick);
        let changes = self.shown.changes(frame);
        if !changes.is_empty() {
            self.buffer.clear();
            self.frames.write(time_ns, &changes, &mut self.buffer).map_err(Error::other)?;
            self.write_buffer(POSES, frame.tick)?;
        }
        let PoseFrame { tick, score, sample, .. } = frame;
        let Some(message) = self.telemetry.message(time_ns, *tick, *score, sample) else { return Ok(()) };
        self.buffer.clear();
        message.encode(&mut self.buffer).map_err(Error::other)?;
        self.write_buffer(TELEMETRY, *tick)
    }

    fn end(mut self, outcome: &Outcome, ended_unix_ms: u64, signer: &Signer) -> Result<Written> {
        let text = serde_json::to_string(outcome)?;
        self.chain.extend(RESULT_RECORD, text.as_bytes());
        let metadata = BTreeMap::from([
            ("outcome".into(), text),
            // For readers of the file with other programs.
            ("score".into(), outcome.score.to_string()),
            ("ended_unix_ms".into(), ended_unix_ms.to_string()),
        ]);
        let result = Metadata { name: RESULT_RECORD.into(), metadata };
        self.mcap.write_metadata(&result).map_err(Error::other)?;
        let metadata = BTreeMap::from([
            ("algorithm".into(), "ed25519".into()),
            ("chain".into(), self.chain.to_hex()),
            ("public_key".into(), signer.public().to_string()),
            ("signature".into(), "0".repeat(SIGNATURE_DIGITS)),
        ]);
        let signature = Metadata { name: SIGNATURE_RECORD.into(), metadata };
        self.file.signature_follows();
        self.mcap.write_metadata(&signature).map_err(Error::other)?;
        self.mcap.finish().map_err(Error::other)?;
        self.file.sign(signer)
    }
}
