//! Meshes: STL, OBJ, COLLADA, binary glTF and text formats become binary STL files within the limits of a hand. A scene of
//! a few boxes, balls and cylinders becomes these shapes.

mod collada;
mod gltf;
mod merge;
mod scene;
mod stl;
mod text;
mod transform;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use palmares_models::pieces::TriangleMesh;
use palmares_models::read::Limits;
use palmares_models::{Pose, Vec3};

use crate::decision::{At, Log};
use crate::draft::{Draft, Geometry, LinkShape, Mesh, Origin, Triangles};
use crate::glance::{is_lfs_pointer, lfs_problem};
use crate::source::{Source, limits};

/// A part of a hand larger than this is a mesh in millimetres, m.
const LARGEST_PART: f64 = 1.5;

/// The meshes of a hand that is written.
#[derive(Debug, Default)]
pub(crate) struct Meshes {
    /// Bytes of the files, by their path in the hand's folder.
    pub(crate) files: BTreeMap<PathBuf, Vec<u8>>,
    /// Volume of each file's convex hull, in its cubed unit.
    volumes: BTreeMap<PathBuf, f64>,
    /// Corners of each file's convex hull, in its unit.
    hulls: BTreeMap<PathBuf, Vec<Vec3>>,
}

impl Meshes {
    /// Volume of a mesh's convex hull, m³.
    pub(crate) fn volume(&self, mesh: &Mesh) -> f64 {
        let Triangles::File(path) = &mesh.triangles else { return 0.0 };
        let volume = self.volumes.get(path).copied().unwrap_or_default();
        volume * mesh.scale.iter().product::<f64>().abs()
    }

    /// Points whose convex hull is the shape, in the link's frame.
    fn points(&self, part: &LinkShape) -> Vec<Vec3> {
        let pose = part.origin.pose();
        let ball =
            |radius: f64, z: f64| ellipsoid([radius; 3]).concat().into_iter().map(move |p| p + Vec3::Z * z);
        let points: Vec<Vec3> = match &part.geometry {
            Geometry::Box(size) => {
                let half = Vec3::from_array(*size) * 0.5;
                let sign = |k: usize, bit: usize| if k & bit == 0 { -1.0 } else { 1.0 };
                (0..8).map(|k| half * Vec3::new(sign(k, 1), sign(k, 2), sign(k, 4))).collect()
            }
            Geometry::Sphere { radius } => ball(*radius, 0.0).collect(),
            Geometry::Capsule { radius, length } => {
                ball(*radius, 0.5 * length).chain(ball(*radius, -0.5 * length)).collect()
            }
            Geometry::Cylinder { radius, length } => (0..48)
                .map(|k| {
                    let (sin, cos) = (std::f64::consts::TAU * f64::from(k / 2) / 24.0).sin_cos();
                    Vec3::new(radius * cos, radius * sin, if k % 2 == 0 { 0.5 } else { -0.5 } * length)
                })
                .collect(),
            Geometry::Ellipsoid(radii) => ellipsoid(*radii).concat(),
            Geometry::Mesh(mesh) => {
                let Triangles::File(path) = &mesh.triangles else { return Vec::new() };
                let scale = Vec3::from_array(mesh.scale);
                self.hulls.get(path).into_iter().flatten().map(|p| *p * scale).collect()
            }
        };
        points.into_iter().map(|point| pose * point).collect()
    }
}

