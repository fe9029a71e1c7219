//! Frames of a scene: affine maps, and the nodes that change them.

use palmares_models::{Mat3, Rotation, Vec3};

use super::nodes::Node;

/// An affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) linear: Mat3,
    pub(super) origin: Vec3,
}

impl Frame {
    pub(super) const IDENTITY: Frame = Frame { linear: Mat3::IDENTITY, origin: Vec3::ZERO };

    pub(super) fn point(&self, p: Vec3) -> Vec3 {
        self.linear * p + self.origin
    }

    /// The map that first does `inner`.
    pub(super) fn after(&self, inner: Frame) -> Frame {
        Frame { linear: self.linear * inner.linear, origin: self.point(inner.origin) }
    }

    pub(super) fn at(origin: Vec3) -> Frame {
        Frame { origin, ..Frame::IDENTITY }
    }

    pub(super) fn scaled(factors: [f64; 3]) -> Frame {
        Frame { linear: Mat3::from_diagonal(Vec3::from_array(factors)), ..Frame::IDENTITY }
    }

    fn turned([x, y, z, angle]: [f64; 4]) -> Frame {
        let axis = Vec3::new(x, y, z).normalize_or_zero();
        let turn =
            if axis == Vec3::ZERO { Rotation::IDENTITY } else { Rotation::from_axis_angle(axis, angle) };
        Frame { linear: Mat3::from_quat(turn), ..Frame::IDENTITY }
    }
}

/// The map of a node that moves what comes after it, or its own children; `None` for another node.
pub(super) fn of(node: &Node) -> Result<Option<Frame>, String> {
    let point =
        |name: &str| Ok::<_, String>(node.numbers::<3>(name)?.map(Vec3::from_array).unwrap_or_default());
    let turn = |name: &str| Ok::<_, String>(node.numbers::<4>(name)?.map_or(Frame::IDENTITY, Frame::turned));
    Ok(Some(match node.kind.as_str() {
        "Translation" => Frame::at(point("translation")?),
        "Rotation" => turn("rotation")?,
        "RotationXYZ" => {
            let angle = node.numbers::<1>("angle")?.map_or(0.0, |[angle]| angle);
            let axis = match node.word("axis") {
                Some("Y") => Vec3::Y,
                Some("Z") => Vec3::Z,
                _ => Vec3::X,
            };
            Frame::turned([axis.x, axis.y, axis.z, angle])
        }
        "Scale" => Frame::scaled(node.numbers("scaleFactor")?.unwrap_or([1.0; 3])),
        "Transform" => {
            // T C R SR S SR⁻¹ C⁻¹; VRML 97 calls the factors `scale`.
            let factors = node.numbers("scaleFactor")?.or(node.numbers("scale")?).unwrap_or([1.0; 3]);
            let (center, along) = (point("center")?, turn("scaleOrientation")?);
            let back = Frame { linear: along.linear.transpose(), ..Frame::IDENTITY };
            [turn("rotation")?, along, Frame::scaled(factors), back, Frame::at(-center)]
                .into_iter()
                .fold(Frame::at(point("translation")? + center), |frame, inner| frame.after(inner))
        }
        "MatrixTransform" => {
            // Points are rows to the left of the matrix: its last row moves.
            let Some(m) = node.numbers::<16>("matrix")? else { return Ok(Some(Frame::IDENTITY)) };
            let row = |k: usize| Vec3::new(m[4 * k], m[4 * k + 1], m[4 * k + 2]);
            Frame { linear: Mat3::from_cols(row(0), row(1), row(2)), origin: row(3) }
        }
        _ => return Ok(None),
    }))
}

/// Metres per unit of a `Units` node.
pub(super) fn unit(node: &Node) -> Result<f64, String> {
    let name = node.word("units").unwrap_or("METERS");
    Ok(match name {
        "METERS" => 1.0,
        "CENTIMETERS" => 1e-2,
        "MILLIMETERS" => 1e-3,
        "MICROMETERS" | "MICRONS" => 1e-6,
        "NANOMETERS" => 1e-9,
        "ANGSTROMS" => 1e-10,
        "KILOMETERS" => 1e3,
        "FEET" => 0.3048,
        "INCHES" => 0.0254,
        "POINTS" => 0.0254 / 72.0,
        "YARDS" => 0.9144,
        "MILES" => 1609.344,
        "NAUTICAL_MILES" => 1852.0,
        other => return Err(format!("has the unknown unit '{}'", other.escape_debug())),
    })
}
