//! Cameras. The thread that steps the world copies the poses of all bodies; an image can be rendered later and on any thread.

use super::hand_body::HandBody;
use super::shots::{Shot, camera_name};
use super::studio::{Interest, Studio};
use crate::image::{CameraImage, Pixels};
use crate::scene::Scene;
use crate::task::Task;
use palmares_models::Pose;
use palmares_models::camera::Camera;
use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_models::{Rotation, Vec3};
use palmares_senses::camera::{Body, CameraSensor, GBuffer, Geometry, Intrinsics, draw, shade};
use palmares_senses::channels::cameras::{BODIES, DEPTH, RGB};
use palmares_senses::noise::Noise;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::{Arc, OnceLock};

/// A camera of a run, and the hand's link that carries it.
#[derive(Debug)]
struct View {
    sensor: CameraSensor,
    link: Option<usize>,
}

/// The cameras of a run, and the shapes of its bodies.
#[derive(Debug, Default)]
pub(super) struct Cameras {
    views: Vec<View>,
    bodies: Vec<Body>,
    /// Poses of the bodies that do not move.
    fixed: Vec<Pose>,
    colors: Vec<[f64; 3]>,
    geometry: OnceLock<Geometry>,
    first_link: usize,
    /// Poses of tick 0.
    start: Vec<(usize, Pose)>,
    interest: Interest,
    studio: OnceLock<Studio>,
}

/// Colour of the hand's links.
const HAND_COLOR: [f64; 3] = [0.32, 0.34, 0.38];

impl Cameras {
    pub(super) fn new(
        task: &Task,
        scene: &Scene,
        (hand, links): (&Hand, Vec<HandBody>),
        noise: Option<&Noise>,
        start: Vec<(usize, Pose)>,
    ) -> Self {
        let views = task.cameras.iter().chain(&hand.sensors.cameras).map(|camera| {
            let named = Camera { name: camera_name(task, camera), ..camera.clone() };
            View {
                sensor: CameraSensor::new(named, task.tick_s, noise),
                link: camera.link.as_deref().and_then(|link| hand.link(link)),
            }
        });
        let standing = scene.bodies.iter().map(|body| {
            let parts = body.parts.iter().map(|part| part_at(part.position, part.quat_xyzw, &part.shape));
            Body { parts: parts.collect(), endless: body.endless }
        });
        let links = links.into_iter().map(|link| {
            let parts = link.parts.iter().map(|part| part_at(part.position, part.quat_xyzw, &part.shape));
            Body { parts: parts.collect(), endless: false }
        });
        let fixed = scene.bodies.iter().map(|body| match (body.free, body.position, body.quat_xyzw) {
            (false, Some(position), Some([x, y, z, w])) => {
                Pose::from_parts(Vec3::from_array(position), Rotation::from_xyzw(x, y, z, w))
            }
            _ => Pose::IDENTITY,
        });
        let colors = scene.bodies.iter().map(|body| body.color);
        Cameras {
            views: views.collect(),
            bodies: standing.chain(links).collect(),
            fixed: fixed.chain(hand.links.iter().map(|_| Pose::IDENTITY)).collect(),
            colors: colors.chain(hand.links.iter().map(|_| HAND_COLOR)).collect(),
            geometry: OnceLock::new(),
            first_link: scene.bodies.len(),
            start,
            interest: interest(scene, hand),
            studio: OnceLock::new(),
        }
    }
}

impl Cameras {
    /// sRGB of every body.
    pub(super) fn colors(&self) -> &[[f64; 3]] {
        &self.colors
    }

    /// The bodies' shapes.
    pub(super) fn geometry(&self) -> &Geometry {
        self.geometry.get_or_init(|| Geometry::new(&self.bodies))
    }

    /// View and light of films. The first call chooses them, which takes some milliseconds.
    pub(super) fn studio(&self) -> &Studio {
        let choose =
            || Studio::new(self.geometry(), &self.placed(self.start.iter().copied()), &self.interest);
        self.studio.get_or_init(choose)
    }

