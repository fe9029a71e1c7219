//! Pictures for people: one light with shadows, light of the sky from above, smooth edges.
//!
//! The light is a camera of its own: a point is in shadow where that camera sees something nearer. Every pixel has four samples.
//! Where all four show the same primitive, one colour is enough; so edges are smooth and surfaces are cheap.

use super::draw::{Primitive, rasterise};
use super::gbuffer::GBuffer;
use super::geometry::Geometry;
use super::intrinsics::Intrinsics;
use palmares_models::{Pose, Rotation, Vec3};

/// A light that shines on a sphere. A point outside its cone has no shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Where it is, m.
    pub position: Vec3,
    /// Middle of the sphere, m.
    pub at: Vec3,
    /// Radius of the sphere, m; less than the distance to its middle.
    pub radius: f64,
}

/// Samples in a row, and rows of samples, of a pixel.
const SAMPLES: usize = 2;
/// Pixels in a row of the light's image.
const SHADOW_PIXELS: u32 = 1024;
/// A surface this many of those pixels above another one does not touch its shadow: else rounding would spot every surface.
const SHADOW_GAP_PIXELS: f64 = 2.0;
/// Parts of the light that come from the lamp, and from the sky from above and from below.
const LAMP: f64 = 0.80;
const SKY: f64 = 0.34;
const FLOOR: f64 = 0.14;
/// Largest part that a surface mirrors to the camera, and the exponent of the highlight as a power of two.
const GLOSS: f64 = 0.10;
const GLOSS_DOUBLINGS: u32 = 5;
/// sRGB of pixels that show no body.
const BACKGROUND: [f64; 3] = [0.86, 0.88, 0.90];
/// An endless ground fades into the background from this to that distance, m.
const FADE_M: (f64, f64) = (2.0, 7.0);
/// Steps of linear light for which the sRGB byte is known.
const STEPS: usize = 4096;

/// Draws pictures, and keeps the memory for the next one.
#[derive(Clone, Debug)]
pub struct Film {
    image: GBuffer,
    shadow: GBuffer,
    /// sRGB byte of each step of linear light.
    bytes: Vec<u8>,
}

impl Default for Film {
    fn default() -> Self {
        let byte = |step: usize| (255.0 * encoded(step as f64 / (STEPS - 1) as f64) + 0.5) as u8;
        let bytes = (0..STEPS).map(byte).collect();
        Film { image: GBuffer::default(), shadow: GBuffer::default(), bytes }
    }
}

/// Linear light of an sRGB value (IEC 61966-2-1).
fn linear(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
}

/// sRGB value of linear light.
fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055 }
}

