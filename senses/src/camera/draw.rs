//! Bodies are drawn from front to back into the z-buffer, which then becomes depths, bodies and normals.

use super::canvas::{Area, Canvas};
use super::face::face;
use super::gbuffer::GBuffer;
use super::geometry::{Geometry, Solid, SolidKind};
use super::intrinsics::Intrinsics;
use super::round::Round;
use palmares_models::{Pose, Vec3};

/// A primitive that pixels can show, in the optical frame.
pub(super) enum Primitive {
    Flat { normal: Vec3, body: u16 },
    Round { round: Round, body: u16 },
}

impl Primitive {
    pub(super) fn body(&self) -> u16 {
        match self {
            Primitive::Flat { body, .. } | Primitive::Round { body, .. } => *body,
        }
    }

    /// Outward normal at a point of its surface.
    pub(super) fn normal(&self, point: impl FnOnce() -> Vec3) -> Vec3 {
        match self {
            Primitive::Flat { normal, .. } => *normal,
            Primitive::Round { round, .. } => round.normal(point()),
        }
    }
}

/// Draws bodies at their world poses for a camera whose optical frame is at `camera`. The new image replaces the last one in
/// the G-buffer and uses its memory.
pub fn draw(geometry: &Geometry, poses: &[Pose], camera: Pose, lens: &Intrinsics, image: &mut GBuffer) {
    let primitives = rasterise(geometry, poses, camera, lens, image);
    resolve(&primitives, lens, image);
}

/// Writes 1/z and number of the nearest primitive of every pixel, whatever the range; returns the primitives, of which the first
/// stands for a pixel that shows nothing.
pub(super) fn rasterise(
    geometry: &Geometry,
    poses: &[Pose],
    camera: Pose,
    lens: &Intrinsics,
    image: &mut GBuffer,
) -> Vec<Primitive> {
    let pixels = lens.pixels();
    let GBuffer { inverse, primitive, .. } = image;
    inverse.clear();
    inverse.resize(pixels, 0.0);
    primitive.clear();
    primitive.resize(pixels, 0);
    let mut primitives = vec![Primitive::Flat { normal: Vec3::ZERO, body: GBuffer::NOTHING }];
    let columns = lens.columns();
    let mut canvas = Canvas { width: lens.width as usize, columns: &columns, inverse, primitive, number: 0 };
    let camera_from_world = camera.inverse();
    if camera_from_world.is_finite() {
        // From front to back, since hidden pixels cost less.
        let mut order: Vec<(f64, usize, Pose)> = Vec::with_capacity(poses.len());
        for (body, (parts, pose)) in geometry.bodies.iter().zip(poses).enumerate() {
            let from_body = camera_from_world * *pose;
            if from_body.is_finite() {
                let middle = |solid: &Solid| from_body.transform_point(solid.center).z - solid.radius;
                order.push((parts.solids.iter().map(middle).fold(f64::INFINITY, f64::min), body, from_body));
            }
        }
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, body, from_body) in order {
            let (parts, pose) = (&geometry.bodies[body], &poses[body]);
            let body = body as u16;
            if let Some(height) = parts.ground {
                let normal = camera_from_world.rotation * Vec3::Z;
                let world = Vec3::new(0.0, 0.0, pose.translation.z + height);
                let point = camera_from_world.transform_point(world);
                canvas.number = primitives.len() as u32;
                primitives.push(Primitive::Flat { normal, body });
                face(normal, point, &[], Area::whole(lens), lens, &mut canvas);
            }
            for solid in &parts.solids {
                draw_solid(solid, &from_body, body, lens, &mut canvas, &mut primitives);
            }
        }
    }
    primitives
}

