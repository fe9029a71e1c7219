//! A triangle mesh, and whether it encloses a volume.

use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;
use parry3d_f64::transformation::try_convex_hull;

use crate::Vec3;
use crate::shape::inertia::{Inertia, of_triangles, volume_of_triangles};

/// Triangles between vertices, each vertex once.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// m
    pub vertices: Vec<Vec3>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
}

/// Whether the triangles of a mesh are the surface of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Closed surface.
    Closed {
        /// m³
        volume: f64,
        /// Triangles face into the solid: the mesh, or a part of it, is inside out.
        inward: bool,
        /// Volume of closed cavities, m³: no part of the volume, and unreachable.
        cavities: f64,
    },
    /// The surface has borders.
    Open {
        /// Edges of an odd number of triangles.
        edges: usize,
    },
    /// No borders, but neighbouring triangles face opposite sides.
    Twisted {
        /// Edges between triangles that face opposite sides.
        edges: usize,
    },
    /// Closed, but without volume: a sheet with two sides.
    Empty,
}

/// Largest number of triangles checked to distinguish cavities from parts that are inside out, some tenths of
/// a second; further parts count as inside out.
const MAX_CHECKED: usize = 5_000_000;

/// A connected part of a mesh.
struct MeshComponent {
    triangles: Vec<[u32; 3]>,
}

/// A closed mesh with less than this part of its hull's volume is empty.
const EMPTY: f64 = 1e-4;

impl TriangleMesh {
    /// A mesh of triangles by their corners. Equal corners become one vertex; triangles with two equal
    /// corners are dropped.
    pub fn new(corners: &[[Vec3; 3]]) -> TriangleMesh {
        // Minus zero is zero.
        let clean = |p: &Vec3| (*p + Vec3::ZERO).to_array();
        let order = |a: &[f64; 3], b: &[f64; 3]| {
            a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
        };
        let mut vertices: Vec<[f64; 3]> = corners.iter().flatten().map(clean).collect();
        vertices.sort_by(order);
        vertices.dedup();
        let index = |p: &Vec3| {
            let found = vertices.binary_search_by(|v| order(v, &clean(p)));
            found.unwrap_or_default() as u32
        };
        let triangles = corners.iter().map(|triangle| [0, 1, 2].map(|k| index(&triangle[k])));
        let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        TriangleMesh { vertices: vertices.into_iter().map(Vec3::from_array).collect(), triangles }
    }

    /// The convex hull of points; `None` if they span no volume.
    pub fn hull(points: &[Vec3]) -> Option<TriangleMesh> {
        let (vertices, triangles) = try_convex_hull(points).ok()?;
        let hull = TriangleMesh { vertices, triangles };
        matches!(hull.surface(), Surface::Closed { .. }).then_some(hull)
    }

