//! Accuracy of convex pieces for a mesh: volumes, largest distances, mass properties.

use parry3d_f64::query::{PointQuery, PointQueryWithLocation};
use parry3d_f64::shape::{TriMesh, TrianglePointLocation};
use parry3d_f64::transformation::try_convex_hull;

use super::mesh::{Surface, TriangleMesh};
use crate::shape::Shape;
use crate::shape::hull::{outside, planes};
use crate::shape::inertia::{Inertia, of_shapes, volume_of_triangles};
use crate::{Pose, Vec3};

/// Accuracy of convex pieces for a mesh.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Volume of the mesh, m³; `None` if it is not closed.
    pub mesh_volume: Option<f64>,
    /// Volume of its closed cavities, m³, which pieces fill.
    pub cavities: f64,
    /// Sum of the volumes of all pieces, m³; overlaps count once per piece, as they do for an object's mass.
    pub pieces_volume: f64,
    /// Volume counted more than once, m³; accurate to a few parts in a thousand of the whole.
    pub overlap_volume: f64,
    /// The point of the mesh that is farthest outside of all pieces.
    pub uncovered: Farthest,
    /// The point of the pieces' common surface that is farthest outside of the mesh; if the mesh is not closed,
    /// farthest from it.
    pub beyond: Farthest,
    /// Distance of neighbouring sample points, m.
    pub spacing: f64,
    /// Distance of the centres of mass, m; `None` if the mesh is not closed.
    pub com_shift: Option<f64>,
    /// The largest difference of a principal moment of inertia for equal masses, relative to the mesh's.
    pub inertia_error: Option<f64>,
}

/// A point and its distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Farthest {
    /// m
    pub distance: f64,
    /// In the mesh's frame, m.
    pub at: Vec3,
}

impl Farthest {
    const NONE: Farthest = Farthest { distance: 0.0, at: Vec3::ZERO };

    fn take(&mut self, distance: f64, at: Vec3) {
        if distance > self.distance {
            *self = Farthest { distance, at };
        }
    }
}

impl Fit {
    /// Volume of the pieces above the mesh's, as a part of it; overlaps count once.
    pub fn volume_error(&self) -> Option<f64> {
        self.mesh_volume.map(|mesh| (self.pieces_volume - self.overlap_volume) / mesh - 1.0)
    }

    /// The larger of the two distances, m.
    pub fn gap(&self) -> f64 {
        self.uncovered.distance.max(self.beyond.distance)
    }
}

/// Points on each of the two surfaces.
const SAMPLES: usize = 40_000;
/// Cells along the longest side in which overlaps are counted.
const CELLS: usize = 96;

/// A convex piece, prepared for point queries.
struct Solid {
    planes: Vec<(Vec3, f64)>,
    mesh: TriangleMesh,
    surface: TriMesh,
    low: Vec3,
    high: Vec3,
}

impl Solid {
    fn new(points: &[Vec3]) -> Option<Solid> {
        let (vertices, triangles) = try_convex_hull(points).ok()?;
        let mesh = TriangleMesh { vertices, triangles };
        let surface = TriMesh::new(mesh.vertices.clone(), mesh.triangles.clone()).ok()?;
        let (low, high) = mesh.bounds();
        Some(Solid { planes: planes(&mesh.vertices, &mesh.triangles), mesh, surface, low, high })
    }

    /// Whether the point is inside, or outside by no more than `margin`.
    fn has(&self, p: Vec3, margin: f64) -> bool {
        let box_gap = (self.low - p).max(p - self.high).max_element();
        box_gap <= margin && outside(&self.planes, p) <= margin
    }

    /// Distance of a point, or a number larger than `most`; 0 inside.
    fn distance(&self, p: Vec3, most: f64) -> f64 {
        let least = (self.low - p).max(p - self.high).max_element();
        if least > most {
            return least;
        }
        let least = outside(&self.planes, p);
        if least <= 0.0 {
            0.0
        } else if least > most {
            least
        } else {
            self.surface.distance_to_local_point(p, false)
        }
    }
}

/// Compares sharp hulls of points with a mesh. `None` when a piece spans no volume, or the mesh has no triangles.
pub fn compare(mesh: &TriangleMesh, pieces: &[Vec<Vec3>]) -> Option<Fit> {
    let solids: Vec<Solid> = pieces.iter().map(|points| Solid::new(points)).collect::<Option<_>>()?;
    let of_mesh = TriMesh::new(mesh.vertices.clone(), mesh.triangles.clone()).ok()?;
    let (mesh, surface) = &mesh.outward();
    let (low, high) = mesh.bounds();
    let tiny = 1e-6 * (high - low).max_element();
    let pieces_area: f64 = solids.iter().map(|s| s.mesh.area()).sum();
    let volumes: Vec<f64> =
        solids.iter().map(|s| volume_of_triangles(&s.mesh.vertices, &s.mesh.triangles)).collect();
    let pieces_volume = volumes.iter().sum::<f64>();
    let (com_shift, inertia_error) =
        mesh.inertia(1.0).and_then(|of_mesh| mass_differences(&of_mesh, pieces)).unzip();
    let (mesh_volume, cavities) = match surface {
        Surface::Closed { volume, cavities, .. } => (Some(*volume), *cavities),
        _ => (None, 0.0),
    };
    Some(Fit {
        mesh_volume,
        cavities,
        pieces_volume,
        overlap_volume: pieces_volume * overlap(&solids),
        uncovered: uncovered(mesh, &solids),
        beyond: beyond(mesh, &of_mesh, matches!(surface, Surface::Closed { .. }), &solids, tiny),
        spacing: (mesh.area().max(pieces_area) / SAMPLES as f64).sqrt(),
        com_shift,
        inertia_error,
    })
}

