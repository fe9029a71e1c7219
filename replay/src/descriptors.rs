//! Protobuf descriptors, written into a file for those who read its messages.

use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, Timestamp};

/// Name of the file that describes a time.
pub(crate) const TIME: &str = "google/protobuf/timestamp.proto";
/// Name of the type of a time.
pub(crate) const TIMESTAMP: &str = ".google.protobuf.Timestamp";

/// A time, ns since 1970 UTC.
pub(crate) fn timestamp(time_ns: u64) -> Timestamp {
    Timestamp { seconds: (time_ns / 1_000_000_000) as i64, nanos: (time_ns % 1_000_000_000) as i32 }
}

/// The file that describes a time.
pub(crate) fn time() -> FileDescriptorProto {
    let fields = vec![field("seconds", Type::Int64, None), field("nanos", Type::Int32, None)];
    file(TIME, "google.protobuf", &[], message("Timestamp", fields))
}

/// A file with one message.
pub(crate) fn file(
    name: &str,
    package: &str,
    dependencies: &[&str],
    message: DescriptorProto,
) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(name.into()),
        package: Some(package.into()),
        dependency: dependencies.iter().map(ToString::to_string).collect(),
        message_type: vec![message],
        syntax: Some("proto3".into()),
        ..FileDescriptorProto::default()
    }
}

/// A message whose fields are numbered from 1 on.
pub(crate) fn message(name: &str, mut fields: Vec<FieldDescriptorProto>) -> DescriptorProto {
    for (field, number) in fields.iter_mut().zip(1..) {
        field.number = Some(number);
    }
    DescriptorProto { name: Some(name.into()), field: fields, ..DescriptorProto::default() }
}

/// A field that is there once.
pub(crate) fn field(name: &str, kind: Type, type_name: Option<&str>) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.into()),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        type_name: type_name.map(Into::into),
        ..FieldDescriptorProto::default()
    }
}

/// A field that is there many times.
pub(crate) fn list(name: &str, kind: Type, type_name: Option<&str>) -> FieldDescriptorProto {
    FieldDescriptorProto { label: Some(Label::Repeated.into()), ..field(name, kind, type_name) }
}
