//! Impossible hands, played with random actions: every tick ends, within the work a step may take,
//! without a panic, and a world that is not sound says so.

use palmares_models::hand::{
    Coordinate, CoordinateNumbers, Geom, Hand, Hinge, HingeKind, Inertia, Joint, Link, Linkage,
    LinkageNumbers, MotorSettings, Spring, SpringNumbers, StatedTendon, Tendon,
};
use palmares_models::shape::Shape;
use palmares_models::{Mat3, Pose, Rotation, Vec3};
use palmares_sim::bounds::{MAX_DISTANCE, MAX_SPEED, STEP_WORK};
use palmares_sim::{BaseCommand, Command, Config, Fault, Model, State, World};
use palmares_tasks::Sensing;
use palmares_tasks::action::{Action, BaseTarget};
use palmares_tasks::build::build;
use palmares_tasks::run::{Reason, Run};
use palmares_tasks::seed::Seed;
use palmares_tasks::task::Task;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

/// Hands tried.
const HANDS: u64 = 1000;
/// Steps of each.
const STEPS: usize = 10;
/// Whole runs.
const RUNS: u64 = 20;

/// Numbers that look random and are the same every time.
struct Numbers(u64);

impl Numbers {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, end: usize) -> usize {
        (self.unit() * end as f64) as usize
    }

    /// Log-uniform between 1e-300 and `most`, often nearer to what is usual, and sometimes an end.
    fn size(&mut self, most: f64) -> f64 {
        let top = most.log10();
        match self.below(8) {
            0 => most,
            1 => 1e-300,
            2 => 10f64.powf(-300.0 + (top + 300.0) * self.unit()),
            3..5 => 10f64.powf(top - 12.0 * self.unit()),
            _ => 10f64.powf(-3.0 + 4.0 * self.unit()).min(most),
        }
    }

    fn either(&mut self, most: f64) -> f64 {
        if self.below(2) == 0 { self.size(most) } else { -self.size(most) }
    }

    fn vector(&mut self, most: f64) -> Vec3 {
        Vec3::new(self.either(most), self.either(most), self.either(most))
    }

    fn pose(&mut self, most: f64) -> Pose {
        let axis = Vec3::new(self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5);
        Pose::from_parts(self.vector(most), Rotation::from_scaled_axis(axis * 6.0))
    }

    /// Changes about a third of what it is shown.
    fn upset(&mut self, x: &mut f64, most: f64) {
        if self.below(3) == 0 {
            *x = self.size(most);
        }
    }

    fn shape(&mut self) -> Shape {
        let (radius, half_length) = (self.size(10.0), self.size(10.0));
        match self.below(4) {
            0 => Shape::Sphere { radius },
            1 => Shape::Capsule { radius, half_length },
            2 => Shape::Cylinder { radius, half_length },
            _ => {
                let half_extents = [radius, half_length, self.size(10.0)];
                let least = half_extents.into_iter().fold(f64::INFINITY, f64::min);
                Shape::Box { half_extents, rounding: if self.below(2) == 0 { 0.0 } else { 0.5 * least } }
            }
        }
    }

    /// One that comes with the program, with other numbers.
    fn known_hand(&mut self) -> Hand {
        let name = ["softhand", "reflex", "pinch"][self.below(3)];
        let mut hand = Hand::clone(&Hand::builtin(name).expect("built in"));
        for coordinate in &mut hand.coordinates {
            self.upset(&mut coordinate.stiffness, 1e9);
            self.upset(&mut coordinate.damping, 1e9);
            self.upset(&mut coordinate.rest, 1e9);
        }
        for tendon in &mut hand.tendons {
            self.upset(&mut tendon.stiffness, 1e9);
            self.upset(&mut tendon.damping, 1e9);
            self.upset(&mut tendon.force_limit, 1e9);
        }
        for motor in &mut hand.motors {
            self.upset(&mut motor.scaling, 1e9);
            self.upset(&mut motor.offset, 1e9);
            self.upset(&mut motor.speed_limit, 1e9);
        }
        if self.below(2) == 0 {
            for link in &mut hand.links {
                self.upset(&mut link.inertia.mass, 100.0);
                link.geoms.iter_mut().for_each(|geom| self.upset(&mut geom.friction, 1e9));
            }
        }
        hand
    }

    fn link(&mut self, k: usize, moves: bool) -> Link {
        let about_com = Mat3::from_diagonal(Vec3::splat(self.size(1e9)));
        let inertia = Inertia { mass: self.size(100.0), com: self.vector(10.0), about_com };
        let geoms = (0..self.below(3))
            .map(|_| Geom { link_from_geom: self.pose(10.0), shape: self.shape(), friction: self.size(1e9) })
            .collect();
        let joint = moves.then(|| Joint {
            name: format!("joint_{k}"),
            coordinate: k - 1,
            hinges: (0..1 + self.below(2))
                .map(|_| Hinge {
                    parent_from_hinge: self.pose(10.0),
                    axis: [Vec3::X, Vec3::Y, Vec3::Z][self.below(3)],
                    kind: [HingeKind::Revolute, HingeKind::Prismatic][self.below(2)],
                    ratio: self.either(1e9),
                    offset: self.either(1e9),
                })
                .collect(),
        });
        let parent = moves.then(|| self.below(k));
        Link { name: format!("link_{k}"), parent, joint, inertia, geoms }
    }

    /// A small tree.
    fn unknown_hand(&mut self) -> Hand {
        let n = 1 + self.below(4);
        let coordinates = (0..n)
            .map(|k| {
                let lower = self.either(1e9);
                Coordinate {
                    name: format!("joint_{k}"),
                    lower,
                    upper: lower + self.size(1e9),
                    numbers: CoordinateNumbers {
                        stiffness: self.size(1e9),
                        damping: if self.below(3) == 0 { 0.0 } else { self.size(1e9) },
                        rest: self.either(1e9),
                        friction: if self.below(3) == 0 { self.size(1e9) } else { 0.0 },
                    },
                }
            })
            .collect();
        let tendons = (0..1 + self.below(2))
            .map(|k| Tendon {
                name: format!("tendon_{k}"),
                motors: vec![(0, if k == 0 { 1.0 } else { self.either(1e3) })],
                moment_arms: (0..n).map(|c| (c, self.either(1e9))).collect(),
                elements: Vec::new(),
                guides: Vec::new(),
                numbers: StatedTendon {
                    rest: (k > 0).then(|| self.either(1e9)),
                    both_ways: Some(self.below(2) == 0),
                    stiffness: Some(self.size(1e9)),
                    damping: Some(self.size(1e9)),
                    force_limit: Some(self.size(1e9)),
                    ..StatedTendon::default()
                }
                .numbers(),
            })
            .collect();
        let springs = (0..self.below(2))
            .map(|k| Spring {
                name: format!("spring_{k}"),
                arms: (0..n).map(|c| (c, self.either(1e3))).collect(),
                numbers: SpringNumbers {
                    stiffness: self.size(1e9),
                    damping: self.size(1e9),
                    rest: self.either(1e3),
                },
            })
            .collect();
        let linkages = (0..self.below(2))
            .map(|k| Linkage {
                name: format!("linkage_{k}"),
                links: [0, n],
                points: [0; 2].map(|_| Vec3::new(self.either(1.0), self.either(1.0), self.either(1.0))),
                numbers: LinkageNumbers { stiffness: self.size(1e9), damping: self.size(1e9) },
            })
            .collect();
        Hand {
            base_from_root: Pose::IDENTITY,
            name: "absurd".to_owned(),
            description: String::new(),
            links: (0..=n).map(|k| self.link(k, k > 0)).collect(),
            coordinates,
            tendons,
            springs,
            linkages,
            motors: vec![
                MotorSettings {
                    scaling: Some(self.either(1e9)),
                    offset: Some(self.either(1e9)),
                    speed_limit: Some(self.size(1e9)),
                    stall_force: (self.below(2) == 0).then(|| self.size(1e9)),
                    power_limit: (self.below(2) == 0).then(|| self.size(1e9)),
                }
                .motor("motor"),
            ],
            gravity_compensation: self.below(2) == 0,
            no_collision: Vec::new(),
            tactile: Vec::new(),
            sensors: Default::default(),
            pads: Vec::new(),
            start: palmares_models::hand::Start::default(),
            uncertain: Vec::new(),
        }
    }

    fn action(&mut self, motors: usize) -> Action {
        let near = |numbers: &mut Self| 0.3 * (2.0 * numbers.unit() - 1.0);
        let base = match self.below(3) {
            0 => BaseTarget::Twist {
                linear: self.vector(1e300).to_array(),
                angular: self.vector(1e300).to_array(),
            },
            1 => BaseTarget::Pose {
                position: self.vector(1e300).to_array(),
                quat_xyzw: [self.either(1e100), self.either(1e100), self.either(1e100), 1.0],
            },
            _ => BaseTarget::Pose {
                position: [near(self), near(self), near(self)],
                quat_xyzw: [0.0, 1.0, 0.0, 0.0],
            },
        };
        Action {
            base: Some(base),
            hand: Some((0..motors).map(|_| self.either(1e300)).collect()),
            effort: None,
        }
    }
}

