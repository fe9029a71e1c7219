//! The kinds of surfaces that meet in a scene of rigid bodies, by which settings differ.

use palmares_models::shape::Shape;
use palmares_sim::Model;

/// What can meet something in a scene of rigid bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Surfaces {
    /// A free body has a sphere or a capsule.
    pub round: bool,
    /// A free body has another shape, with faces.
    pub flat: bool,
}

impl Surfaces {
    /// Those of a scene.
    pub fn of(model: &Model) -> Self {
        if model.colliders().len() < 2 {
            return Surfaces::default();
        }
        let is_round = |shape: &Shape| matches!(shape, Shape::Sphere { .. } | Shape::Capsule { .. });
        let mut shapes = model.objects().iter().flat_map(|object| &object.parts).map(|(_, shape)| shape);
        Surfaces { round: shapes.clone().any(is_round), flat: !shapes.all(is_round) }
    }
}
