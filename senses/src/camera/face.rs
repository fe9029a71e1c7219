//! Flat faces.
//!
//! A ray d with z = 1 through the camera's centre meets the plane n·p = c at z = c / (n·d): 1/z is linear over the image.
//! The sign of d·(a × b) is the side on which the ray passes the line through corners a and b. It is linear as well, and
//! needs no clipping when a corner is behind the camera.

use super::canvas::{Area, Canvas};
use super::intrinsics::Intrinsics;
use palmares_models::Vec3;

/// A linear function over the image: its value at the middle of the first pixel, and its steps along a row and from row to
/// row.
#[derive(Clone, Copy)]
struct Linear {
    at: f64,
    along: f64,
    down: f64,
}

impl Linear {
    /// n·d as a function of the ray d.
    fn of(n: Vec3, lens: &Intrinsics) -> Self {
        let (along, down) = (n.x / lens.fx, n.y / lens.fy);
        let at = n.z + n.x * (0.5 - lens.cx) / lens.fx + n.y * (0.5 - lens.cy) / lens.fy;
        Linear { at, along, down }
    }
}

/// Draws a face, or a whole plane without corners. `corners` are anticlockwise as seen from outside. All are in the optical
/// frame.
pub(super) fn face(
    normal: Vec3,
    point: Vec3,
    corners: &[Vec3],
    area: Area,
    lens: &Intrinsics,
    canvas: &mut Canvas<'_>,
) {
    let c = normal.dot(point);
    // The camera is behind the face, or in its plane.
    if c >= 0.0 {
        return;
    }
    let inverse = normal / c;
    let mut sides = [Linear { at: 0.0, along: 0.0, down: 0.0 }; MAX_CORNERS];
    let count = corners.len();
    if count > MAX_CORNERS {
        return;
    }
    for (k, side) in sides[..count].iter_mut().enumerate() {
        *side = Linear::of(-corners[k].cross(corners[(k + 1) % count]), lens);
    }
    for v in area.top..area.bottom {
        let (mut left, mut right) = (area.left as f64, area.right as f64 - 1.0);
        let y = v as f64;
        for side in &sides[..count] {
            let start = side.at + side.down * y;
            if side.along > 0.0 {
                left = left.max(-start / side.along);
            } else if side.along < 0.0 {
                right = right.min(-start / side.along);
            } else if start < 0.0 {
                right = -1.0;
            }
        }
        let start = inverse.y * lens.row(v) + inverse.z;
        let (left, right) = (left.ceil(), right.floor());
        if left <= right {
            canvas.flat_row(v, left as usize, right as usize + 1, start, inverse.x);
        }
    }
}

/// Faces have three or four corners.
const MAX_CORNERS: usize = 4;
