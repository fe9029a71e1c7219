//! Camera images of an observation.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};
use std::borrow::Cow;

/// Pixels, row by row from the top left: bytes in MessagePack, base64 in JSON.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pixels(pub Vec<u8>);

impl Pixels {
    /// 16-bit numbers, little-endian.
    pub fn of_words(words: &[u16]) -> Self {
        let mut bytes = Vec::with_capacity(2 * words.len());
        words.iter().for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()));
        Pixels(bytes)
    }
}

impl Serialize for Pixels {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            serializer.serialize_str(&STANDARD.encode(&self.0))
        } else {
            serializer.serialize_bytes(&self.0)
        }
    }
}

impl JsonSchema for Pixels {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "Pixels".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "string", "contentEncoding": "base64"})
    }
}

/// An image of a camera.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CameraImage {
    /// The camera's name.
    pub camera: String,
    /// The tick after which it was exposed; with `noise: "real"` some ticks before that of the observation.
    pub tick: u64,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal lengths, pixels. The point (x, y, z) of the optical frame is at u = fx x/z + cx, v = fy y/z + cy, where the
    /// middle of the first pixel is at 0.5, 0.5.
    pub fx: f64,
    /// See `fx`.
    pub fy: f64,
    /// The optical axis in the image, pixels.
    pub cx: f64,
    /// See `cx`.
    pub cy: f64,
    /// Origin of the optical frame (x right, y down, z forward) in the world when it was exposed, m.
    pub position: [f64; 3],
    /// Orientation of the optical frame, x, y, z, w.
    pub quat_xyzw: [f64; 4],
    /// Unit of `depth`, m.
    pub depth_unit: f64,
    /// Distance along the optical axis, 16 bits a pixel; 0 where there is no reading.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<Pixels>,
    /// sRGB, three bytes a pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rgb: Option<Pixels>,
    /// Id of the visible body, 16 bits a pixel: those of the scene, then the hand's links; 65535 for none. Only with
    /// sensing `truth`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bodies: Option<Pixels>,
}