impl Film {
    /// sRGB, three bytes a pixel, of bodies at their world poses, by a camera whose optical frame is at `camera`. `colors` has the
    /// sRGB of every body.
    pub fn picture(
        &mut self,
        geometry: &Geometry,
        poses: &[Pose],
        camera: Pose,
        lens: &Intrinsics,
        colors: &[[f64; 3]],
        light: &Light,
    ) -> Vec<u8> {
        let (many, fine) = (SAMPLES as u32, SAMPLES as f64);
        let samples = Intrinsics {
            width: many * lens.width,
            height: many * lens.height,
            fx: fine * lens.fx,
            fy: fine * lens.fy,
            cx: fine * lens.cx,
            cy: fine * lens.cy,
            ..*lens
        };
        let primitives = rasterise(geometry, poses, camera, &samples, &mut self.image);
        let lamp = lamp(light);
        let shadow_lens = shadow_lens(light);
        rasterise(geometry, poses, lamp, &shadow_lens, &mut self.shadow);
        let studio = Studio {
            primitives: &primitives,
            colors: colors.iter().map(|color| color.map(linear)).collect(),
            grounds: geometry.bodies.iter().map(|body| body.ground.is_some()).collect(),
            background: BACKGROUND.map(linear),
            up: camera.rotation.inverse() * Vec3::Z,
            lamp: camera.inverse().transform_point(light.position),
            lamp_from_camera: lamp.inverse() * camera,
            gap: SHADOW_GAP_PIXELS / shadow_lens.fx,
            shadow_lens,
            shadow: &self.shadow.inverse,
        };
        let width = samples.width as usize;
        let columns = samples.columns();
        let mut bytes = vec![0; 3 * lens.pixels()];
        for (v, row) in bytes.chunks_exact_mut(3 * lens.width.max(1) as usize).enumerate() {
            let first = SAMPLES * v;
            let ys: [f64; SAMPLES] = std::array::from_fn(|k| samples.row(first + k));
            for (u, rgb) in row.chunks_exact_mut(3).enumerate() {
                let left = SAMPLES * u;
                let at = |i: usize, j: usize| (first + j) * width + left + i;
                let shown = &self.image.primitive;
                let one = shown[at(0, 0)];
                let color = if one == shown[at(1, 0)] && one == shown[at(0, 1)] && one == shown[at(1, 1)] {
                    let inverse = &self.image.inverse;
                    let nearness =
                        inverse[at(0, 0)] + inverse[at(1, 0)] + inverse[at(0, 1)] + inverse[at(1, 1)];
                    let ray = (0.5 * (columns[left] + columns[left + 1]), 0.5 * (ys[0] + ys[1]));
                    studio.color(one, 0.25 * nearness, ray)
                } else {
                    let mut sum = [0.0; 3];
                    for j in 0..SAMPLES {
                        for i in 0..SAMPLES {
                            let k = at(i, j);
                            let color =
                                studio.color(shown[k], self.image.inverse[k], (columns[left + i], ys[j]));
                            sum.iter_mut().zip(color).for_each(|(sum, part)| *sum += 0.25 * part);
                        }
                    }
                    sum
                };
                for (byte, part) in rgb.iter_mut().zip(color) {
                    *byte = self.bytes[((part * (STEPS - 1) as f64 + 0.5) as usize).min(STEPS - 1)];
                }
            }
        }
        bytes
    }
}

/// The optical frame of the light.
fn lamp(light: &Light) -> Pose {
    let z = (light.at - light.position).normalize_or_zero();
    let aside = if z.x.abs() < 0.9 { Vec3::X } else { Vec3::Y };
    let x = aside.cross(z).normalize_or_zero();
    Pose::from_parts(light.position, rotation(x, z.cross(x), z))
}

/// The rotation whose columns these are.
fn rotation(x: Vec3, y: Vec3, z: Vec3) -> Rotation {
    Rotation::from_mat3(&palmares_models::Mat3::from_cols(x, y, z))
}

fn shadow_lens(light: &Light) -> Intrinsics {
    let distance = (light.at - light.position).length();
    let half = libm::asin((light.radius / distance).min(0.98));
    Intrinsics::new(SHADOW_PIXELS, SHADOW_PIXELS, 2.0 * half.to_degrees(), 0.0, f64::INFINITY)
}

/// A picture's bodies and lights, in the optical frame of the camera.
struct Studio<'a> {
    primitives: &'a [Primitive],
    /// Linear light that each body reflects.
    colors: Vec<[f64; 3]>,
    /// Which bodies are an endless ground.
    grounds: Vec<bool>,
    background: [f64; 3],
    up: Vec3,
    lamp: Vec3,
    lamp_from_camera: Pose,
    /// Length of [`SHADOW_GAP_PIXELS`] at the distance 1 m from the light, m.
    gap: f64,
    shadow_lens: Intrinsics,
    shadow: &'a [f64],
}

