//! Every pixel of drawn depth against rays that march along the exact distance to each shape.

use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_senses::camera::{Body, GBuffer, Geometry, Intrinsics, draw};
use proptest::prelude::*;

const WIDTH: usize = 48;
const HEIGHT: usize = 36;

fn lens() -> Intrinsics {
    Intrinsics::new(WIDTH as u32, HEIGHT as u32, 70.0, 0.02, 5.0)
}

/// Signed distance from a point in the shape's frame, in closed form or by projection on a polyhedron.
fn distance(shape: &Shape, p: Vec3) -> f64 {
    let round = |half: Vec3, r: f64| {
        let q = p.abs() - half;
        q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - r
    };
    match shape {
        Shape::Sphere { radius } => p.length() - radius,
        Shape::Capsule { radius, half_length } => {
            (p - Vec3::Z * p.z.clamp(-*half_length, *half_length)).length() - radius
        }
        Shape::Cylinder { radius, half_length } => {
            let (across, along) = (p.x.hypot(p.y) - radius, p.z.abs() - half_length);
            across.max(along).min(0.0) + across.max(0.0).hypot(along.max(0.0))
        }
        Shape::Box { half_extents, rounding } => {
            round(Vec3::from_array(*half_extents) - Vec3::splat(*rounding), *rounding)
        }
        Shape::Hull { points, rounding } => {
            let sharp = Shape::Hull { points: points.clone(), rounding: 0.0 };
            let (hull, _) = sharp.to_parry().expect("a volume");
            let projected = hull.project_point(&Pose::IDENTITY, p, false);
            let length = (projected.point - p).length();
            if projected.is_inside { -length - rounding } else { length - rounding }
        }
    }
}

/// Depth at which a ray d (z = 1) from the camera's centre meets the shape; none if it does not.
fn marched(shape: &Shape, from_shape: &Pose, d: Vec3) -> Option<f64> {
    let (into, length) = (from_shape.inverse(), d.length());
    let mut t = 0.0;
    for _ in 0..4000 {
        let gap = distance(shape, into.transform_point(d * t));
        if gap < 1e-10 {
            return Some(t);
        }
        t += gap / length;
        if t > 6.0 {
            return None;
        }
    }
    Some(t)
}

fn tetrahedron(s: f64, rounding: f64) -> Shape {
    let points = vec![[s, s, s], [s, -s, -s], [-s, s, -s], [-s, -s, s], [0.2 * s, 0.3 * s, 1.2 * s]];
    Shape::Hull { points, rounding }
}

/// Draws one shape and compares every pixel. Returns the number of pixels that show it, and of those that differ at its rim.
fn compare(shape: &Shape, pose: Pose) -> (usize, usize) {
    let lens = lens();
    let body = Body { parts: vec![(Pose::IDENTITY, shape.clone())], endless: false };
    let geometry = Geometry::new(&[body]);
    let mut image = GBuffer::default();
    image.with_normals(true);
    draw(&geometry, &[pose], Pose::IDENTITY, &lens, &mut image);
    let expected: Vec<Option<f64>> = (0..WIDTH * HEIGHT)
        .map(|k| marched(shape, &pose, lens.ray(k % WIDTH, k / WIDTH)).filter(|z| *z >= lens.near))
        .collect();
    let (mut shown, mut at_rim) = (0, 0);
    for (k, expected) in expected.iter().enumerate() {
        let drawn = Some(image.depth[k]).filter(|z| z.is_finite());
        assert_eq!(drawn.is_some(), image.body[k] == 0);
        match (drawn, expected) {
            (None, None) => {}
            (Some(drawn), Some(expected)) if (drawn - expected).abs() <= 1e-6 => {
                shown += 1;
                let ray = lens.ray(k % WIDTH, k / WIDTH);
                let point = pose.inverse().transform_point(ray * drawn);
                let normal = image.normal.as_ref().expect("wanted")[k].map(f64::from);
                let normal = pose.rotation.inverse() * Vec3::from_array(normal);
                // Outwards the distance grows; along an edge the direction is either face's.
                let grown = distance(shape, point + normal * 1e-5);
                assert!(grown > 0.5e-5, "{shape:?} at pixel {k}: normal {normal:?}, {grown}");
            }
            _ => {
                // The ray almost misses: of two rays half a pixel away, one hits and one misses.
                let (u, v) = (k % WIDTH, k / WIDTH);
                let around = [(-0.5, 0.0), (0.5, 0.0), (0.0, -0.5), (0.0, 0.5)].map(|(du, dv)| {
                    let step = Vec3::new(du / lens.fx, dv / lens.fy, 0.0);
                    marched(shape, &pose, lens.ray(u, v) + step)
                });
                let hits = around.iter().flatten().count();
                let spread =
                    around.iter().flatten().fold((f64::MAX, 0.0f64), |(a, b), z| (a.min(*z), b.max(*z)));
                assert!(
                    hits < 4 || spread.1 - spread.0 > 0.01,
                    "{shape:?} at pixel {u}, {v}: drawn {drawn:?}, expected {expected:?}"
                );
                at_rim += 1;
            }
        }
    }
    (shown, at_rim)
}

