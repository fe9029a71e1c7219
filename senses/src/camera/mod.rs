//! Cameras.

mod stereo;

pub use stereo::{plain_depth, stereo_depth};

use palmares_models::camera::Camera;
use palmares_models::shape::Shape;
use palmares_models::Pose;

/// A pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    pub width: u32,
    pub height: u32,
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub near: f64,
    pub far: f64,
}

impl Intrinsics {
    pub fn new(width: u32, height: u32, fov_deg: f64, near: f64, far: f64) -> Self {
        let fx = 0.5 * f64::from(width) / libm::tan(0.5 * fov_deg.to_radians());
        let (cx, cy) = (0.5 * f64::from(width), 0.5 * f64::from(height));
        Intrinsics { width, height, fx, fy: fx, cx, cy, near, far }
    }
    pub fn of(camera: &Camera) -> Self {
        Intrinsics::new(camera.width, camera.height, camera.fov_deg, camera.near, camera.far)
    }
}

#[derive(Clone, Debug, Default)]
pub struct Picture {
    pub depth: Vec<f64>,
    pub body: Vec<u16>,
    pub normal: Option<Vec<[f32; 3]>>,
}

impl Picture {
    pub fn with_normals(&mut self, wanted: bool) {
        self.normal = wanted.then(Vec::new);
    }
}

#[derive(Clone, Debug)]
pub struct Body {
    pub parts: Vec<(Pose, Shape)>,
    pub endless: bool,
}

#[derive(Debug)]
pub struct Geometry;

impl Geometry {
    pub fn new(_: &[Body]) -> Self {
        Geometry
    }
}

pub fn draw(_: &Geometry, _: &[Pose], _: Pose, intrinsics: &Intrinsics, picture: &mut Picture) {
    let n = (intrinsics.width * intrinsics.height) as usize;
    picture.depth.resize(n, f64::INFINITY);
    picture.body.resize(n, u16::MAX);
    if let Some(normal) = &mut picture.normal {
        normal.resize(n, [0.0; 3]);
    }
}

pub fn shade(picture: &Picture, _: &Intrinsics, _: &[[f64; 3]]) -> Vec<u8> {
    vec![0; 3 * picture.depth.len()]
}
