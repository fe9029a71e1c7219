//! Free rigid objects.

use crate::error::ModelError;
use crate::shape::Shape;
use crate::shape::inertia::{self, Inertia};
use crate::{Mat3, Pose, Vec3};

/// A rigid object: convex parts, mass and surface. Mass is spread evenly over the parts' volume.
#[derive(Clone, Debug)]
pub struct Object {
    /// Identifier: `ball_100mm`.
    pub name: String,
    /// Convex parts and their poses in the object frame.
    pub parts: Vec<(Pose, Shape)>,
    /// kg
    pub mass: f64,
    /// Centre of mass in the object frame, m.
    pub com: Vec3,
    /// Inertia about the centre of mass in object axes, kg·m².
    pub inertia: Mat3,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// Coefficient of rolling resistance as a length, m: the lever of the resisting torque per normal force.
    pub rolling_friction: f64,
    /// Coefficient of torsional friction as a length, m: the lever of the largest torque about the normal of
    /// a contact, per normal force. For an even pressure on a disc of radius a it is ⅔ μ a.
    pub torsional_friction: f64,
    /// Coefficient of restitution e of Newton's law of impact; with 0 the contact's own spring and damper
    /// determine the rebound.
    pub restitution: f64,
}

impl Object {
    /// An object whose centre of mass and inertia follow from its parts; overlaps of parts count twice.
    ///
    /// # Errors
    /// No parts, a part without volume, a pose that is not finite, mass not positive, friction negative.
    pub fn new(
        name: impl Into<String>,
        parts: Vec<(Pose, Shape)>,
        mass: f64,
        friction: f64,
        rolling_friction: f64,
    ) -> Result<Object, ModelError> {
        let name = name.into();
        check(&name, &parts, mass, friction, rolling_friction)?;
        let Some(body) = inertia::of_shapes(parts.iter().map(|(pose, shape)| (*pose, shape)), mass) else {
            return Err(inconsistent(&name, "parts", "there are none with a volume".to_owned()));
        };
        Ok(Object::of(name, parts, &body, friction, rolling_friction))
    }

    /// An object with given mass, centre of mass and inertia, all in the object frame.
    ///
    /// # Errors
    /// As [`Object::new`]; or an inertia that no solid of this mass can have.
    pub fn with_inertia(
        name: impl Into<String>,
        parts: Vec<(Pose, Shape)>,
        body: &Inertia,
        friction: f64,
        rolling_friction: f64,
    ) -> Result<Object, ModelError> {
        let name = name.into();
        check(&name, &parts, body.mass, friction, rolling_friction)?;
        if parts.is_empty() {
            return Err(inconsistent(&name, "parts", "there are none".to_owned()));
        }
        if let Some(problem) = body.implausible() {
            return Err(inconsistent(&name, "inertia", problem));
        }
        if body.principal()[0] <= 0.0 {
            let problem = "a principal moment is not positive; all three must be".to_owned();
            return Err(inconsistent(&name, "inertia", problem));
        }
        Ok(Object::of(name, parts, body, friction, rolling_friction))
    }

    fn of(
        name: String,
        parts: Vec<(Pose, Shape)>,
        body: &Inertia,
        friction: f64,
        rolling_friction: f64,
    ) -> Object {
        let Inertia { mass, com, about_com: inertia } = *body;
        let (torsional_friction, restitution) = (0.0, 0.0);
        Object {
            name,
            parts,
            mass,
            com,
            inertia,
            friction,
            rolling_friction,
            torsional_friction,
            restitution,
        }
    }

    /// The same object with a coefficient of restitution, clamped to [0, 1].
    #[must_use]
    pub fn with_restitution(self, restitution: f64) -> Object {
        Object { restitution: restitution.clamp(0.0, 1.0), ..self }
    }

    /// The same object with a coefficient of torsional friction, m.
    ///
    /// # Errors
    /// The coefficient is negative or not finite.
    pub fn with_torsional_friction(self, torsional_friction: f64) -> Result<Object, ModelError> {
        check_coefficient(&self.name, "torsional_friction", torsional_friction)?;
        Ok(Object { torsional_friction, ..self })
    }

    /// The same object with mass, friction coefficient and all lengths scaled by these factors.
    #[must_use]
    pub fn varied(&self, mass: f64, friction: f64, size: f64) -> Object {
        let parts = self.parts.iter().map(|(pose, shape)| {
            (Pose::from_parts(pose.translation * size, pose.rotation), shape.scaled(size))
        });
        Object {
            name: self.name.clone(),
            parts: parts.collect(),
            mass: self.mass * mass,
            com: self.com * size,
            inertia: self.inertia * (mass * size * size),
            friction: self.friction * friction,
            // A lever is a length, too.
            rolling_friction: self.rolling_friction * size,
            torsional_friction: self.torsional_friction * size,
            restitution: self.restitution,
        }
    }

    /// Lowest and highest corner of its bounding box in its own frame, m.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let mut low = Vec3::splat(f64::INFINITY);
        let mut high = Vec3::splat(f64::NEG_INFINITY);
        for (pose, shape) in &self.parts {
            if let Some((parry, upright)) = shape.to_parry() {
                let aabb = parry.compute_aabb(&(*pose * upright));
                low = low.min(aabb.mins);
                high = high.max(aabb.maxs);
            }
        }
        (low, high)
    }
}

fn inconsistent(name: &str, element: &str, problem: String) -> ModelError {
    ModelError::Inconsistent { name: name.to_owned(), element: element.to_owned(), problem }
}

/// Rejects invalid values.
fn check(
    name: &str,
    parts: &[(Pose, Shape)],
    mass: f64,
    friction: f64,
    rolling_friction: f64,
) -> Result<(), ModelError> {
    let bad = |element: &str, problem: String| Err(inconsistent(name, element, problem));
    for (i, (pose, shape)) in parts.iter().enumerate() {
        if let Err(problem) = shape.validate() {
            return bad(&format!("part {i}"), problem);
        }
        if !pose.is_finite() {
            return bad(&format!("part {i}"), "its pose is not finite".to_owned());
        }
    }
    if !(mass.is_finite() && mass > 0.0) {
        return bad("mass", format!("{mass} kg; it must be positive and finite"));
    }
    check_coefficient(name, "friction", friction)?;
    check_coefficient(name, "rolling_friction", rolling_friction)
}

fn check_coefficient(name: &str, element: &str, value: f64) -> Result<(), ModelError> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(inconsistent(name, element, format!("{value}; it must be finite and at least 0")))
}
