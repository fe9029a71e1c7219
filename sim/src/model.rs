//! Constant parts of a world: the hand, the objects, the furniture and the constants.

use crate::config::Config;
use crate::law::{Law, Laws};
use crate::surface::seams::Seams;
use crate::surface::solid::Solid;
use crate::surface::spin::SpinSurface;
use palmares_models::hand::{Hand, Pad};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Mat3, Pose, Vec3};
use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::shape::SharedShape;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;

/// The body of a collision shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Owner {
    /// Furniture; never moves.
    Static,
    /// A link of the hand.
    Link(usize),
    /// A free object.
    Object(usize),
}

/// A collision shape in its body's frame; furniture's in the world's.
#[derive(Clone)]
pub struct Collider {
    /// The body it belongs to.
    pub owner: Owner,
    /// Pose in the body frame.
    pub body_from_shape: Pose,
    /// The geometry.
    pub shape: SharedShape,
    /// The shape without its rounding: for a capsule, a segment. Distances and balls are computed exactly
    /// with it, where parry would search a rounded shape for its nearest point by iteration.
    pub core: SharedShape,
    /// The core's faces, as contact manifolds need them.
    pub solid: Solid,
    /// The parts of its faces that other parts of its body, or other furniture, cover.
    pub seams: Seams,
    /// The radius that rounds its core, m; 0 for a shape that is its own core.
    pub rounding: f64,
    /// Bounds in the shape's own frame; parry would compute a hull's from all its vertices every time.
    pub local_bounds: Aabb,
    /// Largest distance of a point of the shape from its own origin, m; infinite for a ground.
    pub bounding_radius: f64,
    /// Distance of the closest two parallel planes, one of them along a face, that contain the shape between
    /// them, m; infinite for a ground.
    pub width: f64,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// Lever of rolling resistance, m.
    pub rolling_friction: f64,
    /// Resistance of the surface to spin.
    pub spin: SpinSurface,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// A ball: its contact has a closed form; a cached manifold would only make it polygonal.
    pub is_ball: bool,
    /// A cylinder or capsule: it rolls off a contact point that is kept too long.
    pub is_round: bool,
}

/// Bounds of a ground, m: beyond every position that [`crate::bounds::MAX_DISTANCE`] allows.
const END_M: f64 = 1e9;

#[derive(Clone, Copy, Default)]
struct Surface {
    friction: f64,
    rolling_friction: f64,
    torsional_friction: f64,
    restitution: f64,
    pad: Option<Pad>,
}

/// A shape's core and the radius that rounds it, m.
fn without_rounding(shape: &SharedShape) -> (SharedShape, f64) {
    if let Some(capsule) = shape.as_capsule() {
        (SharedShape::new(capsule.segment), capsule.radius)
    } else if let Some(round) = shape.as_round_cuboid() {
        (SharedShape::new(round.inner_shape), round.border_radius)
    } else if let Some(round) = shape.as_round_convex_polyhedron() {
        (SharedShape::new(round.inner_shape.clone()), round.border_radius)
    } else {
        (shape.clone(), 0.0)
    }
}

/// Most comparisons of faces with half-spaces for [`Seams`] in a model. No shipped scene makes more than 1,100.
const MOST_SEAM_WORK: u64 = 50_000_000;

/// A block of the solver's unknowns with dense coupling: the base, a finger, or an object.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// Indices in the generalized velocity.
    pub dofs: Range<usize>,
}