/// Converts all meshes of a draft; its shapes then name the written files. Meshes that cannot be read are left out.
pub(crate) fn convert(draft: &mut Draft, source: &Source, log: &mut Log) -> Meshes {
    let mut converter = Converter {
        source,
        log,
        meshes: Meshes::default(),
        done: BTreeMap::new(),
        bytes: 0,
        vertices: 0,
        replaced: Vec::new(),
    };
    // Shapes that touch come first: if all meshes together are too large, pictures are left out.
    for link in &mut draft.links {
        let name = link.name.clone();
        link.collisions = converter.parts(std::mem::take(&mut link.collisions), &name, true);
    }
    let most = converter.most_shapes(draft);
    for link in draft.links.iter_mut().filter(|link| link.collisions.len() > most) {
        let name = link.name.clone();
        link.collisions = converter.merged(std::mem::take(&mut link.collisions), &name, most);
    }
    for link in &mut draft.links {
        let name = link.name.clone();
        link.visuals = converter.parts(std::mem::take(&mut link.visuals), &name, false);
    }
    let Converter { replaced, mut meshes, .. } = converter;
    for path in replaced {
        let mut parts = draft.links.iter().flat_map(|link| link.collisions.iter().chain(&link.visuals));
        if !parts.any(|part| names(part, &path)) {
            meshes.files.remove(&path);
        }
    }
    meshes
}

/// Whether a shape is the mesh of a file.
fn names(part: &LinkShape, path: &Path) -> bool {
    matches!(&part.geometry, Geometry::Mesh(Mesh { triangles: Triangles::File(file), .. }) if file == path)
}

/// The written form of a file of the source.
#[derive(Clone, Debug)]
enum Converted {
    /// A file of the hand.
    File(PathBuf),
    /// Shapes at their poses, in the unit of the file.
    Shapes(Vec<(Pose, Geometry)>),
}

struct Converter<'a> {
    source: &'a Source,
    log: &'a mut Log,
    meshes: Meshes,
    /// The written form of each file of the source, and the factor to metres; `None` if it cannot be read.
    done: BTreeMap<PathBuf, Option<(Converted, f64)>>,
    /// Size of all written files.
    bytes: u64,
    /// Vertices of all written files that touch.
    vertices: usize,
    /// Written files that some link no longer uses.
    replaced: Vec<PathBuf>,
}

