//! Depth as a stereo camera measures it.
//!
//! In two imagers with the baseline B a point at depth z has the disparity d = f B / z. The camera finds it with a noise of
//! σ pixels and in steps, so that depth scatters by z² σ / (f B). It finds none where something nearer hides the point from
//! the second imager, where the point is outside the second image, at grazing angles, and in a share of all other pixels.

use super::gbuffer::GBuffer;
use super::intrinsics::Intrinsics;
use crate::noise::Sample;
use crate::quantise::quantised;
use palmares_models::camera::{Camera, Stereo};

/// Exact depths in the camera's unit; 0 where it has no reading.
pub fn plain_depth(image: &GBuffer, camera: &Camera) -> Vec<u16> {
    image.depth.iter().map(|&z| in_units(z, camera)).collect()
}

/// A depth in the camera's unit; 0 out of its range.
fn in_units(z: f64, camera: &Camera) -> u16 {
    if z >= camera.near && z <= camera.far { (z / camera.depth_unit + 0.5) as u16 } else { 0 }
}

/// Depths with the errors of a real camera. The G-buffer must have normals.
pub fn stereo_depth(
    image: &GBuffer,
    intrinsics: &Intrinsics,
    camera: &Camera,
    sample: &mut Sample,
) -> Vec<u16> {
    let Stereo { baseline, disparity_noise, disparity_step, grazing_deg, dropout, .. } = camera.stereo;
    let (columns, scale) = (intrinsics.columns(), intrinsics.fx * baseline);
    let width = columns.len().max(1);
    let grazing = libm::cos(grazing_deg.to_radians());
    let lost = grazing * grazing;
    let normals = image.normal.as_deref().unwrap_or_default();
    let mut depths = vec![0; image.body.len()];
    let mut disparities = vec![0.0; width];
    let rows = image.inverse.chunks(width).zip(image.body.chunks(width));
    let rows = rows.zip(normals.chunks(width)).zip(depths.chunks_mut(width));
    for (v, (((inverse, bodies), normals), depths)) in rows.enumerate() {
        both_see(inverse, bodies, scale, &mut disparities);
        let y = intrinsics.row(v);
        for (((&disparity, normal), x), depth) in disparities.iter().zip(normals).zip(&columns).zip(depths) {
            // Drawn for every pixel, so that no reading depends on its neighbours.
            let (chance, noise) = sample.pixel();
            if disparity <= 0.0 || chance < dropout {
                continue;
            }
            let [nx, ny, nz] = normal.map(f64::from);
            let facing = -(nx * x + ny * y + nz);
            if facing < 0.0 || facing * facing < lost * (x * x + y * y + 1.0) {
                continue;
            }
            let found = quantised(disparity + disparity_noise * noise, disparity_step);
            if found > 0.0 {
                *depth = in_units(scale / found, camera);
            }
        }
    }
    depths
}