    /// World poses of all bodies.
    pub(super) fn placed(&self, moved: impl Iterator<Item = (usize, Pose)>) -> Vec<Pose> {
        let mut poses = self.fixed.clone();
        for (body, pose) in moved {
            poses[body] = pose;
        }
        poses
    }

    /// World pose of the optical frame at a pose in a link or in the world.
    pub(super) fn optical(&self, poses: &[Pose], link: Option<usize>, pose: Pose) -> Pose {
        link.map_or(Pose::IDENTITY, |link| poses[self.first_link + link]) * pose
    }

    /// Draws the bodies at these poses, by a camera at a pose in a link or in the world.
    pub(super) fn draw(
        &self,
        moved: impl Iterator<Item = (usize, Pose)>,
        link: Option<usize>,
        pose: Pose,
        lens: &Intrinsics,
        image: &mut GBuffer,
    ) -> Pose {
        let poses = self.placed(moved);
        let at = self.optical(&poses, link, pose);
        draw(self.geometry(), &poses, at, lens, image);
        at
    }
}

/// The bodies that a film shows.
fn interest(scene: &Scene, hand: &Hand) -> Interest {
    let first = scene.bodies.len();
    let fingers = hand.fingers().into_iter().flat_map(|finger| finger.links);
    let regions = scene.regions.iter().filter(|region| region.role.is_some());
    Interest {
        fingers: fingers.map(|link| first + link).collect(),
        objects: scene.bodies.iter().filter(|body| body.free).map(|body| body.id).collect(),
        regions: regions.map(|region| (region.min, region.max)).collect(),
        links: (first..first + hand.links.len()).collect(),
    }
}

fn part_at(position: [f64; 3], quat_xyzw: [f64; 4], shape: &Shape) -> (Pose, Shape) {
    let [x, y, z, w] = quat_xyzw;
    (Pose::from_parts(Vec3::from_array(position), Rotation::from_xyzw(x, y, z, w)), shape.clone())
}

/// Recent poses of all bodies, for cameras whose images come late.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct PoseHistory {
    poses: VecDeque<(u64, Vec<(usize, Pose)>)>,
}

impl PoseHistory {
    /// Whether all of its bodies are in a world of `bodies` bodies.
    pub(super) fn fits(&self, bodies: usize) -> bool {
        self.poses
            .iter()
            .all(|(_, poses)| poses.iter().all(|(body, pose)| *body < bodies && pose.is_finite()))
    }

    /// The poses after `tick`, if they are kept.
    fn at(&self, tick: u64) -> Option<&Vec<(usize, Pose)>> {
        self.poses.iter().find(|(at, _)| *at == tick).map(|(_, poses)| poses)
    }

    /// Keeps the poses after `tick` if a camera takes an image then, and drops those that no camera needs any more.
    pub(super) fn remember(
        &mut self,
        cameras: &Cameras,
        tick: u64,
        poses: impl Iterator<Item = (usize, Pose)>,
    ) {
        let late = || cameras.views.iter().map(|view| &view.sensor).filter(|sensor| sensor.is_late());
        if !late().any(|sensor| sensor.last(tick).1 == tick) {
            return;
        }
        let oldest = late().map(|sensor| sensor.newest(tick).1).min().unwrap_or(tick);
        let mut recycled = Vec::new();
        while self.poses.front().is_some_and(|(at, _)| *at < oldest) {
            recycled = self.poses.pop_front().map(|(_, poses)| poses).unwrap_or_default();
        }
        recycled.clear();
        recycled.extend(poses);
        self.poses.push_back((tick, recycled));
    }
}

/// An image that has been exposed, and is rendered when it is needed.
#[derive(Debug)]
pub struct Exposure {
    cameras: Arc<Cameras>,
    shot: Shot,
    tick: u64,
    frame: u64,
    poses: Vec<(usize, Pose)>,
    image: OnceLock<CameraImage>,
}