impl Studio<'_> {
    /// Linear light that a ray (x, y, 1) brings from a primitive at 1/z.
    fn color(&self, primitive: u32, nearness: f64, (x, y): (f64, f64)) -> [f64; 3] {
        let primitive = &self.primitives[primitive as usize];
        let body = usize::from(primitive.body());
        let Some(color) = self.colors.get(body) else { return self.background };
        let ray = Vec3::new(x, y, 1.0);
        let z = 1.0 / nearness;
        let ground = self.grounds[body];
        let near = if ground { (1.0 - (z - FADE_M.0) / (FADE_M.1 - FADE_M.0)).clamp(0.0, 1.0) } else { 1.0 };
        if near == 0.0 {
            return self.background;
        }
        let point = ray * z;
        let normal = primitive.normal(|| point);
        let to_lamp = self.lamp - point;
        let distance = to_lamp.length();
        let to_lamp = to_lamp / distance;
        let facing = normal.dot(to_lamp);
        let lit = if facing > 0.0 { self.lit(point + normal * (self.gap * distance)) } else { 0.0 };
        let sky = FLOOR + (SKY - FLOOR) * (0.5 + 0.5 * normal.dot(self.up));
        let diffuse = LAMP * facing.max(0.0) * lit + sky;
        let mut gloss = 0.0;
        if !ground && lit > 0.0 {
            let half = (to_lamp - ray.normalize()).normalize_or_zero();
            gloss = normal.dot(half).max(0.0);
            (0..GLOSS_DOUBLINGS).for_each(|_| gloss *= gloss);
            gloss *= GLOSS * lit;
        }
        std::array::from_fn(|k| near * (color[k] * diffuse + gloss) + (1.0 - near) * self.background[k])
    }

    /// The part of the light that reaches a point: of the nine nearest pixels of the light's image, those that show nothing nearer,
    /// with weights that are linear in the place.
    fn lit(&self, point: Vec3) -> f64 {
        let p = self.lamp_from_camera.transform_point(point);
        let lens = &self.shadow_lens;
        if p.z <= 0.0 {
            return 1.0;
        }
        let nearness = 1.0 / p.z;
        let (u, v) = (lens.fx * p.x * nearness + lens.cx - 1.0, lens.fy * p.y * nearness + lens.cy - 1.0);
        let width = SHADOW_PIXELS as usize;
        let most = f64::from(SHADOW_PIXELS) - 3.0;
        if !(u >= 0.0 && v >= 0.0 && u <= most && v <= most) {
            return 1.0;
        }
        let (left, top) = (u as usize, v as usize);
        let rows: [&[f64]; 3] = std::array::from_fn(|row| {
            let first = (top + row) * width + left;
            &self.shadow[first..first + 3]
        });
        // Most points are wholly in the light, or wholly in a shadow.
        match rows.iter().flat_map(|row| row.iter()).filter(|depth| **depth <= nearness).count() {
            0 => return 0.0,
            9 => return 1.0,
            _ => {}
        }
        let (a, b) = (u - left as f64, v - top as f64);
        let (across, down) = ([1.0 - a, 1.0, a], [1.0 - b, 1.0, b]);
        let mut sum = 0.0;
        for (row, down) in rows.iter().zip(&down) {
            for (depth, across) in row.iter().zip(&across) {
                sum += if *depth <= nearness { across * down } else { 0.0 };
            }
        }
        0.25 * sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Body;
    use palmares_models::shape::Shape;

    const GROUND: [f64; 3] = [0.6, 0.6, 0.6];
    const BALL: [f64; 3] = [0.8, 0.2, 0.2];

    /// A ball above a ground, seen from straight above; the light comes from +x.
    fn picture(size: u32) -> Vec<u8> {
        let slab = Shape::Box { half_extents: [1.0, 1.0, 0.05], rounding: 0.0 };
        let ground = Body {
            parts: vec![(Pose::from_parts(Vec3::new(0.0, 0.0, -0.05), Rotation::IDENTITY), slab)],
            endless: true,
        };
        let ball = Body { parts: vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.05 })], endless: false };
        let geometry = Geometry::new(&[ground, ball]);
        let poses = [Pose::IDENTITY, Pose::from_parts(Vec3::new(0.0, 0.0, 0.2), Rotation::IDENTITY)];
        let camera = Pose::from_parts(Vec3::new(0.0, 0.0, 1.0), Rotation::from_xyzw(1.0, 0.0, 0.0, 0.0));
        let lens = Intrinsics::new(size, size, 60.0, 0.01, 10.0);
        let light = Light { position: Vec3::new(1.0, 0.0, 1.2), at: Vec3::ZERO, radius: 0.6 };
        Film::default().picture(&geometry, &poses, camera, &lens, &[GROUND, BALL], &light)
    }

    fn pixel(bytes: &[u8], size: usize, u: usize, v: usize) -> [u8; 3] {
        let k = 3 * (v * size + u);
        [bytes[k], bytes[k + 1], bytes[k + 2]]
    }

    #[test]
    fn the_shadow_is_where_a_ray_from_the_light_meets_the_ball_first() {
        let size = 200;
        let bytes = picture(size);
        let size = size as usize;
        let at = |x: f64, y: f64| {
            let f = 0.5 * size as f64 / libm::tan(30f64.to_radians());
            let place = |to: f64| (0.5 * size as f64 + f * to) as usize;
            pixel(&bytes, size, place(x), place(-y))
        };
        // The light at (1, 0, 1.2) and the ball's middle at height 0.2: its shadow is around x = −0.2 on the ground.
        let (dark, bright) = (at(-0.2, 0.0), at(-0.2, 0.15));
        assert!(dark[0] + 40 < bright[0], "{dark:?} {bright:?}");
        let beside = at(0.3, 0.0);
        assert!(beside[0].abs_diff(bright[0]) < 20, "{beside:?} {bright:?}");
        // The ball is red, brightest towards the light.
        let (to_light, away) = (at(0.03, 0.0), at(-0.05, 0.0));
        assert!(to_light[0] > 2 * to_light[1] && to_light[0] > away[0] + 30, "{to_light:?} {away:?}");
    }

    #[test]
    fn no_surface_shades_itself_and_edges_are_smooth() {
        let size = 200_usize;
        let bytes = picture(200);
        // The ground far from the ball has one brightness that changes slowly.
        let row: Vec<u8> = (110..190).map(|u| pixel(&bytes, size, u, 30)[0]).collect();
        assert!(row.windows(2).all(|pair| pair[0].abs_diff(pair[1]) <= 2), "{row:?}");
        // In most rows, the pixel at the rim of the ball has a colour between those of ball and ground.
        let red = |[r, g, _]: [u8; 3]| f64::from(r) - f64::from(g);
        let between = |v: usize| {
            let row: Vec<f64> = (100..120).rev().map(|u| red(pixel(&bytes, size, u, v))).collect();
            let rim = row.iter().position(|x| *x > 5.0).expect("the ball is in the row");
            row[rim] < 0.85 * row[rim + 1]
        };
        let rows = (92..108).filter(|v| between(*v)).count();
        assert!(rows >= 8, "{rows} of 16 rows");
    }

    #[test]
    fn pictures_are_the_same_bytes_whatever_was_drawn_before() {
        assert_eq!(picture(64), picture(64));
        let mut film = Film::default();
        let geometry = Geometry::new(&[]);
        let light = Light { position: Vec3::Z, at: Vec3::ZERO, radius: 0.5 };
        for size in [8, 4] {
            let lens = Intrinsics::new(size, size, 60.0, 0.01, 10.0);
            let bytes = film.picture(&geometry, &[], Pose::IDENTITY, &lens, &[], &light);
            assert_eq!(bytes.len(), 3 * lens.pixels());
            let wanted = BACKGROUND.map(|part| (255.0 * part).round() as u8);
            let same = |rgb: &[u8]| rgb.iter().zip(wanted).all(|(a, b)| a.abs_diff(b) <= 1);
            assert!(bytes.chunks(3).all(same), "{bytes:?}");
        }
    }
}