/// The disparity of each point of a row that is visible in the second imager, to the right, as well; 0 for the others. A
/// point at u is at u − d there, and a nearer point to its right can hide it.
fn both_see(inverse: &[f64], bodies: &[u16], scale: f64, disparities: &mut [f64]) {
    let mut leftmost = f64::INFINITY;
    for (u, ((inverse, body), disparity)) in inverse.iter().zip(bodies).zip(disparities).enumerate().rev() {
        let shift = scale * inverse;
        let there = u as f64 - shift;
        let visible = *body != GBuffer::NOTHING && there < leftmost && there >= 0.0;
        *disparity = if visible { shift } else { 0.0 };
        leftmost = if *body != GBuffer::NOTHING { leftmost.min(there) } else { leftmost };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Noise;

    const DEPTH_UNIT: f64 = 1e-4;

    fn camera(stereo: Stereo) -> Camera {
        Camera {
            name: "test".into(),
            link: None,
            position: [0.0; 3],
            quat_xyzw: [0.0, 0.0, 0.0, 1.0],
            width: 200,
            height: 100,
            fov_deg: 60.0,
            near: 0.1,
            far: 3.0,
            depth_unit: DEPTH_UNIT,
            stereo,
        }
    }

    fn stereo() -> Stereo {
        Stereo {
            rate_hz: 30.0,
            latency_s: 0.03,
            baseline: 0.05,
            disparity_noise: 0.05,
            disparity_step: 0.0,
            grazing_deg: 80.0,
            dropout: 0.0,
        }
    }

    fn wall(camera: &Camera, z: impl Fn(usize) -> f64) -> (GBuffer, Intrinsics) {
        let intrinsics =
            Intrinsics::new(camera.width, camera.height, camera.fov_deg, camera.near, camera.far);
        let pixels = camera.width as usize * camera.height as usize;
        let depth: Vec<f64> = (0..pixels).map(|k| z(k % camera.width as usize)).collect();
        let inverse = depth.iter().map(|z| 1.0 / z).collect();
        let normal = Some(vec![[0.0, 0.0, -1.0]; pixels]);
        (GBuffer { depth, inverse, body: vec![0; pixels], normal, ..GBuffer::default() }, intrinsics)
    }

    #[test]
    fn depth_scatters_with_the_square_of_the_distance() {
        for z in [0.5, 1.0, 2.0] {
            let camera = camera(stereo());
            let (image, intrinsics) = wall(&camera, |_| z);
            let mut sample = Noise::new(&[1; 32]).sensor("camera").sample(0);
            let depths = stereo_depth(&image, &intrinsics, &camera, &mut sample);
            let read: Vec<f64> =
                depths.iter().filter(|d| **d > 0).map(|d| f64::from(*d) * DEPTH_UNIT).collect();
            let mean = read.iter().sum::<f64>() / read.len() as f64;
            let deviation = (read.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / read.len() as f64).sqrt();
            let law = z * z * 0.05 / (intrinsics.fx * 0.05);
            assert!((deviation / law - 1.0).abs() < 0.05, "{z}: {deviation} {law}");
            assert!(
                (mean - z).abs() < 5.0 * law / (read.len() as f64).sqrt() + law * law / z * 2.0,
                "{mean}"
            );
        }
    }

    #[test]
    fn disparity_comes_in_steps() {
        let camera = camera(Stereo { disparity_step: 0.25, ..stereo() });
        let (image, intrinsics) = wall(&camera, |_| 1.0);
        let mut sample = Noise::new(&[1; 32]).sensor("camera").sample(0);
        let mut depths = stereo_depth(&image, &intrinsics, &camera, &mut sample);
        depths.sort_unstable();
        depths.dedup();
        let scale = intrinsics.fx * 0.05;
        assert!(depths.len() <= 4, "{depths:?}");
        for depth in depths.into_iter().filter(|depth| *depth > 0) {
            let steps = scale / (f64::from(depth) * DEPTH_UNIT) / 0.25;
            assert!((steps - steps.round()).abs() < 0.01, "{steps}");
        }
    }

    /// To the left of something at z₁ before a wall at z₂ is a shadow of f B (1/z₁ − 1/z₂) pixels.
    #[test]
    fn a_near_object_hides_points_from_the_second_imager() {
        let camera = camera(Stereo { disparity_noise: 0.0, ..stereo() });
        let (image, intrinsics) = wall(&camera, |u| if (100..150).contains(&u) { 0.5 } else { 1.5 });
        let mut sample = Noise::new(&[1; 32]).sensor("camera").sample(0);
        let depths = stereo_depth(&image, &intrinsics, &camera, &mut sample);
        let scale = intrinsics.fx * 0.05;
        let shadow = (scale * (1.0 / 0.5 - 1.0 / 1.5)).round() as usize;
        assert!(shadow > 5);
        let lost: Vec<usize> = (30..200).filter(|u| depths[*u] == 0).collect();
        assert!(lost.len().abs_diff(shadow) <= 1, "{lost:?} {shadow}");
        assert!(lost.iter().all(|u| (100 - shadow - 1..100).contains(u)), "{lost:?}");
        // At the left edge the points are outside the second image.
        let band = (scale / 1.5).ceil() as usize;
        assert!((0..band).all(|u| depths[u] == 0) && depths[band] > 0);
    }

    #[test]
    fn grazing_views_and_a_part_of_all_others_are_lost() {
        let camera = camera(Stereo { dropout: 0.1, ..stereo() });
        let (mut image, intrinsics) = wall(&camera, |_| 1.0);
        let share = |image: &GBuffer| {
            let mut sample = Noise::new(&[5; 32]).sensor("camera").sample(3);
            let depths = stereo_depth(image, &intrinsics, &camera, &mut sample);
            let kept = depths.chunks(200).flat_map(|row| &row[20..]).filter(|d| **d > 0).count();
            kept as f64 / (180.0 * 100.0)
        };
        assert!((share(&image) - 0.9).abs() < 0.012, "{}", share(&image));
        // A surface that is turned away from the view by 79 or 81 degrees at every pixel.
        let turned = |degrees: f64| {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            let normal = |k: usize| {
                let view = intrinsics.ray(k % 200, k / 200).normalize();
                let across = view.cross(palmares_models::Vec3::X).normalize();
                (across * sin - view * cos).to_array().map(|x| x as f32)
            };
            Some((0..200 * 100).map(normal).collect())
        };
        image.normal = turned(79.0);
        assert!((share(&image) - 0.9).abs() < 0.012);
        image.normal = turned(81.0);
        assert_eq!(share(&image), 0.0);
    }
}
