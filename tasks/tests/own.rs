//! Tasks of one's own, from folders: read, built, and refused with file and field.

use palmares_models::hand::Hand;
use palmares_tasks::build::build;
use palmares_tasks::{Reason, Run, Seed, Task};
use std::path::Path;
use std::sync::Arc;

const CUBE: &str = include_str!("cube.toml");

/// The post as a mesh of half a metre in millimetres, the cube as a URDF.
const URDF: &str = r#"<robot name="cube"><link name="cube">
  <inertial><origin xyz="0 0 0.005"/><mass value="0.2"/>
    <inertia ixx="6e-5" ixy="0" ixz="0" iyy="6e-5" iyz="0" izz="6e-5"/></inertial>
  <collision><geometry><box size="0.04 0.04 0.04"/></geometry></collision>
</link></robot>"#;

/// An octahedron, its corners `size` from the middle.
fn stl(size: f64) -> String {
    let corner = |k: i32, s: f64| {
        let mut p = [0.0; 3];
        p[k as usize] = s * size;
        format!("vertex {} {} {}\n", p[0], p[1], p[2])
    };
    let mut text = "solid post\n".to_owned();
    for octant in 0..8 {
        let sign = |bit: i32| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let corners: String = (0..3).map(|k| corner(k, sign(k))).collect();
        text += &format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n");
    }
    text + "endsolid post\n"
}

/// A folder with the cube as a URDF and the post as a mesh.
fn folder(task: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("temporary directory");
    std::fs::create_dir(folder.path().join("meshes")).expect("made");
    std::fs::write(folder.path().join("task.toml"), task).expect("written");
    std::fs::write(folder.path().join("cube.urdf"), URDF).expect("written");
    std::fs::write(folder.path().join("meshes/post.stl"), stl(80.0)).expect("written");
    folder
}

fn with_files() -> String {
    let text = CUBE.replace(
        "parts = [{ shape = \"box\", size = [0.04, 0.04, 0.04] }]\nmass = 0.2\n",
        "urdf = \"cube.urdf\"\n",
    );
    let mesh = "parts = [{ shape = \"mesh\", file = \"meshes/post.stl\", scale = [0.001, 0.001, 0.001], at = [0.0, 0.0, 0.03] }]";
    let text = text.replace("parts = [{ shape = \"cylinder\", radius = 0.03, height = 0.1 }]", mesh);
    // As a mesh the post is on a corner: it starts in a hole of its own, between the furniture.
    let holder = "[[furniture]]\nname = \"holder\"\nfriction = 0.5\ncolor = [0.5, 0.5, 0.5]\nparts = [\
        { position = [0.24, 0.0, 0.02], half_extents = [0.03, 0.1, 0.02] },\
        { position = [0.36, 0.0, 0.02], half_extents = [0.03, 0.1, 0.02] },\
        { position = [0.3, 0.07, 0.02], half_extents = [0.03, 0.04, 0.02] },\
        { position = [0.3, -0.07, 0.02], half_extents = [0.03, 0.04, 0.02] }]\n\n[objects]";
    text.replace("[objects]", holder)
}

fn refusal(task: &str) -> String {
    Task::load(folder(task).path()).expect_err(task).to_string()
}

