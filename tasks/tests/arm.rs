//! A hand on an arm: what its files may say, how its joints follow, and that the run stays one run.

use palmares_models::builtin::builtin_hands;
use palmares_models::hand::Hand;
use palmares_tasks::action::ActionError;
use palmares_tasks::run::Placement;
use palmares_tasks::{Action, BaseTarget, Run, Seed, Sensing, Task};
use std::path::Path;
use std::sync::Arc;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../client-py/src/palmares/examples/arm");
const TOML: &str = include_str!("../../client-py/src/palmares/examples/arm/task.toml");
const URDF: &str = include_str!("../../client-py/src/palmares/examples/arm/fr3.urdf");

fn task() -> Arc<Task> {
    Arc::new(Task::load(Path::new(FOLDER)).expect("the example is valid").task)
}

fn softhand() -> Arc<Hand> {
    builtin_hands().iter().find(|hand| hand.name == "softhand").expect("it comes with the program").clone()
}

fn open() -> Run {
    Run::new(task(), softhand(), Seed::from_u64(3)).expect("it is sound")
}

/// Texts and what replaces them.
type Changes<'a> = &'a [(&'a str, &'a str)];

/// Loads the task with changes of both files.
fn loaded(toml: Changes, urdf: Changes) -> Result<Task, String> {
    let folder = tempfile::tempdir().expect("temporary directory");
    let changed = |text: &str, changes: Changes| {
        changes.iter().fold(text.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replacen(from, to, 1)
        })
    };
    std::fs::write(folder.path().join("task.toml"), changed(TOML, toml)).expect("written");
    std::fs::write(folder.path().join("fr3.urdf"), changed(URDF, urdf)).expect("written");
    Task::load(folder.path()).map(|loaded| loaded.task).map_err(|error| error.to_string())
}

fn to(joints: &[f64]) -> Action {
    let base = BaseTarget::Joints { joints: joints.to_vec() };
    Action { base: Some(base), hand: None, effort: None }
}

fn q(run: &Run) -> Vec<f64> {
    run.arm_reading().expect("there is an arm").position
}

#[test]
fn the_hand_starts_where_the_task_says_and_the_arm_holds_it_there() {
    let mut run = open();
    let arm = Arc::clone(run.arm().expect("there is an arm"));
    let base = run.world().state().base;
    let from_joints = arm.base_at(&q(&run));
    assert!((from_joints.translation - base.translation).length() < 1e-5);
    for _ in 0..50 {
        run.step(&Action::default()).expect("valid");
    }
    assert!((run.world().state().base.translation - base.translation).length() < 1e-3);
    let reading = run.observe(Sensing::Sensors).arm.expect("there is an arm");
    assert!(reading.velocity.iter().all(|speed| speed.abs() < 1e-2), "{reading:?}");
}

#[test]
fn joints_go_as_fast_as_they_may_and_the_base_follows() {
    let mut run = open();
    let arm = Arc::clone(run.arm().expect("there is an arm"));
    let start = q(&run);
    let mut wanted = start.clone();
    wanted[0] += 0.5;
    wanted[3] -= 0.3;
    let mut passed = 0.0_f64;
    for _ in 0..200 {
        run.step(&to(&wanted)).expect("valid");
        let reading = run.arm_reading().expect("there is an arm");
        passed = passed.max(reading.velocity[0]);
        assert!(arm.base_at(&reading.position).translation.is_finite());
    }
    // The base's own acceleration is the limit of so short a way.
    assert!(passed > 1.0 && passed < arm.joints[0].speed, "{passed}");
    for (found, wanted) in q(&run).iter().zip(&wanted) {
        assert!((found - wanted).abs() < 2e-3, "{:?} {wanted:?}", q(&run));
    }
    let base = run.world().state().base;
    assert!((arm.base_at(&wanted).translation - base.translation).length() < 2e-3);
}

#[test]
fn poses_and_velocities_are_followed_as_far_as_the_arm_reaches() {
    let mut run = open();
    let start = run.world().state().base;
    let position = (start.translation + palmares_models::Vec3::new(0.05, 0.1, -0.1)).to_array();
    let pose = BaseTarget::Pose { position, quat_xyzw: start.rotation.to_array() };
    for _ in 0..150 {
        run.step(&Action { base: Some(pose.clone()), hand: None, effort: None }).expect("valid");
    }
    let off = run.world().state().base.translation - palmares_models::Vec3::from_array(position);
    assert!(off.length() < 2e-3, "{off}");

    let far = BaseTarget::Twist { linear: [1.0, 0.0, 0.0], angular: [0.0; 3] };
    for _ in 0..300 {
        run.step(&Action { base: Some(far.clone()), hand: None, effort: None }).expect("valid");
    }
    let arm = Arc::clone(run.arm().expect("there is an arm"));
    let reached = run.world().state().base.translation.x;
    assert!(reached > 0.1 && reached < 0.5, "an arm of 0.86 m at -0.55 m: {reached}");
    let joints = q(&run);
    let within = arm.joints.iter().zip(&joints).all(|(j, q)| *q > j.lower - 1e-2 && *q < j.upper + 1e-2);
    assert!(within, "{joints:?}");
}