/// Reason why a model could not be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A hull without volume.
    #[error("{owner}: shape {index} spans no volume; a hull needs four points that are not in one plane")]
    FlatShape {
        /// Name of the link, object or furniture.
        owner: String,
        /// Index of the shape.
        index: usize,
    },
    /// Shapes of one body that overlap so much that their common surface takes too long to find.
    #[error(
        "{owner}: its shapes up to number {index} overlap too much: finding their common surface took {work} comparisons, and at \
         most {MOST_SEAM_WORK} are made for a scene; use fewer shapes, or convex pieces that only touch"
    )]
    Overlaps {
        /// Name of the link, object or furniture.
        owner: String,
        /// Index of the shape.
        index: usize,
        /// Comparisons made.
        work: u64,
    },
    /// A mass that is not positive.
    #[error("{owner}: mass is {mass} kg; it must be positive and finite")]
    BadMass {
        /// Name of the link or object.
        owner: String,
        /// The offending value.
        mass: f64,
    },
}

/// An immutable world description, shared by `Arc`.
#[derive(Clone)]
pub struct Model {
    config: Config,
    hand: Option<Arc<Hand>>,
    objects: Vec<Arc<Object>>,
    object_inertia_inverse: Vec<Mat3>,
    /// Per object: largest distance of a point from its centre of mass, m.
    object_radius: Vec<f64>,
    colliders: Vec<Collider>,
    clusters: Vec<Cluster>,
    /// Collider pairs of the hand with itself, ascending.
    self_pairs: Vec<(u32, u32)>,
    /// Whether the hand has joints and none of them is damped or rubs.
    undamped_hand: bool,
    /// Rows of dry friction of the hand.
    friction_rows: usize,
    /// Smallest width of the shapes of objects and furniture, m.
    thinnest_m: f64,
    /// Whether any shape has restitution.
    rebounds: bool,
    /// Comparisons made for the seams of the colliders so far.
    seam_work: u64,
    /// Laws that a study leaves out.
    left_out: Laws,
}

impl Model {
    /// A world with the given constants, with or without a hand. Add furniture and objects next.
    pub fn new(config: Config, hand: Option<Arc<Hand>>) -> Result<Self, ModelError> {
        let mut model = Model {
            config,
            hand: hand.clone(),
            objects: Vec::new(),
            object_inertia_inverse: Vec::new(),
            object_radius: Vec::new(),
            colliders: Vec::new(),
            clusters: Vec::new(),
            self_pairs: Vec::new(),
            undamped_hand: hand.as_ref().is_some_and(|hand| {
                hand.friction_places() == 0 && hand.coordinates.iter().all(|c| c.damping == 0.0)
            }),
            friction_rows: hand.as_ref().map_or(0, |hand| hand.friction_places()),
            thinnest_m: f64::INFINITY,
            rebounds: false,
            seam_work: 0,
            left_out: Laws::default(),
        };
        if let Some(hand) = &hand {
            for (i, link) in hand.links.iter().enumerate() {
                let mass = link.inertia.mass;
                if !(mass > 0.0 && mass.is_finite()) {
                    return Err(ModelError::BadMass { owner: link.name.clone(), mass });
                }
                for (k, geom) in link.geoms.iter().enumerate() {
                    let pad = hand.pads.iter().find(|on| (on.link, on.geom) == (i, k)).map(|on| on.pad);
                    let surface = Surface { friction: geom.friction, pad, ..Surface::default() };
                    model.add_collider(
                        Owner::Link(i),
                        &link.name,
                        k,
                        &geom.shape,
                        geom.link_from_geom,
                        surface,
                    )?;
                }
            }
            model.clusters = hand_clusters(hand);
            model.self_pairs = self_pairs(hand, &model.colliders);
        }
        Ok(model)
    }

    /// The same under another gravity, m/s².
    #[must_use]
    pub fn with_gravity(mut self, gravity: Vec3) -> Self {
        self.config.gravity = gravity;
        self
    }

