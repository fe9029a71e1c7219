//! `<mesh>` assets: files or vertices of the document, at their scale and place.

use std::path::{Path, PathBuf};

use palmares_models::{Mat3, Pose, Vec3};

use super::compiler::{Compiler, asset_path};
use super::defaults::{Attributes, Defaults};
use super::principal::principal;
use crate::decision::Log;
use crate::meshes::triangles;
use crate::numbers::numbers;
use crate::read::element::{Element, Notes};
use crate::source::{Source, limits};

/// Rule of a mesh's inertia.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Volume {
    /// The inertia of the tetrahedra below each face, all positive, as in versions before 3.3.
    Legacy,
    /// The inertia of the tetrahedra with their signs.
    Exact,
    /// The inertia of the convex hull.
    Convex,
}

/// A mesh.
#[derive(Clone, Debug)]
pub(crate) struct Mesh {
    pub(crate) name: String,
    /// Its file in the source, if the file and its scale are all there is to it.
    pub(crate) file: Option<PathBuf>,
    pub(crate) scale: [f64; 3],
    /// Triangles in the geom's frame, m.
    pub(crate) triangles: Vec<[Vec3; 3]>,
    volume: Volume,
}

/// All meshes of a document.
pub(crate) fn read_meshes(
    source: &Source,
    main: &Path,
    root: &Element,
    compiler: &Compiler,
    defaults: &Defaults,
    log: &mut Log,
) -> Vec<Mesh> {
    let mut meshes = Vec::new();
    for element in root.all("asset").flat_map(|asset| asset.all("mesh")) {
        let at = defaults.of(element, "mesh", None, log);
        let scale = at.array::<3>("scale", log).unwrap_or([1.0; 3]);
        let moved = at.get("refpos").is_some() || at.get("refquat").is_some();
        let place = reference(&at, log);
        let volume = match at.get("inertia") {
            Some("exact") => Volume::Exact,
            Some("convex") => Volume::Convex,
            _ => Volume::Legacy,
        };
        let stem = |file: &str| Path::new(file).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let name = element.get("name").map(str::to_owned).or_else(|| stem(element.get("file")?));
        let name = name.unwrap_or_default();
        let (corners, file) = match element.get("file") {
            Some(file) => {
                from_file(source, main, &asset_path(compiler, file), element, log).unwrap_or_default()
            }
            None => (inline(&at, log), None),
        };
        let put = |corner: Vec3| (place.inverse() * corner) * Vec3::from_array(scale);
        let mut triangles: Vec<[Vec3; 3]> = corners.into_iter().map(|face| face.map(put)).collect();
        if scale.iter().product::<f64>() < 0.0 {
            triangles.iter_mut().for_each(|face| face.swap(0, 1));
        }
        meshes.push(Mesh { name, file: file.filter(|_| !moved), scale, triangles, volume });
    }
    meshes
}

/// The frame that becomes the mesh's own.
fn reference(at: &Attributes<'_>, log: &mut Log) -> Pose {
    let position = at.array::<3>("refpos", log).map_or(Vec3::ZERO, Vec3::from_array);
    let [w, x, y, z] = at.array::<4>("refquat", log).unwrap_or([1.0, 0.0, 0.0, 0.0]);
    let rotation = palmares_models::Rotation::from_xyzw(x, y, z, w);
    Pose::from_parts(position, rotation.normalize())
}

type Triangles = Vec<[Vec3; 3]>;

fn from_file(
    source: &Source,
    main: &Path,
    file: &Path,
    element: &Element,
    log: &mut Log,
) -> Option<(Triangles, Option<PathBuf>)> {
    let found = match source.resolve(main, &file.to_string_lossy()) {
        Ok(found) => found.path,
        Err(problem) => {
            log.bad(element, problem);
            return None;
        }
    };
    if found.extension().is_some_and(|kind| kind.eq_ignore_ascii_case("msh")) {
        let bytes = source.bytes(&found, "mesh", limits().mesh_bytes).map_err(|error| error.to_string());
        return match bytes.and_then(|bytes| msh(&bytes)) {
            Ok(triangles) => Some((triangles, None)),
            Err(problem) => {
                log.bad(element, problem);
                None
            }
        };
    }
    let bytes = source.bytes(&found, "mesh", limits().mesh_bytes).map_err(|error| error.to_string());
    match bytes.and_then(|bytes| triangles(&bytes, &found, source)) {
        Ok(read) if !read.corners.is_empty() => Some((read.corners, Some(found))),
        Ok(_) => {
            log.bad(element, format!("mesh {} draws nothing", found.display()));
            None
        }
        Err(problem) => {
            log.bad(element, format!("mesh {} {problem}", found.display()));
            None
        }
    }
}

