//! Poses as Foxglove shows them: `foxglove.FrameTransforms`, written as protobuf. They are nine tenths of a replay, and
//! JSON takes several times as long to write and to pack.

use palmares_models::hand::Link;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_tasks::Run;
use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet, Timestamp};

/// The frame everything else stands in.
pub(super) const WORLD: &str = "world";

/// A frame and what it moves in.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    /// Its name.
    pub(super) name: String,
    /// Name of the frame that its poses are given in.
    pub(super) parent: String,
}

/// The frame of a link of the hand.
pub(super) fn link_frame(link: &Link) -> String {
    format!("hand/{}", link.name)
}

/// The frames of all bodies that can move: links first, then free objects.
pub(super) fn frames(run: &Run) -> Vec<Frame> {
    let all = &run.hand().links;
    let links = all.iter().map(|link| Frame {
        name: link_frame(link),
        parent: link.parent.map_or(WORLD.into(), |parent| link_frame(&all[parent])),
    });
    let objects = run.scene().bodies.iter().filter(|body| body.free);
    links.chain(objects.map(|body| Frame { name: body.name.clone(), parent: WORLD.into() })).collect()
}

#[derive(Clone, Copy, PartialEq, Message)]
struct Xyz {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct Xyzw {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
    #[prost(double, tag = "4")]
    w: f64,
}

#[derive(Clone, PartialEq, Message)]
struct FrameTransform {
    #[prost(message, required, tag = "1")]
    timestamp: Timestamp,
    #[prost(string, tag = "2")]
    parent_frame_id: String,
    #[prost(string, tag = "3")]
    child_frame_id: String,
    #[prost(message, required, tag = "4")]
    translation: Xyz,
    #[prost(message, required, tag = "5")]
    rotation: Xyzw,
}

/// `foxglove.FrameTransforms`
#[derive(Clone, PartialEq, Message)]
pub(super) struct FrameTransforms {
    #[prost(message, repeated, tag = "1")]
    transforms: Vec<FrameTransform>,
}

impl FrameTransforms {
    /// These frames at a time, ns since 1970 UTC.
    pub(super) fn new<'a>(time_ns: u64, frames: impl Iterator<Item = (&'a Frame, Pose)>) -> Self {
        let timestamp =
            Timestamp { seconds: (time_ns / 1_000_000_000) as i64, nanos: (time_ns % 1_000_000_000) as i32 };
        let transforms = frames.map(|(frame, pose)| FrameTransform {
            timestamp,
            parent_frame_id: frame.parent.clone(),
            child_frame_id: frame.name.clone(),
            translation: xyz(pose.translation),
            rotation: xyzw(pose.rotation),
        });
        FrameTransforms { transforms: transforms.collect() }
    }

    /// Parent, name and pose of each.
    pub(super) fn poses(&self) -> impl Iterator<Item = (&str, &str, Pose)> {
        self.transforms.iter().map(|frame| {
            let (t, q) = (frame.translation, frame.rotation);
            let rotation = Rotation::from_xyzw(q.x, q.y, q.z, q.w).normalize();
            let pose = Pose::from_parts(Vec3::new(t.x, t.y, t.z), rotation);
            (frame.parent_frame_id.as_str(), frame.child_frame_id.as_str(), pose)
        })
    }
}

/// To 2⁻¹⁷, less than a hundredth of a millimetre: finer is not seen, and most bytes of such a number are zero.
fn rounded(x: f64) -> f64 {
    const STEPS: f64 = (1 << 17) as f64;
    // Adding zero makes -0 a 0.
    (x * STEPS).round() / STEPS + 0.0
}

fn xyz(v: Vec3) -> Xyz {
    Xyz { x: rounded(v.x), y: rounded(v.y), z: rounded(v.z) }
}

fn xyzw(q: Rotation) -> Xyzw {
    Xyzw { x: rounded(q.x), y: rounded(q.y), z: rounded(q.z), w: rounded(q.w) }
}

/// The `FileDescriptorSet` that readers of `foxglove.FrameTransforms` need. Its fields are those of the published
/// definition (<https://github.com/foxglove/foxglove-sdk/tree/main/schemas/proto/foxglove>).
pub(super) fn schema() -> Vec<u8> {
    let file =
        |name: &str, package: &str, dependencies: &[&str], message: DescriptorProto| FileDescriptorProto {
            name: Some(name.into()),
            package: Some(package.into()),
            dependency: dependencies.iter().map(ToString::to_string).collect(),
            message_type: vec![message],
            syntax: Some("proto3".into()),
            ..FileDescriptorProto::default()
        };
    let coordinates = |name: &str, axes: &[&str]| {
        message(name, axes.iter().map(|axis| field(axis, Type::Double, None)).collect())
    };
    let time = vec![field("seconds", Type::Int64, None), field("nanos", Type::Int32, None)];
    let transform = vec![
        field("timestamp", Type::Message, Some(".google.protobuf.Timestamp")),
        field("parent_frame_id", Type::String, None),
        field("child_frame_id", Type::String, None),
        field("translation", Type::Message, Some(".foxglove.Vector3")),
        field("rotation", Type::Message, Some(".foxglove.Quaternion")),
    ];
    let mut transforms = field("transforms", Type::Message, Some(".foxglove.FrameTransform"));
    transforms.label = Some(Label::Repeated.into());
    const TIME: &str = "google/protobuf/timestamp.proto";
    const VECTOR: &str = "foxglove/Vector3.proto";
    const QUATERNION: &str = "foxglove/Quaternion.proto";
    const TRANSFORM: &str = "foxglove/FrameTransform.proto";
    let files = vec![
        file(TIME, "google.protobuf", &[], message("Timestamp", time)),
        file(VECTOR, "foxglove", &[], coordinates("Vector3", &["x", "y", "z"])),
        file(QUATERNION, "foxglove", &[], coordinates("Quaternion", &["x", "y", "z", "w"])),
        file(TRANSFORM, "foxglove", &[TIME, VECTOR, QUATERNION], message("FrameTransform", transform)),
        file(
            "foxglove/FrameTransforms.proto",
            "foxglove",
            &[TRANSFORM],
            message("FrameTransforms", vec![transforms]),
        ),
    ];
    FileDescriptorSet { file: files }.encode_to_vec()
}

/// A message whose fields are numbered from 1 on.
fn message(name: &str, mut fields: Vec<FieldDescriptorProto>) -> DescriptorProto {
    for (field, number) in fields.iter_mut().zip(1..) {
        field.number = Some(number);
    }
    DescriptorProto { name: Some(name.into()), field: fields, ..DescriptorProto::default() }
}

fn field(name: &str, kind: Type, type_name: Option<&str>) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.into()),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        type_name: type_name.map(Into::into),
        ..FieldDescriptorProto::default()
    }
}
