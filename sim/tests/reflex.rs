//! A hand whose moment arms depend on its configuration, against the exact equilibrium of R(q).

use palmares_models::hand::Hand;
use palmares_models::{Mat3, Pose, Vec3};
use palmares_sim::Push;
use palmares_sim::dynamics::crba::Inertias;
use palmares_sim::dynamics::jacobian::add_point_force;
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::statics::equilibrium::{
    ClosedForm, FreeEquilibrium, NoClosedForm, elastic_energy, solve_free,
};
use palmares_sim::{Command, Config, Model, State, World};
use std::sync::Arc;

fn reflex() -> Arc<Hand> {
    Hand::builtin("reflex").expect("it is built in")
}

fn world_of(hand: &Arc<Hand>, dt_s: f64) -> (World, Command) {
    world_with(hand, Config::with_step(dt_s))
}

fn world_with(hand: &Arc<Hand>, config: Config) -> (World, Command) {
    let model = Arc::new(Model::new(config, Some(Arc::clone(hand))).expect("a sound model"));
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let command = Command::stay(&model, Pose::IDENTITY);
    (World::new(model, state), command)
}

fn wound_by(hand: &Hand, sigma: &[f64]) -> Vec<f64> {
    hand.tendons.iter().map(|tendon| tendon.wound(&hand.motors, |motor| sigma[motor])).collect()
}

fn open(hand: &Hand) -> Vec<f64> {
    hand.coordinates.iter().map(|c| c.rest).collect()
}

