//! Bodies are drawn from front to back into the z-buffer, which then becomes depths, bodies and normals.

use super::canvas::{Area, Canvas};
use super::face::face;
use super::gbuffer::GBuffer;
use super::geometry::{Geometry, Solid, SolidKind};
use super::intrinsics::Intrinsics;
use super::round::Round;
use palmares_models::{Pose, Vec3};

/// What a pixel may show, in the optical frame.
enum Piece {
    Flat { normal: Vec3, body: u16 },
    Round { round: Round, body: u16 },
}

impl Piece {
    fn body(&self) -> u16 {
        match self {
            Piece::Flat { body, .. } | Piece::Round { body, .. } => *body,
        }
    }
}

/// Draws bodies at their world poses as a camera sees them whose optical frame is at `camera`. The picture is made anew;
/// its memory is used again.
pub fn draw(geometry: &Geometry, poses: &[Pose], camera: Pose, lens: &Intrinsics, picture: &mut GBuffer) {
    let pixels = lens.pixels();
    let GBuffer { inverse, piece, .. } = picture;
    inverse.clear();
    inverse.resize(pixels, 0.0);
    piece.clear();
    piece.resize(pixels, 0);
    // The first piece is nothing.
    let mut pieces = vec![Piece::Flat { normal: Vec3::ZERO, body: GBuffer::NOTHING }];
    let columns = lens.columns();
    let mut canvas = Canvas { width: lens.width as usize, columns: &columns, inverse, piece, number: 0 };
    let camera_from_world = camera.inverse();
    if camera_from_world.is_finite() {
        // From front to back: what is hidden costs less.
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
                canvas.number = pieces.len() as u32;
                pieces.push(Piece::Flat { normal, body });
                face(normal, point, &[], Area::whole(lens), lens, &mut canvas);
            }
            for solid in &parts.solids {
                draw_solid(solid, &from_body, body, lens, &mut canvas, &mut pieces);
            }
        }
    }
    resolve(&pieces, lens, &columns, picture);
}

fn draw_solid(
    solid: &Solid,
    from_body: &Pose,
    body: u16,
    lens: &Intrinsics,
    canvas: &mut Canvas<'_>,
    pieces: &mut Vec<Piece>,
) {
    let center = from_body.transform_point(solid.center);
    let Some(area) = Area::of_sphere(center, solid.radius, lens) else { return };
    let place = |p: Vec3| from_body.transform_point(p);
    match &solid.kind {
        SolidKind::Capsule { a, b, radius } => {
            capsule(place(*a), place(*b), *radius, body, area, lens, canvas, pieces);
        }
        SolidKind::Cylinder { a, b, radius } => {
            let round = Round::new(place(*a), place(*b), *radius, true);
            canvas.number = pieces.len() as u32;
            pieces.push(Piece::Round { round, body });
            canvas.round(&round, area, lens);
        }
        SolidKind::Rounded { faces, edges, rounding } => {
            // Of a face that is turned away nothing is seen, nor of an edge between two such.
            let mut seen = Vec::with_capacity(faces.len());
            for piece in faces {
                let normal = from_body.rotation * piece.normal;
                let mut corners = [Vec3::ZERO; 4];
                let count = piece.corners.len().min(4);
                for (corner, p) in corners.iter_mut().zip(&piece.corners) {
                    *corner = place(*p);
                }
                let facing = normal.dot(corners[0]) < 0.0;
                seen.push(facing);
                if facing {
                    canvas.number = pieces.len() as u32;
                    pieces.push(Piece::Flat { normal, body });
                    face(normal, corners[0], &corners[..count], area, lens, canvas);
                }
            }
            for edge in edges {
                if edge.faces.iter().any(|face| seen[*face]) {
                    capsule(place(edge.a), place(edge.b), *rounding, body, area, lens, canvas, pieces);
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
    pieces: &mut Vec<Piece>,
) {
    let ends = [Area::of_sphere(a, radius, lens), Area::of_sphere(b, radius, lens)];
    let area = match ends {
        // Between two ends in view, and not around the camera, nothing leaves their common rectangle.
        [Some(first), Some(second)] => first.union(second).within(area),
        _ => Some(area),
    };
    let Some(area) = area else { return };
    let round = Round::new(a, b, radius, false);
    canvas.number = pieces.len() as u32;
    pieces.push(Piece::Round { round, body });
    canvas.round(&round, area, lens);
}

/// From the nearest pieces to what the picture tells.
fn resolve(pieces: &[Piece], lens: &Intrinsics, columns: &[f64], picture: &mut GBuffer) {
    let GBuffer { depth, body, normal, inverse, piece } = picture;
    depth.clear();
    body.clear();
    let bodies: Vec<u16> = pieces.iter().map(Piece::body).collect();
    let range = lens.near..=lens.far;
    depth.extend(inverse.iter().zip(piece.iter_mut()).map(|(inverse, piece)| {
        let z = 1.0 / inverse;
        let there = range.contains(&z);
        *piece = if there { *piece } else { 0 };
        if there { z } else { f64::INFINITY }
    }));
    body.extend(piece.iter().map(|piece| bodies[*piece as usize]));
    let Some(normals) = normal else { return };
    normals.clear();
    normals.reserve(lens.pixels());
    let width = columns.len().max(1);
    for (v, (pieces_seen, depths)) in piece.chunks(width).zip(depth.chunks(width)).enumerate() {
        let y = lens.row(v);
        let row = pieces_seen.iter().zip(depths).zip(columns);
        normals.extend(row.map(|((piece, z), x)| {
            let normal = match &pieces[*piece as usize] {
                Piece::Flat { normal, .. } => *normal,
                Piece::Round { round, .. } => round.normal(Vec3::new(x * z, y * z, *z)),
            };
            [normal.x as f32, normal.y as f32, normal.z as f32]
        }));
    }
}