/// Difference of the mass properties of hulls from those of the mesh.
fn mass_differences(of_mesh: &Inertia, pieces: &[Vec<Vec3>]) -> Option<(f64, f64)> {
    let hull = |points: &Vec<Vec3>| Shape::Hull {
        points: points.iter().map(|p| p.to_array()).collect(),
        rounding: 0.0,
    };
    let shapes: Vec<Shape> = pieces.iter().map(hull).collect();
    let of_pieces = of_shapes(shapes.iter().map(|shape| (Pose::IDENTITY, shape)), of_mesh.mass)?;
    let ratios = of_mesh.principal().into_iter().zip(of_pieces.principal());
    let error = ratios.map(|(mesh, pieces)| (pieces / mesh - 1.0).abs()).fold(0.0, f64::max);
    Some(((of_pieces.com - of_mesh.com).length(), error))
}

/// The point of the mesh that is farthest from all pieces.
fn uncovered(mesh: &TriangleMesh, solids: &[Solid]) -> Farthest {
    let mut farthest = Farthest::NONE;
    let samples = mesh.samples(SAMPLES);
    for p in mesh.vertices.iter().chain(samples.iter().map(|(_, p)| p)) {
        let mut distance = f64::INFINITY;
        for solid in solids {
            distance = distance.min(solid.distance(*p, distance));
            // It will not be the farthest.
            if distance <= farthest.distance {
                break;
            }
        }
        farthest.take(distance, *p);
    }
    farthest
}

/// The point of the pieces' common surface that is farthest outside of the mesh, or farthest from it if it is
/// not closed.
fn beyond(mesh: &TriangleMesh, of_mesh: &TriMesh, closed: bool, solids: &[Solid], tiny: f64) -> Farthest {
    let area: f64 = solids.iter().map(|s| s.mesh.area()).sum();
    let mut candidates: Vec<(f64, Vec3)> = Vec::new();
    for (k, solid) in solids.iter().enumerate() {
        let count = (SAMPLES as f64 * solid.mesh.area() / area).ceil() as usize;
        let others = || solids.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, solid)| solid);
        for (triangle, p) in solid.mesh.samples(count) {
            let [a, b, c] = solid.mesh.corners(solid.mesh.triangles[triangle]);
            // A little outside, so that the faces along which two pieces were cut do not count.
            let p = p + (b - a).cross(c - a).normalize_or_zero() * tiny;
            if others().all(|other| !other.has(p, tiny)) {
                let (near, (nearest, location)) = of_mesh.project_local_point_and_get_location(p, false);
                // If it is below the nearest face, the point is within the mesh, and not outside.
                let [a, b, c] = mesh.corners(mesh.triangles[nearest as usize]);
                let below = (p - near.point).dot((b - a).cross(c - a)) < 0.0;
                if !(closed && below && matches!(location, TrianglePointLocation::OnFace(..))) {
                    candidates.push(((p - near.point).length(), p));
                }
            }
        }
    }
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
    let found = candidates.iter().find(|(_, p)| !closed || mesh.winding(*p).abs() < 0.5);
    found.map_or(Farthest::NONE, |(distance, at)| Farthest { distance: *distance, at: *at })
}

/// Part of the pieces' volume that is counted more than once.
fn overlap(solids: &[Solid]) -> f64 {
    if solids.len() < 2 {
        return 0.0;
    }
    let low = solids.iter().fold(Vec3::splat(f64::INFINITY), |low, s| low.min(s.low));
    let high = solids.iter().fold(Vec3::splat(f64::NEG_INFINITY), |high, s| high.max(s.high));
    let cell = (high - low).max_element() / CELLS as f64;
    let count = ((high - low) / cell).ceil().to_array().map(|n| (n as usize).clamp(1, CELLS + 1));
    let mut often = vec![0_u8; count.iter().product()];
    for solid in solids {
        let from = ((solid.low - low) / cell).floor().to_array().map(|n| n.max(0.0) as usize);
        let to = ((solid.high - low) / cell).ceil().to_array();
        let to = [0, 1, 2].map(|axis| (to[axis] as usize).min(count[axis]));
        for i in from[0]..to[0] {
            for j in from[1]..to[1] {
                for k in from[2]..to[2] {
                    let middle = Vec3::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5);
                    if outside(&solid.planes, low + middle * cell) <= 0.0 {
                        let at = (i * count[1] + j) * count[2] + k;
                        often[at] = often[at].saturating_add(1);
                    }
                }
            }
        }
    }
    let (once, all) =
        often.iter().fold((0_u64, 0_u64), |(once, all), &n| (once + u64::from(n > 0), all + u64::from(n)));
    if all == 0 { 0.0 } else { 1.0 - once as f64 / all as f64 }
}
