//! Cameras: what of the world a picture is made from is copied where the world is stepped; the picture can be drawn later
//! and on any thread.

use super::hand_body::HandBody;
use super::shots::{Channels, Shot, camera_name};
use crate::image::{CameraImage, Pixels};
use crate::scene::Scene;
use crate::task::Task;
use palmares_models::Pose;
use palmares_models::camera::Camera;
use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_models::{Rotation, Vec3};
use palmares_senses::camera::{Body, GBuffer, Geometry, Intrinsics, draw, plain_depth, shade, stereo_depth};
use palmares_senses::noise::{Noise, SensorNoise};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::{Arc, OnceLock};

/// A camera of a run.
#[derive(Debug)]
struct View {
    camera: Camera,
    intrinsics: Intrinsics,
    /// The hand's link on which it sits.
    link: Option<usize>,
    noise: Option<SensorNoise>,
    /// Ticks between two pictures, and from exposure until one can be read; none for a camera without errors.
    period: f64,
    latency: u64,
}

/// The cameras of a run, and the shapes that they see.
#[derive(Debug, Default)]
pub(super) struct Cameras {
    views: Vec<View>,
    bodies: Vec<Body>,
    /// Where bodies stand that do not move.
    fixed: Vec<Pose>,
    colors: Vec<[f64; 3]>,
    geometry: OnceLock<Geometry>,
    first_link: usize,
}

/// Colour of the hand's links.
const HAND_COLOR: [f64; 3] = [0.32, 0.34, 0.38];

impl Cameras {
    pub(super) fn new(
        task: &Task,
        scene: &Scene,
        (hand, links): (&Hand, Vec<HandBody>),
        noise: Option<&Noise>,
    ) -> Self {
        let views = task.cameras.iter().chain(&hand.sensors.cameras).map(|camera| {
            let name = camera_name(task, camera);
            let stereo = &camera.stereo;
            View {
                intrinsics: Intrinsics::of(camera),
                link: camera.link.as_deref().and_then(|link| hand.link(link)),
                noise: noise.map(|noise| noise.sensor(&format!("camera {name}"))),
                period: 1.0 / (stereo.rate_hz * task.tick_s),
                latency: (stereo.latency_s / task.tick_s - 1e-9).ceil().max(0.0) as u64,
                camera: Camera { name, ..camera.clone() },
            }
        });
        let standing = scene.bodies.iter().map(|body| {
            let parts = body.parts.iter().map(|part| placed(part.position, part.quat_xyzw, &part.shape));
            Body { parts: parts.collect(), endless: body.endless }
        });
        let links = links.into_iter().map(|link| {
            let parts = link.parts.iter().map(|part| placed(part.position, part.quat_xyzw, &part.shape));
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
        }
    }
}

fn placed(position: [f64; 3], quat_xyzw: [f64; 4], shape: &Shape) -> (Pose, Shape) {
    let [x, y, z, w] = quat_xyzw;
    (Pose::from_parts(Vec3::from_array(position), Rotation::from_xyzw(x, y, z, w)), shape.clone())
}

impl View {
    /// The tick after which picture `frame` is taken.
    fn exposed(&self, frame: u64) -> u64 {
        (frame as f64 * self.period - 1e-9).ceil().max(0.0) as u64
    }

    /// Number and tick of the last picture taken until `tick`.
    fn last(&self, tick: u64) -> (u64, u64) {
        let mut frame = (tick as f64 / self.period) as u64 + 1;
        while frame > 0 && self.exposed(frame) > tick {
            frame -= 1;
        }
        (frame, self.exposed(frame))
    }

    /// Number and tick of the picture that can be read after `tick`.
    fn newest(&self, tick: u64) -> (u64, u64) {
        match self.noise {
            None => (tick, tick),
            Some(_) => self.last(tick.saturating_sub(self.latency)),
        }
    }
}

/// Recent poses of all bodies, for cameras whose images come late.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct PoseHistory {
    poses: VecDeque<(u64, Vec<(usize, Pose)>)>,
}

