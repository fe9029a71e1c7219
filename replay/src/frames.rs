//! Poses as `foxglove.FrameTransforms`, in protobuf. They are nine tenths of a replay, and JSON takes several times
//! as long to write and to compress. The fields are those of the published definitions
//! (<https://github.com/foxglove/foxglove-sdk/tree/main/schemas/proto/foxglove>).

use crate::descriptors::{described, timestamp};
use palmares_models::hand::Link;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_tasks::Run;
use prost::{EncodeError, Message};
use prost_types::Timestamp;
use schemars::JsonSchema;
use serde::Serialize;

/// The root of all frames.
pub(crate) const WORLD: &str = "world";

/// The frame of a link of the hand.
pub(crate) fn link_frame(link: &Link) -> String {
    format!("hand/{}", link.name)
}

/// Steps of 2⁻¹⁷, less than 0.01 mm: finer ones are invisible, and most bytes of a rounded number are zero.
const STEPS: f64 = (1 << 17) as f64;

/// The nearest multiple of `1 / steps`.
fn rounded(x: f64, steps: f64) -> f64 {
    // Adding zero turns -0 into 0.
    (x * steps).round() / steps + 0.0
}

described! {
    "foxglove", "Vector3":
    /// A vector, m.
    #[derive(Clone, Copy, PartialEq, Message, Serialize, JsonSchema)]
    pub(crate) struct Vector3 {
        #[prost(double, tag = "1")]
        x: f64,
        #[prost(double, tag = "2")]
        y: f64,
        #[prost(double, tag = "3")]
        z: f64,
    }
}

described! {
    "foxglove", "Quaternion":
    /// A unit quaternion.
    #[derive(Clone, Copy, PartialEq, Message, Serialize, JsonSchema)]
    pub(crate) struct Quaternion {
        #[prost(double, tag = "1")]
        x: f64,
        #[prost(double, tag = "2")]
        y: f64,
        #[prost(double, tag = "3")]
        z: f64,
        #[prost(double, tag = "4")]
        w: f64,
    }
}

impl Vector3 {
    /// A vector, rounded to multiples of `1 / steps`.
    pub(crate) fn rounded(v: Vec3, steps: f64) -> Self {
        let [x, y, z] = v.to_array().map(|x| rounded(x, steps));
        Vector3 { x, y, z }
    }
}

impl Quaternion {
    /// An orientation, rounded to multiples of `1 / steps`.
    pub(crate) fn rounded(q: Rotation, steps: f64) -> Self {
        let [x, y, z, w] = q.to_array().map(|x| rounded(x, steps));
        Quaternion { x, y, z, w }
    }
}

described! {
    "foxglove", "FrameTransform":
    #[derive(Clone, PartialEq, Message)]
    struct FrameTransform {
        #[prost(message, required, tag = "1")]
        timestamp: Timestamp,
        #[prost(string, tag = "2")]
        parent_frame_id: String,
        #[prost(string, tag = "3")]
        child_frame_id: String,
        #[prost(message, required, tag = "4")]
        translation: Vector3,
        #[prost(message, required, tag = "5")]
        rotation: Quaternion,
    }
}

described! {
    "foxglove", "FrameTransforms":
    /// `foxglove.FrameTransforms`
    #[derive(Clone, PartialEq, Message)]
    pub(crate) struct FrameTransforms {
        #[prost(message, repeated, tag = "1")]
        transforms: Vec<FrameTransform>,
    }
}

/// Frames of the bodies that can move: links first, then free objects.
#[derive(Debug)]
pub(crate) struct Frames(Vec<FrameTransform>);

impl Frames {
    /// The frames of a run. The parent of a link's frame is that of its parent link; the base and objects are in the
    /// world.
    pub(crate) fn of(run: &Run) -> Self {
        let frame = |child: String, parent: String| FrameTransform {
            parent_frame_id: parent,
            child_frame_id: child,
            ..FrameTransform::default()
        };
        let all = &run.hand().links;
        let parent = |link: &Link| link.parent.map_or(WORLD.into(), |parent| link_frame(&all[parent]));
        let links = all.iter().map(|link| frame(link_frame(link), parent(link)));
        let objects = run.scene().bodies.iter().filter(|body| body.free);
        Frames(links.chain(objects.map(|body| frame(body.name.clone(), WORLD.into()))).collect())
    }

    /// Writes a `foxglove.FrameTransforms` with these poses, each with the index of its frame; the time is ns since
    /// 1970 UTC.
    pub(crate) fn write(
        &mut self,
        time_ns: u64,
        poses: &[(usize, Pose)],
        buffer: &mut Vec<u8>,
    ) -> Result<(), EncodeError> {
        let timestamp = timestamp(time_ns);
        // The message borrows the names: there are thousands of them per second.
        let lent = poses.iter().map(|(k, pose)| FrameTransform {
            timestamp,
            translation: Vector3::rounded(pose.translation, STEPS),
            rotation: Quaternion::rounded(pose.rotation, STEPS),
            ..std::mem::take(&mut self.0[*k])
        });
        let message = FrameTransforms { transforms: lent.collect() };
        let written = message.encode(buffer);
        for ((k, _), frame) in poses.iter().zip(message.transforms) {
            self.0[*k] = frame;
        }
        written
    }
}

impl FrameTransforms {
    /// The pose of one frame in the world, at a time in ns since 1970 UTC.
    pub(crate) fn of(time_ns: u64, name: &str, pose: Pose) -> Self {
        let frame = FrameTransform {
            timestamp: timestamp(time_ns),
            parent_frame_id: WORLD.into(),
            child_frame_id: name.into(),
            translation: Vector3::rounded(pose.translation, STEPS),
            rotation: Quaternion::rounded(pose.rotation, STEPS),
        };
        FrameTransforms { transforms: vec![frame] }
    }

    /// Parent, name and pose of each.
    pub(crate) fn poses(&self) -> impl Iterator<Item = (&str, &str, Pose)> {
        self.transforms.iter().map(|frame| {
            let (t, q) = (frame.translation, frame.rotation);
            let rotation = Rotation::from_xyzw(q.x, q.y, q.z, q.w).normalize();
            let pose = Pose::from_parts(Vec3::new(t.x, t.y, t.z), rotation);
            (frame.parent_frame_id.as_str(), frame.child_frame_id.as_str(), pose)
        })
    }
}
