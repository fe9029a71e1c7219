//! A moment of a run, written as JSON once for all who watch.

use super::messages::{BodyKind, Poses, WatchBody, WatchReply, WatchRun, WatchScene};
use axum::extract::ws::Utf8Bytes;
use palmares_models::Pose;
use palmares_tasks::Run;
use std::sync::OnceLock;

/// Colour of a hand's links, sRGB.
const HAND_COLOR: [f64; 3] = [0.72, 0.74, 0.78];

/// A moment of a run.
#[derive(Debug)]
pub(super) struct Frame {
    /// What the run would be worth if it ended now.
    pub(super) score: f64,
    /// Where everything that moves is.
    pub(super) poses: Poses,
    text: OnceLock<Utf8Bytes>,
}

impl Frame {
    /// The run as it stands.
    pub(super) fn of(run_id: &str, run: &Run) -> Self {
        let poses = Poses {
            run_id: run_id.to_owned(),
            tick: run.tick(),
            sim_time_s: run.sim_time_s(),
            poses: run.poses().map(|(_, pose)| seven(pose)).collect(),
        };
        Frame { score: run.score(), poses, text: OnceLock::new() }
    }

    /// The message `poses`.
    pub(super) fn text(&self) -> Utf8Bytes {
        self.text.get_or_init(|| text(&WatchReply::Poses(self.poses.clone()))).clone()
    }
}

/// Single precision: a tenth of a micrometre, and half the bytes.
fn seven(pose: Pose) -> [f32; 7] {
    let ([x, y, z], [i, j, k, w]) = (pose.translation.to_array(), pose.rotation.to_array());
    [x, y, z, i, j, k, w].map(|number| number as f32)
}

/// A message as JSON.
pub(super) fn text(message: &WatchReply) -> Utf8Bytes {
    // Plain structs of numbers and strings: writing them cannot fail.
    serde_json::to_string(message).unwrap_or_default().into()
}

/// The message `scene` of a run at tick 0.
pub(super) fn scene(info: WatchRun, run: &Run) -> Utf8Bytes {
    let scene = run.scene();
    let mut bodies: Vec<WatchBody> = scene
        .bodies
        .iter()
        .map(|body| WatchBody {
            id: body.id,
            name: body.name.clone(),
            kind: if body.free { BodyKind::Object } else { BodyKind::Furniture },
            // The run itself tells all poses.
            position: body.position.unwrap_or_default(),
            quat_xyzw: body.quat_xyzw.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            parts: body.parts.clone(),
            color: body.color,
        })
        .collect();
    let poses: Vec<(usize, Pose)> = run.poses().collect();
    for link in run.hand_bodies() {
        let pose = poses.iter().find(|(id, _)| *id == link.id).map_or(Pose::IDENTITY, |(_, pose)| *pose);
        bodies.push(WatchBody {
            id: link.id,
            name: link.name,
            kind: BodyKind::Hand,
            position: pose.translation.to_array(),
            quat_xyzw: pose.rotation.to_array(),
            parts: link.parts,
            color: HAND_COLOR,
        });
    }
    let moving = poses.iter().map(|(id, _)| *id).collect();
    let regions = scene.regions.clone();
    text(&WatchReply::Scene(Box::new(WatchScene { run: info, bodies, moving, regions })))
}