impl Converter<'_> {
    fn parts(&mut self, parts: Vec<LinkShape>, link: &str, touches: bool) -> Vec<LinkShape> {
        parts.into_iter().flat_map(|part| self.part(part, link, touches)).collect()
    }

    /// The largest number of shapes of each link with which a hand loads.
    fn most_shapes(&self, draft: &Draft) -> usize {
        let limits = Limits::default();
        let total =
            |most: usize| draft.links.iter().map(|link| link.collisions.len().min(most)).sum::<usize>();
        (1..=limits.link_shapes).rev().find(|&most| total(most) <= limits.shapes).unwrap_or(1)
    }

    /// The shapes of a link with convex hulls instead of groups of near ones.
    fn merged(&mut self, parts: Vec<LinkShape>, link: &str, most: usize) -> Vec<LinkShape> {
        let (at, element) = (At::Link(link.to_owned()), format!("link '{link}'"));
        let points: Vec<Vec<Vec3>> = parts.iter().map(|part| self.meshes.points(part)).collect();
        let groups = merge::groups(&points, most);
        let replaced: usize = groups.iter().filter(|group| group.len() > 1).map(Vec::len).sum();
        let hulls = groups.iter().filter(|group| group.len() > 1).count();
        let text = format!(
            "has {} shapes, a hand at most {most}: the convex hulls of {hulls} groups replace {replaced} of them; their hollows are filled",
            parts.len()
        );
        self.log.guessed(at.clone(), &element, text);
        let hull = |group: &[usize]| {
            let all: Vec<Vec3> = group.iter().flat_map(|&k| &points[k]).copied().collect();
            let hull = TriangleMesh::hull(&all)?;
            Some(hull.triangles.iter().map(|&t| hull.corners(t)).collect::<Vec<_>>())
        };
        let mut merged = Vec::new();
        for group in &groups {
            if let [one] = group.as_slice() {
                merged.push(parts[*one].clone());
                continue;
            }
            let Some(corners) = hull(group) else { continue };
            let name = format!("{link}_group");
            let file = self.write(&name, &corners, [1.0; 3], &at, &element, true);
            merged.extend(file.map(|file| LinkShape {
                origin: Origin::default(),
                geometry: Geometry::Mesh(Mesh { triangles: Triangles::File(file), scale: [1.0; 3] }),
            }));
        }
        let used = |path: &PathBuf| merged.iter().any(|part| names(part, path));
        let freed = parts.iter().filter_map(|part| match &part.geometry {
            Geometry::Mesh(Mesh { triangles: Triangles::File(path), .. }) => Some(path),
            _ => None,
        });
        self.replaced.extend(freed.filter(|path| !used(path)).cloned());
        merged
    }

    fn part(&mut self, part: LinkShape, link: &str, touches: bool) -> Vec<LinkShape> {
        match part.geometry {
            Geometry::Mesh(mesh) => self.mesh(mesh, part.origin, link, touches),
            Geometry::Ellipsoid(radii) => {
                let corners = ellipsoid(radii);
                let element = format!("link '{link}'");
                let text = format!("an ellipsoid with the half axes {radii:?} m is written as a mesh");
                self.log.taken(At::Link(link.to_owned()), element, text);
                let triangles = Triangles::Inline { name: format!("{link}_ellipsoid"), corners };
                self.mesh(Mesh { triangles, scale: [1.0; 3] }, part.origin, link, touches)
            }
            _ => vec![part],
        }
    }

    fn mesh(&mut self, mesh: Mesh, origin: Origin, link: &str, touches: bool) -> Vec<LinkShape> {
        let (at, element) = (At::Link(link.to_owned()), format!("link '{link}'"));
        let (converted, unit) = match mesh.triangles {
            Triangles::Inline { name, corners } => {
                let file = self.write(&name, &corners, mesh.scale, &at, &element, touches);
                (file.map(Converted::File), 1.0)
            }
            Triangles::File(path) => {
                if !self.done.contains_key(&path) {
                    let converted = self.file(&path, mesh.scale, &at, &element, touches);
                    self.done.insert(path.clone(), converted);
                }
                match self.done.get(&path).cloned().flatten() {
                    Some((converted, unit)) => (Some(converted), unit),
                    None => (None, 1.0),
                }
            }
        };
        let scale = mesh.scale.map(|s| s * unit);
        match converted {
            None => Vec::new(),
            Some(Converted::File(path)) => {
                let geometry = Geometry::Mesh(Mesh { triangles: Triangles::File(path), scale });
                vec![LinkShape { origin, geometry }]
            }
            Some(Converted::Shapes(shapes)) => {
                let placed = |(pose, geometry): (Pose, Geometry)| {
                    let there = Pose::from_parts(pose.translation * scale[0], pose.rotation);
                    let origin = Origin::from_pose(&(origin.pose() * there));
                    LinkShape { origin, geometry: geometry.scaled(scale[0]) }
                };
                let parts: Vec<LinkShape> = shapes.into_iter().map(placed).collect();
                // Ellipsoids become files.
                parts.into_iter().flat_map(|part| self.part(part, link, touches)).collect()
            }
        }
    }

    /// Converts a file of the source. The result has the factor by which its unit was corrected.
    fn file(
        &mut self,
        path: &Path,
        scale: [f64; 3],
        at: &At,
        element: &str,
        touches: bool,
    ) -> Option<(Converted, f64)> {
        let shown = path.display();
        let bytes = match self.source.bytes(path, element, limits().mesh_bytes) {
            Ok(bytes) => bytes,
            Err(error) => {
                self.lost(at, element, format!("mesh {error}; the shape is left out"), touches);
                return None;
            }
        };
        let (corners, shapes) = match triangles(&bytes, path, self.source) {
            Ok(read) => {
                read.notes.into_iter().for_each(|note| {
                    self.log.taken(at.clone(), element, format!("mesh {shown}: {note}"));
                });
                (read.corners, read.shapes)
            }
            Err(problem) => {
                self.lost(at, element, format!("mesh {shown} {problem}; the shape is left out"), touches);
                return None;
            }
        };
        if corners.is_empty() {
            self.log.taken(at.clone(), element, format!("mesh {shown} is a scene that draws nothing"));
            return None;
        }
        let longest = longest_edge(&corners, scale);
        let unit = if longest > LARGEST_PART {
            let text = format!("mesh {shown} is {longest:.3} m long, so that its unit is taken to be mm");
            self.log.guessed(at.clone(), element, text);
            1e-3
        } else {
            1.0
        };
        if !shapes.is_empty() && scale == [scale[0].abs(); 3] {
            return Some((Converted::Shapes(shapes), unit));
        }
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let scale = scale.map(|s| s * unit);
        Some((Converted::File(self.write(&stem, &corners, scale, at, element, touches)?), unit))
    }

    /// A shape that is left out: a problem if it touches. A picture only changes the look.
    fn lost(&mut self, at: &At, element: &str, text: String, touches: bool) {
        if touches {
            self.log.problem(at.clone(), element, text);
        } else {
            self.log.dropped(at.clone(), element, format!("picture: {text}"));
        }
    }

    /// Adds a file, reduced to its hull where it is larger than a hand's mesh may be.
    fn write(
        &mut self,
        stem: &str,
        corners: &[[Vec3; 3]],
        scale: [f64; 3],
        at: &At,
        element: &str,
        touches: bool,
    ) -> Option<PathBuf> {
        let of_hand = Limits::default();
        if corners.iter().flatten().any(|p| !p.is_finite()) {
            let text = format!("mesh '{stem}' has corners that are not finite; it is left out");
            self.lost(at, element, text, touches);
            return None;
        }
        let mut mesh = TriangleMesh::new(corners);
        let hull = TriangleMesh::hull(&mesh.vertices);
        let count = 3 * mesh.triangles.len();
        let room = of_hand.mesh_total_bytes.saturating_sub(self.bytes);
        let fits = |mesh: &TriangleMesh| {
            let size = 84 + 50 * mesh.triangles.len() as u64;
            3 * mesh.triangles.len() <= of_hand.mesh_vertices && size <= of_hand.mesh_bytes && size <= room
        };
        let few = self.vertices + mesh.vertices.len() <= of_hand.mesh_total_vertices;
        let Some(hull) = hull else {
            let text = format!("mesh '{stem}' spans no volume; it is left out");
            self.lost(at, element, text, touches);
            return None;
        };
        if !fits(&mesh) || !few {
            let limit = of_hand.mesh_vertices;
            let text = format!(
                "mesh '{stem}' has {count} vertices; the limit is {limit}: its convex hull is written"
            );
            self.log.guessed(at.clone(), element, text);
            mesh = hull.clone();
        }
        if !fits(&mesh) {
            let text = format!("mesh '{stem}': all meshes together are too large; it is left out");
            self.lost(at, element, text, touches);
            return None;
        }
        let bytes = mesh.to_stl(&format!("{stem}, imported"));
        self.bytes += bytes.len() as u64;
        self.vertices += if touches { mesh.vertices.len() } else { 0 };
        let path = self.free_name(stem, &bytes);
        let (low, _) = hull.bounds();
        let volume: f64 = hull
            .triangles
            .iter()
            .map(|&t| {
                let [a, b, c] = hull.corners(t).map(|p| p - low);
                a.cross(b).dot(c) / 6.0
            })
            .sum();
        debug_assert!(scale.iter().all(|s| s.is_finite()) || volume.is_finite());
        self.meshes.volumes.insert(path.clone(), volume.abs());
        self.meshes.hulls.insert(path.clone(), hull.vertices);
        self.meshes.files.insert(path.clone(), bytes);
        Some(path)
    }

    /// `meshes/stem.stl`, or with a number if another file has this name.
    fn free_name(&self, stem: &str, bytes: &[u8]) -> PathBuf {
        let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.') { c } else { '_' };
        let stem: String = stem.chars().map(plain).collect();
        let name = |k: usize| {
            Path::new("meshes").join(if k == 1 { format!("{stem}.stl") } else { format!("{stem}_{k}.stl") })
        };
        let free = |path: &PathBuf| self.meshes.files.get(path).is_none_or(|other| other == bytes);
        (1..).map(name).find(free).unwrap_or_else(|| name(1))
    }
}