/// The equilibrium of the free hand at motor positions σ.
fn free(hand: &Hand, sigma: &[f64]) -> FreeEquilibrium {
    solve_free(hand, &wound_by(hand, sigma), &vec![0.0; hand.coordinates.len()], &open(hand))
        .expect("it has one")
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The same hand with constant moment arms, those at q = 0.
fn with_constant_arms(hand: &Hand) -> Hand {
    let mut constant = hand.clone();
    let rows = hand.moment_arms(&vec![0.0; hand.coordinates.len()]);
    for (tendon, row) in constant.tendons.iter_mut().zip(rows) {
        tendon.elements.clear();
        tendon.moment_arms = row.into_iter().enumerate().filter(|(_, r)| *r != 0.0).collect();
    }
    constant
}

#[test]
fn newtons_equilibrium_is_the_closed_form_where_there_is_one() {
    let hand = Hand::builtin("softhand").expect("it is built in");
    let form = ClosedForm::new(&hand).expect("it has springs and constant arms");
    for sigma in [0.1, 0.5, 1.0] {
        let s = wound_by(&hand, &[sigma]);
        let tau: Vec<f64> = (0..hand.coordinates.len()).map(|i| 0.01 * (i as f64).cos()).collect();
        let (q, f) = form.solve(&s, &tau);
        let found = solve_free(&hand, &s, &tau, &open(&hand)).expect("it has one");
        assert!(largest(&found.q, &q) < 1e-12, "{}", largest(&found.q, &q));
        assert!(largest(&found.tension, &f) < 1e-10);
    }
}

#[test]
fn a_hand_with_varying_arms_has_no_closed_form() {
    let mut hand = Hand::clone(&reflex());
    assert!(matches!(ClosedForm::new(&hand), Err(NoClosedForm::VaryingArms { .. })));
    hand.tendons.iter_mut().for_each(|tendon| tendon.elements.clear());
    assert!(matches!(ClosedForm::new(&hand), Err(NoClosedForm::NoSpring { .. })));
}

#[test]
fn tensions_of_the_equilibrium_stay_within_their_bounds() {
    let hand = reflex();
    let slack = free(&hand, &[0.0, 0.0, 0.0, 0.5]);
    assert!(slack.tension[..3].iter().all(|f| f.abs() < 1e-12), "{:?}", slack.tension);
    // A torque that opens the distal joint further than the slack tendon allows; one that closes it.
    let s = wound_by(&hand, &[0.0; 4]);
    let mut tau = [0.0; 7];
    tau[2] = -0.05;
    let pulled = solve_free(&hand, &s, &tau, &open(&hand)).expect("it has one");
    assert!(pulled.tension[0] > 1e-3 && pulled.tension[1].abs() < 1e-12, "{:?}", pulled.tension);
    tau[2] = 0.05;
    let loose = solve_free(&hand, &s, &tau, &open(&hand)).expect("it has one");
    assert_eq!(loose.tension[0], 0.0);
    assert!((loose.q[2] - 0.05 / 0.30).abs() < 1e-12);
    // Held open against a fully wound motor: the tension is the motor's limit.
    tau = [0.0; 7];
    tau[1] = -3.0;
    let held = solve_free(&hand, &wound_by(&hand, &[1.0; 4]), &tau, &open(&hand)).expect("it has one");
    assert_eq!(held.tension[0], 1.5);
    assert!(held.beyond_limits.contains(&1));
}

#[test]
fn closing_on_air_ends_in_the_exact_equilibrium_at_every_step() {
    let hand = reflex();
    for sigma in [0.3, 0.6, 0.9] {
        let sigma = [sigma, sigma, sigma, 0.0];
        let expected = free(&hand, &sigma);
        assert!(expected.beyond_limits.is_empty());
        assert!(expected.residual < 1e-12, "{}", expected.residual);
        let touching = hand.pairs_closer_than(5e-4, &expected.q);
        assert!(touching.iter().all(|pair| hand.no_collision.contains(pair)), "{touching:?}");
        let constant = free(&with_constant_arms(&hand), &sigma);
        let wrong = largest(&expected.q, &constant.q);
        println!("sigma {}: q {:?}, constant R is wrong by {wrong:.3} rad", sigma[0], &expected.q[1..3]);
        assert!(sigma[0] < 0.9 || wrong > 0.1, "{wrong}");
        for dt in [0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3] {
            let (mut world, mut command) = world_of(&hand, dt);
            command.sigma = sigma.to_vec();
            for _ in 0..(6.0 / dt) as usize {
                assert!(world.step(&command).converged);
            }
            let error = largest(&world.state().q, &expected.q);
            assert!(error <= 1e-9, "sigma {}, dt {dt}: {error:e} rad", sigma[0]);
            let residual = world.joint_residual().iter().fold(0.0, |most: f64, tau| tau.abs().max(most));
            // A cable of 300 N·m/rad turns 1e-9 rad into this.
            assert!(residual <= 3e-7, "sigma {}, dt {dt}: {residual:e} N·m", sigma[0]);
        }
    }
}

#[test]
fn a_pushed_fingertip_ends_in_the_exact_equilibrium_too() {
    let hand = reflex();
    let link = hand.link("distal_1").expect("it has a first finger");
    for dt in [1e-3, 8e-3] {
        let (mut world, mut command) = world_of(&hand, dt);
        command.sigma = vec![0.6, 0.6, 0.6, 0.2];
        let push = Push { link, point: Vec3::new(0.03, 0.0, 0.0), force: Vec3::new(4.0, 0.0, 2.0) };
        command.pushes.push(push);
        for _ in 0..(8.0 / dt) as usize {
            world.step(&command);
        }
        let mut kin = Kinematics::default();
        kin.update(&hand, world.state().base, &world.state().q);
        let at = kin.pose[link].transform_point(push.point);
        let mut tau = vec![0.0; 6 + hand.coordinates.len()];
        add_point_force(&hand, &kin, link, at, push.force, 1.0, &mut tau);
        let s = wound_by(&hand, &command.sigma);
        let expected = solve_free(&hand, &s, &tau[6..], &world.state().q).expect("it has one");
        let bent = largest(&free(&hand, &command.sigma).q, &expected.q);
        assert!(bent > 0.1, "the push bends the finger, by {bent}");
        let error = largest(&world.state().q, &expected.q);
        assert!(error <= 1e-9, "dt {dt}: {error:e} rad");
    }
}

/// A finger that is wound far beyond the end of the free hand rests at its proximal stop with its distal
/// joint where the arm shrinks as it bends. The cable adds a multiple of the joint's own stiffness
/// (`geometric_stiffness`; without it these fingers whirl, with the stock limit from 16 ms on, with four
/// times as much from 4 ms on).
#[test]
fn a_saturated_finger_comes_to_rest_at_every_step() {
    let mut hand = Hand::clone(&reflex());
    for motor in &mut hand.motors[..3] {
        (motor.scaling, motor.speed_limit) = (20.0, 10.0);
    }
    hand.no_collision =
        (0..hand.links.len()).flat_map(|a| (a + 1..hand.links.len()).map(move |b| [a, b])).collect();
    for limit in [1.5, 6.0] {
        for tendon in &mut hand.tendons[..3] {
            tendon.force_limit = limit;
        }
        let shared = Arc::new(hand.clone());
        let curvature = |q: f64| shared.tendons[0].elements[0].path.length(q).curvature;
        for dt in [1e-3, 4e-3, 8e-3, 16e-3] {
            let (mut world, mut command) = world_with(&shared, Config::with_step(dt));
            command.sigma = vec![1.0, 1.0, 1.0, 0.0];
            for _ in 0..(3.0 / dt) as usize {
                assert!(world.step(&command).converged);
            }
            let (state, what) = (world.state(), format!("limit {limit}, dt {dt}"));
            assert_eq!(state.tension[..3], [limit; 3], "{what}");
            let added = -limit * curvature(state.q[2]);
            assert!(added > 5.0 * 0.30, "{what}: the cable adds {added} N·m/rad");
            let fastest = state.v.iter().fold(0.0, |most: f64, v| v.abs().max(most));
            assert!(fastest < 1e-3, "{what}: {fastest} rad/s");
            let residual = world.joint_residual().iter().fold(0.0, |most: f64, tau| tau.abs().max(most));
            assert!(residual < 1e-5, "{what}: {residual:e} N·m");
        }
    }
}

/// Kinetic energy of the hand, J.
fn kinetic(hand: &Hand, state: &State) -> f64 {
    let n = 6 + hand.coordinates.len();
    let (mut kin, mut inertias, mut m) = (Kinematics::default(), Inertias::default(), vec![0.0; n * n]);
    kin.update(hand, state.base, &state.q);
    inertias.update(hand, &kin, 0);
    inertias.mass_matrix(hand, &kin, &mut m);
    (0..n * n).map(|k| 0.5 * state.v[k / n] * m[k] * state.v[k % n]).sum()
}

/// Gains and losses of energy over a swing of the undamped hand, J: R(q) as the gradient of a length is
/// conservative, so both vanish with the step.
fn swing(hand: &Arc<Hand>, dt: f64) -> (f64, f64) {
    let (mut world, mut command) = world_of(hand, dt);
    // The motors are at their set points, the fingers are not.
    command.sigma = vec![0.5, 0.6, 0.7, 0.0];
    for (motor, sigma) in world.state_mut().motors.iter_mut().zip(&command.sigma) {
        motor.position = *sigma;
        motor.command = *sigma;
    }
    let s = wound_by(hand, &command.sigma);
    let start = free(hand, &command.sigma).q;
    world.state_mut().q.copy_from_slice(&start);
    for finger in [1, 3, 5] {
        // Along the tendon's null space: no tension is added, the springs are stretched.
        world.state_mut().q[finger + 1] += 0.3;
    }
    let energy = |state: &State| kinetic(hand, state) + elastic_energy(hand, &s, &state.q);
    let first = energy(world.state());
    let (mut gain, mut last) = (0.0f64, first);
    for _ in 0..(0.1 / dt).round() as usize {
        world.step(&command);
        let now = energy(world.state());
        gain = gain.max(now - first);
        last = now;
    }
    (gain, first - last)
}

#[test]
fn without_dampers_energy_is_kept_as_the_step_shrinks() {
    let mut hand = Hand::clone(&reflex());
    for c in &mut hand.coordinates {
        c.damping = 0.0;
    }
    // A cable soft enough that its vibration is resolved.
    for tendon in &mut hand.tendons {
        tendon.stiffness = 5.0;
        tendon.damping = 0.0;
    }
    // A heavy base that does not recoil; otherwise its servo would act.
    hand.links[0].inertia.mass = 1e9;
    hand.links[0].inertia.about_com = Mat3::from_diagonal(Vec3::splat(1e9));
    let hand = Arc::new(hand);
    let (coarse_gain, coarse) = swing(&hand, 4e-5);
    let (gain, fine) = swing(&hand, 1e-5);
    println!("lost {coarse:e} J at 40 us, {fine:e} J at 10 us; gained {coarse_gain:e} and {gain:e} J");
    assert!(fine.abs() < 0.3 * coarse.abs(), "{coarse:e} {fine:e}");
    assert!(gain <= 0.3 * coarse_gain.max(1e-12));
}

#[test]
fn preshape_turns_fingers_to_where_its_motor_is() {
    let hand = reflex();
    for (sigma, dt) in [(0.4, 1e-3), (1.0, 8e-3)] {
        let (mut world, mut command) = world_of(&hand, dt);
        command.sigma = vec![0.0, 0.0, 0.0, sigma];
        for _ in 0..(4.0 / dt) as usize {
            assert!(world.step(&command).converged);
        }
        let state = world.state();
        assert!((state.q[0] - hand.motors[3].scaling * sigma).abs() < 1e-9, "{}", state.q[0]);
        let poses = hand.base_from_links(&state.q);
        let tip = |name: &str| poses[hand.link(name).expect("it is there")].translation;
        let (one, two) = (tip("distal_1"), tip("distal_2"));
        assert!((one - Vec3::new(two.x, -two.y, two.z)).length() < 1e-9, "{one} {two}");
    }
}

#[test]
fn preshape_holds_against_pushes_from_both_sides_up_to_its_limit() {
    let hand = reflex();
    let link = hand.link("proximal_1").expect("it is there");
    for sign in [-1.0, 1.0] {
        let (mut world, mut command) = world_of(&hand, 1e-3);
        command.sigma = vec![0.0, 0.0, 0.0, 0.5];
        for _ in 0..2000 {
            world.step(&command);
        }
        // Across the finger, 30 mm along it.
        let across = world_finger_side(&world, &hand, link) * (20.0 * sign);
        command.pushes.push(Push { link, point: Vec3::new(0.03, 0.0, 0.0), force: across });
        for _ in 0..2000 {
            world.step(&command);
        }
        let turned = world.state().q[0] - hand.motors[3].scaling * 0.5;
        let torque = -world.state().tension[3] * sign;
        assert!((0.5..1.1).contains(&torque.abs()), "{torque}");
        assert!((turned - -world.state().tension[3] / 100.0).abs() < 1e-9, "{turned}");
        assert!(turned.abs() < 0.02);
    }
}

fn world_finger_side(world: &World, hand: &Hand, link: usize) -> Vec3 {
    hand.base_from_links(&world.state().q)[link].rotation * Vec3::Y
}
