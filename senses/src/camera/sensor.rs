//! A camera of a run: when it takes images, and the errors of their depth.

use super::gbuffer::GBuffer;
use super::intrinsics::Intrinsics;
use super::stereo::{plain_depth, stereo_depth};
use crate::noise::{Noise, SensorNoise};
use palmares_models::camera::Camera;

/// A camera of a run, ideal or with the errors of a real one.
#[derive(Debug)]
pub struct CameraSensor {
    /// The camera.
    pub camera: Camera,
    /// Its intrinsics.
    pub intrinsics: Intrinsics,
    noise: Option<SensorNoise>,
    /// Ticks from one image to the next.
    period: f64,
    /// Ticks from an exposure until its image can be read.
    latency: u64,
}

impl CameraSensor {
    /// A camera whose name is unique in the run; with errors if `noise` is given.
    pub fn new(camera: Camera, tick_s: f64, noise: Option<&Noise>) -> Self {
        CameraSensor {
            intrinsics: Intrinsics::of(&camera),
            noise: noise.map(|noise| noise.sensor(&format!("camera {}", camera.name))),
            period: 1.0 / (camera.stereo.rate_hz * tick_s),
            latency: (camera.stereo.latency_s / tick_s - 1e-9).ceil().max(0.0) as u64,
            camera,
        }
    }

    /// Whether it has a rate and a latency: without errors an image is of the tick in which it is read.
    pub fn is_late(&self) -> bool {
        self.noise.is_some()
    }

    /// The tick after which image `frame` is exposed.
    pub fn exposed(&self, frame: u64) -> u64 {
        (frame as f64 * self.period - 1e-9).ceil().max(0.0) as u64
    }

    /// Number and tick of the last image exposed until `tick`.
    pub fn last(&self, tick: u64) -> (u64, u64) {
        let mut frame = (tick as f64 / self.period) as u64 + 1;
        while frame > 0 && self.exposed(frame) > tick {
            frame -= 1;
        }
        (frame, self.exposed(frame))
    }

    /// Number and tick of the newest image that can be read after `tick`.
    pub fn newest(&self, tick: u64) -> (u64, u64) {
        if self.is_late() { self.last(tick.saturating_sub(self.latency)) } else { (tick, tick) }
    }

    /// Depths of image `frame`, in the camera's unit; 0 where there is no reading. With errors, the G-buffer must have normals.
    pub fn depth(&self, drawn: &GBuffer, frame: u64) -> Vec<u16> {
        match &self.noise {
            None => plain_depth(drawn, &self.camera),
            Some(noise) => stereo_depth(drawn, &self.intrinsics, &self.camera, &mut noise.sample(frame)),
        }
    }
}
