//! What the cameras of a run saw, drawn again from its replay into a file of its own.

use crate::descriptors::{self, TIME, TIMESTAMP, field, file, list, message};
use crate::frames::{self, FrameTransforms};
use crate::reader::Replay;
use crate::verify::verify_watched;
use crate::verify_error::VerifyError;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_tasks::image::{CameraImage, Pixels};
use palmares_tasks::run::ShotError;
use palmares_tasks::{Noise, Run, Sensing, Task};
use prost::Message;
use prost_types::field_descriptor_proto::Type;
use prost_types::{FileDescriptorSet, Timestamp};
use std::collections::BTreeMap;
use std::fs::File;
use std::sync::Arc;

/// Why there is no film.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// There are no such cameras.
    #[error(transparent)]
    Cameras(#[from] ShotError),
    /// The run does not come to what was recorded.
    #[error("refused: {name}: {0}", name = .0.name())]
    Replay(#[from] VerifyError),
    /// The file cannot be written.
    #[error("cannot write the pictures: {0}")]
    Write(#[from] mcap::McapError),
}

/// `foxglove.RawImage`
#[derive(Clone, PartialEq, Message)]
pub(crate) struct RawImage {
    #[prost(message, required, tag = "1")]
    pub(crate) timestamp: Timestamp,
    #[prost(fixed32, tag = "2")]
    pub(crate) width: u32,
    #[prost(fixed32, tag = "3")]
    pub(crate) height: u32,
    #[prost(string, tag = "4")]
    pub(crate) encoding: String,
    #[prost(fixed32, tag = "5")]
    pub(crate) step: u32,
    #[prost(bytes = "vec", tag = "6")]
    pub(crate) data: Vec<u8>,
    #[prost(string, tag = "7")]
    pub(crate) frame_id: String,
}

/// `foxglove.CameraCalibration`
#[derive(Clone, PartialEq, Message)]
pub(crate) struct CameraCalibration {
    #[prost(message, required, tag = "1")]
    pub(crate) timestamp: Timestamp,
    #[prost(fixed32, tag = "2")]
    pub(crate) width: u32,
    #[prost(fixed32, tag = "3")]
    pub(crate) height: u32,
    #[prost(string, tag = "4")]
    pub(crate) distortion_model: String,
    #[prost(double, repeated, tag = "5")]
    pub(crate) d: Vec<f64>,
    #[prost(double, repeated, tag = "6")]
    pub(crate) k: Vec<f64>,
    #[prost(double, repeated, tag = "7")]
    pub(crate) r: Vec<f64>,
    #[prost(double, repeated, tag = "8")]
    pub(crate) p: Vec<f64>,
    #[prost(string, tag = "9")]
    pub(crate) frame_id: String,
}

/// The `FileDescriptorSet`s of both, whose fields are those of the published definitions
/// (<https://github.com/foxglove/foxglove-sdk/tree/main/schemas/proto/foxglove>).
fn schemas() -> [Vec<u8>; 2] {
    let time = || field("timestamp", Type::Message, Some(TIMESTAMP));
    let number = |name: &str| field(name, Type::Fixed32, None);
    let text = |name: &str| field(name, Type::String, None);
    let matrix = |name: &str| list(name, Type::Double, None);
    let image = vec![
        time(),
        number("width"),
        number("height"),
        text("encoding"),
        number("step"),
        field("data", Type::Bytes, None),
        text("frame_id"),
    ];
    let calibration = vec![
        time(),
        number("width"),
        number("height"),
        text("distortion_model"),
        matrix("D"),
        matrix("K"),
        matrix("R"),
        matrix("P"),
        text("frame_id"),
    ];
    [("RawImage", image), ("CameraCalibration", calibration)].map(|(name, fields)| {
        let described = file(&format!("foxglove/{name}.proto"), "foxglove", &[TIME], message(name, fields));
        FileDescriptorSet { file: vec![descriptors::time(), described] }.encode_to_vec()
    })
}

/// A depth in millimetres, as 16UC1 has it (REP 118 of ROS); 0 stays 0.
fn millimetres(depth: &Pixels, unit: f64) -> Vec<u8> {
    let pixels = depth.0.chunks_exact(2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]));
    Pixels::of_words(&pixels.map(|steps| (1e3 * unit * f64::from(steps) + 0.5) as u16).collect::<Vec<_>>()).0
}

struct Film {
    mcap: mcap::Writer<File>,
    /// Ids of the schemas of pictures, calibrations and frames.
    schemas: [u16; 3],
    /// By topic: id and number of messages so far.
    channels: BTreeMap<String, (u16, u32)>,
    start_ns: u64,
    tick_s: f64,
    /// The last picture of each camera, by its tick.
    last: BTreeMap<String, u64>,
    pictures: u64,
}

