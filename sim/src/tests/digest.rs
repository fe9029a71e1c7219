//! Snapshots and digests: equal motions have equal digests, different ones do not.

use crate::anchor::{Anchor, Pair};
use crate::{Command, Config, Model, State, World};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use parry3d_f64::shape::PackedFeatureId;
use std::f64::consts::PI;
use std::sync::Arc;

/// A hand, fingers down, that closes among boxes, cylinders and balls that fall into each other.
fn scene() -> (World, Command) {
    let hand = Hand::builtin("softhand").expect("built in");
    let mut model = Model::new(Config::default(), Some(hand)).expect("a hand");
    model.add_ground(0.0, 0.5);
    let shapes = [
        Shape::Box { half_extents: [0.03, 0.02, 0.04], rounding: 0.0 },
        Shape::Cylinder { radius: 0.03, half_length: 0.04 },
        Shape::Sphere { radius: 0.03 },
        Shape::Capsule { radius: 0.02, half_length: 0.03 },
        Shape::Box { half_extents: [0.02, 0.05, 0.03], rounding: 0.005 },
    ];
    let mut poses = Vec::new();
    for k in 0..10 {
        let parts = vec![(Pose::IDENTITY, shapes[k % 5].clone())];
        model
            .add_object(Arc::new(Object::new(format!("{k}"), parts, 0.2, 0.6, 1e-4).expect("sound")))
            .expect("fits");
        let (x, y) = ((k % 3) as f64 - 1.0, (k / 3 % 2) as f64 - 0.5);
        poses.push(Pose::new(
            Vec3::new(0.08 * x + 0.003 * k as f64, 0.1 * y, 0.06 + 0.04 * k as f64),
            Vec3::new(0.2 * k as f64, 0.3, 0.1),
        ));
    }
    let down = Pose::new(Vec3::new(0.0, 0.0, 0.3), Vec3::new(0.0, PI, 0.0));
    let world = World::new(Arc::new(model.clone()), State::at_rest(&model, down, &poses));
    let mut command = Command::stay(&model, down);
    command.sigma[0] = 0.8;
    (world, command)
}

/// A world restored from a snapshot continues like the original, independent of its own caches.
#[test]
fn a_restored_snapshot_goes_on_bit_for_bit() {
    let (mut world, command) = scene();
    let mut points = 0;
    for round in 0..60 {
        let mut other = World::new(Arc::clone(world.model()), world.state().clone());
        for step in 0..20 {
            world.step(&command);
            other.step(&command);
            assert_eq!(world.state().hash(), other.state().hash(), "round {round}, step {step}");
        }
        points = points.max(world.outcome().points);
    }
    assert!(points > 10, "things touch");
}

fn loaded(pairs: &mut [Pair]) -> &mut Pair {
    let touching = |pair: &&mut Pair| pair.manifold.points.iter().any(|point| point.data.loaded);
    pairs.iter_mut().find(touching).expect("something touches")
}

fn point(state: &mut State) -> &mut parry3d_f64::query::TrackedContact<Anchor> {
    &mut loaded(&mut state.pairs).manifold.points[0]
}

/// The smallest change of a number.
fn nudge(x: &mut f64) {
    *x = f64::from_bits(x.to_bits() ^ 1);
}

#[test]
fn a_world_that_failed_comes_back_from_its_snapshot_as_it_is() {
    let (mut world, command) = scene();
    let state = world.state_mut();
    (state.v[0], state.motors[0].velocity) = (f64::NAN, f64::NAN);
    world.step(&command);
    assert!(world.fault().is_some());
    let snapshot = world.snapshot();
    assert!(snapshot.fits(world.model()), "a fault is no forgery");
    world.resume(&snapshot);
    assert!(world.fault().is_some());
}

