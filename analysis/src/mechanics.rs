//! The mechanics of a hand in the present state of a world: `M(q) v̇ + c(q, v) = Rᵀ f − E (q − q₀) + Jᵀ f_c + …`.
//!
//! Velocities and rows are those of the state: linear velocity of the base's origin, its angular velocity, q̇; all in world axes.
//! Sources: Featherstone, *Rigid Body Dynamics Algorithms* (2008), tables 5.1 and 6.2.

use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::World;
use palmares_sim::dynamics::crba::Inertias;
use palmares_sim::dynamics::rnea::Recursion;
use palmares_sim::dynamics::tree::Kinematics;

/// Kinematics, mass matrix and bias of a hand; reused, it allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct Mechanics {
    kin: Kinematics,
    inertias: Inertias,
    recursion: Recursion,
    mass: Vec<f64>,
    bias: Vec<f64>,
}

impl Mechanics {
    /// Computes everything for the present state. A world without a hand has nothing.
    pub fn update(&mut self, world: &World) {
        let (model, state) = (world.model(), world.state());
        let Some(hand) = model.hand() else { return };
        let n = model.hand_dofs();
        self.kin.update(hand, state.base, &state.q);
        self.inertias.update(hand, &self.kin, 0);
        self.mass.clear();
        self.mass.resize(n * n, 0.0);
        self.inertias.mass_matrix(hand, &self.kin, &mut self.mass);
        self.bias.resize(n, 0.0);
        let gravity = model.config().gravity;
        self.recursion.bias(hand, &self.kin, &self.inertias, &state.v[..n], gravity, &mut self.bias);
    }

    /// World pose of every link.
    pub fn links(&self) -> &[Pose] {
        &self.kin.pose
    }

    /// Velocity of a point of a link, given in the world: linear, m/s, and angular, rad/s.
    pub fn velocity(&self, link: usize, point: Vec3) -> (Vec3, Vec3) {
        let of_link = self.recursion.velocity[link];
        (of_link.at(point - self.kin.origin), of_link.angular)
    }

    /// M, row-major n × n, kg, kg·m and kg·m².
    pub fn mass_matrix(&self) -> &[f64] {
        &self.mass
    }

    /// c: Coriolis and centrifugal forces, and gravity if the hand does not compensate its own weight; N and N·m.
    pub fn bias(&self) -> &[f64] {
        &self.bias
    }

    /// Adds the Jacobian of a point of a link, given in the world, to `rows`, row-major 6 × n of zeros: linear velocity, then angular.
    pub fn add_jacobian(&self, hand: &Hand, link: usize, point: Vec3, rows: &mut [f64]) {
        let n = 6 + hand.coordinates.len();
        let r = point - self.kin.origin;
        let mut add = |column: usize, linear: Vec3, angular: Vec3| {
            for (k, x) in linear.to_array().into_iter().chain(angular.to_array()).enumerate() {
                rows[k * n + column] += x;
            }
        };
        for (k, axis) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
            add(k, axis, Vec3::ZERO);
            add(3 + k, axis.cross(r), axis);
        }
        let mut i = link;
        while let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) {
            let screw = self.kin.screw[i];
            add(6 + joint.coordinate, screw.at(r), screw.angular);
            i = parent;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_sim::{Config, Model, State};
    use std::sync::Arc;

    /// A hand of each kind of joint, closed a little, turned and moving.
    fn worlds() -> Vec<World> {
        let hands = ["softhand", "reflex", "barrett_bh282", "yale_t42"];
        let world = |name: &str| {
            let hand = Hand::builtin(name).expect("it is built in");
            let model = Arc::new(Model::new(Config::default(), Some(hand)).expect("a model"));
            let base = Pose::from_parts(
                Vec3::new(0.3, -0.2, 0.7),
                palmares_models::Rotation::from_xyzw(0.1, -0.3, 0.2, 0.9).normalize(),
            );
            let mut world = World::new(Arc::clone(&model), State::at_rest(&model, base, &[]));
            let mut motion = world.hand_motion().expect("a hand");
            for (k, q) in motion.q.iter_mut().enumerate() {
                *q += 0.1 + 0.02 * k as f64;
            }
            for (k, v) in motion.v.iter_mut().enumerate() {
                *v = libm::sin(1.7 * k as f64);
            }
            world.place_hand(&motion).expect("it fits");
            world
        };
        hands.into_iter().map(world).collect()
    }

    #[test]
    fn jacobians_times_velocities_are_velocities_and_differences_of_poses() {
        for world in worlds() {
            let hand = world.model().hand().expect("a hand");
            let (mut now, mut later) = (Mechanics::default(), Mechanics::default());
            now.update(&world);
            let state = world.state();
            let step = 1e-6;
            let mut moved = world.hand_motion().expect("a hand");
            let turn = Vec3::new(state.v[3], state.v[4], state.v[5]) * step;
            moved.base.translation += Vec3::new(state.v[0], state.v[1], state.v[2]) * step;
            moved.base.rotation =
                (palmares_models::Rotation::from_scaled_axis(turn) * moved.base.rotation).normalize();
            for (q, v) in moved.q.iter_mut().zip(&state.v[6..]) {
                *q += v * step;
            }
            let mut there = World::new(Arc::clone(world.model()), state.clone());
            there.place_hand(&moved).expect("it fits");
            later.update(&there);
            let n = world.model().hand_dofs();
            for link in 0..hand.links.len() {
                let point = now.links()[link].translation;
                let mut rows = vec![0.0; 6 * n];
                now.add_jacobian(hand, link, point, &mut rows);
                let product: Vec<f64> =
                    rows.chunks(n).map(|row| row.iter().zip(&state.v).map(|(a, b)| a * b).sum()).collect();
                let (linear, angular) = now.velocity(link, point);
                for (found, wanted) in product.iter().zip(linear.to_array().iter().chain(&angular.to_array()))
                {
                    assert!((found - wanted).abs() < 1e-12, "{}: {found} {wanted}", hand.links[link].name);
                }
                let difference = (later.links()[link].translation - point) / step;
                assert!((difference - linear).length() < 1e-5, "{}", hand.links[link].name);
            }
        }
    }

    #[test]
    fn the_mass_matrix_is_the_kinetic_energy_of_the_links() {
        for world in worlds() {
            let hand = world.model().hand().expect("a hand");
            let mut now = Mechanics::default();
            now.update(&world);
            let (n, v) = (world.model().hand_dofs(), &world.state().v);
            let mut twice = 0.0;
            for (row, a) in now.mass_matrix().chunks(n).zip(v) {
                twice += a * row.iter().zip(v).map(|(m, b)| m * b).sum::<f64>();
            }
            let mut wanted = 0.0;
            for (k, link) in hand.links.iter().enumerate() {
                let pose = now.links()[k];
                let com = pose.translation + pose.rotation * link.inertia.com;
                let (linear, angular) = now.velocity(k, com);
                let turned = pose.rotation.inverse() * angular;
                wanted +=
                    link.inertia.mass * linear.dot(linear) + turned.dot(link.inertia.about_com * turned);
            }
            assert!((twice - wanted).abs() < 1e-12 * wanted.max(1.0), "{}: {twice} {wanted}", hand.name);
        }
    }
}
