//! The deepest overlap of shapes in a usable run.

use palmares_sim::{Model, Owner};

/// The bound, as a part of the least width of the thinnest body that moves, object or link. A body that has sunk in by half
/// its width is nearer to the far side of the other's surface than to the near one, and is pushed out there: it passes
/// through.
pub const PART: f64 = 0.5;

/// Scenes that begin with a deeper overlap may deepen it by a tenth.
pub const DEEPER: f64 = 1.1;

/// The bound of a scene whose deepest overlap was `first_m` at its first step, m; infinite where nothing can touch.
pub fn bound_m(model: &Model, first_m: f64) -> f64 {
    let moving = model.colliders().iter().filter(|collider| collider.owner != Owner::Static);
    let widths = moving.flat_map(|collider| collider.shape.compute_local_aabb().extents().to_array());
    (PART * widths.fold(f64::INFINITY, f64::min)).max(DEEPER * first_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rigs::softhand;
    use palmares_models::Pose;
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use palmares_sim::Config;
    use std::sync::Arc;

    #[test]
    fn half_of_the_thinnest_object_or_link_is_the_bound() {
        let hand = Some(softhand().expect("built in"));
        let mut model = Model::new(Config::with_step(1e-3), hand).expect("sound");
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        close(bound_m(&model, 0.0), 7e-3);
        for (half, bound) in [(0.03, 7e-3), (0.005, 5e-3)] {
            let shape = Shape::Box { half_extents: [0.05, 0.05, half], rounding: 0.0 };
            let cuboid = Object::new("box", vec![(Pose::IDENTITY, shape)], 0.5, 0.8, 0.0).expect("sound");
            model.add_object(Arc::new(cuboid)).expect("it fits");
            close(bound_m(&model, 0.0), bound);
        }
        close(bound_m(&model, 0.02), 0.022);
    }
}