#[test]
fn a_folder_with_a_mesh_and_a_urdf_is_read_and_built() {
    let folder = folder(&with_files());
    let loaded = Task::load(folder.path()).expect("valid");
    let task = Arc::new(loaded.task);
    let (again, file) = (Task::load(folder.path()), Task::load(&folder.path().join("task.toml")));
    for other in [again, file] {
        assert_eq!(other.expect("valid").task.content_hash(), task.content_hash());
    }
    let built = build(&task, None, Seed::from_u64(1)).expect("a sound scene");
    let [cube, post, ..] = built.scene.bodies.as_slice() else { panic!("two objects") };
    assert_eq!((cube.name.as_str(), cube.mass, cube.com[2]), ("cube", 0.2, 0.005), "as the URDF says");
    let half = post.half_extents();
    assert!((half[0] - 0.08).abs() < 2e-3 && post.mass == 1.0, "{half:?}, a mesh in mm");
    // The content of the files counts, not only that of the task.
    std::fs::write(folder.path().join("meshes/post.stl"), stl(81.0)).expect("written");
    assert_ne!(Task::load(folder.path()).expect("valid").task.content_hash(), task.content_hash());
    std::fs::write(folder.path().join("meshes/post.stl"), stl(80.0)).expect("written");
    assert_eq!(Task::load(folder.path()).expect("valid").task.content_hash(), task.content_hash());
    let urdf = URDF.replace("mass value=\"0.2\"", "mass value=\"0.21\"");
    std::fs::write(folder.path().join("cube.urdf"), urdf).expect("written");
    assert_ne!(Task::load(folder.path()).expect("valid").task.content_hash(), task.content_hash());
}

#[test]
fn an_error_names_file_field_and_valid_values() {
    let cases = [
        (
            CUBE.replace(
                "source = \"made up for a test\"\nparts = [{ shape = \"box\"",
                "source = \" \"\nparts = [{ shape = \"box\"",
            ),
            "task.toml: objects.own `cube`: source: is empty; valid: author, licence",
        ),
        (CUBE.replace("source = \"made up for a test\"\n", ""), "missing field `source`"),
        (CUBE.replace("mass = 0.2\n", ""), "objects.own `cube`: mass: is missing; valid: kg"),
        (CUBE.replace("mass = 0.2", "mass = -0.2"), "objects.own `cube`: mass: -0.2 kg"),
        (CUBE.replace("mass = 0.2", "mass = 0.2\nurdf = \"cube.urdf\""), "urdf: stands beside parts or mass"),
        (CUBE.replace("friction = 0.8", "friction = -1.0"), "friction: -1"),
        (
            CUBE.replace("size = [0.04, 0.04, 0.04]", "size = [4.0, 0.04, 0.04]"),
            "at most 1 m along each axis",
        ),
        (CUBE.replace("name = \"post\"", "name = \"cube\""), "two are called `cube`"),
        (CUBE.replace("\"post\"", "\"025_mug\""), "`025_mug` is an object of the catalogue already"),
        (
            CUBE.replace("name = \"post\"", "name = \"a/b\""),
            "objects.own.name = 'a/b'; valid: 1 to 64 letters",
        ),
        (
            CUBE.replace("name = \"cube\"\ndescription", "name = \"\"\ndescription"),
            "name = ''; valid: 1 to 64 letters",
        ),
        (with_files().replace("meshes/post.stl", "meshes/pots.stl"), "meshes/pots.stl"),
        (
            with_files().replace("meshes/post.stl", "../post.stl"),
            "names mesh '../post.stl'; valid: an .stl file in the folder of the file that names it, or under it",
        ),
        (with_files().replace(", scale = [0.001, 0.001, 0.001]", ""), "a mesh in millimetres needs scale"),
        (with_files().replace("\"cube.urdf\"", "\"../cube.urdf\""), "lies outside the folder"),
        (with_files().replace("\"cube.urdf\"", "\"cub.urdf\""), "cub.urdf: "),
        (
            CUBE.replace("object = \"post\"\nposition", "object = \"pots\"\nposition"),
            "place.fixed of `pots`: object is none of the task's objects: cube, post",
        ),
        (
            CUBE.replace("object = \"post\"\nposition", "object = \"post\"\non = \"box\"\nposition"),
            "on = `box` is not placed before it; before it are: [cube]",
        ),
        (
            CUBE.replace("[[place.fixed]]\nobject = \"post\"\nposition = [0.3, 0.0, 0.05]\n", ""),
            "nothing says where `post` starts",
        ),
        (CUBE.replace("turn_deg = 20.0", "turn_deg = 200.0"), "turn_deg = 200; 0 to 180 degrees"),
        (
            CUBE.replace("inside = \"tray\"", "inside = \"try\""),
            "rules.goals.inside = \"try\" is no region; regions: tray",
        ),
        (
            CUBE.replace("{ object = \"post\", min", "{ object = \"pots\", min"),
            "rules.goals `at_post`: within.object = `pots` is no object; objects: cube, post",
        ),
        (CUBE.replace("{ object = \"post\", min", "{ object = \"cube\", min"), "name another one"),
        (CUBE.replace("above_m = 0.1\n", ""), "rules.goals `up`: asks for nothing"),
        (CUBE.replace("name = \"in_tray\"", "name = \"up\""), "two are called `up`"),
        (CUBE.replace("points = 2.0", "points = nan"), "points = NaN"),
        (CUBE.replace("for_s = 0.1", "for_s = -0.1"), "for_s = -0.1; it must be in [0, 600]"),
        (CUBE.replace("upright_deg = 10.0", "upright = 10.0"), "unknown field `upright`"),
        (CUBE.replace("kind = \"arrange\"", "kind = \"arrang\""), "arrang"),
        (CUBE.replace("count = 2", "count = 1"), "need objects that are there with every seed"),
        (
            CUBE.replace("quat_xyzw = [0.0, 1.0, 0.0, 0.0]", "quat_xyzw = [0.0, 0.0, 0.0, 0.0]"),
            "hand.quat_xyzw",
        ),
        (
            with_files().replace("half_extents = [0.03, 0.1, 0.02]", "half_extents = [0.03, 0.0, 0.02]"),
            "furniture `holder`: part 0: half_extents",
        ),
    ];
    for (text, expected) in cases {
        let error = refusal(&text);
        assert!(error.contains(expected), "{error}, not {expected}");
    }
    let none = Task::load(Path::new("/no/such/folder")).expect_err("it is not there").to_string();
    assert!(none.contains("/no/such/folder"), "{none}");
    let two = URDF.replace("</robot>", "<link name=\"more\"/></robot>");
    let folder = folder(&with_files());
    std::fs::write(folder.path().join("cube.urdf"), two).expect("written");
    let error = Task::load(folder.path()).expect_err("two links").to_string();
    assert!(error.contains("cube.urdf: robot: ") && !error.contains("task.toml"), "{error}");
    let massless = URDF.replace("<mass value=\"0.2\"/>", "<mass value=\"0\"/>");
    std::fs::write(folder.path().join("cube.urdf"), massless).expect("written");
    let error = Task::load(folder.path()).expect_err("no mass").to_string();
    assert!(error.contains("has no mass; valid: an <inertial>"), "{error}");
}

