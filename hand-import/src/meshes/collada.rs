//! COLLADA 1.4 and 1.5: the triangles of the visual scene, in metres.
//!
//! mesh-loader's reader places each geometry once, knows no `<instance_node>`, and panics at indices that are not there.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use nalgebra::{Matrix4, Rotation3, Unit, Vector3};
use palmares_models::Vec3;
use palmares_models::read::{Limits, xml};
use roxmltree::Node;

use super::text::Corners;
use super::transform::{MAX_DEPTH, MAX_NODES, place};
use crate::numbers::numbers;
use crate::source::limits;
use crate::xml::{child, children};

/// The triangles, and what the file states about unit and axes.
pub(super) fn collada(text: &str) -> Result<(Corners, Vec<String>), String> {
    let limits = Limits { xml_nodes: 2_000_000, xml_depth: 2 * MAX_DEPTH, ..limits() };
    let document = xml(Path::new(""), text, &limits).map_err(|error| format!("cannot be read: {error}"))?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(format!("has the root element <{}>, not <COLLADA>", root.tag_name().name()));
    }
    let with_id = root.descendants().filter_map(|node| Some((node.attribute("id")?, node)));
    let mut scene = ColladaScene {
        by_id: with_id.collect(),
        geometries: BTreeMap::new(),
        corners: Vec::new(),
        visited: 0,
    };
    let mut notes = Vec::new();
    let asset = child(root, "asset");
    let unit = asset.and_then(|asset| child(asset, "unit")).and_then(|unit| unit.attribute("meter"));
    let metres = match unit.map(|text| (text, text.trim().parse::<f64>())) {
        None => 1.0,
        Some((_, Ok(metres))) if metres > 0.0 && metres.is_finite() => metres,
        Some((text, _)) => return Err(format!("has the unit '{text}'; valid: a number of metres above 0")),
    };
    if metres != 1.0 {
        notes.push(format!("its unit of {metres} m is applied"));
    }
    // RViz and Gazebo ignore the up axis, so that published files are right without it.
    let up = asset.and_then(|asset| child(asset, "up_axis")).and_then(|up| up.text()).map(str::trim);
    if let Some(up @ ("X_UP" | "Y_UP")) = up {
        notes.push(format!("it states {up}; its coordinates are taken as they are, as RViz and Gazebo do"));
    }
    let instance = child(root, "scene").and_then(|node| child(node, "instance_visual_scene"));
    let visual = match instance {
        Some(instance) => Some(scene.target(instance, "url")?),
        None => root.descendants().find(|node| node.has_tag_name(name(root, "visual_scene"))),
    };
    let scale = Matrix4::new_scaling(metres);
    match visual {
        Some(visual) => {
            for node in children(visual, "node") {
                scene.node(node, &scale, 0)?;
            }
        }
        // A library of geometries without a scene.
        None => {
            let geometries = root.descendants().filter(|node| node.has_tag_name(name(root, "geometry")));
            for geometry in geometries {
                scene.add(geometry, &scale)?;
            }
        }
    }
    Ok((scene.corners, notes))
}

/// The name of an element in the namespace of the root.
fn name<'a>(root: Node<'a, '_>, tag: &'a str) -> roxmltree::ExpandedName<'a, 'a> {
    root.tag_name().namespace().map_or_else(|| tag.into(), |space| (space, tag).into())
}

struct ColladaScene<'a, 'input> {
    by_id: HashMap<&'a str, Node<'a, 'input>>,
    /// Triangles of each geometry, by the place of its element.
    geometries: BTreeMap<usize, Corners>,
    corners: Corners,
    /// Nodes that were placed.
    visited: usize,
}

impl<'a, 'input> ColladaScene<'a, 'input> {
    /// The element that an attribute of the form `#id` names.
    fn target(&self, node: Node<'a, 'input>, attribute: &str) -> Result<Node<'a, 'input>, String> {
        let url = node.attribute(attribute).unwrap_or_default();
        let found = self.by_id.get(url.strip_prefix('#').unwrap_or(url)).copied();
        found.ok_or_else(|| format!("<{}> names '{url}', which is not there", node.tag_name().name()))
    }