/// Every number that affects a step; the patterns in `State::hash` are exhaustive, so that a new field cannot
/// be forgotten.
#[test]
fn every_field_counts_in_the_digest() {
    let (mut world, command) = scene();
    for _ in 0..600 {
        world.step(&command);
    }
    let mut state = world.state().clone();
    state.earlier.smooth = true;
    type Change = (&'static str, fn(&mut State));
    let changes: [Change; 59] = [
        ("step", |s| s.step ^= 1),
        ("base place", |s| nudge(&mut s.base.translation.y)),
        ("base turn", |s| nudge(&mut s.base.rotation.w)),
        ("q", |s| nudge(&mut s.q[3])),
        ("v", |s| nudge(&mut s.v[7])),
        ("object place", |s| nudge(&mut s.objects[1].translation.x)),
        ("object turn", |s| nudge(&mut s.objects[1].rotation.z)),
        ("reference pose", |s| nudge(&mut s.reference.pose.translation.z)),
        ("reference linear", |s| nudge(&mut s.reference.linear.x)),
        ("reference angular", |s| nudge(&mut s.reference.angular.x)),
        ("motor command", |s| nudge(&mut s.motors[0].command)),
        ("motor position", |s| nudge(&mut s.motors[0].position)),
        ("motor velocity", |s| nudge(&mut s.motors[0].velocity)),
        ("tension", |s| nudge(&mut s.tension[0])),
        ("friction", |s| s.friction.push(0.0)),
        ("still steps", |s| s.sleep[2].still_steps ^= 1),
        ("moved since", |s| nudge(&mut s.sleep[2].moved[0][1])),
        ("rests", |s| s.sleep[2].rests ^= true),
        ("asleep", |s| s.sleep[2].asleep ^= true),
        ("earlier smooth", |s| s.earlier.smooth ^= true),
        ("earlier base", |s| nudge(&mut s.earlier.motion.base.translation.x)),
        ("earlier q", |s| nudge(&mut s.earlier.motion.q[0])),
        ("earlier v", |s| nudge(&mut s.earlier.motion.v[0])),
        ("substeps", |s| s.substeps ^= 1),
        ("pair key", |s| loaded(&mut s.pairs).key.1 ^= 1),
        ("normal on a", |s| nudge(&mut loaded(&mut s.pairs).manifold.local_n1.x)),
        ("normal on b", |s| nudge(&mut loaded(&mut s.pairs).manifold.local_n2.x)),
        ("subshape of a", |s| loaded(&mut s.pairs).manifold.subshape1 ^= 1),
        ("subshape of b", |s| loaded(&mut s.pairs).manifold.subshape2 ^= 1),
        ("initial_overlap", |s| nudge(&mut loaded(&mut s.pairs).initial_overlap)),
        ("gap at the update", |s| nudge(&mut loaded(&mut s.pairs).updated_at.0)),
        ("place at the update", |s| nudge(&mut loaded(&mut s.pairs).updated_at.1.translation.y)),
        ("turn at the update", |s| nudge(&mut loaded(&mut s.pairs).updated_at.1.rotation.w)),
        ("mean known", |s| loaded(&mut s.pairs).mean.known ^= true),
        ("mean loaded", |s| loaded(&mut s.pairs).mean.loaded ^= true),
        ("mean stretch", |s| nudge(&mut loaded(&mut s.pairs).mean.stretch.y)),
        ("mean twist", |s| nudge(&mut loaded(&mut s.pairs).mean.twist)),
        ("mean blow", |s| nudge(&mut loaded(&mut s.pairs).mean.struck_s)),
        ("mean slip", |s| nudge(&mut loaded(&mut s.pairs).mean.slip)),
        ("mean force", |s| nudge(&mut loaded(&mut s.pairs).mean.normal_force)),
        ("covered", |s| loaded(&mut s.pairs).covered ^= true),
        ("predicted", |s| loaded(&mut s.pairs).predicted = None),
        ("beside", |s| nudge(&mut loaded(&mut s.pairs).beside.x)),
        ("placed", |s| loaded(&mut s.pairs).placed ^= true),
        ("lever", |s| nudge(&mut loaded(&mut s.pairs).lever)),
        ("number of points", |s| loaded(&mut s.pairs).manifold.points.truncate(0)),
        ("point on a", |s| nudge(&mut point(s).local_p1.x)),
        ("point on b", |s| nudge(&mut point(s).local_p2.x)),
        ("distance", |s| nudge(&mut point(s).dist)),
        ("feature of a", |s| point(s).fid1 = PackedFeatureId(point(s).fid1.0 ^ 1)),
        ("feature of b", |s| point(s).fid2 = PackedFeatureId(point(s).fid2.0 ^ 1)),
        ("stretch", |s| nudge(&mut point(s).data.stretch.x)),
        ("twist", |s| nudge(&mut point(s).data.twist)),
        ("slip", |s| nudge(&mut point(s).data.slip)),
        ("force", |s| nudge(&mut point(s).data.normal_force)),
        ("bearing", |s| nudge(&mut point(s).data.bearing)),
        ("blow", |s| nudge(&mut point(s).data.struck_s)),
        ("known", |s| point(s).data.known ^= true),
        ("loaded", |s| point(s).data.loaded ^= true),
    ];
    let before = state.hash();
    for (name, change) in changes {
        let mut changed = state.clone();
        change(&mut changed);
        assert_ne!(changed.hash(), before, "{name}");
    }
    assert_eq!(state.clone().hash(), before);
}