    /// The same furniture and objects with a hand. Its shapes and velocities come first, then those of this
    /// model in order. The present hand, if any, is dropped.
    pub fn with_hand(&self, hand: Arc<Hand>) -> Result<Self, ModelError> {
        let mut model = Model::new(self.config.clone(), Some(hand))?;
        let others = self.colliders.iter().filter(|collider| !matches!(collider.owner, Owner::Link(_)));
        model.colliders.extend(others.cloned());
        let first = model.velocity_len();
        model
            .clusters
            .extend((0..self.objects.len()).map(|k| Cluster { dofs: first + 6 * k..first + 6 * (k + 1) }));
        model.object_inertia_inverse.clone_from(&self.object_inertia_inverse);
        model.object_radius.clone_from(&self.object_radius);
        model.thinnest_m = self.thinnest_m;
        model.rebounds |= self.rebounds;
        model.objects.clone_from(&self.objects);
        self.left_out.iter().for_each(|law| model.leave_out(law));
        Ok(model)
    }

    /// Leaves a law out of all steps of this complete scene, to find what the law buys. It is no part of the constants, their hash,
    /// or any format: a run of a task has all laws.
    pub fn leave_out(&mut self, law: Law) {
        self.left_out.insert(law);
        match law {
            Law::SpinFriction => {
                for SpinSurface { lever, layer, bulk, .. } in self.colliders.iter_mut().map(|it| &mut it.spin)
                {
                    (*lever, *layer, *bulk) = (0.0, 0.0, 0.0);
                }
            }
            Law::SelfContact => self.self_pairs.clear(),
            Law::Sleep => self.config.sleeping = false,
            _ => {}
        }
    }

    /// Whether steps have this law.
    #[inline]
    pub(crate) fn has(&self, law: Law) -> bool {
        !self.left_out.contains(law)
    }

    /// Whether anything can rebound.
    pub(crate) fn rebounds(&self) -> bool {
        self.rebounds
    }

    /// Number of collision shapes of the hand; they come first.
    pub fn hand_colliders(&self) -> usize {
        self.colliders.iter().take_while(|collider| matches!(collider.owner, Owner::Link(_))).count()
    }

    /// Adds a fixed shape at a world pose.
    pub fn add_static(
        &mut self,
        name: &str,
        shape: &Shape,
        world_from_shape: Pose,
        friction: f64,
    ) -> Result<(), ModelError> {
        let surface = Surface { friction, ..Surface::default() };
        self.add_collider(Owner::Static, name, 0, shape, world_from_shape, surface)
    }

    /// Adds a horizontal ground of infinite extent, whose surface is at `height`, m.
    pub fn add_ground(&mut self, height: f64, friction: f64) {
        let below = Vec3::new(END_M, END_M, 0.0);
        self.colliders.push(Collider {
            owner: Owner::Static,
            body_from_shape: Pose::translation(0.0, 0.0, height),
            shape: SharedShape::halfspace(Vec3::Z),
            core: SharedShape::halfspace(Vec3::Z),
            solid: Solid::HalfSpace { normal: Vec3::Z },
            seams: Seams::default(),
            rounding: 0.0,
            local_bounds: Aabb { mins: Vec3::splat(-END_M), maxs: below },
            bounding_radius: f64::INFINITY,
            width: f64::INFINITY,
            friction,
            rolling_friction: 0.0,
            spin: SpinSurface { reach: f64::INFINITY, ..SpinSurface::default() },
            restitution: 0.0,
            is_ball: false,
            is_round: false,
        });
        self.cover_last();
    }

    /// Adds a free object; returns its index.
    pub fn add_object(&mut self, object: Arc<Object>) -> Result<usize, ModelError> {
        let id = self.objects.len();
        if !(object.mass > 0.0 && object.mass.is_finite()) {
            return Err(ModelError::BadMass { owner: object.name.clone(), mass: object.mass });
        }
        for (k, (pose, shape)) in object.parts.iter().enumerate() {
            // The body frame of an object in this crate is central: at its centre of mass.
            let central = Pose::from_parts(pose.translation - object.com, pose.rotation);
            let surface = Surface {
                friction: object.friction,
                rolling_friction: object.rolling_friction,
                torsional_friction: object.torsional_friction,
                restitution: object.restitution,
                pad: None,
            };
            self.add_collider(Owner::Object(id), &object.name, k, shape, central, surface)?;
        }
        let first = self.velocity_len();
        self.clusters.push(Cluster { dofs: first..first + 6 });
        self.object_inertia_inverse.push(object.inertia.inverse());
        let parts = &self.colliders[self.colliders.len() - object.parts.len()..];
        let reach = |part: &Collider| part.body_from_shape.translation.length() + part.bounding_radius;
        self.object_radius.push(parts.iter().map(reach).fold(0.0, f64::max));
        self.objects.push(object);
        Ok(id)
    }

