//! G, J and stiffness against differences of the kinematics and of equilibria that Newton's method finds.

use crate::contact::{Contact, ContactModel, LinkContact};
use crate::grasp::{Grasp, directions};
use crate::hand::{CompliantHand, Posture, Tendons, moment_arms};
use crate::quasistatic::{ContactStiffness, QuasiStatic};
use nalgebra::{DMatrix, DVector};
use palmares_models::hand::{Hand, Spring, SpringNumbers};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::statics::drives::wound_lengths;
use palmares_sim::statics::prediction::solve_loaded;
use palmares_sim::{Config, Push};
use std::sync::Arc;

const STEP: f64 = 1e-6;

fn base() -> Pose {
    Pose::from_parts(
        Vec3::new(0.1, -0.2, 0.3),
        Rotation::from_rotation_y(0.4) * Rotation::from_rotation_z(-0.7),
    )
}

fn object() -> Pose {
    Pose::from_parts(Vec3::new(0.12, -0.17, 0.41), Rotation::from_rotation_x(0.3))
}

/// A contact on every leaf of a hand, of different models.
fn contacts(hand: &Hand) -> Vec<LinkContact> {
    let leaf = |&i: &usize| hand.links[i].joint.is_some() && hand.links.iter().all(|l| l.parent != Some(i));
    let models = [ContactModel::SoftFinger, ContactModel::HardFinger, ContactModel::HardFinger];
    let at = |(k, link): (usize, usize)| {
        let point = Vec3::new(0.004, -0.003 + 0.001 * k as f64, 0.012);
        let normal = Vec3::new(1.0, 0.3 - 0.2 * k as f64, 0.4);
        LinkContact { link, in_link: Contact::new(point, normal, models[k % 3], 0.8, 0.004) }
    };
    (0..hand.links.len()).filter(leaf).enumerate().map(at).collect()
}

fn posture(hand: &Hand) -> Vec<f64> {
    hand.coordinates.iter().enumerate().map(|(i, c)| c.rest + 0.2 + 0.02 * i as f64).collect()
}

/// The three hands of the paper's kind, and one with a spring across two joints.
fn hands() -> Vec<Arc<Hand>> {
    let built_in = |name| Hand::builtin(name).expect("it is built in");
    let mut coupled = Hand::clone(&built_in("pinch"));
    "coupled".clone_into(&mut coupled.name);
    coupled.springs.push(Spring {
        name: "across".to_owned(),
        arms: vec![(0, 1.0), (3, -0.5)],
        numbers: SpringNumbers { stiffness: 0.06, damping: 0.0, rest: 0.1 },
    });
    vec![built_in("pinch"), built_in("reflex"), built_in("softhand"), Arc::new(coupled)]
}

#[test]
fn the_hand_jacobian_is_the_derivative_of_the_contacts_positions() {
    for hand in &hands() {
        let (q, contacts) = (posture(hand), contacts(hand));
        let grasp = Grasp::new(hand, base(), &q, &contacts, object()).expect("contacts of the hand");
        for c in 0..q.len() {
            let moved = |by: f64| {
                let mut q = q.clone();
                q[c] += by;
                Grasp::new(hand, base(), &q, &contacts, object()).expect("contacts").contacts
            };
            let (more, less) = (moved(STEP), moved(-STEP));
            let mut row = 0;
            for ((contact, more), less) in grasp.contacts.iter().zip(&more).zip(&less) {
                let velocity = (more.point - less.point) / (2.0 * STEP);
                // The spin is the part of the two tangents' turn about the normal.
                let [n, t, o] = contact.axes();
                let spin = (more.tangent - less.tangent).dot(o) / (2.0 * STEP);
                let expected = [velocity.dot(n), velocity.dot(t), velocity.dot(o), spin];
                for expected in &expected[..contact.model.components()] {
                    assert!((grasp.j[(row, c)] - expected).abs() < 1e-8, "{} {row} {c}", hand.name);
                    row += 1;
                }
            }
        }
    }
}

/// The object moved by u in its own axes, about its origin.
fn moved_object(u: &[f64]) -> Pose {
    let turn = object().rotation * Vec3::new(u[3], u[4], u[5]);
    let angle = turn.length();
    let rotation =
        if angle > 0.0 { Rotation::from_axis_angle(turn / angle, angle) } else { Rotation::IDENTITY };
    let shift = object().rotation * Vec3::new(u[0], u[1], u[2]);
    Pose::from_parts(object().translation + shift, rotation * object().rotation)
}

