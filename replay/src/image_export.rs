//! Renders the camera images of a recorded run, and writes them into another file.
//!
//! The fields of the messages are those of the published definitions
//! (<https://github.com/foxglove/foxglove-sdk/tree/main/schemas/proto/foxglove>).

use crate::descriptors::{self, described};
use crate::frames::FrameTransforms;
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
use prost_types::Timestamp;
use std::collections::BTreeMap;
use std::fs::File;
use std::sync::Arc;

/// Reason why images cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// There are no such cameras.
    #[error(transparent)]
    Cameras(#[from] ShotError),
    /// The simulation differs from the recording.
    #[error("refused: {name}: {0}", name = .0.name())]
    Replay(#[from] VerifyError),
    /// The file cannot be written.
    #[error("cannot write the images: {0}")]
    Write(#[from] mcap::McapError),
}

described! {
    "foxglove", "RawImage":
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
}

described! {
    "foxglove", "CameraCalibration":
    /// `foxglove.CameraCalibration`
    #[allow(non_snake_case, reason = "the names of the published definition")]
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
        pub(crate) D: Vec<f64>,
        #[prost(double, repeated, tag = "6")]
        pub(crate) K: Vec<f64>,
        #[prost(double, repeated, tag = "7")]
        pub(crate) R: Vec<f64>,
        #[prost(double, repeated, tag = "8")]
        pub(crate) P: Vec<f64>,
        #[prost(string, tag = "9")]
        pub(crate) frame_id: String,
    }
}

/// A depth in millimetres, as 16UC1 has it (REP 118 of ROS); 0 stays 0.
fn millimetres(depth: &Pixels, unit: f64) -> Vec<u8> {
    let pixels = depth.0.chunks_exact(2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]));
    Pixels::of_words(&pixels.map(|steps| (1e3 * unit * f64::from(steps) + 0.5) as u16).collect::<Vec<_>>()).0
}

struct ImageFile {
    mcap: mcap::Writer<File>,
    /// Ids of the schemas of images, calibrations and frames.
    schemas: [u16; 3],
    /// By topic: id, and number of messages.
    channels: BTreeMap<String, (u16, u32)>,
    start_ns: u64,
    tick_s: f64,
    /// Tick of the last image of each camera.
    last: BTreeMap<String, u64>,
    images: u64,
}

impl ImageFile {
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

    /// Writes an image that is newer than the last one of its camera.
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
            self.images += 1;
        }
        let calibration = CameraCalibration {
            timestamp,
            width: *width,
            height: *height,
            distortion_model: String::new(),
            D: Vec::new(),
            K: vec![*fx, 0.0, *cx, 0.0, *fy, *cy, 0.0, 0.0, 1.0],
            R: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            P: vec![*fx, 0.0, *cx, 0.0, 0.0, *fy, *cy, 0.0, 0.0, 0.0, 1.0, 0.0],
            frame_id: frame_id.clone(),
        };
        self.write(&format!("/{frame_id}/calibration"), 1, time_ns, &calibration)?;
        let [x, y, z, w] = image.quat_xyzw;
        let pose = Pose::from_parts(Vec3::from_array(image.position), Rotation::from_xyzw(x, y, z, w));
        self.write("/tf", 2, time_ns, &FrameTransforms::of(time_ns, &frame_id, pose))
    }
}

/// Simulates a run again and writes the images of `cameras` (`name` or `name.channel`, as in a controller's request):
/// of cameras with noise at their own rate, of others `rate_hz` times per second. `own`: tasks that are not built in.
/// Returns the number of images.
///
/// # Errors
/// There is no such camera, the replay is refused, or the file cannot be written.
pub fn export_images(
    replay: &Replay,
    own: &[Arc<Task>],
    cameras: &[String],
    rate_hz: f64,
    out: File,
) -> Result<u64, ExportError> {
    let mut mcap = WriteOptions::new().create(out)?;
    let schemas = [
        mcap.add_schema("foxglove.RawImage", "protobuf", &descriptors::schema::<RawImage>())?,
        mcap.add_schema(
            "foxglove.CameraCalibration",
            "protobuf",
            &descriptors::schema::<CameraCalibration>(),
        )?,
        mcap.add_schema("foxglove.FrameTransforms", "protobuf", &descriptors::schema::<FrameTransforms>())?,
    ];
    let tick_s = replay.header.tick_s;
    let start_ns = replay.header.started_unix_ms.saturating_mul(1_000_000);
    let (channels, last) = (BTreeMap::new(), BTreeMap::new());
    let mut images = ImageFile { mcap, schemas, channels, start_ns, tick_s, last, images: 0 };
    let (mut failure, real) = (None, replay.header.noise == Noise::Real);
    let mut observe = |run: &mut Run| {
        let number = |tick: u64| (tick as f64 * tick_s * rate_hz + 1e-9) as u64;
        let tick = run.tick();
        // A camera with noise has its own rate; `add` skips an image that it has already.
        let between = !real && tick > 0 && number(tick) == number(tick - 1);
        if failure.is_some() || between {
            return;
        }
        let mut take = || -> Result<(), ExportError> {
            // The run is over, so every camera may be used.
            let shots = run.shots(cameras, Sensing::Truth)?;
            run.expose(&shots).iter().try_for_each(|exposure| Ok(images.add(exposure.render())?))
        };
        failure = take().err();
    };
    let verified = verify_watched(replay, own, Some(&mut observe));
    if let Some(error) = failure {
        return Err(error);
    }
    verified?;
    images.mcap.finish()?;
    Ok(images.images)
}
