//! The images of cameras. A camera belongs to a task or to a hand, and takes an image when a request names it, so that
//! images are not part of the row of numbers. [`crate::camera`] has their law and their errors.

use palmares_models::camera::Camera;
use schemars::JsonSchema;
use serde::Serialize;

/// One kind of image of a camera.
#[derive(Debug)]
pub struct ImageChannel {
    /// For `camera.NAME` in a request, and its field in `obs.cameras[]`.
    pub name: &'static str,
    /// Numbers of a pixel.
    pub width: usize,
    /// Bytes of a number on the wire: an unsigned integer, little-endian.
    pub bytes: usize,
    /// Unit of the array's numbers.
    pub unit: &'static str,
    /// It belongs to the truth: a controller with `sensing: "sensors"` does not get it.
    pub truth: bool,
    /// One sentence without a full stop.
    pub doc: &'static str,
}

/// Distance along the optical axis.
pub static DEPTH: ImageChannel = ImageChannel {
    name: "depth",
    width: 1,
    bytes: 2,
    unit: "m",
    truth: false,
    doc: "Distance along the optical axis, on the wire in steps of `depth_unit`; 0 where there is no reading",
};

/// Colour.
pub static RGB: ImageChannel =
    ImageChannel { name: "rgb", width: 3, bytes: 1, unit: "", truth: false, doc: "Colour, sRGB" };

/// Bodies.
pub static BODIES: ImageChannel = ImageChannel {
    name: "bodies",
    width: 1,
    bytes: 2,
    unit: "",
    truth: true,
    doc: "Id of the body that the pixel shows; 65535 where there is none",
};

/// Every kind of image.
pub static IMAGES: [&ImageChannel; 3] = [&DEPTH, &RGB, &BODIES];

/// An image of a camera, as clients learn it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ImageInfo {
    /// Its field in `obs.cameras[]`, and `NAME` in the request `camera.NAME`.
    pub name: &'static str,
    /// Shape of the array: rows, pixels in a row, and the numbers of a pixel if it has several.
    pub shape: Vec<usize>,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Least value.
    pub minimum: f64,
    /// Largest value.
    pub maximum: f64,
    /// Only with sensing `truth`.
    pub truth: bool,
    /// For people.
    pub description: &'static str,
}

impl ImageInfo {
    /// The images of a camera.
    pub fn all(camera: &Camera) -> Vec<Self> {
        let info = |channel: &&ImageChannel| {
            let mut shape = vec![camera.height as usize, camera.width as usize];
            shape.extend((channel.width > 1).then_some(channel.width));
            let most =
                if channel.unit == "m" { camera.far } else { 2f64.powi(8 * channel.bytes as i32) - 1.0 };
            ImageInfo {
                name: channel.name,
                shape,
                unit: channel.unit,
                minimum: 0.0,
                maximum: most,
                truth: channel.truth,
                description: channel.doc,
            }
        };
        IMAGES.iter().map(info).collect()
    }
}