    /// A node of the scene with everything below it.
    fn node(&mut self, node: Node<'a, 'input>, above: &Matrix4<f64>, depth: usize) -> Result<(), String> {
        self.visited += 1;
        if depth > MAX_DEPTH || self.visited > MAX_NODES {
            return Err(format!("has more than {MAX_DEPTH} nodes inside each other, or {MAX_NODES} in all"));
        }
        let mut to = *above;
        for item in node.children().filter(Node::is_element) {
            if let Some(matrix) = transform(item)? {
                to *= matrix;
            }
        }
        for item in node.children().filter(Node::is_element) {
            match item.tag_name().name() {
                "node" => self.node(item, &to, depth + 1)?,
                "instance_node" => self.node(self.target(item, "url")?, &to, depth + 1)?,
                "instance_geometry" => self.add(self.target(item, "url")?, &to)?,
                "instance_controller" => self.controller(self.target(item, "url")?, &to, depth + 1)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// A geometry that bones or weights deform, as it is without them.
    fn controller(
        &mut self,
        node: Node<'a, 'input>,
        above: &Matrix4<f64>,
        depth: usize,
    ) -> Result<(), String> {
        if depth > MAX_DEPTH {
            return Err(format!("has more than {MAX_DEPTH} controllers inside each other"));
        }
        let Some(skin) = child(node, "skin").or_else(|| child(node, "morph")) else { return Ok(()) };
        let bind = child(skin, "bind_shape_matrix").and_then(|bind| bind.text());
        let to = above * bind.map_or(Ok(Matrix4::identity()), matrix)?;
        let source = self.target(skin, "source")?;
        if source.tag_name().name() == "controller" {
            return self.controller(source, &to, depth + 1);
        }
        self.add(source, &to)
    }

    /// The triangles of a geometry at a place.
    fn add(&mut self, geometry: Node<'a, 'input>, to: &Matrix4<f64>) -> Result<(), String> {
        let key = geometry.range().start;
        if !self.geometries.contains_key(&key) {
            let corners = self.geometry(geometry)?;
            self.geometries.insert(key, corners);
        }
        place(&self.geometries[&key], to, &mut self.corners)
    }

    fn geometry(&self, geometry: Node<'a, 'input>) -> Result<Corners, String> {
        let mesh = child(geometry, "mesh").or_else(|| child(geometry, "convex_mesh"));
        let Some(mesh) = mesh else { return Ok(Vec::new()) };
        // `<convex_mesh convex_hull_of='#other'>`: the hull of another geometry, which is written as a hull anyway.
        if mesh.has_attribute("convex_hull_of") {
            let other = self.target(mesh, "convex_hull_of")?;
            if other.id() == geometry.id() || child(other, "mesh").is_none() {
                return Ok(Vec::new());
            }
            return self.geometry(other);
        }
        let mut corners = Vec::new();
        let mut positions = HashMap::new();
        for set in mesh.children().filter(Node::is_element) {
            let kind = set.tag_name().name();
            if !["triangles", "polylist", "polygons", "tristrips", "trifans"].contains(&kind) {
                continue;
            }
            let offset = |input: Node<'_, '_>| -> Result<usize, String> {
                input.attribute("offset").map_or(Ok(0), |text| index(text.trim()))
            };
            let mut stride = 1;
            let mut vertex = None;
            for input in children(set, "input") {
                let offset = offset(input)?;
                stride = stride.max(offset.saturating_add(1));
                if input.attribute("semantic") == Some("VERTEX") {
                    vertex = Some((self.target(input, "source")?, offset));
                }
            }
            let Some((vertices, offset)) = vertex else {
                return Err(format!("<{kind}> has no <input semantic='VERTEX'>"));
            };
            let points = match positions.entry(vertices.id()) {
                Entry::Occupied(entry) => entry.into_mut(),
                Entry::Vacant(entry) => entry.insert(self.points(vertices)?),
            };
            let mut faces = Vec::new();
            for list in set.descendants().filter(|node| node.is_element() && node.tag_name().name() == "p") {
                let list = list.text().unwrap_or_default().split_whitespace();
                let all: Vec<usize> = list.map(index).collect::<Result<_, _>>()?;
                // An index of each input for each corner.
                faces.push(all.chunks(stride).filter_map(|corner| corner.get(offset).copied()).collect());
            }
            triangles(kind, set, &faces, points, &mut corners)?;
        }
        Ok(corners)
    }

    /// Positions of a `<vertices>` or `<source>`.
    fn points(&self, node: Node<'a, 'input>) -> Result<Vec<Vec3>, String> {
        let source = if node.tag_name().name() == "vertices" {
            let input = children(node, "input").find(|input| input.attribute("semantic") == Some("POSITION"));
            self.target(input.ok_or("<vertices> has no <input semantic='POSITION'>")?, "source")?
        } else {
            node
        };
        let accessor = child(source, "technique_common").and_then(|common| child(common, "accessor"));
        let number = |name: &str, or: usize| -> Result<usize, String> {
            accessor.and_then(|node| node.attribute(name)).map_or(Ok(or), |text| index(text.trim()))
        };
        let (stride, first) = (number("stride", 3)?, number("offset", 0)?);
        if stride < 3 {
            return Err(format!("has positions of {stride} numbers; valid: 3 or more"));
        }
        let array = match accessor.filter(|node| node.has_attribute("source")) {
            Some(accessor) => Some(self.target(accessor, "source")?),
            None => child(source, "float_array"),
        };
        let text = array.and_then(|array| array.text()).unwrap_or_default();
        let values = numbers(text).ok_or("has a position that is no finite number")?;
        let values = values.get(first..).unwrap_or_default();
        let count = number("count", values.len() / stride)?.min(values.len() / stride);
        Ok(values.chunks_exact(stride).take(count).map(|v| Vec3::new(v[0], v[1], v[2])).collect())
    }
}

fn index(word: &str) -> Result<usize, String> {
    word.parse().map_err(|_| format!("has '{word}' where an index is expected"))
}

/// Triangles of one set of faces.
fn triangles(
    kind: &str,
    set: Node<'_, '_>,
    faces: &[Vec<usize>],
    points: &[Vec3],
    corners: &mut Corners,
) -> Result<(), String> {
    let point = |i: usize| points.get(i).copied().ok_or("names vertices that are not there");
    let mut add = |a: usize, b: usize, c: usize| -> Result<(), String> {
        corners.push([point(a)?, point(b)?, point(c)?]);
        Ok(())
    };
    for face in faces {
        match kind {
            "triangles" => face.chunks_exact(3).try_for_each(|f| add(f[0], f[1], f[2]))?,
            "tristrips" => {
                for (k, f) in face.windows(3).enumerate() {
                    // Every second one is turned over.
                    let (a, b) = if k % 2 == 0 { (f[0], f[1]) } else { (f[1], f[0]) };
                    add(a, b, f[2])?;
                }
            }
            "polylist" => {
                let counts = child(set, "vcount").and_then(|node| node.text()).unwrap_or_default();
                let mut rest = face.as_slice();
                for count in counts.split_whitespace() {
                    let (polygon, after) = rest
                        .split_at_checked(index(count)?)
                        .ok_or("<vcount> and <p> have different numbers of corners")?;
                    rest = after;
                    polygon.windows(2).skip(1).try_for_each(|pair| add(polygon[0], pair[0], pair[1]))?;
                }
            }
            // `polygons`, `trifans`: a fan around the first corner.
            _ => face.windows(2).skip(1).try_for_each(|pair| add(face[0], pair[0], pair[1]))?,
        }
    }
    Ok(())
}

/// The transform that a child of a node states, if it states one.
fn transform(node: Node<'_, '_>) -> Result<Option<Matrix4<f64>>, String> {
    let kind = node.tag_name().name();
    if !["matrix", "translate", "rotate", "scale", "skew", "lookat"].contains(&kind) {
        return Ok(None);
    }
    let text = node.text().unwrap_or_default();
    if kind == "matrix" {
        return matrix(text).map(Some);
    }
    let list = numbers(text).ok_or_else(|| format!("<{kind}> has a word that is no finite number"))?;
    let unit = |v: Vector3<f64>| Unit::try_new(v, 1e-12);
    let matrix = match (kind, list.as_slice()) {
        ("translate", &[x, y, z]) => Matrix4::new_translation(&Vector3::new(x, y, z)),
        ("scale", &[x, y, z]) => Matrix4::new_nonuniform_scaling(&Vector3::new(x, y, z)),
        ("rotate", &[x, y, z, degrees]) => match unit(Vector3::new(x, y, z)) {
            Some(axis) => Rotation3::from_axis_angle(&axis, degrees.to_radians()).to_homogeneous(),
            None => Matrix4::identity(),
        },
        // Shear along b by the angle, for points along a.
        ("skew", &[degrees, ax, ay, az, bx, by, bz]) => {
            let (a, b) = (unit(Vector3::new(ax, ay, az)), unit(Vector3::new(bx, by, bz)));
            let (a, b) = a.zip(b).ok_or("<skew> has an axis without a length")?;
            let mut matrix = Matrix4::identity();
            let shear = b.into_inner() * a.transpose() * degrees.to_radians().tan();
            let mut linear = matrix.fixed_view_mut::<3, 3>(0, 0);
            linear += shear;
            matrix
        }
        ("lookat", &[ex, ey, ez, ix, iy, iz, ux, uy, uz]) => {
            let eye = Vector3::new(ex, ey, ez);
            let back = unit(eye - Vector3::new(ix, iy, iz));
            let right = back.and_then(|back| unit(Vector3::new(ux, uy, uz).cross(&back)));
            let (back, right) = back.zip(right).ok_or("<lookat> has no direction")?;
            let up = back.cross(&right);
            let columns = [right.into_inner(), up, back.into_inner(), eye];
            Matrix4::from_fn(
                |row, column| {
                    if row == 3 { f64::from(column == 3) } else { columns[column][row] }
                },
            )
        }
        _ => return Err(format!("<{kind}> has {} numbers", list.len())),
    };
    Ok(Some(matrix))
}

/// 16 numbers, row by row.
fn matrix(text: &str) -> Result<Matrix4<f64>, String> {
    let list = numbers(text).filter(|list| list.len() == 16);
    list.map(|list| Matrix4::from_row_slice(&list)).ok_or_else(|| "a matrix has not 16 numbers".to_owned())
}
