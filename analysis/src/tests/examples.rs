//! Worked examples of the literature.

use crate::closure::{PLANAR, force_closure, form_closure, frictional_closure};
use crate::contact::{Contact, ContactModel};
use crate::design::Design;
use crate::grasp::grasp_matrix;
use crate::linear::{null_space, rank};
use crate::quality::{Norm, QualitySettings, quality};
use nalgebra::{DMatrix, DVector};
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn contact(
    point: [f64; 3],
    normal: [f64; 3],
    tangent: [f64; 3],
    model: ContactModel,
    friction: f64,
) -> Contact {
    Contact {
        point: Vec3::from_array(point),
        normal: Vec3::from_array(normal).normalize(),
        tangent: Vec3::from_array(tangent).normalize(),
        model,
        friction,
        arm: 0.5,
    }
}

/// Murray, Li and Sastry, *A Mathematical Introduction to Robotic Manipulation* (1994), example 5.2: two soft fingers on opposite sides of a
/// box, at (0, ∓r, 0). Their columns are the forces along x, y, z of the contact frame and the moment about z, the inward normal.
#[test]
fn the_grasp_map_of_a_box_between_two_soft_fingers() {
    let r = 0.7;
    let soft = ContactModel::SoftFinger;
    let contacts = [
        contact([0.0, -r, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], soft, 0.5),
        contact([0.0, r, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], soft, 0.5),
    ];
    let g = grasp_matrix(&contacts, Pose::IDENTITY);
    #[rustfmt::skip]
    let expected = DMatrix::from_row_slice(6, 8, &[
        0.0, 1.0, 0.0, 0.0,  1.0, 0.0, 0.0, 0.0,
        0.0, 0.0, 1.0, 0.0,  0.0, 0.0, -1.0, 0.0,
        1.0, 0.0, 0.0, 0.0,  0.0, 1.0, 0.0, 0.0,
        -r,  0.0, 0.0, 0.0,  0.0, r,   0.0, 0.0,
        0.0, 0.0, 0.0, 1.0,  0.0, 0.0, 0.0, -1.0,
        0.0, r,   0.0, 0.0,  -r,  0.0, 0.0, 0.0,
    ]);
    // Ours are n, t, o, m: their z, x, y and the moment.
    let ours = [1, 2, 0, 3, 5, 6, 4, 7];
    assert!((g.select_columns(&ours) - expected).amax() < 1e-15);
    assert_eq!(rank(&g), 6);
    assert!(frictional_closure(&contacts, &g, &[0, 1, 2, 3, 4, 5]).closed);
}

/// Prattichizzo and Trinkle, "Grasping" (Springer Handbook of Robotics), example "Grasped sphere": two fingers at angles θ on a sphere
/// of radius r, n̂ to its centre, t̂ in the plane and ô out of it.
#[test]
fn two_fingers_on_a_sphere() {
    let r = 1.3;
    for (first, second) in [(0.4f64, 2.0f64), (0.0, PI)] {
        let on = |angle: f64, model| {
            let (s, c) = angle.sin_cos();
            contact([r * c, r * s, 0.0], [-c, -s, 0.0], [s, -c, 0.0], model, 0.5)
        };
        let soft = [on(first, ContactModel::SoftFinger), on(second, ContactModel::SoftFinger)];
        let g = grasp_matrix(&soft, Pose::IDENTITY);
        for (k, angle) in [first, second].into_iter().enumerate() {
            let (s, c) = angle.sin_cos();
            #[rustfmt::skip]
            let expected = DMatrix::from_row_slice(6, 4, &[
                -c,  s,   0.0,    0.0,
                -s,  -c,  0.0,    0.0,
                0.0, 0.0, 1.0,    0.0,
                0.0, 0.0, r * s,  -c,
                0.0, 0.0, -r * c, -s,
                0.0, -r,  0.0,    0.0,
            ]);
            assert!((g.columns(4 * k, 4) - expected).amax() < 1e-15);
        }
        assert_eq!(rank(&g), 6);
        assert_eq!(null_space(&g).ncols(), 2);
        let hard = soft.map(|contact| Contact { model: ContactModel::HardFinger, ..contact });
        let g = grasp_matrix(&hard, Pose::IDENTITY);
        // The object turns about the line through both contacts.
        assert_eq!(rank(&g), 5);
        let free = null_space(&g.transpose());
        let line = (hard[1].point - hard[0].point).normalize();
        let turn = Vec3::new(free[3], free[4], free[5]).normalize();
        assert!((turn.dot(line).abs() - 1.0).abs() < 1e-12);
        assert_eq!(null_space(&g).ncols(), 1);
    }
}

