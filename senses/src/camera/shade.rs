//! Colours, shaded by a light at the camera.

use super::gbuffer::GBuffer;
use super::intrinsics::Intrinsics;

/// Share of ambient light.
const AMBIENT: f64 = 0.35;
/// sRGB of pixels that show no body.
const BACKGROUND: [f64; 3] = [0.86, 0.88, 0.90];

/// The byte nearest to 255 x, where 0 ≤ x ≤ 1.
fn byte(x: f64) -> u8 {
    (255.0 * x + 0.5) as u8
}

/// sRGB, three bytes a pixel: the body's colour, darker where its surface is turned away. The G-buffer must have normals.
pub fn shade(image: &GBuffer, lens: &Intrinsics, colors: &[[f64; 3]]) -> Vec<u8> {
    let columns = lens.columns();
    let width = columns.len().max(1);
    let normals = image.normal.as_deref().unwrap_or_default();
    let mut bytes = vec![0; 3 * image.body.len()];
    let rows = bytes.chunks_mut(3 * width).zip(image.body.chunks(width)).zip(normals.chunks(width));
    for (v, ((bytes, bodies), normals)) in rows.enumerate() {
        let y = lens.row(v);
        for (((rgb, body), normal), x) in bytes.chunks_exact_mut(3).zip(bodies).zip(normals).zip(&columns) {
            let Some(color) = colors.get(usize::from(*body)) else {
                rgb.copy_from_slice(&BACKGROUND.map(byte));
                continue;
            };
            let [nx, ny, nz] = normal.map(f64::from);
            let facing = -(nx * x + ny * y + nz) / (x * x + y * y + 1.0).sqrt();
            let light = AMBIENT + (1.0 - AMBIENT) * facing.clamp(0.0, 1.0);
            for (byte_of, part) in rgb.iter_mut().zip(color) {
                *byte_of = byte(part * light);
            }
        }
    }
    bytes
}