fn shapes() -> impl Strategy<Value = Shape> {
    let half = || 0.02..0.15f64;
    prop_oneof![
        half().prop_map(|radius| Shape::Sphere { radius }),
        (half(), half()).prop_map(|(radius, half_length)| Shape::Capsule { radius, half_length }),
        (half(), half()).prop_map(|(radius, half_length)| Shape::Cylinder { radius, half_length }),
        (half(), half(), half(), 0.0..0.9f64).prop_map(|(x, y, z, r)| {
            Shape::Box { half_extents: [x, y, z], rounding: if r < 0.3 { 0.0 } else { r * x.min(y).min(z) } }
        }),
        (half(), 0.0..0.03f64)
            .prop_map(|(s, rounding)| tetrahedron(s, if rounding < 0.01 { 0.0 } else { rounding })),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]
    #[test]
    fn depth_is_that_of_the_shape_at_every_pixel(
        shape in shapes(),
        at in (-0.3..0.3f64, -0.25..0.25f64, 0.05..0.8f64),
        turn in prop::array::uniform3(-3.0..3.0f64),
    ) {
        let rotation = Rotation::from_scaled_axis(Vec3::from_array(turn));
        let pose = Pose::from_parts(Vec3::new(at.0, at.1, at.2), rotation);
        // A camera inside the shape has nothing to compare.
        prop_assume!(distance(&shape, pose.inverse().transform_point(Vec3::ZERO)) > 0.03);
        let (shown, at_rim) = compare(&shape, pose);
        prop_assert!(at_rim <= 2 + shown / 50, "{} of {} at the rim", at_rim, shown);
    }

    /// With no pose and no lens anything panics or a pixel is not a number.
    #[test]
    fn nothing_brings_it_down(
        shape in shapes(),
        numbers in prop::array::uniform6(prop_oneof![-1e3..1e3f64, Just(0.0), Just(1e200), Just(f64::NAN), Just(-1e-200)]),
        fov in 0.5..179.0f64,
    ) {
        let lens = Intrinsics::new(17, 9, fov, 0.01, 10.0);
        let geometry = Geometry::new(&[Body { parts: vec![(Pose::IDENTITY, shape)], endless: false }]);
        let [x, y, z, a, b, c] = numbers;
        let pose = Pose::from_parts(Vec3::new(x, y, z), Rotation::from_xyzw(a, b, c, 1.0));
        let mut image = GBuffer::default();
        for (body, camera) in [(pose, Pose::IDENTITY), (Pose::IDENTITY, pose)] {
            draw(&geometry, &[body], camera, &lens, &mut image);
            prop_assert!(image.depth.iter().all(|z| z.is_infinite() || (0.01..=10.0).contains(z)));
            prop_assert_eq!(image.depth.len(), 17 * 9);
        }
    }
}

#[test]
fn the_ground_has_no_end_and_bodies_behind_the_camera_are_not_visible() {
    let top = Pose::translation(0.0, 0.0, -0.15);
    let slab = Shape::Box { half_extents: [1.0, 1.0, 0.05], rounding: 0.0 };
    let ground = Body { parts: vec![(top, slab)], endless: true };
    let ball = |z: f64| (Pose::translation(0.0, 0.0, z), Shape::Sphere { radius: 0.05 });
    let balls = Body { parts: vec![ball(0.4), ball(1.7)], endless: false };
    let geometry = Geometry::new(&[ground, balls]);
    // One metre up, looking down.
    let camera = Pose::from_parts(Vec3::new(0.0, 0.0, 1.0), Rotation::from_xyzw(1.0, 0.0, 0.0, 0.0));
    let (lens, mut image) = (lens(), GBuffer::default());
    draw(&geometry, &[Pose::IDENTITY; 2], camera, &lens, &mut image);
    let first = (image.depth.clone(), image.body.clone());
    let middle = HEIGHT / 2 * WIDTH + WIDTH / 2;
    assert_eq!((image.body[0], image.body[middle]), (0, 1));
    assert!((image.depth[0] - 1.1).abs() < 1e-12, "{}", image.depth[0]);
    let (along, z) = (lens.ray(WIDTH / 2, HEIGHT / 2).length_squared(), 0.6f64);
    let expected = (z - (z * z - along * (z * z - 0.05 * 0.05)).sqrt()) / along;
    assert!((image.depth[middle] - expected).abs() < 1e-12, "{} {expected}", image.depth[middle]);
    draw(&geometry, &[Pose::IDENTITY; 2], camera, &lens, &mut image);
    assert_eq!(first, (image.depth.clone(), image.body.clone()), "memory is used again");
}

/// The image of a ball is the ellipse of its tangents, to half a pixel.
#[test]
fn the_rim_of_a_ball_is_where_its_tangents_are() {
    let lens = lens();
    let center = Vec3::new(0.1, -0.05, 0.6);
    let body = Body { parts: vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.12 })], endless: false };
    let mut image = GBuffer::default();
    let pose = Pose::from_parts(center, Rotation::IDENTITY);
    draw(&Geometry::new(&[body]), &[pose], Pose::IDENTITY, &lens, &mut image);
    for v in 0..HEIGHT {
        for u in 0..WIDTH {
            let ray = lens.ray(u, v).normalize();
            let miss = (center - ray * center.dot(ray)).length() - 0.12;
            // A pixel's width at that distance.
            let pixel = center.z / lens.fx;
            if miss.abs() > 0.5 * pixel {
                assert_eq!(image.body[v * WIDTH + u] == 0, miss < 0.0, "{u} {v}");
            }
        }
    }
}
