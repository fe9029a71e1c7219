//! Protobuf messages that describe themselves: a file has the descriptors of its messages for those who read it.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet, Timestamp};

/// A time, ns since 1970 UTC.
pub(crate) fn timestamp(time_ns: u64) -> Timestamp {
    Timestamp { seconds: (time_ns / 1_000_000_000) as i64, nanos: (time_ns % 1_000_000_000) as i32 }
}

/// A message with a descriptor; [`described!`] writes it.
pub(crate) trait Described {
    /// Package and name.
    const NAME: (&'static str, &'static str);

    /// Adds the file that describes the message, after those that it depends on. Returns the file's name.
    fn describe(files: &mut Vec<FileDescriptorProto>) -> String;
}

/// The `FileDescriptorSet` that readers of a message need.
pub(crate) fn schema<T: Described>() -> Vec<u8> {
    let mut file = Vec::new();
    T::describe(&mut file);
    FileDescriptorSet { file }.encode_to_vec()
}

impl<T: Described> Described for Vec<T> {
    const NAME: (&'static str, &'static str) = T::NAME;

    fn describe(files: &mut Vec<FileDescriptorProto>) -> String {
        T::describe(files)
    }
}

impl Described for Timestamp {
    const NAME: (&'static str, &'static str) = ("google.protobuf", "Timestamp");

    fn describe(files: &mut Vec<FileDescriptorProto>) -> String {
        let field = |name, tag, kind| field(name, kind, "", tag, None);
        let fields = vec![field("seconds", "1", "int64"), field("nanos", "2", "int32")];
        add::<Timestamp>(files, "google/protobuf/timestamp.proto".into(), Vec::new(), fields)
    }
}

/// Adds a file with one message, unless it is there.
pub(crate) fn add<T: Described>(
    files: &mut Vec<FileDescriptorProto>,
    name: String,
    dependency: Vec<String>,
    field: Vec<FieldDescriptorProto>,
) -> String {
    if files.iter().all(|file| file.name() != name) {
        let (package, message) = T::NAME;
        files.push(FileDescriptorProto {
            name: Some(name.clone()),
            package: Some(package.into()),
            dependency,
            message_type: vec![DescriptorProto {
                name: Some(message.into()),
                field,
                ..DescriptorProto::default()
            }],
            syntax: Some("proto3".into()),
            ..FileDescriptorProto::default()
        });
    }
    name
}

/// A field, from the words of its prost attribute. `message`: package and name of its type, if that is a message.
pub(crate) fn field(
    name: &str,
    kind: &str,
    label: &str,
    tag: &str,
    message: Option<(&str, &str)>,
) -> FieldDescriptorProto {
    let label = if label == "repeated" { Label::Repeated } else { Label::Optional };
    FieldDescriptorProto {
        name: Some(name.into()),
        number: tag.parse().ok(),
        label: Some(label.into()),
        r#type: Type::from_str_name(&format!("TYPE_{}", kind.to_uppercase())).map(Into::into),
        type_name: message.map(|(package, name)| format!(".{package}.{name}")),
        ..FieldDescriptorProto::default()
    }
}

/// Derives the descriptor of a prost message from its fields' attributes: `described! { "package", "Name": struct … }`.
macro_rules! described {
    (@field $files:ident, $used:ident, $field:ident, $type:ty; message, $label:ident, tag = $tag:literal) => {{
        $used.push(<$type as $crate::descriptors::Described>::describe($files));
        let message = Some(<$type as $crate::descriptors::Described>::NAME);
        $crate::descriptors::field(stringify!($field), "message", stringify!($label), $tag, message)
    }};
    (@field $files:ident, $used:ident, $field:ident, $type:ty; $kind:ident, $label:ident, tag = $tag:literal) => {
        $crate::descriptors::field(stringify!($field), stringify!($kind), stringify!($label), $tag, None)
    };
    (@field $files:ident, $used:ident, $field:ident, $type:ty; $kind:ident $(= $form:literal)?, tag = $tag:literal) => {
        $crate::descriptors::field(stringify!($field), stringify!($kind), "", $tag, None)
    };
    (
        $package:literal, $name:literal:
        $(#[$outer:meta])*
        $visible:vis struct $message:ident {
            $(#[prost($($attribute:tt)*)] $field_visible:vis $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$outer])*
        $visible struct $message {
            $(#[prost($($attribute)*)] $field_visible $field: $type,)*
        }

        impl $crate::descriptors::Described for $message {
            const NAME: (&'static str, &'static str) = ($package, $name);

            #[allow(unused_mut, reason = "most messages use no others")]
            fn describe(files: &mut Vec<prost_types::FileDescriptorProto>) -> String {
                let mut used = Vec::new();
                let fields = vec![
                    $($crate::descriptors::described!(@field files, used, $field, $type; $($attribute)*),)*
                ];
                $crate::descriptors::add::<$message>(files, format!("{}/{}.proto", $package, $name), used, fields)
            }
        }
    };
}
pub(crate) use described;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::FrameTransforms;
    use crate::image_export::{CameraCalibration, RawImage};
    use crate::telemetry::TelemetryMessage;
    use sha2::{Digest, Sha256};

    /// Readers of old files and of new ones get the same descriptors.
    #[test]
    fn descriptors_stay_as_they_are() {
        let digests = [
            schema::<FrameTransforms>(),
            schema::<TelemetryMessage>(),
            schema::<RawImage>(),
            schema::<CameraCalibration>(),
        ];
        let digests = digests.map(|bytes| hex::encode(Sha256::digest(bytes))[..16].to_owned());
        assert_eq!(digests, ["2578406d1856811b", "6b1974111b6a5ac3", "3f7f3e34541ec2d1", "42d7321e58c9d756"]);
    }
}
