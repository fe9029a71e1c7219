//! Colours: plain shading by a light at the camera.

use super::Picture;
use super::intrinsics::Intrinsics;
use palmares_models::Vec3;

/// Part of the light that comes from everywhere.
const AMBIENT: f64 = 0.35;
/// sRGB of what is behind everything.
const BACKGROUND: [f64; 3] = [0.86, 0.88, 0.90];

/// sRGB, three bytes a pixel: the body's colour, darker the more its surface is turned away. The picture has normals.
pub fn shade(picture: &Picture, lens: &Intrinsics, colors: &[[f64; 3]]) -> Vec<u8> {
    let byte = |x: f64| (255.0 * x.clamp(0.0, 1.0)).round() as u8;
    let width = (lens.width as usize).max(1);
    let mut bytes = Vec::with_capacity(3 * picture.body.len());
    for (pixel, body) in picture.body.iter().enumerate() {
        let Some(color) = colors.get(usize::from(*body)) else {
            bytes.extend(BACKGROUND.map(byte));
            continue;
        };
        let normal = picture.normal.as_ref().map_or([0.0; 3], |normals| normals[pixel]).map(f64::from);
        let view = lens.ray(pixel % width, pixel / width);
        let facing = (-Vec3::from_array(normal).dot(view) / view.length()).max(0.0);
        let light = AMBIENT + (1.0 - AMBIENT) * facing;
        bytes.extend(color.map(|x| byte(x * light)));
    }
    bytes
}