/// Four contacts without friction hold a square against turns only if their lines do not meet (Reuleaux; Prattichizzo and Trinkle, section
/// "Form closure"). Alike forces balance, so that all of them are at the mean: the margin is 1.
#[test]
fn a_square_has_form_closure_with_two_couples_and_none_without() {
    let a = 0.4;
    let square = |side: f64, friction: f64| {
        let contact = |point: [f64; 2], normal: [f64; 2]| {
            contact(
                [point[0], point[1], 0.0],
                [normal[0], normal[1], 0.0],
                [-normal[1], normal[0], 0.0],
                ContactModel::HardFinger,
                friction,
            )
        };
        [
            contact([-1.0, a], [1.0, 0.0]),
            contact([1.0, -a], [-1.0, 0.0]),
            contact([side * a, -1.0], [0.0, 1.0]),
            contact([-side * a, 1.0], [0.0, -1.0]),
        ]
    };
    let held = square(1.0, 0.3);
    let found = form_closure(&held, &grasp_matrix(&held, Pose::IDENTITY), &PLANAR);
    assert!(found.closed && (found.margin - 1.0).abs() < 1e-7, "{found:?}");
    assert!(found.forces.iter().all(|force| (force - 1.0).abs() < 1e-7));
    let turning = square(-1.0, 0.3);
    let g = grasp_matrix(&turning, Pose::IDENTITY);
    let found = form_closure(&turning, &g, &PLANAR);
    assert!(!found.closed && found.rank == 3 && found.margin < 1e-7, "{found:?}");
    // All normals turn it the same way, at the arm a; friction has the arm 1 and holds it if μ is above a.
    assert!(!frictional_closure(&turning, &g, &PLANAR).closed);
    let rough = square(-1.0, 0.5);
    assert!(frictional_closure(&rough, &g, &PLANAR).closed);
    assert!(!form_closure(&held[..3], &grasp_matrix(&held[..3], Pose::IDENTITY), &PLANAR).closed);
}

/// Two fingers hold an object in the plane if the line between them is in both friction cones (Nguyen 1988). The margin in closed form: with
/// both normal forces 1 and the tangential one tan φ, `d = μ − tan φ`.
#[test]
fn two_fingers_hold_if_the_line_between_them_is_in_both_cones() {
    for (slope, friction) in [(0.2f64, 0.5), (0.49, 0.5), (0.51, 0.5), (0.0, 0.1)] {
        let angle = slope.atan();
        let (s, c) = angle.sin_cos();
        let on = |side: f64| {
            contact(
                [-side, 0.0, 0.0],
                [side * c, side * s, 0.0],
                [-side * s, side * c, 0.0],
                ContactModel::HardFinger,
                friction,
            )
        };
        let contacts = [on(1.0), on(-1.0)];
        let g = grasp_matrix(&contacts, Pose::IDENTITY);
        let found = frictional_closure(&contacts, &g, &PLANAR);
        assert_eq!(found.closed, slope < friction, "{slope}: {found:?}");
        assert!((found.margin - (friction - slope).max(0.0)).abs() < 1e-7, "{slope}: {found:?}");
        // In space it turns about the line.
        assert!(!frictional_closure(&contacts, &g, &[0, 1, 2, 3, 4, 5]).closed);
        // A hand that cannot squeeze does not have force closure.
        let squeeze = DMatrix::zeros(g.ncols(), 1);
        assert!(!force_closure(&contacts, &g, &squeeze, &PLANAR).closed);
    }
}

fn disc(contacts: usize, friction: f64) -> Vec<Contact> {
    (0..contacts)
        .map(|k| {
            let (s, c) = (TAU * k as f64 / contacts as f64).sin_cos();
            contact([c, s, 0.0], [-c, -s, 0.0], [s, -c, 0.0], ContactModel::HardFinger, friction)
        })
        .collect()
}