#[test]
fn the_grasp_matrix_is_the_derivative_of_points_on_the_object_and_does_the_work_of_the_wrench() {
    let hand = Hand::builtin("softhand").expect("it is built in");
    let grasp = Grasp::new(&hand, base(), &posture(&hand), &contacts(&hand), object()).expect("contacts");
    for k in 0..6 {
        let at = |by: f64| {
            let mut u = [0.0; 6];
            u[k] = by;
            moved_object(&u) * object().inverse()
        };
        let (more, less) = (at(STEP), at(-STEP));
        let mut row = 0;
        for contact in &grasp.contacts {
            let velocity =
                (more.transform_point(contact.point) - less.transform_point(contact.point)) / (2.0 * STEP);
            let [n, t, o] = contact.axes();
            let spin = (more.rotation * t - less.rotation * t).dot(o) / (2.0 * STEP);
            let expected = [velocity.dot(n), velocity.dot(t), velocity.dot(o), spin];
            for expected in &expected[..contact.model.components()] {
                assert!((grasp.g[(k, row)] - expected).abs() < 1e-8, "{row} {k}");
                row += 1;
            }
        }
    }
    // Virtual work: the wrench G λ on the object's motion, and Jᵀ λ on the joints', are λ on the contacts'.
    let forces = DVector::from_fn(grasp.g.ncols(), |i, _| 1.0 + 0.3 * i as f64);
    let wrench = &grasp.g * &forces;
    let (mut force, mut moment) = (Vec3::ZERO, Vec3::ZERO);
    let mut tau = vec![0.0; 6 + hand.coordinates.len()];
    let mut kin = Kinematics::default();
    kin.update(&hand, base(), &posture(&hand));
    for ((contact, link), (f, m)) in grasp.contacts.iter().zip(&grasp.links).zip(grasp.wrenches(&forces)) {
        force += f;
        moment += m + (contact.point - object().translation).cross(f);
        use palmares_sim::dynamics::jacobian::{add_link_torque, add_point_force};
        add_point_force(&hand, &kin, *link, contact.point, f, 1.0, &mut tau);
        add_link_torque(&hand, &kin, *link, m, 1.0, &mut tau);
    }
    let back = object().rotation.inverse();
    let expected: Vec<f64> =
        (back * force).to_array().into_iter().chain((back * moment).to_array()).collect();
    assert!((wrench - DVector::from_vec(expected)).amax() < 1e-13);
    assert!((grasp.j.transpose() * forces - DVector::from_vec(tau.split_off(6))).amax() < 1e-13);
}

#[test]
fn joint_compliance_and_synergies_are_the_derivatives_of_the_equilibrium() {
    let config = Config::default();
    for hand in &hands() {
        let sigma = vec![0.3; hand.motors.len()];
        let at = |sigma: &[f64], pushes: &[Push]| {
            solve_loaded(&config, hand, base(), sigma, pushes).expect("an equilibrium")
        };
        let rest = at(&sigma, &[]);
        let posture = Posture { q: &rest.q, tension: &rest.tension };
        let compliant =
            CompliantHand::tendon_driven(hand, posture, Tendons::Compliant, config.limit_stiffness, None)
                .expect("a compliant hand");
        let grasp = Grasp::new(hand, base(), &rest.q, &contacts(hand), object()).expect("contacts");
        for k in 0..sigma.len() {
            let moved = |by: f64| {
                let mut sigma = sigma.clone();
                sigma[k] += by;
                at(&sigma, &[])
            };
            let (more, less) = (moved(1e-5), moved(-1e-5));
            for i in 0..rest.q.len() {
                let expected = (more.q[i] - less.q[i]) / 2e-5;
                assert!((compliant.motion[(i, k)] - expected).abs() < 1e-6, "{} {i} {k}", hand.name);
            }
            for (row, &t) in compliant.acting.iter().enumerate() {
                let expected = (more.tension[t] - less.tension[t]) / 2e-5;
                assert!((compliant.tension[(row, k)] - expected).abs() < 1e-6 * expected.abs().max(1.0));
            }
        }
        let mut row = 0;
        for (contact, &link) in grasp.contacts.iter().zip(&grasp.links) {
            for (force, _) in directions(contact).take(3) {
                let point = contacts(hand).iter().find(|c| c.link == link).expect("it").in_link.point;
                let pushed = |by: f64| at(&sigma, &[Push { link, point, force: force * by }]);
                let (more, less) = (pushed(1e-4), pushed(-1e-4));
                let expected = &compliant.compliance * grasp.j.row(row).transpose();
                let tensions = &compliant.tension_per_torque * grasp.j.row(row).transpose();
                for i in 0..rest.q.len() {
                    let found = (more.q[i] - less.q[i]) / 2e-4;
                    assert!((found - expected[i]).abs() < 1e-6, "{} {row} {i}: {found}", hand.name);
                }
                for (m, &t) in compliant.acting.iter().enumerate() {
                    let found = (more.tension[t] - less.tension[t]) / 2e-4;
                    assert!((found - tensions[m]).abs() < 1e-6, "{} {row} {t}: {found}", hand.name);
                }
                row += 1;
            }
            row += usize::from(contact.model == ContactModel::SoftFinger);
        }
    }
}