/// MuJoCo's binary format: four counts (vertices, normals, texture coordinates, faces), then the lists.
fn msh(bytes: &[u8]) -> Result<Triangles, String> {
    let word = |k: usize| bytes.get(4 * k..4 * k + 4).and_then(|word| word.try_into().ok());
    let count = |k: usize| -> Result<usize, String> {
        let count = word(k).map(i32::from_le_bytes).ok_or("is too short for an .msh file")?;
        usize::try_from(count).map_err(|_| "has a negative number of elements".to_owned())
    };
    let (vertices, normals, coordinates, faces) = (count(0)?, count(1)?, count(2)?, count(3)?);
    let words = [3 * vertices, 3 * normals, 2 * coordinates, 3 * faces].iter().sum::<usize>() + 4;
    if bytes.len() != 4 * words {
        return Err(format!("has {} bytes; an .msh file with its counts has {}", bytes.len(), 4 * words));
    }
    let float = |k: usize| word(k).map_or(0.0, |word| f64::from(f32::from_le_bytes(word)));
    let vertex = |k: usize| Vec3::new(float(4 + 3 * k), float(5 + 3 * k), float(6 + 3 * k));
    let first_face = 4 + 3 * vertices + 3 * normals + 2 * coordinates;
    let mut triangles = Vec::with_capacity(faces);
    for face in 0..faces {
        let mut corners = [Vec3::ZERO; 3];
        for (k, corner) in corners.iter_mut().enumerate() {
            let index = count(first_face + 3 * face + k)?;
            if index >= vertices {
                return Err(format!("has a face with vertex {index}; there are {vertices}"));
            }
            *corner = vertex(index);
        }
        triangles.push(corners);
    }
    Ok(triangles)
}

/// Vertices of the document; without faces the mesh is their convex hull.
fn inline(at: &Attributes<'_>, log: &mut Log) -> Triangles {
    let vertices: Vec<Vec3> = at
        .get("vertex")
        .and_then(numbers)
        .unwrap_or_default()
        .chunks_exact(3)
        .map(|v| Vec3::new(v[0], v[1], v[2]))
        .collect();
    if vertices.is_empty() {
        log.bad(at.element, "has neither a file nor vertices");
        return Vec::new();
    }
    if let Some(faces) = at.get("face").and_then(numbers) {
        let corner = |index: f64| vertices.get(index as usize).copied();
        let faces = faces.chunks_exact(3).filter_map(|f| Some([corner(f[0])?, corner(f[1])?, corner(f[2])?]));
        return faces.collect();
    }
    hull(&vertices)
}

fn hull(points: &[Vec3]) -> Triangles {
    let Ok((vertices, faces)) = parry3d_f64::transformation::try_convex_hull(points) else {
        return Vec::new();
    };
    faces.iter().map(|face| face.map(|k| vertices[k as usize])).collect()
}

impl Mesh {
    /// Volume, centre of mass, and inertia about it for a mass of 1.
    pub(crate) fn solid(&self) -> Option<(f64, Vec3, Mat3)> {
        let convex;
        let triangles = if self.volume == Volume::Convex {
            let points: Vec<Vec3> = self.triangles.iter().flatten().copied().collect();
            convex = hull(&points);
            &convex
        } else {
            &self.triangles
        };
        let area = |[a, b, c]: &[Vec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
        let total: f64 = triangles.iter().map(area).sum();
        let centre = triangles
            .iter()
            .fold(Vec3::ZERO, |sum, face| sum + (face[0] + face[1] + face[2]) * (area(face) / 3.0));
        let centre = centre / total;
        // The volume counts from the centre of mass, which counts from the surface's centre.
        let signed = |face: &[Vec3; 3], apex: Vec3| {
            let [a, b, c] = face.map(|corner| corner - apex);
            let volume = a.dot(b.cross(c)) / 6.0;
            if self.volume == Volume::Legacy { volume.abs() } else { volume }
        };
        let mut volume = 0.0;
        let mut first = Vec3::ZERO;
        for face in triangles {
            let part = signed(face, centre);
            volume += part;
            first += ((face[0] + face[1] + face[2]) * 0.25 + centre * 0.25) * part;
        }
        if volume.is_nan() || volume <= 0.0 {
            return None;
        }
        let com = first / volume;
        let volume: f64 = triangles.iter().map(|face| signed(face, com)).sum();
        // ∫ x xᵀ of a tetrahedron with one corner at the centre of mass: V/20 (Σ v vᵀ + s sᵀ), s = Σ v.
        let mut second = Mat3::ZERO;
        for face in triangles {
            let [a, b, c] = face.map(|corner| corner - com);
            let s = a + b + c;
            let outer = |v: Vec3| Mat3::from_cols(v * v.x, v * v.y, v * v.z);
            second += (outer(a) + outer(b) + outer(c) + outer(s)) * (signed(face, com) / 20.0);
        }
        let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
        let inertia = Mat3::from_cols(Vec3::X * trace, Vec3::Y * trace, Vec3::Z * trace) - second;
        Some((volume, com, inertia * (1.0 / volume)))
    }

    /// Half edges of the box with the same inertia, and its place.
    pub(crate) fn inertia_box(&self) -> Option<(Vec3, Pose)> {
        let (_, com, unit) = self.solid()?;
        let (axes, [a, b, c]) = principal(&unit);
        let half = |x: f64| (1.5 * x.max(0.0)).sqrt();
        Some((Vec3::new(half(b + c - a), half(a + c - b), half(a + b - c)), Pose::from_parts(com, axes)))
    }
}