#[test]
fn applied_actions_and_snapshots_give_the_same_run() {
    let mut run = open();
    let start = q(&run);
    let mut applied = Vec::new();
    let mut again = open();
    let mut kept = None;
    for k in 0..120 {
        let phase = 0.1 * f64::from(k);
        let mut wanted = start.clone();
        wanted[1] += 0.3 * libm::sin(phase);
        wanted[6] += 40.0 * libm::sin(0.5 * phase);
        if k == 60 {
            kept = Some(run.snapshot().to_bytes());
        }
        if k % 3 == 0 {
            run.step(&to(&wanted)).expect("valid");
        } else {
            run.step(&Action::default()).expect("valid");
        }
        applied.push(run.applied().clone());
    }
    let Some(BaseTarget::Joints { joints }) = &applied[119].base else { panic!("joints were sent") };
    let most = run.arm().expect("there is an arm").joints[6].upper;
    assert!(joints[6].abs() <= most, "clipped to the range");
    for action in &applied {
        again.step(action).expect("valid");
    }
    assert_eq!(again.digest(), run.digest());
    let bytes = kept.expect("taken");
    let snapshot = palmares_tasks::run::Snapshot::from_bytes(&bytes).expect("whole");
    again.restore(&snapshot).expect("of this run");
    let mut fork = again.fork();
    for action in &applied[60..] {
        again.step(action).expect("valid");
        fork.step(action).expect("valid");
    }
    assert_eq!([again.digest(), fork.digest()], [run.digest(); 2]);
    assert_eq!(q(&again), q(&run));
}

#[test]
fn what_does_not_fit_an_arm_is_refused() {
    let mut run = open();
    let refused = |found: Result<(), ActionError>| found.expect_err("refused").to_string();
    assert_eq!(refused(run.step(&to(&[0.0; 6]))), "action.base.joints has 6 entries; the arm has 7 joints");
    assert_eq!(refused(run.step(&to(&[f64::NAN; 7]))), "action.base.joints[0] is not a finite number");
    let grasp = Task::builtin().into_iter().find(|task| task.name == "grasp").expect("built in");
    let mut free = Run::new(grasp, softhand(), Seed::from_u64(3)).expect("sound");
    let message = refused(free.step(&to(&[0.0; 7])));
    assert!(message.contains("task `grasp` has no arm"), "{message}");

    let mut base = run.base_state();
    base.position = [2.0, 0.0, 0.5];
    let hash = run.state_hash();
    let error = run.place(&Placement { base: Some(base), ..Placement::default() }).expect_err("far away");
    assert!(error.to_string().contains("out of the arm's reach"), "{error}");
    assert_eq!(run.state_hash(), hash);
    base.position = [0.1, 0.1, 0.5];
    run.place(&Placement { base: Some(base), ..Placement::default() }).expect("within reach");
    let arm = Arc::clone(run.arm().expect("there is an arm"));
    let off = arm.base_at(&q(&run)).translation - palmares_models::Vec3::from_array(base.position);
    assert!(off.length() < 1e-5);
}

#[test]
fn files_of_arms_are_refused_with_the_field() {
    let changes: [(Changes, Changes, &str); 11] = [
        (&[("\"fr3.urdf\"", "\"none.urdf\"")], &[], "none.urdf"),
        (&[("urdf = \"fr3.urdf\"", "urdf = \"fr3.urdf\"\ntip = \"hand\"")], &[], "has no link 'hand'"),
        (&[("urdf = \"fr3.urdf\"", "urdf = \"fr3.urdf\"\nspeed = 2")], &[], "unknown field `speed`"),
        (&[("[-0.55, 0.0, 0.0]", "[-2.55, 0.0, 0.0]")], &[], "out of the arm's reach"),
        (&[("1.9, 0.0]", "1.9]")], &[], "arm.start has 6 numbers; one for each of 7 joints"),
        (&[("start = [0.0,", "start = [9.0,")], &[], "arm.start: joint `fr3_joint1` at 9"),
        (&[], &[("velocity=\"2.62\"", "velocity=\"0\"")], "has the largest speed 0"),
        (&[], &[("type=\"revolute\"", "type=\"floating\"")], "an arm cannot have"),
        (&[], &[("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 0\"/>")], "no direction"),
        (&[], &[("lower=\"-2.7437\"", "lower=\"3\"")], "has the range 3 to 2.7437"),
        (
            &[],
            &[(
                "<link name=\"fr3_link8\"/>",
                "<link name=\"fr3_link8\"/><link name=\"camera\"/><joint name=\"c\" type=\"fixed\"><parent link=\"fr3_link7\"/><child link=\"camera\"/></joint>",
            )],
            "ends in 2 links: fr3_link8, camera",
        ),
    ];
    for (toml, urdf, wanted) in changes {
        let error = loaded(toml, urdf).expect_err(wanted);
        assert!(error.contains(wanted), "{error}");
    }
    let tip = loaded(&[("urdf = \"fr3.urdf\"", "urdf = \"fr3.urdf\"\ntip = \"fr3_link8\"")], &[]);
    assert_ne!(tip.expect("valid").content_hash(), task().content_hash());
    let faster = loaded(&[], &[("velocity=\"2.62\"", "velocity=\"2.5\"")]).expect("valid");
    assert_ne!(faster.content_hash(), task().content_hash(), "the hash is of the arm, too");
    let error = Task::parse("x.toml", TOML).expect_err("no folder").to_string();
    assert!(error.contains("arm names `fr3.urdf`, but the task has no folder"), "{error}");
}
