//! Objects, furniture, surfaces.

use super::hand::HandBody;
use palmares_sim::model::pair_friction;
use palmares_sim::{Model, Owner};
use rapier3d_f64::dynamics::{CoefficientCombineRule, MassProperties, RigidBodyBuilder, RigidBodyHandle};
use rapier3d_f64::geometry::{ColliderBuilder, ColliderHandle, ColliderSet, SolverFlags};
use rapier3d_f64::pipeline::{
    ActiveHooks, ContactModificationContext, PairFilterContext, PhysicsHooks, PhysicsWorld,
};
use std::sync::Arc;

/// Free bodies at the origin, to be placed; their frames are central as in the state.
pub(super) fn add_objects(world: &mut PhysicsWorld, model: &Model) -> Vec<RigidBodyHandle> {
    let config = model.config();
    let unit = world.integration_parameters.length_unit;
    let insert = |object: &Arc<palmares_models::object::Object>| {
        let mass = MassProperties::with_inertia_matrix(Default::default(), object.mass, object.inertia);
        let builder = RigidBodyBuilder::dynamic().additional_mass_properties(mass).can_sleep(config.sleeping);
        let handle = world.insert_body(builder);
        if let Some(body) = world.bodies.get_mut(handle).filter(|_| config.sleeping) {
            let activation = body.activation_mut();
            activation.normalized_linear_threshold = config.sleep_linear / unit;
            activation.angular_threshold = config.sleep_angular;
            activation.time_until_sleep = config.sleep_after_s;
        }
        handle
    };
    model.objects().iter().map(insert).collect()
}

/// All collision shapes; a collider's user data is its place in the model plus one.
pub(super) fn add_colliders(
    world: &mut PhysicsWorld,
    model: &Model,
    hand: Option<&HandBody>,
    objects: &[RigidBodyHandle],
) {
    for (i, collider) in model.colliders().iter().enumerate() {
        let parent = match collider.owner {
            Owner::Static => None,
            Owner::Link(link) => hand.map(|hand| hand.body(link)),
            Owner::Object(k) => Some(objects[k]),
        };
        let hooks = match collider.owner {
            Owner::Static => ActiveHooks::empty(),
            Owner::Link(_) => ActiveHooks::FILTER_CONTACT_PAIRS | ActiveHooks::MODIFY_SOLVER_CONTACTS,
            Owner::Object(_) => ActiveHooks::MODIFY_SOLVER_CONTACTS,
        };
        let builder = ColliderBuilder::new(collider.shape.clone())
            .position(collider.body_from_shape)
            .density(0.0)
            .friction(collider.friction)
            .restitution(collider.restitution)
            // Of two coefficients the larger one, as ours.
            .restitution_combine_rule(CoefficientCombineRule::Max)
            .user_data(i as u128 + 1)
            .active_hooks(hooks);
        world.insert_collider(builder, parent);
    }
}

/// Deepest overlap of shapes, m.
pub(super) fn penetration(world: &PhysicsWorld) -> f64 {
    let points = world.narrow_phase.contact_pairs().flat_map(|pair| pair.manifolds()).flat_map(|m| &m.points);
    points.fold(0.0, |deepest: f64, point| deepest.max(-point.dist))
}

/// The pairs of shapes of the hand that may touch, and the friction of every pair, as in the model.
pub(super) struct Surfaces {
    model: Arc<Model>,
}

impl Surfaces {
    pub(super) fn new(model: Arc<Model>) -> Self {
        Surfaces { model }
    }

    /// Places in the model of two colliders, ascending.
    fn pair(&self, set: &ColliderSet, a: ColliderHandle, b: ColliderHandle) -> Option<(usize, usize)> {
        let place = |handle| (set.get(handle)?.user_data as usize).checked_sub(1);
        let (a, b) = (place(a)?, place(b)?);
        Some((a.min(b), a.max(b)))
    }
}

impl PhysicsHooks for Surfaces {
    fn filter_contact_pair(&self, context: &PairFilterContext) -> Option<SolverFlags> {
        let (a, b) = self.pair(context.colliders, context.collider1, context.collider2)?;
        let shapes = self.model.colliders();
        let within_hand = matches!((shapes[a].owner, shapes[b].owner), (Owner::Link(_), Owner::Link(_)));
        let meet = !within_hand || self.model.self_pairs().binary_search(&(a as u32, b as u32)).is_ok();
        meet.then_some(SolverFlags::COMPUTE_RIGID_IMPULSES)
    }

    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        let Some((a, b)) = self.pair(context.colliders, context.collider1, context.collider2) else { return };
        let shapes = self.model.colliders();
        if let Some(manifold) = context.rigid_mut() {
            *manifold.friction = pair_friction(&shapes[a], &shapes[b]);
        }
    }
}
