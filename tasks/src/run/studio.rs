//! A view that shows fingers and objects, and the light of a film.
//!
//! The view does not move: hand, objects and goals of tick 0 fill the picture. Its direction is the one of a few that shows most
//! links of the fingers and most objects.

use palmares_models::{Mat3, Pose, Rotation, Vec3};
use palmares_senses::camera::{GBuffer, Geometry, Intrinsics, Light, draw};

/// Name of the view.
pub const FILM: &str = "film";
/// Pixels in a row and rows, without another wish.
pub const FILM_SIZE: (u32, u32) = (640, 480);
/// Horizontal field of view, degrees.
const FOV_DEG: f64 = 36.0;
/// Nearest and farthest surface, m.
const RANGE_M: (f64, f64) = (0.02, 20.0);
/// Part of the picture that the bodies of interest fill.
const FILLED: f64 = 0.92;
/// Directions from which the view may be: about the vertical, from −y on, degrees; and above the horizon.
const AZIMUTHS_DEG: [f64; 8] = [0.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0, 180.0];
const ELEVATIONS_DEG: [f64; 3] = [30.0, 18.0, 45.0];
/// A direction must show so much more than an earlier one to be better: earlier ones are those that people expect.
const BETTER: f64 = 0.03;
/// Size of the pictures that the choice is made by, and the pixels with which a body counts as visible.
const TRIAL: (u32, u32) = (160, 120);
const VISIBLE_PIXELS: f64 = 6.0;
/// The light: angle from the view about the vertical and above the horizon, degrees; distance in radii of the scene.
const LIGHT_AZIMUTH_DEG: f64 = -50.0;
const LIGHT_ELEVATION_DEG: f64 = 58.0;
const LIGHT_DISTANCE: f64 = 4.0;
/// The scene that has shadows is so much larger than what is of interest at tick 0.
const LIGHT_MARGIN: f64 = 1.25;

/// The content of a film, and its viewpoint.
#[derive(Clone, Debug)]
pub(super) struct Studio {
    /// Points that must be in the picture, each with a distance around it, m.
    points: Vec<(Vec3, f64)>,
    /// From the scene to the camera.
    towards: Vec3,
    light: Light,
}

/// Bodies of interest, by their index among the bodies of cameras.
#[derive(Clone, Debug, Default)]
pub(super) struct Interest {
    /// Links of the fingers.
    pub(super) fingers: Vec<usize>,
    /// Free bodies.
    pub(super) objects: Vec<usize>,
    /// Places of the rules: lower and upper corner.
    pub(super) regions: Vec<([f64; 3], [f64; 3])>,
    /// All links of the hand.
    pub(super) links: Vec<usize>,
}

/// A unit vector with these angles about the vertical, from −y on, and above the horizon.
fn direction(azimuth_deg: f64, elevation_deg: f64) -> Vec3 {
    let (sin, cos) = libm::sincos(azimuth_deg.to_radians());
    let (up, along) = libm::sincos(elevation_deg.to_radians());
    Vec3::new(along * sin, -along * cos, up)
}

/// The optical frame at a place that looks along `-towards`.
fn looking(position: Vec3, towards: Vec3) -> Pose {
    let z = -towards;
    let x = z.cross(Vec3::Z).normalize_or(Vec3::X);
    Pose::from_parts(position, Rotation::from_mat3(&Mat3::from_cols(x, z.cross(x), z)))
}

/// The lens of a view of this size.
fn lens((width, height): (u32, u32)) -> Intrinsics {
    Intrinsics::new(width, height, FOV_DEG, RANGE_M.0, RANGE_M.1)
}

/// The nearest pose along `towards` from which a lens sees all points, in the middle of its picture.
fn fitted(points: &[(Vec3, f64)], towards: Vec3, lens: &Intrinsics) -> Pose {
    let frame = looking(Vec3::ZERO, towards);
    let into = frame.inverse();
    let slopes = [lens.cx / lens.fx, lens.cy / lens.fy].map(|slope| FILLED * slope);
    // A point at (x, z) with a margin is in the picture of a camera at (c, d) if |x − c| + margin ≤ slope (z − d), so for each
    // axis c and d are between two lines; the camera is where the narrower ones meet.
    let mut middle = [0.0; 2];
    let mut depth = f64::INFINITY;
    for axis in 0..2 {
        let slope = slopes[axis];
        let (mut low, mut high) = (f64::INFINITY, f64::INFINITY);
        for (point, margin) in points {
            let p = into.transform_point(*point);
            let (x, z) = (p[axis], p.z);
            low = low.min(slope * z - x - margin);
            high = high.min(slope * z + x - margin);
        }
        middle[axis] = 0.5 * (high - low);
        depth = depth.min(0.5 * (low + high) / slope);
    }
    let position = frame.transform_point(Vec3::new(middle[0], middle[1], depth));
    looking(position, towards)
}