    /// The mesh with each axis scaled by a factor.
    #[must_use]
    pub fn scaled(&self, scale: Vec3) -> TriangleMesh {
        let vertices = self.vertices.iter().map(|v| *v * scale).collect();
        TriangleMesh { vertices, triangles: self.triangles.clone() }
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|i| self.vertices[i as usize])
    }

    /// Lowest and highest corner of its bounding box, m.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let grown = |(low, high): (Vec3, Vec3), p: &Vec3| (low.min(*p), high.max(*p));
        self.vertices.iter().fold((Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY)), grown)
    }

    /// Whether the mesh is closed, and what it encloses.
    pub fn surface(&self) -> Surface {
        self.outward().1
    }

    /// Whether the mesh is closed, and if so, the same mesh with all triangles facing out of the solid:
    /// connected parts that are inside out are flipped, except for cavities, which are within another part.
    pub(crate) fn outward(&self) -> (TriangleMesh, Surface) {
        let (open, twisted) = self.odd_edges();
        if open > 0 || self.triangles.is_empty() {
            return (self.clone(), Surface::Open { edges: open });
        }
        if twisted > 0 {
            return (self.clone(), Surface::Twisted { edges: twisted });
        }
        let parts = self.connected();
        let volumes: Vec<f64> =
            parts.iter().map(|part| volume_of_triangles(&self.vertices, &part.triangles)).collect();
        // The largest part is no cavity.
        let largest = volumes.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        let mut triangles = Vec::with_capacity(self.triangles.len());
        let mut looked_at = 0;
        let (mut inward, mut cavities) = (false, 0.0);
        for (k, part) in parts.iter().enumerate() {
            // Unchanged if the largest part faces outward.
            let faces_inward = volumes[k] * largest < 0.0;
            looked_at += if faces_inward { self.triangles.len() } else { 0 };
            let cavity = faces_inward && looked_at <= MAX_CHECKED && self.within_others(&parts, k);
            let turn_over = (volumes[k] < 0.0) != cavity;
            inward |= turn_over;
            cavities += if cavity { volumes[k].abs() } else { 0.0 };
            let turned = |t: &[u32; 3]| if turn_over { [t[0], t[2], t[1]] } else { *t };
            triangles.extend(part.triangles.iter().map(turned));
        }
        let mesh = TriangleMesh { vertices: self.vertices.clone(), triangles };
        let volume = volume_of_triangles(&mesh.vertices, &mesh.triangles);
        let (low, high) = self.bounds();
        let size = high - low;
        if volume <= EMPTY * size.x * size.y * size.z {
            return (self.clone(), Surface::Empty);
        }
        (mesh, Surface::Closed { volume, inward, cavities })
    }

    /// Number of edges with an odd number of triangles, and number of other edges with triangles that face
    /// opposite sides.
    fn odd_edges(&self) -> (usize, usize) {
        // Each edge of a closed surface is passed as often one way as the other.
        let mut edges: Vec<(u32, u32, i64)> = Vec::with_capacity(3 * self.triangles.len());
        for [a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                edges.push(if from < to { (*from, *to, 1) } else { (*to, *from, -1) });
            }
        }
        edges.sort_unstable();
        let (mut open, mut twisted) = (0, 0);
        for edge in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let balance: i64 = edge.iter().map(|e| e.2).sum();
            if edge.len() % 2 == 1 {
                open += 1;
            } else if balance != 0 {
                twisted += 1;
            }
        }
        (open, twisted)
    }

    /// The parts of the mesh whose triangles share vertices, in the order of their first triangles.
    fn connected(&self) -> Vec<MeshComponent> {
        // Each vertex points to the first one of its part.
        let mut first: Vec<u32> = (0..self.vertices.len() as u32).collect();
        let find = |first: &mut [u32], mut v: u32| {
            while first[v as usize] != v {
                first[v as usize] = first[first[v as usize] as usize];
                v = first[v as usize];
            }
            v
        };
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| find(&mut first, v));
            let least = a.min(b).min(c);
            [a, b, c].into_iter().for_each(|v| first[v as usize] = least);
        }
        let mut place = vec![usize::MAX; self.vertices.len()];
        let mut parts: Vec<MeshComponent> = Vec::new();
        for triangle in &self.triangles {
            let root = find(&mut first, triangle[0]) as usize;
            if place[root] == usize::MAX {
                place[root] = parts.len();
                parts.push(MeshComponent { triangles: Vec::new() });
            }
            parts[place[root]].triangles.push(*triangle);
        }
        parts
    }

    /// Whether a part is within the others: its outermost point decides.
    fn within_others(&self, parts: &[MeshComponent], k: usize) -> bool {
        let points = parts[k].triangles.iter().flatten().map(|&i| self.vertices[i as usize]);
        let Some(outermost) = points.max_by(|a, b| a.x.total_cmp(&b.x)) else { return false };
        let others = parts.iter().enumerate().filter(|(other, _)| *other != k);
        let triangles = others.flat_map(|(_, part)| &part.triangles);
        self.winding_of(triangles, outermost).abs() > 0.5
    }

    /// Mass properties of `mass` kg spread evenly over the enclosed volume; `None` if it is not closed.
    pub fn inertia(&self, mass: f64) -> Option<Inertia> {
        let (mesh, surface) = self.outward();
        matches!(surface, Surface::Closed { .. })
            .then(|| of_triangles(&mesh.vertices, &mesh.triangles, mass))
            .flatten()
    }

    /// Winding number of the mesh about a point: ±1 inside a closed mesh, 0 outside.
    pub(crate) fn winding(&self, p: Vec3) -> f64 {
        self.winding_of(&self.triangles, p)
    }

    fn winding_of<'a>(&self, triangles: impl IntoIterator<Item = &'a [u32; 3]>, p: Vec3) -> f64 {
        let angle = |triangle: &[u32; 3]| {
            let [a, b, c] = self.corners(*triangle).map(|x| x - p);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            // Solid angle of a triangle (van Oosterom and Strackee 1983).
            let over = a.dot(b.cross(c));
            let under = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * libm::atan2(over, under)
        };
        triangles.into_iter().map(angle).sum::<f64>() / (4.0 * core::f64::consts::PI)
    }

    /// Distance of the farthest of about `count` points on this mesh from another mesh, m.
    pub(crate) fn farthest_from(&self, other: &TriangleMesh, count: usize) -> f64 {
        let Ok(other) = TriMesh::new(other.vertices.clone(), other.triangles.clone()) else { return 0.0 };
        let distance = |(_, p): &(usize, Vec3)| other.distance_to_local_point(*p, false);
        self.samples(count).iter().map(distance).fold(0.0, f64::max)
    }

    /// The area, m².
    pub(crate) fn area(&self) -> f64 {
        self.triangles.iter().map(|t| area(self.corners(*t))).sum()
    }

    /// Points spread evenly over the surface, about `count` of them, each with its triangle.
    pub(crate) fn samples(&self, count: usize) -> Vec<(usize, Vec3)> {
        let each = self.area() / count.max(1) as f64;
        let mut out = Vec::with_capacity(count + 1);
        let mut passed = 0.0;
        for (k, triangle) in self.triangles.iter().enumerate() {
            let [a, b, c] = self.corners(*triangle);
            passed += area([a, b, c]);
            // One sample per equal share of the area.
            while (out.len() as f64 + 0.5) * each < passed {
                // The plane's quasi-random sequence with the plastic number (Roberts 2018).
                let n = (out.len() + 1) as f64;
                let (mut u, mut v) = ((0.754_877_666_246_693 * n) % 1.0, (0.569_840_290_998_053 * n) % 1.0);
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                out.push((k, a + (b - a) * u + (c - a) * v));
            }
        }
        out
    }

    /// The bytes of a binary STL file; `about` is its header, up to 80 bytes of ASCII.
    ///
    /// A file has single precision.
    pub fn to_stl(&self, about: &str) -> Vec<u8> {
        let mut bytes: Vec<u8> =
            about.bytes().map(|b| if b.is_ascii() { b } else { b'?' }).take(80).collect();
        bytes.resize(80, b' ');
        bytes.extend((self.triangles.len() as u32).to_le_bytes());
        for triangle in &self.triangles {
            let [a, b, c] = self.corners(*triangle);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for x in [normal, a, b, c].into_iter().flat_map(|v| v.to_array()) {
                bytes.extend((x as f32).to_le_bytes());
            }
            bytes.extend([0, 0]);
        }
        bytes
    }
}

fn area([a, b, c]: [Vec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