fn task(text: &str) -> Arc<Task> {
    Arc::new(Task::parse("task.toml", text).expect("valid"))
}

/// Ten balls at rest in a box, and a hand right in them.
fn among_balls(hand: Hand, balls: &State, rest: &Model) -> World {
    let mut model = Model::new(Config::default(), Some(Arc::new(hand))).expect("an accepted hand");
    model.add_ground(0.0, 0.5);
    for object in rest.objects() {
        model.add_object(Arc::clone(object)).expect("it was added before");
    }
    let base = Pose::from_parts(Vec3::new(0.0, 0.0, 0.2), Rotation::from_rotation_y(PI));
    let state = State::at_rest(&model, base, &balls.objects);
    World::new(Arc::new(model), state)
}

fn command(numbers: &mut Numbers, motors: usize, at: Pose) -> Command {
    let base = match numbers.below(3) {
        0 => BaseCommand::Twist { linear: numbers.vector(1e300), angular: numbers.vector(1e300) },
        1 => BaseCommand::stay(Pose::from_parts(numbers.vector(2.0), at.rotation)),
        _ => BaseCommand::stay(at),
    };
    Command {
        base,
        sigma: (0..motors).map(|_| numbers.either(1e300)).collect(),
        effort: vec![numbers.either(2.0); motors],
        pushes: Vec::new(),
    }
}

