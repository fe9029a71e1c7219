//! Puts down objects that begin in the air or a little inside of what is below them: a task settles its objects before the hand comes, and
//! refuses one that then is elsewhere.

use palmares_models::Vec3;

use super::fixed::Fixed;
use super::scene::Body;
use crate::decision::{At, Log};

/// Height from which an object may fall, m; the settling allows 20 mm.
const FALL: f64 = 0.015;
/// An object that begins less deep inside of another one stands on it, m.
const INSIDE: f64 = 0.02;
/// Deeper than this it is put on the surface, m.
const TOUCHING: f64 = 5e-4;

/// The largest object that a task may have: its longest side in m, and kg.
const LARGEST: (f64, f64) = (1.0, 20.0);
/// Farthest place of an object along each axis, m.
const FARTHEST: f64 = 10.0;
/// Objects of a run.
const MOST_OBJECTS: usize = 200;

/// Leaves out what no object of a task can be, and puts the others down.
pub(super) fn put_down(objects: &mut Vec<Body>, fixed: &Fixed, log: &mut Log) {
    objects.retain(|body| match refusal(body) {
        Some(text) => {
            log.problem(At::Hand, &body.element, format!("{text}; it is left out"));
            false
        }
        None => true,
    });
    if objects.len() > MOST_OBJECTS {
        let text =
            format!("has {} objects, a task at most {MOST_OBJECTS}: the others are left out", objects.len());
        log.problem(At::Hand, "world", text);
        objects.truncate(MOST_OBJECTS);
    }
    let mut order: Vec<usize> = (0..objects.len()).collect();
    let bottom = |body: &Body| body.shape.bounds(&body.pose).0.z;
    order.sort_by(|&a, &b| bottom(&objects[a]).total_cmp(&bottom(&objects[b])));
    let mut below: Vec<(Vec3, Vec3)> = fixed.furniture.iter().flat_map(|piece| piece.boxes.clone()).collect();
    for k in order {
        let body = &mut objects[k];
        let (low, high) = body.shape.bounds(&body.pose);
        let under = |sides: &&(Vec3, Vec3)| {
            let crosses = (0..2).all(|axis| sides.0[axis] < high[axis] && low[axis] < sides.1[axis]);
            crosses && sides.1.z <= low.z + INSIDE
        };
        let ground = fixed.ground.height;
        let support = below.iter().filter(under).map(|sides| sides.1.z).fold(ground, f64::max);
        let gap = low.z - support;
        let moved = if gap > FALL {
            let text = format!(
                "begins {gap:.3} m above what is below it, and is put down there: a run begins with objects at rest"
            );
            log.taken(At::Hand, &body.element, text);
            -gap
        } else if gap < -INSIDE {
            let text = format!("reaches {:.3} m below the ground; it is put on the ground", -gap);
            log.guessed(At::Hand, &body.element, text);
            -gap
        } else if gap < -TOUCHING {
            let text =
                format!("begins {:.1} mm inside of what is below it; it is raised by that", -1e3 * gap);
            log.guessed(At::Hand, &body.element, text);
            -gap
        } else {
            0.0
        };
        body.pose.translation.z += moved;
        let lift = Vec3::Z * moved;
        below.push((low + lift, high + lift));
    }
}

/// Why a body can be no object of a task.
fn refusal(body: &Body) -> Option<String> {
    let (low, high) = body.shape.bounds(&palmares_models::Pose::IDENTITY);
    let size = high - low;
    let (side, mass) = LARGEST;
    if !size.is_finite() || size.min_element() <= 0.0 {
        return Some("its shape has no volume".to_owned());
    }
    if size.max_element() > side {
        let [x, y, z] = size.to_array();
        return Some(format!(
            "measures {x:.3} x {y:.3} x {z:.3} m, and an object at most {side} m; is its mesh in millimetres? <geometry scale=\"0.001\">"
        ));
    }
    if body.pose.translation.abs().max_element() > FARTHEST {
        return Some(format!(
            "is at {} m; objects are within {FARTHEST} m along each axis",
            body.pose.translation
        ));
    }
    let valid = body.mass > 0.0 && body.mass <= mass;
    (!valid).then(|| format!("weighs {} kg; an object has more than 0 and at most {mass} kg", body.mass))
}