/// A hand and an object with springs between them: the balance that the linear model is the derivative of.
struct Springs<'a> {
    hand: &'a Hand,
    links: Vec<LinkContact>,
    /// World frames and stiffness of the springs, and points on the object, where they have no length.
    at_rest: Vec<(Contact, [f64; 3], Vec3)>,
    sigma: Vec<f64>,
    wrench: DVector<f64>,
}

impl Springs<'_> {
    /// Forces on the object, in the world.
    fn forces(&self, q: &[f64], u: &[f64]) -> Vec<Vec3> {
        let grasp = Grasp::new(self.hand, base(), q, &self.links, object()).expect("contacts");
        let moved = moved_object(u) * object().inverse();
        let of = |(contact, (frame, stiffness, point)): (&Contact, &(Contact, [f64; 3], Vec3))| {
            let stretch = contact.point - moved.transform_point(*point);
            frame.axes().iter().zip(stiffness).map(|(axis, k)| *axis * (k * axis.dot(stretch))).sum()
        };
        grasp.contacts.iter().zip(&self.at_rest).map(of).collect()
    }

    /// Unbalanced torques on the joints, then the wrench on the object in the axes of its frame at u = 0.
    fn residual(&self, x: &DVector<f64>) -> DVector<f64> {
        let n = self.hand.coordinates.len();
        let (q, u) = x.as_slice().split_at(n);
        let forces = self.forces(q, u);
        let mut kin = Kinematics::default();
        kin.update(self.hand, base(), q);
        let mut tau = vec![0.0; 6 + n];
        let (mut force, mut moment) = (Vec3::ZERO, Vec3::ZERO);
        let pose = moved_object(u);
        let moved = pose * object().inverse();
        for ((link, force_on_object), (_, _, point)) in self.links.iter().zip(&forces).zip(&self.at_rest) {
            let at = kin.pose[link.link].transform_point(link.in_link.point);
            palmares_sim::dynamics::jacobian::add_point_force(
                self.hand,
                &kin,
                link.link,
                at,
                -*force_on_object,
                1.0,
                &mut tau,
            );
            force += *force_on_object;
            moment += (moved.transform_point(*point) - pose.translation).cross(*force_on_object);
        }
        let s = wound_lengths(self.hand, &self.sigma);
        let mut all = DVector::from_vec(tau.split_off(6));
        for (tendon, s) in self.hand.tendons.iter().zip(s) {
            let f = tendon.stiffness * (s - tendon.length(q));
            tendon.gradient(q, |c, r| all[c] += r * f);
        }
        for (i, c) in self.hand.coordinates.iter().enumerate() {
            all[i] -= c.stiffness * (q[i] - c.rest);
        }
        for spring in &self.hand.springs {
            let torque = spring.stiffness * spring.stretch(q);
            spring.arms.iter().for_each(|&(c, arm)| all[c] -= arm * torque);
        }
        let back = object().rotation.inverse();
        let wrench: Vec<f64> =
            (back * force).to_array().into_iter().chain((back * moment).to_array()).collect();
        let balance = DVector::from_vec(wrench) + &self.wrench;
        DVector::from_iterator(n + 6, all.iter().chain(balance.iter()).copied())
    }

    fn equilibrium(&self, start: &DVector<f64>) -> DVector<f64> {
        let mut x = start.clone();
        for _ in 0..12 {
            let residual = self.residual(&x);
            if residual.amax() < 1e-14 {
                break;
            }
            let mut slope = DMatrix::zeros(x.len(), x.len());
            for k in 0..x.len() {
                let at = |by: f64| {
                    let mut x = x.clone();
                    x[k] += by;
                    self.residual(&x)
                };
                slope.set_column(k, &((at(1e-6) - at(-1e-6)) / 2e-6));
            }
            x -= slope.lu().solve(&residual).expect("a regular problem");
        }
        x
    }
}