/// Whether all is within what a sound world may be.
fn within_bounds(state: &State) -> bool {
    state.v.iter().all(|v| v.abs() <= MAX_SPEED)
        && state.objects.iter().all(|pose| pose.translation.abs().max_element() <= MAX_DISTANCE)
}

#[test]
fn absurd_hands_end_every_step_or_fail_with_a_reason() {
    let balls = build(&task(include_str!("../balls/task.toml")), None, Seed::from_u64(1)).expect("builds");
    let (mut numbers, mut ends, mut most) = (Numbers(1), BTreeMap::new(), 0);
    for k in 0..HANDS {
        let hand = if k % 2 == 0 { numbers.known_hand() } else { numbers.unknown_hand() };
        if hand.validate().is_err() {
            *ends.entry("not accepted".to_owned()).or_insert(0) += 1;
            continue;
        }
        let motors = hand.motors.len();
        let mut world = among_balls(hand, balls.world.state(), balls.world.model());
        let at = world.state().base;
        for _ in 0..STEPS {
            let command = command(&mut numbers, motors, at);
            let work = world.step(&command).work;
            most = most.max(work);
            assert!(work <= STEP_WORK + STEP_WORK / 10, "hand {k}: a step took {work}");
            assert!(
                within_bounds(world.state()) || world.fault().is_some(),
                "hand {k} is unsound and says nothing"
            );
            if world.fault().is_some() {
                let hash = world.state().hash();
                world.step(&command);
                assert_eq!(world.state().hash(), hash, "hand {k}: a failed world stands still");
                break;
            }
        }
        let end = world.fault().map_or("sound".to_owned(), |fault| format!("{fault:?}"));
        *ends.entry(end).or_insert(0) += 1;
    }
    println!("{ends:?}, at most {most} in a step");
    let count = |why: &str| ends.get(why).copied().unwrap_or(0);
    assert!(count("sound") > 100, "{ends:?}");
    assert!(count(&format!("{:?}", Fault::OutOfBounds)) > 0, "{ends:?}");
}