fn draw_solid(
    solid: &Solid,
    from_body: &Pose,
    body: u16,
    lens: &Intrinsics,
    canvas: &mut Canvas<'_>,
    primitives: &mut Vec<Primitive>,
) {
    let center = from_body.transform_point(solid.center);
    let Some(area) = Area::of_sphere(center, solid.radius, lens) else { return };
    let place = |p: Vec3| from_body.transform_point(p);
    match &solid.kind {
        SolidKind::Capsule { a, b, radius } => {
            capsule(place(*a), place(*b), *radius, body, area, lens, canvas, primitives);
        }
        SolidKind::Cylinder { a, b, radius } => {
            let round = Round::new(place(*a), place(*b), *radius, true);
            canvas.number = primitives.len() as u32;
            primitives.push(Primitive::Round { round, body });
            canvas.round(&round, area, lens);
        }
        SolidKind::Rounded { faces, edges, rounding } => {
            // A face that is turned away is not visible, and neither is an edge between two such faces.
            let mut facing = Vec::with_capacity(faces.len());
            for flat in faces {
                let normal = from_body.rotation * flat.normal;
                let mut corners = [Vec3::ZERO; 4];
                let count = flat.corners.len().min(4);
                for (corner, p) in corners.iter_mut().zip(&flat.corners) {
                    *corner = place(*p);
                }
                let is_facing = normal.dot(corners[0]) < 0.0;
                facing.push(is_facing);
                if is_facing {
                    canvas.number = primitives.len() as u32;
                    primitives.push(Primitive::Flat { normal, body });
                    face(normal, corners[0], &corners[..count], area, lens, canvas);
                }
            }
            for edge in edges {
                if edge.faces.iter().any(|face| facing[*face]) {
                    capsule(place(edge.a), place(edge.b), *rounding, body, area, lens, canvas, primitives);
                }
            }
        }
    }
}

#[allow(clippy::too_many_arguments)]
fn capsule(
    a: Vec3,
    b: Vec3,
    radius: f64,
    body: u16,
    area: Area,
    lens: &Intrinsics,
    canvas: &mut Canvas<'_>,
    primitives: &mut Vec<Primitive>,
) {
    let ends = [Area::of_sphere(a, radius, lens), Area::of_sphere(b, radius, lens)];
    let area = match ends {
        // A capsule between two ends in view, not around the camera, is within their common rectangle.
        [Some(first), Some(second)] => first.union(second).within(area),
        _ => Some(area),
    };
    let Some(area) = area else { return };
    let round = Round::new(a, b, radius, false);
    canvas.number = primitives.len() as u32;
    primitives.push(Primitive::Round { round, body });
    canvas.round(&round, area, lens);
}

/// Writes depths, bodies and normals of the nearest primitives.
fn resolve(primitives: &[Primitive], lens: &Intrinsics, image: &mut GBuffer) {
    let GBuffer { depth, body, normal, inverse, primitive } = image;
    depth.clear();
    body.clear();
    let bodies: Vec<u16> = primitives.iter().map(Primitive::body).collect();
    let range = lens.near..=lens.far;
    depth.extend(inverse.iter().zip(primitive.iter_mut()).map(|(inverse, primitive)| {
        let z = 1.0 / inverse;
        let there = range.contains(&z);
        *primitive = if there { *primitive } else { 0 };
        if there { z } else { f64::INFINITY }
    }));
    body.extend(primitive.iter().map(|primitive| bodies[*primitive as usize]));
    let Some(normals) = normal else { return };
    normals.clear();
    normals.reserve(lens.pixels());
    let columns = lens.columns();
    let width = columns.len().max(1);
    for (v, (row_primitives, depths)) in primitive.chunks(width).zip(depth.chunks(width)).enumerate() {
        let y = lens.row(v);
        let row = row_primitives.iter().zip(depths).zip(&columns);
        normals.extend(row.map(|((primitive, z), x)| {
            let normal = primitives[*primitive as usize].normal(|| Vec3::new(x * z, y * z, *z));
            [normal.x as f32, normal.y as f32, normal.z as f32]
        }));
    }
}