/// ε of a set of planar wrenches by its definition: the smallest reach over directions, on a fine grid.
fn epsilon_by_sampling(contacts: &[Contact], norm: Norm) -> f64 {
    let mut least = f64::INFINITY;
    for i in 0..=400 {
        let height = (PI * f64::from(i) / 400.0).cos();
        let width = (1.0 - height * height).sqrt();
        for k in 0..800 {
            let (s, c) = (TAU * f64::from(k) / 800.0).sin_cos();
            let direction = Vec3::new(width * c, width * s, 0.0);
            let mut reach = 0.0f64;
            for contact in contacts {
                let [n, t, _] = contact.axes();
                let along = |force: Vec3| force.dot(direction) + height * contact.point.cross(force).z;
                let own = along(n) + contact.friction * along(t).abs();
                match norm {
                    Norm::Total => reach = reach.max(own),
                    Norm::Each => reach += own.max(0.0),
                }
            }
            least = least.min(reach);
        }
    }
    least
}

/// Ferrari and Canny 1992: both criteria for fingers evenly around a disc of radius 1. Friction alone resists turns: at most μ with the
/// sum of the normal forces 1, and nμ with each of them 1.
#[test]
fn epsilon_of_fingers_around_a_disc() {
    let settings = |norm| QualitySettings { norm, edges: 4, length: 1.0 };
    for (count, friction) in [(3, 0.2), (4, 0.3), (4, 0.9), (5, 0.1), (3, 1.5)] {
        let contacts = disc(count, friction);
        let g = grasp_matrix(&contacts, Pose::IDENTITY);
        for norm in [Norm::Total, Norm::Each] {
            let found = quality(&contacts, &g, &PLANAR, settings(norm)).expect("a hull");
            let sampled = epsilon_by_sampling(&contacts, norm);
            assert!(found.epsilon <= sampled + 1e-9, "{count} {friction} {norm:?}: {found:?} {sampled}");
            assert!(sampled - found.epsilon < 2e-3, "{count} {friction} {norm:?}: {found:?} {sampled}");
            // In the plane a pyramid of four edges is the cone.
            assert!((found.epsilon_bound - found.epsilon).abs() < 1e-8, "{found:?}");
        }
        if friction < 0.4 {
            let total = quality(&contacts, &g, &PLANAR, settings(Norm::Total)).expect("a hull");
            assert!((total.epsilon - friction).abs() < 1e-9, "{count}: {total:?}");
            assert!((total.weakest[2].abs() - 1.0).abs() < 1e-9);
        }
    }
    // Without friction nothing resists turns.
    let smooth = disc(4, 0.0);
    let g = grasp_matrix(&smooth, Pose::IDENTITY);
    assert_eq!(quality(&smooth, &g, &PLANAR, settings(Norm::Total)).expect("a hull").epsilon, 0.0);
}

/// Two soft fingers at the poles of a ball of radius 1: pyramids of more edges come nearer to round cones from inside.
#[test]
fn epsilon_of_two_soft_fingers_on_a_ball() {
    let on = |side: f64| {
        contact([0.0, 0.0, side], [0.0, 0.0, -side], [1.0, 0.0, 0.0], ContactModel::SoftFinger, 0.6)
    };
    let contacts = [on(1.0), on(-1.0)];
    let g = grasp_matrix(&contacts, Pose::IDENTITY);
    let at = |edges| {
        let settings = QualitySettings { norm: Norm::Total, edges, length: 1.0 };
        quality(&contacts, &g, &[0, 1, 2, 3, 4, 5], settings).expect("a hull")
    };
    let [coarse, fine] = [4, 8].map(at);
    assert!(coarse.epsilon > 0.0 && coarse.epsilon <= fine.epsilon + 1e-9, "{coarse:?} {fine:?}");
    assert!(coarse.volume < fine.volume);
    // The round cones are between.
    assert!(fine.epsilon <= coarse.epsilon_bound + 1e-9, "{coarse:?} {fine:?}");
    assert!(fine.epsilon_bound >= fine.epsilon - 1e-9);
}

/// Soft fingers around a ball: pyramids of more edges come as near to round cones as wanted.
#[test]
fn epsilon_of_soft_fingers_reaches_round_cones() {
    let on = |[x, y, z]: [f64; 3]| {
        let out = Vec3::new(x, y, z).normalize();
        Contact::new(out, -out, ContactModel::SoftFinger, 0.7, 0.008 / 0.03)
    };
    let contacts = [[1.0, 0.0, 0.0], [-0.5, 0.8, 0.1], [-0.5, -0.8, 0.1]].map(on);
    let g = grasp_matrix(&contacts, Pose::IDENTITY);
    let at = |edges| {
        let settings = QualitySettings { norm: Norm::Total, edges, length: 1.0 };
        quality(&contacts, &g, &[0, 1, 2, 3, 4, 5], settings).expect("a hull")
    };
    // The reach of round cones by adding the farthest wrench at the nearest facet, in another program: 0.40860 to 0.40866.
    for (found, least) in [4, 8].map(at).iter().zip([0.3, 0.385]) {
        assert!((least..0.40866).contains(&found.epsilon) && found.epsilon_bound > 0.4086, "{found:?}");
    }
}

