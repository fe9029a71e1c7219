//! The same picture by MuJoCo's renderer on the CPU.

use super::scene::CameraScene;
use crate::engine::mujoco::python;
use anyhow::{Context, Result, bail, ensure};
use palmares_models::mjcf::{Element, Lines};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_senses::camera::Intrinsics;
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
    std::fs::write(&document, mjcf(scene, lens))?;
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

/// Nothing moves. Roundings of boxes are left out, those of hulls are 26 corners about each point.
fn mjcf(scene: &CameraScene, lens: &Intrinsics) -> String {
    let (mut world, mut meshes, mut hulls) = (Lines::at(2), Lines::at(2), 0);
    world.leaf(Element::new("light").text("pos", "0 0 3").text("castshadow", "false"));
    for ((body, pose), [r, g, b]) in scene.bodies.iter().zip(&scene.poses).zip(&scene.colors) {
        let mut leaf = |geom: Element, pose: Pose| {
            world.leaf(geom.whole_pose(&pose).text("rgba", &format!("{r:?} {g:?} {b:?} 1")));
        };
        if let (true, [(part, Shape::Box { half_extents, .. })]) = (body.endless, &body.parts[..]) {
            leaf(Element::plane(), *pose * *part * Pose::from_translation(Vec3::Z * half_extents[2]));
            continue;
        }
        for (part, shape) in &body.parts {
            let geom = Element::geom_of_shape(shape, |points, rounding| {
                hulls += 1;
                let name = format!("hull{hulls}");
                meshes.leaf(Element::new("mesh").text("name", &name).hull(points, rounding));
                Element::geom_of_mesh(&name)
            });
            leaf(geom, *pose * *part);
        }
    }
    // Their cameras look along -z, with y up.
    let turned = Pose::from_rotation(Rotation::from_xyzw(1.0, 0.0, 0.0, 0.0));
    let fovy = 2.0 * (0.5 * f64::from(lens.height) / lens.fy).atan().to_degrees();
    let camera = Element::new("camera").text("name", "camera").whole_pose(&(scene.camera.pose() * turned));
    world.leaf(camera.number("fovy", fovy));
    let mut out = Lines::default();
    out.open(Element::new("mujoco"));
    out.open(Element::new("visual"));
    out.leaf(Element::new("map").text("znear", "0.005").text("zfar", "5"));
    let size = Element::new("global").text("offwidth", &lens.width.to_string());
    out.leaf(size.text("offheight", &lens.height.to_string()));
    out.leaf(Element::new("quality").text("shadowsize", "0").text("offsamples", "0"));
    out.close("visual");
    out.leaf(Element::new("statistic").text("extent", "1"));
    out.around("asset", meshes);
    out.around("worldbody", world);
    out.close("mujoco");
    out.into_one_line()
}