/// Whole runs: the scene is built or refused, observations are finite, and the outcome of a failed world names the fault.
#[test]
fn runs_of_absurd_hands_are_built_and_end() {
    let balls = include_str!("../balls/task.toml")
        .replace("count = 10", "count = 1")
        .replace("position = [0.0, 0.0, 0.75]", "position = [0.0, 0.0, 0.2]");
    let tasks = [task(&balls), task(include_str!("../grasp/task.toml"))];
    let (mut numbers, mut ends) = (Numbers(2), BTreeMap::new());
    for k in 0..RUNS {
        let hand = if k % 2 == 0 { numbers.known_hand() } else { numbers.unknown_hand() };
        if hand.validate().is_err() {
            continue;
        }
        let motors = hand.motors.len();
        let task = Arc::clone(&tasks[usize::from(k % 4 > 1)]);
        let Ok(mut run) = Run::new(task, Arc::new(hand), Seed::from_u64(1)) else {
            *ends.entry("no scene".to_owned()).or_insert(0) += 1;
            continue;
        };
        for _ in 0..3 {
            let action = numbers.action(motors);
            if run.check(&action).is_ok() {
                run.step(&action).expect("it was checked");
            }
            let observation = run.observe(Sensing::Truth);
            let predicted = observation.truth.expect("it is observed").predicted_equilibrium;
            assert!(predicted.0.iter().all(|q| q.is_finite()));
        }
        let fault = run.fault();
        assert_eq!(run.healthy(), fault.is_none());
        let outcome = run.finish(Reason::Stopped);
        if fault.is_some() {
            assert_eq!((outcome.reason, outcome.score), (Reason::WorldFault, 0.0));
        }
        *ends.entry(format!("{:?}, {:?}", fault, outcome.reason)).or_insert(0) += 1;
    }
    println!("{ends:?}");
    assert!(ends.len() > 1, "{ends:?}");
}

/// The computation of the built-in hands among thirty objects is far below the budget of a step.
#[test]
fn a_step_of_thirty_objects_takes_a_small_part_of_what_it_may() {
    let text = include_str!("../balls/task.toml")
        .replace("count = 10", "count = 30")
        .replace("radius = 0.05", "radius = 0.04");
    let mut most = 0;
    for name in ["softhand", "reflex"] {
        let hand = Hand::builtin(name).expect("built in");
        let motors = hand.motors.len();
        let mut run = Run::new(task(&text), hand, Seed::from_u64(1)).expect("the scene builds");
        for k in 0..150 {
            // Down into the heap, closing, and about in it.
            let z = (0.75 - 0.01 * f64::from(k)).max(0.2);
            let position = [0.1 * (0.1 * f64::from(k)).sin(), 0.0, z];
            let base = Some(BaseTarget::Pose { position, quat_xyzw: [0.0, 1.0, 0.0, 0.0] });
            let sigma = if k > 60 { 0.9 } else { 0.1 };
            run.step(&Action { base, hand: Some(vec![sigma; motors]), effort: None }).expect("valid");
            most = most.max(run.world().outcome().work);
        }
        assert_eq!(run.fault(), None);
    }
    println!("at most {most} in a step, of {STEP_WORK}");
    assert!(10 * most < STEP_WORK, "{most}");
}

/// Force, stiffness, R and speed of 1e9 on a light link: it turned so fast that one step was divided into more parts than
/// anybody can compute.
#[test]
fn a_hand_of_a_billion_does_not_stop_the_clock() {
    let mut hand = Hand::clone(&Hand::builtin("pinch").expect("built in"));
    for tendon in &mut hand.tendons {
        (tendon.stiffness, tendon.force_limit) = (1e9, 1e9);
        tendon.moment_arms.iter_mut().for_each(|(_, arm)| *arm = 1e9);
    }
    for motor in &mut hand.motors {
        (motor.scaling, motor.speed_limit) = (1e9, 1e9);
    }
    // Slack at the beginning.
    hand.coordinates.iter_mut().for_each(|c| c.rest = 0.0);
    let task = Task::builtin().into_iter().find(|task| task.name == "grasp").expect("built in");
    let mut run = Run::new(task, Arc::new(hand), Seed::from_u64(1)).expect("at rest it is sound");
    let mut told = false;
    for k in 0..60 {
        let sigma = f64::from(k % 2);
        let base = BaseTarget::Pose { position: [0.0, 0.0, 0.1], quat_xyzw: [0.0, 1.0, 0.0, 0.0] };
        run.step(&Action { base: Some(base), hand: Some(vec![sigma; 2]), effort: None }).expect("valid");
        let outcome = run.world().outcome();
        assert!(outcome.work < STEP_WORK, "{}", outcome.work);
        told |= run.fault().is_some() || !outcome.converged;
    }
    assert!(told, "no such hand can be computed soundly");
}
