//! A scene of rigid bodies as JSON, for Drake's process.

use super::settings::Settings;
use crate::engine::adapter::NotPlayed;
use palmares_bench::engine::limit;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::model::Collider;
use palmares_sim::{Model, Owner};
use serde_json::{Value, json};

/// The scene with its settings: lengths in m, step in s, mass in kg, inertia in kg m² row by row, about the centre of mass. `limit_s`
/// is the CPU time of a run, s; null without a limit.
///
/// # Errors
/// It has a part that Drake does not get.
pub(super) fn described(model: &Model, settings: &Settings) -> Result<Value, NotPlayed> {
    let friction = Friction::of(model)?;
    let config = model.config();
    let mut number = 0;
    let mut written = |pose: &Pose, shape: Value, friction: f64| {
        number += 1;
        json!({ "number": number - 1, "friction": friction, "pose": numbers(pose), "shape": shape })
    };
    let fixed = model.colliders().iter().filter(|collider| collider.owner == Owner::Static);
    let fixed: Vec<Value> = fixed
        .map(|collider| {
            let (pose, shape) = furniture(collider)?;
            Ok(written(&pose, shape, friction.fixed))
        })
        .collect::<Result<_, NotPlayed>>()?;
    let mut body = |object: &Object| -> Result<Value, NotPlayed> {
        let colliders = object.parts.iter().map(|(at, shape)| {
            let central = Pose::from_parts(at.translation - object.com, at.rotation);
            Ok(written(&central, of_shape(shape)?, friction.free))
        });
        let colliders: Vec<Value> = colliders.collect::<Result<_, NotPlayed>>()?;
        let inertia = object.inertia.to_cols_array();
        Ok(json!({ "mass": object.mass, "inertia": inertia, "colliders": colliders }))
    };
    let bodies: Vec<Value> =
        model.objects().iter().map(|object| body(object)).collect::<Result<_, NotPlayed>>()?;
    Ok(json!({
        "step_s": config.step_s,
        "gravity": config.gravity.to_array(),
        "limit_s": limit::allowed_s(),
        "plant": settings.plant(),
        "proximity": settings.proximity(),
        "simulator": settings.simulator(),
        "fixed": fixed,
        "bodies": bodies,
    }))
}

/// Owners of the shapes, by their numbers.
pub(super) fn owners(model: &Model) -> Vec<Owner> {
    let fixed = model.colliders().iter().map(|collider| collider.owner).filter(|it| *it == Owner::Static);
    let objects = model.objects().iter().enumerate();
    fixed.chain(objects.flat_map(|(k, object)| object.parts.iter().map(move |_| Owner::Object(k)))).collect()
}

/// Coefficients from which Drake makes those of the pairs: 2 a b / (a + b), where ours is the root of a b.
#[derive(Debug, PartialEq)]
struct Friction {
    fixed: f64,
    free: f64,
}

impl Friction {
    fn of(model: &Model) -> Result<Self, NotPlayed> {
        let all = |of: fn(&Owner) -> bool| {
            let mut found = model.colliders().iter().filter(|it| of(&it.owner)).map(|it| it.friction);
            let first = found.next();
            found.all(|other| Some(other) == first).then_some(first)
        };
        let unequal = || NotPlayed("Drake has no coefficients that make the friction of its pairs".into());
        let fixed = all(|owner| *owner == Owner::Static).ok_or_else(unequal)?;
        let free = all(|owner| *owner != Owner::Static).ok_or_else(unequal)?.unwrap_or_default();
        Friction::from_pairs(fixed.map(|fixed| (fixed * free).sqrt()), free).ok_or_else(unequal)
    }

    /// From the coefficients of a fixed and a free body, and of two free ones.
    fn from_pairs(with_fixed: Option<f64>, free: f64) -> Option<Self> {
        let fixed = match with_fixed {
            None => free,
            Some(0.0) => 0.0,
            Some(pair) => pair * free / (2.0 * free - pair),
        };
        (fixed >= 0.0 && fixed.is_finite()).then_some(Friction { fixed, free })
    }
}

/// Place and quaternion w, x, y, z.
pub(super) fn numbers(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.translation, pose.rotation);
    [p.x, p.y, p.z, q.w, q.x, q.y, q.z]
}

fn of_shape(shape: &Shape) -> Result<Value, NotPlayed> {
    let (kind, size) = match shape {
        Shape::Sphere { radius } => ("sphere", vec![*radius]),
        Shape::Capsule { radius, half_length } => ("capsule", vec![*radius, 2.0 * half_length]),
        Shape::Cylinder { radius, half_length } => ("cylinder", vec![*radius, 2.0 * half_length]),
        // The rounding of an edge is smaller than what contact of a modulus yields.
        Shape::Box { half_extents, .. } => ("box", half_extents.map(|half| 2.0 * half).to_vec()),
        Shape::Hull { points, rounding: 0.0 } => ("convex", points.concat()),
        Shape::Hull { .. } => return Err(NotPlayed("its adapter does not pass on rounded hulls".into())),
    };
    Ok(json!({ "kind": kind, "size": size }))
}

fn furniture(collider: &Collider) -> Result<(Pose, Value), NotPlayed> {
    let at = collider.body_from_shape;
    if let Some(half_space) = collider.shape.as_halfspace() {
        let up = Rotation::from_rotation_arc(Vec3::Z, half_space.normal);
        let pose = Pose::from_parts(at.translation, at.rotation * up);
        return Ok((pose, json!({ "kind": "half_space", "size": [] })));
    }
    let size = match collider.shape.as_cuboid() {
        Some(cuboid) => cuboid.half_extents.to_array().map(|half| 2.0 * half),
        None => {
            return Err(NotPlayed(
                "its adapter does not pass on furniture of other shapes than boxes".into(),
            ));
        }
    };
    Ok((at, json!({ "kind": "box", "size": size })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_give_those_of_the_pairs() {
        let drakes = |a: f64, b: f64| 2.0 * a * b / (a + b);
        for (with_fixed, free) in [(0.5, 0.5), (0.4, 0.9), (0.6, 0.5), (0.0, 0.3)] {
            let found = Friction::from_pairs(Some(with_fixed), free).expect("there are some");
            assert_eq!(drakes(found.free, found.free), free);
            assert!((drakes(found.fixed, found.free) - with_fixed).abs() < 1e-15, "{found:?}");
        }
        // A pair's coefficient is never twice that of one of them.
        assert_eq!(Friction::from_pairs(Some(1.0), 0.5), None);
        assert_eq!(Friction::from_pairs(None, 0.5), Some(Friction { fixed: 0.5, free: 0.5 }));
    }
}
