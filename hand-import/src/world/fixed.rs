//! Ground and furniture of a task, of a world's terrains: fixed bodies of tasks are boxes along the axes above a plane.

use std::collections::BTreeMap;

use palmares_models::Vec3;
use palmares_models::pieces::TriangleMesh;

use super::scene::Body;
use super::shape::{box_of, extent};
use crate::decision::{At, Log};

/// A plane or box at least this wide and deep can be the ground, m.
const GROUND: f64 = 2.0;
/// Thickness of a terrain that is a surface, m.
const PLATE: f64 = 0.01;
/// Largest size of the part of the ground that is drawn, m.
const DRAWN: f64 = 20.0;

/// What does not move.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fixed {
    pub(super) ground: Ground,
    pub(super) furniture: Vec<Furniture>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ground {
    pub(super) height: f64,
    pub(super) friction: f64,
    pub(super) color: [f64; 3],
    pub(super) center: [f64; 2],
    pub(super) size: [f64; 2],
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Furniture {
    pub(super) name: String,
    pub(super) friction: f64,
    pub(super) color: [f64; 3],
    /// Lowest and highest corner of each box.
    pub(super) boxes: Vec<(Vec3, Vec3)>,
}

/// Ground and furniture of the terrains; `objects` say where the ground is if no terrain does.
pub(super) fn fixed(terrains: &[Body], objects: &[Body], log: &mut Log) -> Fixed {
    let mut furniture: Vec<Furniture> = terrains
        .iter()
        .map(|terrain| Furniture {
            name: terrain.name.clone(),
            friction: terrain.friction,
            color: terrain.color,
            boxes: boxes(terrain, log),
        })
        .collect();
    let ground = ground(terrains, &mut furniture, log).unwrap_or_else(|| below(&furniture, objects, log));
    for (piece, terrain) in furniture.iter_mut().zip(terrains) {
        let plates = piece.boxes.iter().filter(|(low, high)| (*high - *low).min_element() == 0.0).count();
        if plates > 0 {
            let text = format!("{plates} of its parts are surfaces; they become {PLATE} m thick");
            log.guessed(At::Hand, &terrain.element, text);
        }
        // A surface gets a thickness: below it, or on both sides if it stands.
        for (low, high) in &mut piece.boxes {
            if high.z == low.z {
                low.z -= PLATE;
            }
            for k in 0..2 {
                if high[k] == low[k] {
                    (low[k], high[k]) = (low[k] - 0.5 * PLATE, high[k] + 0.5 * PLATE);
                }
            }
        }
    }
    furniture.retain(|piece| !piece.boxes.is_empty());
    Fixed { ground, furniture }
}

/// The boxes and plates of a terrain: its pieces that hang together.
fn boxes(terrain: &Body, log: &mut Log) -> Vec<(Vec3, Vec3)> {
    let mut found = Vec::new();
    let mut others: Vec<(Vec3, Vec3)> = Vec::new();
    for piece in pieces(&terrain.shape.triangles()) {
        match box_of(&piece) {
            Some(sides) => found.push(sides),
            None => others.push(extent(&piece)),
        }
    }
    if let Some((low, high)) = others.first() {
        let text = format!(
            "{} of its {} parts are no boxes along the axes, such as that from {} to {} m: a task's fixed bodies are boxes; they are left \
             out. State them by boxes in [[furniture]], or as [[objects.own]]",
            others.len(),
            others.len() + found.len(),
            shown(*low),
            shown(*high)
        );
        log.problem(At::Hand, &terrain.element, text);
    }
    found
}

/// Points of the parts of a mesh that share no corner.
fn pieces(triangles: &[[Vec3; 3]]) -> Vec<Vec<Vec3>> {
    let mesh = TriangleMesh::new(triangles);
    let mut part: Vec<usize> = (0..mesh.vertices.len()).collect();
    fn root(part: &mut [usize], mut k: usize) -> usize {
        while part[k] != k {
            part[k] = part[part[k]];
            k = part[k];
        }
        k
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|k| root(&mut part, k as usize));
        let first = a.min(b).min(c);
        for k in [a, b, c] {
            part[k] = first;
        }
    }
    let mut found: BTreeMap<usize, Vec<Vec3>> = BTreeMap::new();
    for k in 0..part.len() {
        found.entry(root(&mut part, k)).or_default().push(mesh.vertices[k]);
    }
    found.into_values().collect()
}

/// The lowest wide and level surface; it is then no furniture.
fn ground(terrains: &[Body], furniture: &mut [Furniture], log: &mut Log) -> Option<Ground> {
    let wide = |(low, high): &(Vec3, Vec3)| (*high - *low).truncate().min_element() >= GROUND;
    let all = furniture.iter().enumerate().flat_map(|(k, piece)| {
        piece
            .boxes
            .iter()
            .enumerate()
            .filter(|(_, sides)| wide(sides))
            .map(move |(b, sides)| (k, b, sides.1.z))
    });
    let (k, b, height) = all.min_by(|a, b| a.2.total_cmp(&b.2))?;
    let (low, high) = furniture[k].boxes.remove(b);
    let text = format!("its surface at {height} m is the ground of the task, which has no end");
    log.taken(At::Hand, &terrains[k].element, text);
    let piece = &furniture[k];
    let middle = (low + high) * 0.5;
    Some(Ground {
        height,
        friction: piece.friction,
        color: piece.color,
        center: [middle.x, middle.y],
        size: [high.x - low.x, high.y - low.y].map(|side| side.min(DRAWN)),
    })
}

/// A ground below everything.
fn below(furniture: &[Furniture], objects: &[Body], log: &mut Log) -> Ground {
    let boxes = furniture.iter().flat_map(|piece| piece.boxes.iter().copied());
    let of_objects = objects.iter().map(|body| body.shape.bounds(&body.pose));
    let ends: Vec<Vec3> = boxes.chain(of_objects).flat_map(|(low, high)| [low, high]).collect();
    let (low, high) = if ends.is_empty() { (Vec3::ZERO, Vec3::ZERO) } else { extent(&ends) };
    let text = format!(
        "has no terrain of {GROUND} m that lies level: the ground is at {} m, below everything",
        low.z
    );
    log.guessed(At::Hand, "world", text);
    let middle = (low + high) * 0.5;
    Ground {
        height: low.z,
        friction: 0.5,
        color: [0.55, 0.57, 0.60],
        center: [middle.x, middle.y],
        size: [high.x - low.x + GROUND, high.y - low.y + GROUND],
    }
}

/// A place as in messages.
fn shown(p: Vec3) -> String {
    format!("({:.3} {:.3} {:.3})", p.x, p.y, p.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::shape::Shape;
    use palmares_models::{Pose, Rotation};

    #[test]
    fn parts_that_share_no_corner_are_apart() {
        let cube = |at: Vec3| {
            let pose = Pose::from_parts(at, Rotation::IDENTITY);
            Shape::Box { pose, size: Vec3::ONE }.triangles()
        };
        let both = [cube(Vec3::ZERO), cube(Vec3::X * 5.0)].concat();
        let found = pieces(&both);
        assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [8, 8]);
        assert!(found.iter().all(|piece| box_of(piece).is_some()));
        // Two that share a corner are one part, which is no box.
        let found = pieces(&[cube(Vec3::ZERO), cube(Vec3::ONE)].concat());
        assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [15]);
        assert!(box_of(&found[0]).is_none());
    }
}