#[test]
fn fixed_places_are_shifted_and_turned_by_the_seed_within_their_bounds() {
    let task = Task::parse("cube.toml", CUBE).expect("valid");
    let mut places = Vec::new();
    for seed in 0..20 {
        let scene = build(&task, None, Seed::from_u64(seed)).expect("a sound scene").scene;
        let at = |k: usize| scene.bodies[k].position.expect("the builder knows it");
        assert!(at(0)[0].abs() < 0.0101 && at(0)[1].abs() < 0.0101, "{:?}", at(0));
        assert!((at(1)[0] - 0.3).abs() < 1e-3 && at(1)[1].abs() < 1e-3, "{:?}", at(1));
        assert!(!places.contains(&at(0)), "another seed, another place");
        places.push(at(0));
    }
}

#[test]
fn what_stands_on_another_object_moves_and_turns_with_it() {
    let task = Task::builtin().into_iter().find(|task| task.name == "pan").expect("built in");
    for seed in 0..10 {
        let scene = build(&task, None, Seed::from_u64(seed)).expect("a sound scene").scene;
        let [pan, lid, ..] = scene.bodies.as_slice() else { panic!("a pan and its lid") };
        let (pan, lid) = (pan.position.expect("stated"), lid.position.expect("stated"));
        let distance = ((pan[0] - lid[0]).powi(2) + (pan[1] - lid[1]).powi(2)).sqrt();
        // It rests at its initial place: nothing else supports or pushes it.
        assert!(distance < 1e-3 && (lid[2] - pan[2] - 0.06).abs() < 5e-4, "{pan:?} {lid:?}");
    }
}