impl Cameras {
    /// The newest image that can be read after `tick`. With the latency of a real camera its poses are from `pose_history`, else
    /// they are those of `now`.
    pub(super) fn expose(
        self: &Arc<Self>,
        shot: Shot,
        tick: u64,
        image_cache: &mut ImageCache,
        pose_history: &PoseHistory,
        now: impl Iterator<Item = (usize, Pose)>,
    ) -> Arc<Exposure> {
        let (frame, exposed) = self.views[shot.camera].sensor.newest(tick);
        image_cache.of(shot, frame, || {
            let poses = pose_history.at(exposed).cloned().unwrap_or_else(|| now.collect());
            Exposure { cameras: Arc::clone(self), shot, tick: exposed, frame, poses, image: OnceLock::new() }
        })
    }

    /// The image after the newest one that can be read, if it has been exposed.
    pub(super) fn upcoming(
        self: &Arc<Self>,
        shot: Shot,
        tick: u64,
        image_cache: &mut ImageCache,
        pose_history: &PoseHistory,
    ) -> Option<Arc<Exposure>> {
        let sensor = &self.views[shot.camera].sensor;
        if !sensor.is_late() {
            return None;
        }
        let frame = sensor.newest(tick).0 + 1;
        let exposed = sensor.exposed(frame);
        let poses = pose_history.at(exposed)?.clone();
        let make = || Exposure {
            cameras: Arc::clone(self),
            shot,
            tick: exposed,
            frame,
            poses,
            image: OnceLock::new(),
        };
        Some(image_cache.of(shot, frame, make))
    }
}

/// The last images of every camera, so that each is rendered once.
#[derive(Debug, Default)]
pub(super) struct ImageCache(Vec<Arc<Exposure>>);

impl ImageCache {
    fn of(&mut self, shot: Shot, frame: u64, expose: impl FnOnce() -> Exposure) -> Arc<Exposure> {
        if let Some(known) = self.0.iter().find(|known| known.shot == shot && known.frame == frame) {
            return Arc::clone(known);
        }
        self.0.retain(|old| old.shot.camera != shot.camera || old.frame + 1 >= frame);
        self.0.push(Arc::new(expose()));
        self.0[self.0.len() - 1].clone()
    }
}

impl Exposure {
    /// The image. The first call renders it, which takes some milliseconds.
    pub fn render(&self) -> &CameraImage {
        self.image.get_or_init(|| self.draw())
    }

    /// Whether it has been rendered.
    pub fn is_rendered(&self) -> bool {
        self.image.get().is_some()
    }

    fn draw(&self) -> CameraImage {
        let Cameras { views, colors, .. } = &*self.cameras;
        let View { sensor, link } = &views[self.shot.camera];
        let CameraSensor { camera, intrinsics, .. } = sensor;
        let [depth, rgb, bodies] = [&DEPTH, &RGB, &BODIES].map(|image| self.shot.has(image));
        let mut drawn = GBuffer::default();
        drawn.with_normals(rgb || sensor.is_late());
        let poses = self.poses.iter().copied();
        let pose = self.cameras.draw(poses, *link, camera.pose(), intrinsics, &mut drawn);
        CameraImage {
            camera: camera.name.clone(),
            tick: self.tick,
            width: intrinsics.width,
            height: intrinsics.height,
            fx: intrinsics.fx,
            fy: intrinsics.fy,
            cx: intrinsics.cx,
            cy: intrinsics.cy,
            position: pose.translation.to_array(),
            quat_xyzw: pose.rotation.to_array(),
            depth_unit: camera.depth_unit,
            depth: depth.then(|| Pixels::of_words(&sensor.depth(&drawn, self.frame))),
            rgb: rgb.then(|| Pixels(shade(&drawn, intrinsics, colors))),
            bodies: bodies.then(|| Pixels::of_words(&drawn.body)),
        }
    }
}
