//! Shapes of points: sets of faces and of strips, with the points of the node itself or of a node before it.

use palmares_models::Vec3;

use super::nodes::{Node, Tree, Value};
use crate::meshes::text::{Corners, fan};

/// The points that a node defines for those after it.
pub(super) fn points(node: &Node) -> Result<Option<Vec<Vec3>>, String> {
    match node.kind.as_str() {
        "Coordinate3" | "Coordinate" => triples(node.field("point")).map(Some),
        "Coordinate4" => {
            let numbers = node.field("point").map_or(&[][..], |value| &value.numbers);
            let point = |p: &[f64]| Vec3::new(p[0], p[1], p[2]) / p[3];
            Ok(Some(numbers.chunks_exact(4).map(point).collect()))
        }
        "VertexProperty" => match node.field("vertex") {
            Some(vertex) => triples(Some(vertex)).map(Some),
            None => Ok(None),
        },
        _ => Ok(None),
    }
}

fn triples(value: Option<&Value>) -> Result<Vec<Vec3>, String> {
    let numbers = value.map_or(&[][..], |value| &value.numbers);
    if !numbers.len().is_multiple_of(3) {
        return Err(format!("has {} coordinates, no multiple of 3", numbers.len()));
    }
    Ok(numbers.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect())
}

/// The triangles of a node that is a set of faces; `None` for another node.
pub(super) fn faces(tree: &Tree, node: &Node, before: &[Vec3]) -> Result<Option<Corners>, String> {
    let kind = node.kind.as_str();
    if ![
        "IndexedFaceSet",
        "FaceSet",
        "IndexedTriangleStripSet",
        "TriangleStripSet",
        "QuadMesh",
        "IndexedTriangleSet",
    ]
    .contains(&kind)
    {
        return Ok(None);
    }
    let mut own = None;
    let properties = ["coord", "vertexProperty"].into_iter().filter_map(|name| node.field(name));
    for &part in properties.flat_map(|value| &value.nodes).chain(&node.children) {
        own = points(tree.node(part))?.or(own);
    }
    let points = own.as_deref().unwrap_or(before);
    let list = |name: &str| node.field(name).map_or(&[][..], |value| &value.numbers);
    let first = list("startIndex").first().map_or(Ok(0), |&x| index(x))?;
    let mut corners = Corners::new();
    match kind {
        "IndexedFaceSet" => {
            for face in list("coordIndex").split(|x| *x < 0.0) {
                let face: Vec<usize> = face.iter().map(|&x| index(x)).collect::<Result<_, _>>()?;
                fan(&face, points, &mut corners)?;
            }
        }
        "IndexedTriangleSet" => {
            let all = list("coordIndex").iter().filter(|x| **x >= 0.0);
            let all: Vec<usize> = all.map(|&x| index(x)).collect::<Result<_, _>>()?;
            for face in all.chunks_exact(3) {
                fan(face, points, &mut corners)?;
            }
        }
        "IndexedTriangleStripSet" => {
            for run in list("coordIndex").split(|x| *x < 0.0) {
                let run: Vec<usize> = run.iter().map(|&x| index(x)).collect::<Result<_, _>>()?;
                strip(&run, points, &mut corners)?;
            }
        }
        "QuadMesh" => {
            let size = |name: &str| list(name).first().map_or(Ok(1), |&x| index(x));
            let (columns, rows) = (size("verticesPerRow")?, size("verticesPerColumn")?);
            if columns.saturating_mul(rows).saturating_add(first) > points.len() {
                return Err("has a QuadMesh with more vertices than points".to_owned());
            }
            let at = |row: usize, column: usize| first + row * columns + column;
            for row in 1..rows {
                for column in 1..columns {
                    let quad =
                        [at(row - 1, column - 1), at(row, column - 1), at(row, column), at(row - 1, column)];
                    fan(&quad, points, &mut corners)?;
                }
            }
        }
        // A `FaceSet` or `TriangleStripSet` has its vertices in order: the number of each face; -1 is all the others.
        _ => {
            let mut first = first;
            let counts = node.field("numVertices").map_or(&[-1.0][..], |value| &value.numbers);
            for &count in counts {
                let left = points.len().saturating_sub(first);
                let count = if count < 0.0 { left } else { index(count)? };
                if count > left {
                    return Err("has faces with more vertices than points".to_owned());
                }
                let run: Vec<usize> = (first..first + count).collect();
                if kind == "FaceSet" {
                    fan(&run, points, &mut corners)?;
                } else {
                    strip(&run, points, &mut corners)?;
                }
                first += count;
            }
        }
    }
    Ok(Some(corners))
}

/// Each vertex from the third on ends a triangle; every second one is turned over.
fn strip(run: &[usize], points: &[Vec3], corners: &mut Corners) -> Result<(), String> {
    for (k, three) in run.windows(3).enumerate() {
        let turned = [three[1], three[0], three[2]];
        fan(if k % 2 == 0 { three } else { &turned }, points, corners)?;
    }
    Ok(())
}

fn index(x: f64) -> Result<usize, String> {
    if x >= 0.0 && x.fract() == 0.0 && x < 1e15 {
        Ok(x as usize)
    } else {
        Err(format!("has {x} where an index or a count is expected"))
    }
}
