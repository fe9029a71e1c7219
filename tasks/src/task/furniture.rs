//! Fixed bodies: boxes made of slabs, and containers with one open side.

use palmares_models::{Pose, Rotation, Vec3};
use serde::Deserialize;

/// Pose of the hand's base at tick 0.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// m
    pub position: [f64; 3],
    /// x, y, z, w
    pub quat_xyzw: [f64; 4],
}

impl Start {
    /// The pose.
    pub(crate) fn pose(&self) -> Pose {
        let [x, y, z, w] = self.quat_xyzw;
        Pose::from_parts(Vec3::from_array(self.position), Rotation::from_xyzw(x, y, z, w).normalize())
    }

    /// Checks the numbers.
    pub(crate) fn check(&self) -> Result<(), String> {
        if !self.position.iter().all(|x| x.abs() <= MAX_COORDINATE_M) {
            return Err(format!(
                "hand.position = {:?}; three numbers within {MAX_COORDINATE_M} m",
                self.position
            ));
        }
        if !unit_quaternion(&self.quat_xyzw) {
            return Err(format!("hand.quat_xyzw = {:?}; a unit quaternion x, y, z, w", self.quat_xyzw));
        }
        Ok(())
    }
}

/// Whether a quaternion of a file has length 1 to its rounding.
pub(super) fn unit_quaternion(quat_xyzw: &[f64; 4]) -> bool {
    (0.99..=1.01).contains(&quat_xyzw.iter().map(|x| x * x).sum::<f64>().sqrt())
}

/// Maximum distance from the origin, m.
pub(super) const MAX_COORDINATE_M: f64 = 1e3;

/// Checks the surface of a fixed body.
fn check_surface(element: &str, friction: f64, color: &[f64; 3]) -> Result<(), String> {
    if !(0.0..=1e3).contains(&friction) {
        return Err(format!("{element}: friction = {friction}; it must be in [0, 1000]"));
    }
    if !color.iter().all(|c| (0.0..=1.0).contains(c)) {
        return Err(format!("{element}: color = {color:?}; three numbers from 0 to 1"));
    }
    Ok(())
}

/// A horizontal ground without end.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ground {
    /// Height of its surface, m.
    pub height: f64,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// sRGB
    pub color: [f64; 3],
    /// x, y of the middle of the part that is drawn, m.
    pub center: [f64; 2],
    /// Width and depth of that part, m.
    pub size: [f64; 2],
}

impl Ground {
    /// Name of the body in the scene.
    pub const NAME: &str = "ground";

    /// Thickness of what is drawn, m.
    const THICKNESS_M: f64 = 0.1;

    /// The drawn shapes.
    pub fn slab(&self) -> Slab {
        let ([x, y], [width, depth], half) = (self.center, self.size, 0.5 * Self::THICKNESS_M);
        Slab { position: [x, y, self.height - half], half_extents: [0.5 * width, 0.5 * depth, half] }
    }

    /// Checks the numbers.
    pub(crate) fn check(&self) -> Result<(), String> {
        let numbers = [self.height, self.center[0], self.center[1], self.size[0], self.size[1]];
        if !numbers.iter().all(|x| x.abs() <= 1e3) || self.size.iter().any(|x| *x <= 0.0) {
            return Err("ground: height, center and size must be within 1000 m, the size positive".to_owned());
        }
        if !(0.0..=1e3).contains(&self.friction) {
            return Err(format!("ground.friction = {}; it must be in [0, 1000]", self.friction));
        }
        Ok(())
    }
}

/// A fixed body.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Furniture {
    /// Unique name.
    pub name: String,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// sRGB
    pub color: [f64; 3],
    /// Axis-aligned boxes.
    pub parts: Vec<Slab>,
}

impl Furniture {
    /// Checks the numbers.
    pub(crate) fn check(&self) -> Result<(), String> {
        let element = format!("furniture `{}`", self.name);
        check_surface(&element, self.friction, &self.color)?;
        if self.parts.is_empty() {
            return Err(format!("{element}: parts is empty; at least one box"));
        }
        for (k, Slab { position, half_extents }) in self.parts.iter().enumerate() {
            if !position.iter().all(|x| x.abs() <= MAX_COORDINATE_M) {
                return Err(format!(
                    "{element}: part {k}: position = {position:?}; within {MAX_COORDINATE_M} m"
                ));
            }
            if !half_extents.iter().all(|x| *x > 0.0 && *x <= MAX_COORDINATE_M) {
                let valid = format!("more than 0, at most {MAX_COORDINATE_M} m");
                return Err(format!("{element}: part {k}: half_extents = {half_extents:?}; {valid}"));
            }
        }
        Ok(())
    }
}