/// Triangles of a mesh file, in metres if the file states its unit.
pub(crate) struct Read {
    pub(crate) corners: Vec<[Vec3; 3]>,
    /// The same as shapes, if it is a scene of a few.
    shapes: Vec<(Pose, Geometry)>,
    notes: Vec<String>,
}

/// Reads the mesh file at `path`; other files of the source that it names are read as well.
pub(crate) fn triangles(bytes: &[u8], path: &Path, source: &Source) -> Result<Read, String> {
    if is_lfs_pointer(bytes) {
        return Err(lfs_problem());
    }
    let kind = path.extension().map(|kind| kind.to_string_lossy().to_lowercase()).unwrap_or_default();
    let words = || String::from_utf8_lossy(bytes);
    let mut notes = Vec::new();
    let corners = match kind.as_str() {
        "stl" => stl::stl(bytes)?,
        "dae" => {
            let read = collada::collada(words().trim_start_matches('\u{feff}'))?;
            notes = read.1;
            read.0
        }
        "glb" => gltf::glb(bytes)?,
        "obj" => text::obj(&words())?,
        "off" => text::off(&words())?,
        "tri" => text::tri(&words())?,
        "iv" | "wrl" | "vrml" => {
            let open = |name: &str| {
                let found = source.resolve(path, name)?;
                let bytes = source.bytes(&found.path, "scene", limits().mesh_bytes);
                bytes
                    .map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
                    .map_err(|error| error.to_string())
            };
            let drawn = scene::read(&words(), &open)?;
            // A scene may draw nothing: a link without a shape has such a file.
            return Ok(Read { corners: drawn.corners, shapes: drawn.shapes, notes });
        }
        _ => {
            let known = "STL, OBJ, COLLADA (.dae), binary glTF (.glb), OFF, Open Inventor (.iv) and VRML (.wrl) as text";
            return Err(format!("is of type '{kind}'; known are {known}; save it as one of them"));
        }
    };
    if corners.is_empty() {
        return Err("has no triangles".to_owned());
    }
    Ok(Read { corners, shapes: Vec::new(), notes })
}