impl Film {
    fn write(
        &mut self,
        topic: &str,
        schema: usize,
        time_ns: u64,
        message: &impl Message,
    ) -> mcap::McapResult<()> {
        let (channel_id, sequence) = match self.channels.get(topic) {
            Some(known) => *known,
            None => (self.mcap.add_channel(self.schemas[schema], topic, "protobuf", &BTreeMap::new())?, 0),
        };
        self.channels.insert(topic.to_owned(), (channel_id, sequence + 1));
        let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
        self.mcap.write_to_known_channel(&header, &message.encode_to_vec())
    }

    /// Writes a picture that is newer than the last one of its camera.
    fn add(&mut self, image: &CameraImage) -> mcap::McapResult<()> {
        if self.last.insert(image.camera.clone(), image.tick) == Some(image.tick) {
            return Ok(());
        }
        let CameraImage { camera, width, height, fx, fy, cx, cy, .. } = image;
        let time_ns = self.start_ns + (image.tick as f64 * self.tick_s * 1e9).round() as u64;
        let (timestamp, frame_id) = (descriptors::timestamp(time_ns), format!("camera/{camera}"));
        let raw = |encoding: &str, pixel: u32, data: Vec<u8>| RawImage {
            timestamp,
            width: *width,
            height: *height,
            encoding: encoding.into(),
            step: pixel * width,
            data,
            frame_id: frame_id.clone(),
        };
        let depth =
            image.depth.as_ref().map(|depth| ("depth", "16UC1", 2, millimetres(depth, image.depth_unit)));
        let rgb = image.rgb.as_ref().map(|rgb| ("rgb", "rgb8", 3, rgb.0.clone()));
        let bodies = image.bodies.as_ref().map(|bodies| ("bodies", "16UC1", 2, bodies.0.clone()));
        for (channel, encoding, pixel, data) in [depth, rgb, bodies].into_iter().flatten() {
            self.write(&format!("/{frame_id}/{channel}"), 0, time_ns, &raw(encoding, pixel, data))?;
            self.pictures += 1;
        }
        let calibration = CameraCalibration {
            timestamp,
            width: *width,
            height: *height,
            distortion_model: String::new(),
            d: Vec::new(),
            k: vec![*fx, 0.0, *cx, 0.0, *fy, *cy, 0.0, 0.0, 1.0],
            r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: vec![*fx, 0.0, *cx, 0.0, 0.0, *fy, *cy, 0.0, 0.0, 0.0, 1.0, 0.0],
            frame_id: frame_id.clone(),
        };
        self.write(&format!("/{frame_id}/calibration"), 1, time_ns, &calibration)?;
        let [x, y, z, w] = image.quat_xyzw;
        let pose = Pose::from_parts(Vec3::from_array(image.position), Rotation::from_xyzw(x, y, z, w));
        self.write("/tf", 2, time_ns, &FrameTransforms::of(time_ns, &frame_id, pose))
    }
}

/// Simulates a run again and writes what `cameras` saw (`name` or `name.channel`, as a controller asks for them): those with
/// noise at their own rate, others `rate_hz` times a second. `own` are tasks beside those of the program. Returns how many
/// pictures there are.
///
/// # Errors
/// There is no such camera, the replay is refused, or the file cannot be written.
pub fn film(
    replay: &Replay,
    own: &[Arc<Task>],
    cameras: &[String],
    rate_hz: f64,
    out: File,
) -> Result<u64, FilmError> {
    let mut mcap = WriteOptions::new().create(out)?;
    let [image, calibration] = schemas();
    let schemas = [
        mcap.add_schema("foxglove.RawImage", "protobuf", &image)?,
        mcap.add_schema("foxglove.CameraCalibration", "protobuf", &calibration)?,
        mcap.add_schema("foxglove.FrameTransforms", "protobuf", &frames::schema())?,
    ];
    let tick_s = replay.header.tick_s;
    let start_ns = replay.header.started_unix_ms.saturating_mul(1_000_000);
    let (channels, last) = (BTreeMap::new(), BTreeMap::new());
    let mut film = Film { mcap, schemas, channels, start_ns, tick_s, last, pictures: 0 };
    let (mut failure, real) = (None, replay.header.noise == Noise::Real);
    let mut look = |run: &mut Run| {
        let number = |tick: u64| (tick as f64 * tick_s * rate_hz + 1e-9) as u64;
        let tick = run.tick();
        // Real cameras have pictures when they have them; one that was there before is left out.
        let between = !real && tick > 0 && number(tick) == number(tick - 1);
        if failure.is_some() || between {
            return;
        }
        let mut take = || -> Result<(), FilmError> {
            // The run is over: everything may be seen.
            let shots = run.shots(cameras, Sensing::Truth)?;
            run.expose(&shots).iter().try_for_each(|exposure| Ok(film.add(exposure.render())?))
        };
        failure = take().err();
    };
    let verified = verify_watched(replay, own, Some(&mut look));
    if let Some(error) = failure {
        return Err(error);
    }
    verified?;
    film.mcap.finish()?;
    Ok(film.pictures)
}