/// The definition again, in space: no direction of many has a smaller reach than ε.
#[test]
fn epsilon_in_space_is_a_lower_bound_that_is_reached() {
    let on = |k: usize| {
        let (s, c) = (1.3 * k as f64 + 0.2).sin_cos();
        let z = 0.5 * (k as f64 - 1.5);
        let point = Vec3::new(c, s, z).normalize();
        contact(point.to_array(), (-point).to_array(), [-s, c, 0.0], ContactModel::HardFinger, 0.7)
    };
    let contacts = [0, 1, 2, 3, 4].map(on);
    let g = grasp_matrix(&contacts, Pose::IDENTITY);
    let settings = QualitySettings { norm: Norm::Total, edges: 6, length: 1.0 };
    let found = quality(&contacts, &g, &[0, 1, 2, 3, 4, 5], settings).expect("a hull");
    let reach = |direction: &DVector<f64>| {
        let mut total = 0.0f64;
        for (k, contact) in contacts.iter().enumerate() {
            let along = g.columns(3 * k, 3).transpose() * direction;
            let edge = |i: usize| {
                let (s, c) = (TAU * i as f64 / 6.0).sin_cos();
                along[0] + contact.friction * (c * along[1] + s * along[2])
            };
            total = (0..6).map(edge).fold(total, f64::max);
        }
        total
    };
    let mut least = f64::INFINITY;
    for i in 0..20_000 {
        let direction = DVector::from_fn(6, |k, _| (i as f64 * (1.7 + 0.61 * k as f64) + k as f64).sin());
        least = least.min(reach(&direction.normalize()));
    }
    assert!(found.epsilon <= least + 1e-9, "{found:?} {least}");
    assert!((reach(&-found.weakest.clone()) - found.epsilon).abs() < 1e-8, "{found:?}");
}

/// Birglen, Laliberté and Gosselin, *Underactuated Robotic Hands* (2008), section 3.2: forces of a finger of two phalanges with a tendon, without springs:
/// `f₂ = r₂ T/k₂`, `f₁ = (r₁ T − (k₂ + l₁ cos θ₂) f₂)/k₁`.
#[test]
fn phalanx_forces_of_an_underactuated_finger() {
    let mut hand = Hand::clone(&Hand::builtin("pinch").expect("it is built in"));
    // One finger; its springs are negligible against the tendon.
    for coordinate in &mut hand.coordinates {
        (coordinate.stiffness, coordinate.rest) = (1e-9, 0.0);
    }
    for tendon in &mut hand.tendons {
        tendon.moment_arms.clear();
    }
    let (r1, r2) = (0.012, 0.007);
    hand.tendons[0].moment_arms = vec![(0, r1), (1, r2)];
    hand.tendons[1].moment_arms = vec![(2, 0.01), (3, 0.01)];
    let (l1, k1, k2, angle) = (0.05f64, 0.03f64, 0.02f64, 0.6f64);
    let jacobian = DMatrix::from_row_slice(2, 4, &[k1, 0.0, 0.0, 0.0, k2 + l1 * angle.cos(), k2, 0.0, 0.0]);
    let posture = [0.3, angle, 0.0, 0.0];
    let design = Design::of(&hand).expect("constant arms");
    let sigma = [0.9, 0.0];
    let forces = design.forces(&sigma, &jacobian, &posture, 1e-12).expect("forces");
    let wound = hand.motors[0].scaling * (sigma[0] - hand.motors[0].offset);
    let tension = hand.tendons[0].stiffness * (wound - r1 * posture[0] - r2 * posture[1]);
    let f2 = r2 * tension / k2;
    let f1 = (r1 * tension - (k2 + l1 * angle.cos()) * f2) / k1;
    let expected = DVector::from_vec(vec![f1, f2]);
    assert!((&forces - &expected).amax() < 1e-4 * expected.amax(), "{forces} {expected}");
    assert!(angle < FRAC_PI_2);
}
