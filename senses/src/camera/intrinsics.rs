//! A pinhole camera.

use palmares_models::Vec3;
use palmares_models::camera::Camera;

/// A pinhole camera and its range. The point (x, y, z) of the optical frame (x right, y down, z forward) is at
/// u = fx x/z + cx, v = fy y/z + cy; the middle of the first pixel is at 0.5, 0.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal length along a row, pixels.
    pub fx: f64,
    /// Focal length across rows, pixels.
    pub fy: f64,
    /// The optical axis, pixels.
    pub cx: f64,
    /// The optical axis, pixels.
    pub cy: f64,
    /// A nearer surface hides the surfaces behind it and has no depth, m.
    pub near: f64,
    /// A farther surface has no depth, m.
    pub far: f64,
}

impl Intrinsics {
    /// Square pixels, the axis in the middle, and a horizontal field of view in degrees.
    pub fn new(width: u32, height: u32, fov_deg: f64, near: f64, far: f64) -> Self {
        let f = 0.5 * f64::from(width) / libm::tan(0.5 * fov_deg.to_radians());
        let (cx, cy) = (0.5 * f64::from(width), 0.5 * f64::from(height));
        Intrinsics { width, height, fx: f, fy: f, cx, cy, near, far }
    }

    /// The intrinsics of a declared camera.
    pub fn of(camera: &Camera) -> Self {
        Intrinsics::new(camera.width, camera.height, camera.fov_deg, camera.near, camera.far)
    }

    /// The number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// x of the ray of every column, with z = 1.
    pub(super) fn columns(&self) -> Vec<f64> {
        (0..self.width).map(|u| (f64::from(u) + 0.5 - self.cx) / self.fx).collect()
    }

    /// y of the rays of a row, with z = 1.
    pub(super) fn row(&self, v: usize) -> f64 {
        (v as f64 + 0.5 - self.cy) / self.fy
    }

    /// The ray through the middle of a pixel, with z = 1.
    pub fn ray(&self, u: usize, v: usize) -> Vec3 {
        Vec3::new((u as f64 + 0.5 - self.cx) / self.fx, self.row(v), 1.0)
    }
}