/// An axis-aligned box.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slab {
    /// Centre, m.
    pub position: [f64; 3],
    /// m
    pub half_extents: [f64; 3],
}

/// The side of a container that is missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum Side {
    /// Open on top.
    #[default]
    #[serde(rename = "+z")]
    Top,
    /// Open towards +x.
    #[serde(rename = "+x")]
    PlusX,
    /// Open towards -x.
    #[serde(rename = "-x")]
    MinusX,
    /// Open towards +y.
    #[serde(rename = "+y")]
    PlusY,
    /// Open towards -y.
    #[serde(rename = "-y")]
    MinusY,
}

/// A box with one open side: a bin without a lid, a shelf without a front.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpenBox {
    /// Unique name; also the name of its inner volume.
    pub name: String,
    /// x, y of the middle of its floor, m.
    pub center: [f64; 2],
    /// Height of its inner floor, m.
    #[serde(default)]
    pub floor: f64,
    /// Inner width, depth and height, m.
    pub inner: [f64; 3],
    /// The side without a wall: `+z` (the default), `+x`, `-x`, `+y`, `-y`.
    #[serde(default)]
    pub open: Side,
    /// Thickness of walls and floor, m.
    pub wall: f64,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// sRGB
    pub color: [f64; 3],
}

impl OpenBox {
    /// Checks the numbers.
    pub(crate) fn check(&self) -> Result<(), String> {
        let element = format!("box `{}`", self.name);
        check_surface(&element, self.friction, &self.color)?;
        let [x, y] = self.center;
        if ![x, y, self.floor].iter().all(|x| x.abs() <= MAX_COORDINATE_M) {
            return Err(format!("{element}: center and floor must be within {MAX_COORDINATE_M} m"));
        }
        let sizes = [self.inner[0], self.inner[1], self.inner[2], self.wall];
        if !sizes.iter().all(|x| *x > 0.0 && *x <= MAX_COORDINATE_M) {
            return Err(format!(
                "{element}: inner and wall must be more than 0, at most {MAX_COORDINATE_M} m"
            ));
        }
        Ok(())
    }

    /// Lowest and highest corner of the inner volume, m.
    pub fn inner_volume(&self) -> ([f64; 3], [f64; 3]) {
        let ([x, y], [w, d, h], z) = (self.center, self.inner, self.floor);
        ([x - 0.5 * w, y - 0.5 * d, z], [x + 0.5 * w, y + 0.5 * d, z + h])
    }

    /// Floor, walls and roof, without the open side.
    pub fn slabs(&self) -> Vec<Slab> {
        let ([x, y], [w, d, h], t, z) = (self.center, self.inner, 0.5 * self.wall, self.floor);
        let (w, d, h) = (0.5 * w, 0.5 * d, 0.5 * h);
        let slab = |position, half_extents| Slab { position, half_extents };
        let walls = [
            (Side::PlusX, slab([x + w + t, y, z + h], [t, d + 2.0 * t, h])),
            (Side::MinusX, slab([x - w - t, y, z + h], [t, d + 2.0 * t, h])),
            (Side::PlusY, slab([x, y + d + t, z + h], [w, t, h])),
            (Side::MinusY, slab([x, y - d - t, z + h], [w, t, h])),
            (Side::Top, slab([x, y, z + 2.0 * h + t], [w + 2.0 * t, d + 2.0 * t, t])),
        ];
        let floor = slab([x, y, z - t], [w + 2.0 * t, d + 2.0 * t, t]);
        std::iter::once(floor)
            .chain(walls.into_iter().filter(|(side, _)| *side != self.open).map(|(_, slab)| slab))
            .collect()
    }
}

/// A named part of space that no container encloses.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Space {
    /// Unique name.
    pub name: String,
    /// Lowest corner, m.
    pub min: [f64; 3],
    /// Highest corner, m.
    pub max: [f64; 3],
}