/// Longest edge of the bounding box, m.
fn longest_edge(corners: &[[Vec3; 3]], scale: [f64; 3]) -> f64 {
    let scale = Vec3::from_array(scale);
    let (mut low, mut high) = (Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY));
    for p in corners.iter().flatten() {
        low = low.min(*p * scale);
        high = high.max(*p * scale);
    }
    (high - low).max_element()
}

/// Triangles of an ellipsoid: 12 rings of 24 points.
pub(crate) fn ellipsoid([a, b, c]: [f64; 3]) -> Vec<[Vec3; 3]> {
    const RINGS: usize = 12;
    const POINTS: usize = 24;
    let point = |ring: usize, k: usize| {
        let polar = std::f64::consts::PI * ring as f64 / RINGS as f64;
        let turn = std::f64::consts::TAU * (k % POINTS) as f64 / POINTS as f64;
        Vec3::new(a * polar.sin() * turn.cos(), b * polar.sin() * turn.sin(), c * polar.cos())
    };
    let mut corners = Vec::new();
    for ring in 0..RINGS {
        for k in 0..POINTS {
            let [p, q, r, s] =
                [point(ring, k), point(ring + 1, k), point(ring + 1, k + 1), point(ring, k + 1)];
            if ring + 1 < RINGS {
                corners.push([p, q, r]);
            }
            if ring > 0 {
                corners.push([p, r, s]);
            }
        }
    }
    corners
}
