//! Shapes of links.

use std::path::Path;

use palmares_models::Vec3;

use super::collect::Reader;
use super::draft::plain;
use crate::decision::At;
use crate::draft::{Geometry, Mesh, Triangles};
use crate::numbers::numbers;
use crate::read::element::{Element, Notes};

impl Reader<'_> {
    /// A shape; a `picture` of a link that has other shapes can be left out without harm.
    pub(super) fn geometry(
        &mut self,
        element: &Element,
        file: &Path,
        link: &str,
        picture: bool,
    ) -> Option<Geometry> {
        let at = At::Link(plain(link));
        let Some(shape) = element.child("geometry").and_then(|geometry| geometry.children.first()) else {
            self.log.lost(at, element, "has no geometry");
            return None;
        };
        let problem = match self.shape(element, shape, file, link) {
            Ok(geometry) => return geometry,
            Err(problem) => format!("{problem}; the shape is left out"),
        };
        if picture {
            self.log.lost(at, element, problem);
        } else {
            self.log.bad(element, problem);
        }
        None
    }

    /// A shape, `None` for an empty one, or why it cannot be read.
    fn shape(
        &mut self,
        element: &Element,
        shape: &Element,
        file: &Path,
        link: &str,
    ) -> Result<Option<Geometry>, String> {
        let kind = shape.name.as_str();
        let length = |name: &str| {
            let text = shape.child_text(name).unwrap_or_default();
            let one = numbers(text).and_then(|list| <[f64; 1]>::try_from(list).ok());
            one.map(|[x]| x).ok_or_else(|| format!("<{kind}> has the {name} '{text}'; valid: one number"))
        };
        let three = |name: &str| {
            let text = shape.child_text(name).unwrap_or_default();
            let list = numbers(text).and_then(|list| <[f64; 3]>::try_from(list).ok());
            list.ok_or_else(|| format!("<{kind}> has the {name} '{text}'; valid: three numbers"))
        };
        Ok(Some(match kind {
            "box" => Geometry::Box(three("size")?),
            "sphere" => Geometry::Sphere { radius: length("radius")? },
            "cylinder" => Geometry::Cylinder { radius: length("radius")?, length: length("length")? },
            "capsule" => Geometry::Capsule { radius: length("radius")?, length: length("length")? },
            "ellipsoid" => Geometry::Ellipsoid(three("radii")?),
            "polyline" => {
                let text = "its outline is extruded; holes and hollows are filled";
                self.log.kept(
                    At::Link(plain(link)),
                    element,
                    format!("a polyline is written as a mesh: {text}"),
                );
                let name = format!("{}_{}", plain(link), plain(element.get("name").unwrap_or("polyline")));
                let triangles = Triangles::Inline { name, corners: extruded(shape, length("height")?)? };
                Geometry::Mesh(Mesh { triangles, scale: [1.0; 3] })
            }
            "mesh" => {
                let at = At::Link(plain(link));
                let uri = shape.child_text("uri").unwrap_or_default();
                if shape.child("submesh").is_some() {
                    self.log.lost(at.clone(), element, "<submesh>: the whole mesh is taken");
                }
                let scale = if shape.child("scale").is_some() { three("scale")? } else { [1.0; 3] };
                let found = self.source.resolve(file, uri).map_err(|problem| format!("mesh {problem}"))?;
                if let Some(note) = found.note {
                    self.log.chose(at, element, note);
                }
                Geometry::Mesh(Mesh { triangles: Triangles::File(found.path), scale })
            }
            "empty" => return Ok(None),
            other => return Err(format!("a {other} has no counterpart")),
        }))
    }
}

/// The prism over an outline, from z = 0 to its height.
fn extruded(shape: &Element, height: f64) -> Result<Vec<[Vec3; 3]>, String> {
    let corner = |point: &Element| match numbers(&point.text).as_deref() {
        Some(&[x, y]) => Ok(Vec3::new(x, y, 0.0)),
        _ => Err(format!("<polyline> has the point '{}'; valid: two numbers", point.text)),
    };
    let points: Vec<Vec3> = shape.all("point").map(corner).collect::<Result<_, _>>()?;
    let up = Vec3::Z * height;
    let mut corners = Vec::new();
    for (k, &a) in points.iter().enumerate() {
        let b = points[(k + 1) % points.len()];
        corners.extend([[a, b, b + up], [a, b + up, a + up]]);
        if k > 0 {
            corners.extend([[points[0], b, a], [points[0] + up, a + up, b + up]]);
        }
    }
    Ok(corners)
}
