//! The same picture by MuJoCo's renderer on the CPU.

use super::scene::CameraScene;
use crate::engine::mujoco::python;
use anyhow::{Context, Result, bail, ensure};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_senses::camera::Intrinsics;
use std::fmt::Write as _;
use std::process::Command;

const PROGRAM: &str = include_str!("../../python/mujoco_camera.py");

/// Time and content of the picture.
pub(super) struct Drawn {
    pub(super) version: String,
    /// ms of a picture of depth, of bodies, of colours.
    pub(super) depth_ms: f64,
    pub(super) bodies_ms: f64,
    pub(super) rgb_ms: f64,
    /// m.
    pub(super) depth: Vec<f32>,
}

/// Draws a scene.
///
/// # Errors
/// MuJoCo or OSMesa is not there, or does not take the scene.
pub(super) fn draw(scene: &CameraScene, lens: &Intrinsics, repeats: usize) -> Result<Drawn> {
    let folder = tempfile::tempdir()?;
    let (document, depths) = (folder.path().join("scene.xml"), folder.path().join("depth.f32"));
    std::fs::write(&document, mjcf(scene, lens)?)?;
    let output = Command::new(python())
        .args(["-c", PROGRAM])
        .arg(&document)
        .args([lens.width.to_string(), lens.height.to_string(), repeats.to_string()])
        .arg(&depths)
        .output()
        .with_context(|| format!("cannot start `{}`", python()))?;
    let said = String::from_utf8_lossy(&output.stdout);
    let [version, depth_ms, bodies_ms, rgb_ms] = said.split_whitespace().collect::<Vec<_>>()[..] else {
        bail!("{}", String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or("it said nothing"));
    };
    let depth: Vec<f32> = std::fs::read(&depths)?
        .chunks_exact(4)
        .map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        .collect();
    ensure!(depth.len() == lens.pixels(), "{} depths of {} pixels", depth.len(), lens.pixels());
    Ok(Drawn {
        version: version.to_owned(),
        depth_ms: depth_ms.parse()?,
        bodies_ms: bodies_ms.parse()?,
        rgb_ms: rgb_ms.parse()?,
        depth,
    })
}

fn place(pose: &Pose) -> String {
    let ([x, y, z], q) = (pose.translation.to_array(), pose.rotation);
    format!("pos='{x:?} {y:?} {z:?}' quat='{:?} {:?} {:?} {:?}'", q.w, q.x, q.y, q.z)
}

/// Nothing moves. Roundings of boxes are left out, those of hulls are 26 corners about each point.
fn mjcf(scene: &CameraScene, lens: &Intrinsics) -> Result<String> {
    let (mut geoms, mut assets, mut hulls) = (String::new(), String::new(), 0);
    for ((body, pose), color) in scene.bodies.iter().zip(&scene.poses).zip(&scene.colors) {
        let [r, g, b] = color;
        if let (true, [(part, Shape::Box { half_extents, .. })]) = (body.endless, &body.parts[..]) {
            let top = *pose * *part * Pose::from_translation(Vec3::Z * half_extents[2]);
            write!(geoms, "<geom type='plane' size='0 0 1' {} rgba='{r:?} {g:?} {b:?} 1'/>", place(&top))?;
            continue;
        }
        for (part, shape) in &body.parts {
            let size = match shape {
                Shape::Sphere { radius } => format!("type='sphere' size='{radius:?}'"),
                Shape::Capsule { radius, half_length } => {
                    format!("type='capsule' size='{radius:?} {half_length:?}'")
                }
                Shape::Cylinder { radius, half_length } => {
                    format!("type='cylinder' size='{radius:?} {half_length:?}'")
                }
                Shape::Box { half_extents: [x, y, z], .. } => format!("type='box' size='{x:?} {y:?} {z:?}'"),
                Shape::Hull { points, rounding } => {
                    hulls += 1;
                    write!(assets, "<mesh name='hull{hulls}' vertex='")?;
                    for p in corners(points, *rounding) {
                        write!(assets, "{:?} {:?} {:?} ", p.x, p.y, p.z)?;
                    }
                    assets.push_str("'/>");
                    format!("type='mesh' mesh='hull{hulls}'")
                }
            };
            write!(geoms, "<geom {size} {} rgba='{r:?} {g:?} {b:?} 1'/>", place(&(*pose * *part)))?;
        }
    }
    // Their cameras look along -z, with y up.
    let turned = Pose::from_rotation(Rotation::from_xyzw(1.0, 0.0, 0.0, 0.0));
    let fovy = 2.0 * (0.5 * f64::from(lens.height) / lens.fy).atan().to_degrees();
    Ok(format!(
        "<mujoco><visual><map znear='0.005' zfar='5'/><global offwidth='{}' offheight='{}'/>\
         <quality shadowsize='0' offsamples='0'/></visual><statistic extent='1'/><asset>{assets}</asset><worldbody>\
         <light pos='0 0 3' castshadow='false'/>{geoms}<camera name='camera' {} fovy='{fovy:?}'/></worldbody></mujoco>",
        lens.width,
        lens.height,
        place(&(scene.camera.pose() * turned)),
    ))
}

fn corners(points: &[[f64; 3]], rounding: f64) -> Vec<Vec3> {
    let points = points.iter().map(|point| Vec3::from_array(*point));
    if rounding == 0.0 {
        return points.collect();
    }
    let about = |k: usize| Vec3::new((k % 3) as f64, (k / 3 % 3) as f64, (k / 9) as f64) - Vec3::ONE;
    let directions: Vec<Vec3> = (0..27).filter(|k| *k != 13).map(|k| about(k).normalize()).collect();
    points.flat_map(|p| directions.iter().map(move |d| p + *d * rounding).collect::<Vec<_>>()).collect()
}