/// Every hand holds an object with springs under load: stiffness and synergies are the derivatives of its equilibrium, with the geometric terms
/// of contact forces and tendons.
#[test]
fn stiffness_of_a_loaded_grasp_is_the_derivative_of_its_equilibrium() {
    for hand in &hands() {
        let n = hand.coordinates.len();
        let mut links = contacts(hand);
        links.iter_mut().for_each(|contact| contact.in_link.model = ContactModel::HardFinger);
        let config = Config::default();
        let sigma = vec![0.3; hand.motors.len()];
        let rest = solve_loaded(&config, hand, base(), &sigma, &[]).expect("an equilibrium");
        let free = Grasp::new(hand, base(), &rest.q, &links, object()).expect("contacts");
        // The points of the object are 2 mm nearer to the hand than its surface: the grasp has inner forces.
        let stiffness = [3000.0, 2000.0, 2500.0];
        let touching = |c: &Contact| (*c, stiffness, c.point - c.normal * 0.002 - c.axes()[1] * 0.001);
        let at_rest = free.contacts.iter().map(touching).collect();
        let mut springs = Springs {
            hand,
            links,
            at_rest,
            sigma: sigma.clone(),
            wrench: DVector::from_vec(vec![0.1, -0.2, 0.3, 0.01, -0.01, 0.02]),
        };
        let start = DVector::from_iterator(n + 6, rest.q.iter().copied().chain([0.0; 6]));
        let x = springs.equilibrium(&start);
        assert!(springs.residual(&x).amax() < 1e-9, "{}", hand.name);

        // The linear model there: frames of the springs, points on the object.
        let (q, u) = x.as_slice().split_at(n);
        let forces = springs.forces(q, u);
        let mut at = Grasp::new(hand, base(), q, &springs.links, moved_object(u)).expect("contacts");
        let lambda: Vec<f64> = forces
            .iter()
            .zip(&springs.at_rest)
            .flat_map(|(force, (frame, ..))| frame.axes().map(|axis| axis.dot(*force)))
            .collect();
        let lambda = DVector::from_vec(lambda);
        // Springs keep their directions in the world; hand and object feel them at their own points.
        let on_hand: Vec<LinkContact> = {
            let mut kin = Kinematics::default();
            kin.update(hand, base(), q);
            let of = |(contact, (frame, ..)): (&Contact, &(Contact, [f64; 3], Vec3))| Contact {
                point: contact.point,
                ..*frame
            };
            let world: Vec<Contact> = at.contacts.iter().zip(&springs.at_rest).map(of).collect();
            world
                .iter()
                .zip(&springs.links)
                .map(|(c, on)| LinkContact::fixed_to(on.link, c, hand, &kin))
                .collect()
        };
        // G in the axes in which the wrench is given: those of the object at u = 0.
        let frame = Pose::from_parts(moved_object(u).translation, object().rotation);
        let hand_side = Grasp::new(hand, base(), q, &on_hand, frame).expect("contacts");
        let geometric = hand_side.hand_geometric_stiffness(hand, &lambda);
        at = hand_side.clone();
        let moved = moved_object(u) * object().inverse();
        for (contact, (_, _, point)) in at.contacts.iter_mut().zip(&springs.at_rest) {
            contact.point = moved.transform_point(*point);
        }
        let g = crate::grasp::grasp_matrix(&at.contacts, frame);
        let object_side = at.object_geometric_stiffness(&lambda);
        let tension: Vec<f64> = hand
            .tendons
            .iter()
            .zip(wound_lengths(hand, &sigma))
            .map(|(t, s)| t.stiffness * (s - t.length(q)))
            .collect();
        // Tensions of any sign act here, as the springs of this test do not go slack.
        let mut always = Hand::clone(hand);
        for tendon in &mut always.tendons {
            tendon.both_ways = true;
            tendon.force_limit = f64::INFINITY;
        }
        let compliant = CompliantHand::tendon_driven(
            &always,
            Posture { q, tension: &tension },
            Tendons::Compliant,
            0.0,
            Some(&geometric),
        )
        .expect("a compliant hand");
        let parts = ContactStiffness::Parts { normal: stiffness[0], tangential: stiffness[1], spin: 1.0 };
        let k = parts.of(&at.contacts).expect("they are positive");
        let k = DMatrix::from_fn(k.nrows(), k.ncols(), |i, j| if i == j { stiffness[i % 3] } else { 0.0 });
        let linear = QuasiStatic::new(&compliant, &g, &hand_side.j, &k, Some(&object_side)).expect("a grasp");
        let (shift, turn) = (&x.as_slice()[n..n + 3], &x.as_slice()[n + 3..]);
        assert!(shift.iter().chain(turn).all(|part| part.abs() < 0.5), "{}: {u:?}", hand.name);

        let close = |found: f64, expected: f64, scale: f64| (found - expected).abs() < 1e-6 * scale.max(1.0);
        // The turn of the moved object and its small rotation in these axes are the same to first order about u.
        let motion = |more: &DVector<f64>, less: &DVector<f64>, by: f64| -> Vec<f64> {
            let (a, b) = (moved_object(&more.as_slice()[n..]), moved_object(&less.as_slice()[n..]));
            let back = object().rotation.inverse();
            let turn = (a.rotation * b.rotation.inverse()).to_scaled_axis();
            let all = (back * (a.translation - b.translation)).to_array().into_iter();
            all.chain((back * turn).to_array()).map(|d| d / (2.0 * by)).collect()
        };
        for input in 0..sigma.len() {
            let by = 1e-5;
            let mut at = |by: f64| {
                springs.sigma[input] = sigma[input] + by;
                let found = springs.equilibrium(&x);
                springs.sigma[input] = sigma[input];
                found
            };
            let (more, less) = (at(by), at(-by));
            for i in 0..n {
                let found = (more[i] - less[i]) / (2.0 * by);
                let expected = linear.joints_per_input[(i, input)];
                assert!(
                    close(found, expected, linear.joints_per_input.amax()),
                    "{} q{i}: {found} {expected}",
                    hand.name
                );
            }
            for (i, found) in motion(&more, &less, by).iter().enumerate() {
                let expected = linear.object_per_input[(i, input)];
                assert!(
                    close(*found, expected, linear.object_per_input.amax()),
                    "{} u{i}: {found} {expected}",
                    hand.name
                );
            }
        }
        for part in 0..6 {
            let by = 3e-6;
            let mut at = |by: f64| {
                springs.wrench[part] += by;
                let found = springs.equilibrium(&x);
                springs.wrench[part] -= by;
                found
            };
            let (more, less) = (at(by), at(-by));
            for (i, found) in motion(&more, &less, by).iter().enumerate() {
                let expected = linear.object_per_wrench[(i, part)];
                assert!(
                    close(*found, expected, linear.object_per_wrench.amax()),
                    "{} u{i} w{part}: {found} {expected}",
                    hand.name
                );
            }
        }
    }
}

#[test]
fn fixed_tendons_keep_their_length_and_are_the_limit_of_stiff_ones() {
    for hand in &hands() {
        let q = posture(hand);
        let tension: Vec<f64> = hand.tendons.iter().map(|tendon| 0.25 * tendon.force_limit).collect();
        let posture = Posture { q: &q, tension: &tension };
        let fixed =
            CompliantHand::tendon_driven(hand, posture, Tendons::Fixed, 0.0, None).expect("compliant");
        assert!((moment_arms(hand, &q) * &fixed.compliance).amax() < 1e-9, "{}", hand.name);
        let mut stiff = Hand::clone(hand);
        stiff.tendons.iter_mut().for_each(|tendon| tendon.stiffness *= 1e7);
        let limit = CompliantHand::tendon_driven(&stiff, posture, Tendons::Compliant, 0.0, None).expect("it");
        assert!((limit.compliance - fixed.compliance).amax() < 1e-6, "{}", hand.name);
        assert!((limit.motion - fixed.motion).amax() < 1e-5, "{}", hand.name);
    }
}