#[test]
fn an_object_that_cannot_stay_where_it_is_put_makes_no_scene() {
    let task =
        Task::parse("cube.toml", &CUBE.replace("[0.3, 0.0, 0.05]", "[0.3, 0.0, 0.35]")).expect("valid");
    let error = build(&task, None, Seed::from_u64(1)).err().expect("it falls").to_string();
    assert!(error.contains("post did not stay where it was put"), "{error}");
}

#[test]
fn the_referee_of_a_run_sees_the_objects_frames() {
    // The post leans when it is pushed over; here the cube is put where the goals are, by placing it so.
    let text = CUBE.replace("above_m = 0.1\nfor_s = 0.1", "upright_deg = 5.0\nfor_s = 0.1");
    let text = text.replace("position = [0.0, 0.0, 0.02]", "position = [0.0, 0.3, 0.02]");
    let task = Arc::new(Task::parse("cube.toml", &text).expect("valid"));
    let hand = Hand::builtin("pinch").expect("built in");
    let mut run = Run::new(task, hand, Seed::from_u64(3)).expect("a sound scene");
    for _ in 0..20 {
        run.step(&palmares_tasks::Action::default()).expect("holds still");
    }
    let kinds: Vec<&str> = run.events().iter().map(|event| event.kind.as_str()).collect();
    assert!(kinds.is_empty(), "nothing new in the last tick: {kinds:?}");
    let outcome = run.finish(Reason::Stopped);
    let kinds: Vec<&str> = outcome.events.iter().map(|event| event.kind.as_str()).collect();
    assert_eq!((kinds.as_slice(), outcome.score, outcome.in_goal), (&["up", "in_tray"][..], 3.0, 2));
}

#[test]
fn an_error_within_the_rules_names_its_own_line() {
    for (from, to, expected) in [
        ("above_m = 0.1", "above_m = \"10 cm\"", "expected f64"),
        ("settle_s = 1.0", "settle_s = true", "expected f64"),
        ("above_m = 0.1", "above_m = 0.1\nupright = 5.0", "unknown field `upright`"),
    ] {
        let text = CUBE.replacen(from, to, 1);
        assert_ne!(text, CUBE, "{from}");
        let line =
            1 + text.lines().position(|line| to.ends_with(line) && !line.is_empty()).expect("it is there");
        let error = Task::parse("cube.toml", &text).expect_err(to).to_string();
        assert!(
            error.contains(&format!("line {line},")) && error.contains(expected),
            "{to}: line {line}: {error}"
        );
    }
}

#[test]
fn points_that_no_score_can_hold_are_refused() {
    for points in ["1e308", "-3.0", "nan", "inf"] {
        let text = CUBE.replacen("points = 1.0", &format!("points = {points}"), 1);
        assert_ne!(text, CUBE);
        let error = Task::parse("cube.toml", &text).expect_err(points).to_string();
        assert!(
            error.contains("points = ") && error.contains("must be in [0, 1000000]"),
            "{points}: {error}"
        );
    }
}

#[test]
fn a_task_of_ones_own_has_a_name_of_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = CUBE.replacen("name = \"cube\"", "name = \"balls\"", 1);
    assert_ne!(text, CUBE);
    std::fs::write(folder.path().join("task.toml"), text).expect("written");
    let error = Task::load(folder.path()).expect_err("taken").to_string();
    assert!(error.contains("task.toml") && error.contains("that of a task of the program"), "{error}");
}
