//! A task's scene as its cameras see it.

use anyhow::{Context, Result};
use palmares_models::camera::Camera;
use palmares_models::hand::Hand;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_senses::camera::Body;
use palmares_tasks::{Run, Seed, Task};

/// A scene as cameras see it.
pub(super) struct CameraScene {
    pub(super) name: String,
    pub(super) bodies: Vec<Body>,
    pub(super) poses: Vec<Pose>,
    pub(super) colors: Vec<[f64; 3]>,
    pub(super) camera: Camera,
}

/// A task's scene with the SoftHand at its start, of whose objects the first `most` are left.
pub(super) fn scene(task: &str, camera: &str, most: usize) -> Result<CameraScene> {
    let task = Task::builtin().into_iter().find(|known| known.name == task).context("a task")?;
    let hand = Hand::builtin("softhand").context("a hand")?;
    let run = Run::new(task.clone(), hand, Seed::from_u64(1))?;
    let placed = |position: [f64; 3], [x, y, z, w]: [f64; 4]| {
        Pose::from_parts(Vec3::from_array(position), Rotation::from_xyzw(x, y, z, w))
    };
    let (mut bodies, mut poses, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    let parts = |parts: &[palmares_tasks::scene::ScenePart]| {
        parts.iter().map(|part| (placed(part.position, part.quat_xyzw), part.shape.clone())).collect()
    };
    let mut objects = 0;
    for body in &run.scene().bodies {
        objects += usize::from(body.free);
        if body.free && objects > most {
            continue;
        }
        bodies.push(Body { parts: parts(&body.parts), endless: body.endless });
        let (position, quat) = (
            body.position.context("the pose of a body is missing")?,
            body.quat_xyzw.context("the pose of a body is missing")?,
        );
        poses.push(placed(position, quat));
        colors.push(body.color);
    }
    let first = run.scene().bodies.len();
    let links = run.hand_bodies();
    for (id, pose) in run.poses().filter(|(id, _)| *id >= first) {
        bodies.push(Body { parts: parts(&links[id - first].parts), endless: false });
        poses.push(pose);
        colors.push([0.3; 3]);
    }
    let found = task.cameras.iter().find(|known| known.name == camera).cloned();
    let found = match found {
        Some(found) => found,
        None => on_hand(&run, camera).context("a camera")?,
    };
    let name = format!("{}, {} objects", task.name, objects.min(most));
    Ok(CameraScene { name, bodies, poses, colors, camera: found })
}

/// A camera of the hand, where it is in the world.
fn on_hand(run: &Run, name: &str) -> Option<Camera> {
    let camera = run.hand().sensors.cameras.iter().find(|known| known.name == name)?;
    let link = run.scene().bodies.len() + run.hand().link(camera.link.as_deref()?)?;
    let (_, on) = run.poses().find(|(id, _)| *id == link)?;
    let pose = on * camera.pose();
    let (position, quat_xyzw) = (pose.translation.to_array(), pose.rotation.to_array());
    Some(Camera { position, quat_xyzw, ..camera.clone() })
}