impl PoseHistory {
    /// Whether it remembers bodies that there are.
    pub(super) fn fits(&self, bodies: usize) -> bool {
        self.poses
            .iter()
            .all(|(_, poses)| poses.iter().all(|(body, pose)| *body < bodies && pose.is_finite()))
    }

    /// Where everything was after `tick`, if that is remembered.
    fn at(&self, tick: u64) -> Option<&Vec<(usize, Pose)>> {
        self.poses.iter().find(|(at, _)| *at == tick).map(|(_, poses)| poses)
    }

    /// Remembers where everything is after `tick`, if one of the cameras takes a picture then.
    pub(super) fn remember(
        &mut self,
        cameras: &Cameras,
        tick: u64,
        poses: impl Iterator<Item = (usize, Pose)>,
    ) {
        let late = || cameras.views.iter().filter(|view| view.noise.is_some());
        if !late().any(|view| view.last(tick).1 == tick) {
            return;
        }
        let oldest = late().map(|view| view.newest(tick).1).min().unwrap_or(tick);
        let mut room = Vec::new();
        while self.poses.front().is_some_and(|(at, _)| *at < oldest) {
            room = self.poses.pop_front().map(|(_, poses)| poses).unwrap_or_default();
        }
        room.clear();
        room.extend(poses);
        self.poses.push_back((tick, room));
    }
}

/// A picture that has been taken, and is drawn when it is wanted.
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
    /// The newest picture that can be read after `tick`, of the world as it is (`now`) or, with the latency of a real
    /// camera, as it was (`pose_history`).
    pub(super) fn expose(
        self: &Arc<Self>,
        shot: Shot,
        tick: u64,
        image_cache: &mut ImageCache,
        pose_history: &PoseHistory,
        now: impl Iterator<Item = (usize, Pose)>,
    ) -> Arc<Exposure> {
        let (frame, exposed) = self.views[shot.camera].newest(tick);
        image_cache.of(shot, frame, || {
            let poses = pose_history.at(exposed).cloned().unwrap_or_else(|| now.collect());
            Exposure { cameras: Arc::clone(self), shot, tick: exposed, frame, poses, image: OnceLock::new() }
        })
    }

    /// The picture after the newest one that can be read, if it has been taken already.
    pub(super) fn upcoming(
        self: &Arc<Self>,
        shot: Shot,
        tick: u64,
        image_cache: &mut ImageCache,
        pose_history: &PoseHistory,
    ) -> Option<Arc<Exposure>> {
        let view = &self.views[shot.camera];
        view.noise.as_ref()?;
        let frame = view.newest(tick).0 + 1;
        let exposed = view.exposed(frame);
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

/// The last pictures of every camera: one that is asked for twice is drawn once.
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
    /// The picture, which is drawn the first time: some milliseconds of work.
    pub fn render(&self) -> &CameraImage {
        self.image.get_or_init(|| self.draw())
    }

    /// Whether it has been drawn.
    pub fn is_rendered(&self) -> bool {
        self.image.get().is_some()
    }

    fn draw(&self) -> CameraImage {
        let Cameras { views, bodies, fixed, colors, geometry, first_link } = &*self.cameras;
        let View { camera, intrinsics, link, noise, .. } = &views[self.shot.camera];
        let geometry = geometry.get_or_init(|| Geometry::new(bodies));
        let mut poses = fixed.clone();
        for (body, pose) in &self.poses {
            poses[*body] = *pose;
        }
        let on = link.map_or(Pose::IDENTITY, |link| poses[first_link + link]);
        let pose = on * camera.pose();
        let Channels { depth, rgb, bodies } = self.shot.channels;
        let mut picture = GBuffer::default();
        picture.with_normals(rgb || noise.is_some());
        draw(geometry, &poses, pose, intrinsics, &mut picture);
        let depths = || match noise {
            None => plain_depth(&picture, camera),
            Some(noise) => stereo_depth(&picture, intrinsics, camera, &mut noise.sample(self.frame)),
        };
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
            depth: depth.then(|| Pixels::of_words(&depths())),
            rgb: rgb.then(|| Pixels(shade(&picture, intrinsics, colors))),
            bodies: bodies.then(|| Pixels::of_words(&picture.body)),
        }
    }
}