impl Studio {
    /// Chooses the view of bodies at their poses of tick 0.
    pub(super) fn new(geometry: &Geometry, start: &[Pose], interest: &Interest) -> Self {
        let around = |body: &usize| (start[*body].translation, geometry.radius(*body));
        let mut points: Vec<(Vec3, f64)> = interest.objects.iter().map(around).collect();
        points.extend(interest.links.iter().map(|body| (start[*body].translation, LINK_M)));
        for (min, max) in &interest.regions {
            points.extend((0..8).map(|k| {
                let of = |axis: usize| if k >> axis & 1 == 1 { max[axis] } else { min[axis] };
                (Vec3::new(of(0), of(1), of(2)), 0.0)
            }));
        }
        points.retain(|(point, radius)| point.is_finite() && radius.is_finite());
        if points.is_empty() {
            points.push((Vec3::ZERO, 0.3));
        }
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (point, margin) in &points {
            (low, high) = (low.min(*point - Vec3::splat(*margin)), high.max(*point + Vec3::splat(*margin)));
        }
        let middle = 0.5 * (low + high);
        let radius = LIGHT_MARGIN * (0.5 * (high - low).length()).max(0.1);

        let trial = lens(TRIAL);
        let mut image = GBuffer::default();
        let (mut best, mut most) = ((0.0, ELEVATIONS_DEG[0]), f64::NEG_INFINITY);
        for elevation in ELEVATIONS_DEG {
            for azimuth in AZIMUTHS_DEG {
                let pose = fitted(&points, direction(azimuth, elevation), &trial);
                draw(geometry, start, pose, &trial, &mut image);
                let shown = shown(&image.body, interest);
                if shown > most + BETTER {
                    (best, most) = ((azimuth, elevation), shown);
                }
            }
        }
        let (azimuth, elevation) = best;
        let to_light = direction(azimuth + LIGHT_AZIMUTH_DEG, LIGHT_ELEVATION_DEG);
        let light = Light { position: middle + to_light * (LIGHT_DISTANCE * radius), at: middle, radius };
        Studio { points, towards: direction(azimuth, elevation), light }
    }

    /// The lens of a picture of this size, and the pose of its optical frame.
    pub(super) fn view(&self, size: (u32, u32)) -> (Intrinsics, Pose) {
        let lens = lens(size);
        (lens, fitted(&self.points, self.towards, &lens))
    }

    pub(super) fn light(&self) -> &Light {
        &self.light
    }
}

/// Radius around the origin of a link, m.
const LINK_M: f64 = 0.02;

/// The mean of two parts: that of the links of fingers and that of the visible objects.
fn shown(bodies: &[u16], interest: &Interest) -> f64 {
    let most =
        bodies.iter().filter(|body| **body != GBuffer::NOTHING).max().map_or(0, |body| usize::from(*body));
    let mut pixels = vec![0_u32; most + 1];
    for body in bodies.iter().filter(|body| **body != GBuffer::NOTHING) {
        pixels[usize::from(*body)] += 1;
    }
    let visible =
        |body: &usize| (pixels.get(*body).copied().map_or(0.0, f64::from) / VISIBLE_PIXELS).min(1.0);
    let part = |bodies: &[usize]| match bodies.len() {
        0 => 1.0,
        count => bodies.iter().map(visible).sum::<f64>() / count as f64,
    };
    0.5 * (part(&interest.fingers) + part(&interest.objects))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_of_any_shape_has_all_points_in_its_picture_and_is_near() {
        let points = [(Vec3::new(0.3, 0.1, 0.0), 0.05), (Vec3::new(-0.2, 0.4, 0.3), 0.1), (Vec3::ZERO, 0.0)];
        for size in [(640, 480), (480, 640), (400, 100)] {
            let lens = lens(size);
            let towards = direction(20.0, 35.0);
            let into = fitted(&points, towards, &lens).inverse();
            let mut fullest: f64 = 0.0;
            for (point, margin) in points {
                let p = into.transform_point(point);
                for (x, slope) in [(p.x, lens.cx / lens.fx), (p.y, lens.cy / lens.fy)] {
                    fullest = fullest.max((x.abs() + margin) / (slope * p.z));
                }
            }
            assert!((fullest - FILLED).abs() < 1e-9, "{size:?}: {fullest}");
        }
    }
}