    fn add_collider(
        &mut self,
        owner: Owner,
        name: &str,
        index: usize,
        shape: &Shape,
        body_from_geom: Pose,
        surface: Surface,
    ) -> Result<(), ModelError> {
        let Surface { friction, rolling_friction, torsional_friction, restitution, pad } = surface;
        let (parry, geom_from_parry) =
            shape.to_parry().ok_or_else(|| ModelError::FlatShape { owner: name.to_owned(), index })?;
        let local_bounds = parry.compute_local_aabb();
        let bounding_radius = local_bounds.mins.abs().max(local_bounds.maxs.abs()).length();
        let (core, rounding) = without_rounding(&parry);
        let solid = Solid::of(&core);
        let width = parry.as_ball().map_or_else(|| solid.width() + 2.0 * rounding, |ball| 2.0 * ball.radius);
        if !matches!(owner, Owner::Link(_)) {
            self.thinnest_m = self.thinnest_m.min(width);
        }
        self.rebounds |= restitution > 0.0;
        self.colliders.push(Collider {
            width,
            solid,
            seams: Seams::default(),
            core,
            rounding,
            owner,
            bounding_radius,
            body_from_shape: body_from_geom * geom_from_parry,
            local_bounds,
            is_ball: parry.as_ball().is_some(),
            is_round: parry.as_cylinder().is_some() || parry.as_capsule().is_some(),
            shape: parry,
            friction,
            rolling_friction,
            spin: SpinSurface::new(shape, bounding_radius, torsional_friction, pad),
            restitution,
        });
        self.cover_last();
        if self.seam_work > MOST_SEAM_WORK {
            return Err(ModelError::Overlaps { owner: name.to_owned(), index, work: self.seam_work });
        }
        Ok(())
    }

    /// Finds the faces that the last shape and the others of its body cover on each other.
    fn cover_last(&mut self) {
        let Some((last, others)) = self.colliders.split_last_mut() else { return };
        for other in others.iter_mut().filter(|other| other.owner == last.owner) {
            let last_from_other = last.body_from_shape.inverse() * other.body_from_shape;
            let separated = |a: &Collider, b: &Collider, a_from_b: &Pose| {
                let bounds = a.local_bounds.loosened(1e-3);
                !bounds.intersects(&b.local_bounds.transform_by(a_from_b))
            };
            if separated(last, other, &last_from_other) {
                continue;
            }
            let other_from_last = last_from_other.inverse();
            self.seam_work += last.seams.cover(
                (&last.solid, last.rounding),
                (&other.solid, other.rounding),
                &last_from_other,
            );
            self.seam_work += other.seams.cover(
                (&other.solid, other.rounding),
                (&last.solid, last.rounding),
                &other_from_last,
            );
        }
    }

    /// The constants.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The hand, if the scene has one.
    pub fn hand(&self) -> Option<&Arc<Hand>> {
        self.hand.as_ref()
    }

    /// The free objects.
    pub fn objects(&self) -> &[Arc<Object>] {
        &self.objects
    }

    /// Inverse of an object's central inertia, in object axes.
    pub fn object_inertia_inverse(&self, object: usize) -> Mat3 {
        self.object_inertia_inverse[object]
    }

    /// Largest distance of a point of an object from its centre of mass, m.
    pub fn object_radius(&self, object: usize) -> f64 {
        self.object_radius[object]
    }

    /// Smallest width of the shapes of objects and furniture, m; infinite without any.
    pub fn thinnest_m(&self) -> f64 {
        self.thinnest_m
    }

    /// All collision shapes.
    pub fn colliders(&self) -> &[Collider] {
        &self.colliders
    }

    /// Collider pairs of the hand that may touch each other.
    pub fn self_pairs(&self) -> &[(u32, u32)] {
        &self.self_pairs
    }

    /// Number of rows of dry friction: guides on which cables of the hand rub, and joints that rub.
    pub fn friction_rows(&self) -> usize {
        self.friction_rows
    }

    /// Whether no joint of the hand is damped and nothing rubs: without contact it keeps its energy.
    pub fn undamped_hand(&self) -> bool {
        self.undamped_hand
    }

    /// Blocks of the generalized velocity: the hand's first, then one per object.
    pub fn clusters(&self) -> &[Cluster] {
        &self.clusters
    }

    /// Number of clusters that belong to the hand.
    pub fn hand_clusters(&self) -> usize {
        self.clusters.len() - self.objects.len()
    }

    /// Length of the hand's part of the generalized velocity.
    pub fn hand_dofs(&self) -> usize {
        self.hand.as_ref().map_or(0, |hand| 6 + hand.coordinates.len())
    }

    /// Length of the generalized velocity: `[hand (6 + coordinates), 6 per object]`.
    pub fn velocity_len(&self) -> usize {
        self.hand_dofs() + 6 * self.objects.len()
    }

    /// Index of an object's six velocities (linear of its centre of mass, angular).
    pub fn object_dofs(&self, object: usize) -> usize {
        self.hand_dofs() + 6 * object
    }
}

/// The base, then one cluster per branch: ranges of coordinates that share a path to the base.
fn hand_clusters(hand: &Hand) -> Vec<Cluster> {
    let mut intervals: Vec<Range<usize>> = Vec::new();
    for mut i in 0..hand.links.len() {
        let mut range: Option<Range<usize>> = None;
        while let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) {
            let c = joint.coordinate;
            range = Some(range.map_or(c..c + 1, |r| r.start.min(c)..r.end.max(c + 1)));
            i = parent;
        }
        intervals.extend(range);
    }
    intervals.sort_by_key(|r| (r.start, r.end));
    let mut merged: Vec<Range<usize>> = Vec::new();
    for r in intervals {
        match merged.last_mut() {
            Some(last) if r.start < last.end => last.end = last.end.max(r.end),
            _ => merged.push(r),
        }
    }
    let mut clusters = vec![Cluster { dofs: 0..6 }];
    clusters.extend(merged.into_iter().map(|r| Cluster { dofs: 6 + r.start..6 + r.end }));
    clusters
}

fn self_pairs(hand: &Hand, colliders: &[Collider]) -> Vec<(u32, u32)> {
    let mut pairs = Vec::new();
    for (i, a) in colliders.iter().enumerate() {
        for (j, b) in colliders.iter().enumerate().skip(i + 1) {
            let (Owner::Link(x), Owner::Link(y)) = (a.owner, b.owner) else { continue };
            let adjacent = x == y || hand.links[y].parent == Some(x) || hand.links[x].parent == Some(y);
            let excluded = hand.no_collision.contains(&[x.min(y), x.max(y)]);
            if !adjacent && !excluded {
                pairs.push((i as u32, j as u32));
            }
        }
    }
    pairs
}

/// Coulomb coefficient of a pair of surfaces: the geometric mean `√(μ_a μ_b)`, as in Box2D and Jolt. A
/// surface's own coefficient is then that of two equal surfaces, both count equally, and a frictionless
/// surface slides on everything.
pub fn pair_friction(a: &Collider, b: &Collider) -> f64 {
    (a.friction * b.friction).sqrt()
}
