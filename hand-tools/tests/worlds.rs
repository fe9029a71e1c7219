//! Klamp't's worlds as tasks: what is written loads, its scenes settle, and a hand fits above its objects.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use palmares_hand_import::decision::DecisionKind;
use palmares_hand_import::{ImportedWorld, import_world};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::read::Files;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_tasks::build::build;
use palmares_tasks::{Seed, Task, inspect};

/// A folder with a world and the files that it names.
struct Source {
    folder: tempfile::TempDir,
}

impl Source {
    fn new(world: &str, files: &[(&str, &str)]) -> Source {
        let source = Source { folder: tempfile::tempdir().expect("a folder") };
        source.write("world.xml", &format!("<world>{world}</world>"));
        source.write("cube.off", &cube());
        files.iter().for_each(|(path, text)| source.write(path, text));
        source
    }

    fn path(&self, path: &str) -> PathBuf {
        self.folder.path().join("source").join(path)
    }

    fn write(&self, path: &str, text: &str) {
        let path = self.path(path);
        fs::create_dir_all(path.parent().expect("a parent")).expect("made");
        fs::write(path, text).expect("written");
    }

    fn import(&self) -> ImportedWorld {
        import_world(&self.path("world.xml"), None, "mine").unwrap_or_else(|error| panic!("{error}"))
    }

    fn refusal(&self) -> String {
        import_world(&self.path("world.xml"), None, "mine").expect_err("refused").to_string()
    }

    /// The task, after what `palmares task check` asks: it loads without warnings, its scenes settle, a hand fits.
    #[track_caller]
    fn task(self) -> Made {
        let world = self.import();
        let folder = self.folder.path().join("task");
        world.write(&folder, true).expect("written");
        let loaded = Task::load(&folder).unwrap_or_else(|error| panic!("{error}"));
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let task = Arc::new(loaded.task);
        for seed in 1..=2 {
            build(&task, None, Seed::from_u64(seed)).unwrap_or_else(|error| panic!("{error}"));
        }
        let hand = Hand::builtin("softhand").expect("built in");
        let in_the_way = inspect::in_the_way(&hand, std::slice::from_ref(&task));
        assert!(in_the_way.is_empty(), "{}", inspect::join_reasons(&in_the_way));
        Made { world, task, folder, _source: self }
    }
}

/// The task of a world.
struct Made {
    world: ImportedWorld,
    task: Arc<Task>,
    folder: PathBuf,
    _source: Source,
}

impl Made {
    /// An object as the task reads it.
    #[track_caller]
    fn object(&self, name: &str) -> Object {
        let own = self.task.objects.own.iter().find(|own| own.name == name).expect("the object");
        let file = self.folder.join("task.toml");
        own.read(&file, Some(&Files::Folder(self.folder.clone()))).expect("read").0
    }

    /// Where it is in the scene of seed 1.
    #[track_caller]
    fn pose(&self, name: &str) -> Pose {
        let scene = build(&self.task, None, Seed::from_u64(1)).expect("a scene").scene;
        let body = scene.bodies.iter().find(|body| body.name == name).expect("the object");
        let [x, y, z, w] = body.quat_xyzw.expect("a rotation");
        Pose::from_parts(Vec3::from_array(body.position.expect("a place")), Rotation::from_xyzw(x, y, z, w))
    }

    #[track_caller]
    fn has(&self, kind: DecisionKind, element: &str, text: &str) {
        let found = self
            .world
            .decisions
            .iter()
            .any(|d| d.kind == kind && d.element.contains(element) && d.text.contains(text));
        let all: Vec<String> = self.world.decisions.iter().map(ToString::to_string).collect();
        assert!(found, "no {kind:?} about {element} has '{text}':\n{}", all.join("\n"));
    }
}

/// A cube from 0 to 1 along each axis, as Klamp't's own.
fn cube() -> String {
    let corners: String = (0..8).map(|k| format!("{} {} {}\n", k & 1, k >> 1 & 1, k >> 2 & 1)).collect();
    format!("OFF\n8 6 0\n{corners}4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n")
}

const PLANE: &str = "<terrain name='floor' file='plane.env'/>";
const PLANE_FILES: [(&str, &str); 2] = [
    ("plane.env", "mesh \"plane.tri\"\nkFriction 0.7\n"),
    ("plane.tri", "4\n-5 -5 0\n-5 5 0\n5 -5 0\n5 5 0\n2\n0 2 1\n1 2 3\n"),
];

/// An object of 60 x 40 x 20 mm.
fn brick(more: &str, content: &str) -> String {
    format!(
        "<rigidObject name='brick' {more}><geometry mesh='cube.off' scale='0.06 0.04 0.02'/>{content}</rigidObject>"
    )
}

#[track_caller]
fn near(a: Vec3, b: Vec3, within: f64) {
    assert!((a - b).length() <= within, "{a} and {b}");
}

#[test]
fn objects_keep_shape_mass_surface_and_place() {
    let physics =
        "<physics mass='0.3' automass='1' kFriction='0.8' kRestitution='0.1'/><display color='1 0 0'/>";
    let world = format!("{PLANE}{}", brick("position='0.2 0.1 0'", physics));
    let made = Source::new(&world, &PLANE_FILES).task();
    assert!(made.world.problems().next().is_none(), "{:?}", made.world.decisions);
    let (object, pose) = (made.object("brick"), made.pose("brick"));
    assert_eq!((object.mass, object.friction, object.restitution), (0.3, 0.8, 0.1));
    near(object.com, Vec3::new(0.03, 0.02, 0.01), 1e-9);
    // Of a box: m (b² + c²) / 12.
    near(object.inertia.x_axis, Vec3::X * 0.3 * (0.04f64.powi(2) + 0.02f64.powi(2)) / 12.0, 1e-12);
    near(pose.translation, Vec3::new(0.2, 0.1, 0.0), 2e-3);
    assert_eq!((made.task.ground.height, made.task.ground.friction), (0.0, 0.7));
    assert_eq!(made.task.objects.own[0].color, [1.0, 0.0, 0.0]);
}

#[test]
fn rotations_are_about_the_axes_of_the_world_in_klampts_order() {
    // A quarter about x lays the 40 mm upright; then a quarter about z turns x to y.
    for turn in ["rotateX='1.5707963' rotateZ='1.5707963'", "rotateRPY='1.5707963 0 1.5707963'"] {
        let made =
            Source::new(&format!("{PLANE}{}", brick(&format!("position='0 0 0' {turn}"), "")), &PLANE_FILES)
                .task();
        let pose = made.pose("brick");
        near(pose.rotation * Vec3::X, Vec3::Y, 1e-3);
        near(pose.rotation * Vec3::Y, Vec3::Z, 1e-3);
    }
    let made = Source::new(&format!("{PLANE}{}", brick("rotateMoment='0 0 0.5'", "")), &PLANE_FILES).task();
    let pose = made.pose("brick");
    near(pose.rotation * Vec3::X, Vec3::new(0.5f64.cos(), 0.5f64.sin(), 0.0), 1e-3);
}

#[test]
fn a_stated_inertia_and_centre_of_mass_are_kept() {
    let physics =
        "<physics mass='0.3' com='0.03 0.02 0.005' inertia='6e-5 0 1e-6 0 1.1e-4 0 1e-6 0 1.3e-4'/>";
    let made = Source::new(&format!("{PLANE}{}", brick("", physics)), &PLANE_FILES).task();
    let object = made.object("brick");
    near(object.com, Vec3::new(0.03, 0.02, 0.005), 1e-12);
    near(object.inertia.x_axis, Vec3::new(6e-5, 0.0, 1e-6), 1e-15);
    near(object.inertia.z_axis, Vec3::new(1e-6, 0.0, 1.3e-4), 1e-15);
}

#[test]
fn files_of_objects_are_read_and_the_world_overrides_them() {
    let files = [
        PLANE_FILES[0],
        PLANE_FILES[1],
        ("ball.geom", "Primitive\nSphere\n0 0 0  1\n"),
        (
            "ball.obj",
            "mesh \"ball.geom\"\ngeomscale 0.05 0.05 0.05\ngeomtranslate 0 0 0.05\nmass 0.2\nautoMass\nkStiffness 100000\n\
             kFriction 1\nT 1 0 0 0 1 0 0 0 1 0.3 0 0\n",
        ),
    ];
    let ball = |more: &str| format!("{PLANE}<rigidObject file='ball.obj' {more}/>");
    let made = Source::new(&ball(""), &files).task();
    let (own, pose) = (made.object("ball"), made.pose("ball"));
    assert_eq!((own.mass, own.friction), (0.2, 1.0));
    near(own.com, Vec3::Z * 0.05, 1e-12);
    near(pose.translation, Vec3::X * 0.3, 2e-3);
    made.has(DecisionKind::Dropped, "ball.obj", "`kstiffness`");
    let made = Source::new(&ball("position='-0.2 0 0'"), &files).task();
    near(made.pose("ball").translation, Vec3::X * -0.2, 2e-3);
}

#[test]
fn a_mesh_becomes_a_file_of_the_task() {
    // Wavefront's ending is also that of Klamp't's objects.
    let wedge = "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let files = [PLANE_FILES[0], PLANE_FILES[1], ("wedge.obj", wedge)];
    let wedge = |physics: &str| {
        format!(
            "{PLANE}<rigidObject file='wedge.obj'><geometry scale='0.001' translation='0 0 0.02'/>{physics}</rigidObject>"
        )
    };
    let made = Source::new(&wedge("<physics mass='0.4'/>"), &files).task();
    assert!(made.world.files.contains_key(Path::new("meshes/wedge.stl")));
    // A tetrahedron's centre of mass is the mean of its corners; it was put down, from 20 mm above.
    near(made.object("wedge").com, Vec3::new(0.025, 0.025, 0.045), 1e-6);
    near(made.pose("wedge").translation, Vec3::new(0.0, 0.0, -0.02), 2e-3);
    let made = Source::new(&wedge("<physics mass='0.4' com='0.03 0.03 0.03'/>"), &files).task();
    let object = made.object("wedge");
    near(object.com, Vec3::splat(0.03), 1e-12);
    made.has(DecisionKind::Guessed, "rigidObject", "a centre of mass and no inertia");
    assert!(object.inertia.x_axis.x > 1e-4, "{:?}", object.inertia);
}

#[test]
fn surfaces_of_the_simulation_replace_those_of_the_bodies() {
    let simulation = "<simulation><globals gravity='0 0 -9.8' maxContacts='20'/>\
        <rigidObject index='0'><geometry kFriction='0.9' padding='0.001'/></rigidObject>\
        <terrain name='floor'><geometry kFriction='0.2' kRestitution='0.3'/></terrain><object name='none'><geometry/></object></simulation>";
    let made = Source::new(&format!("{PLANE}{}{simulation}", brick("", "")), &PLANE_FILES).task();
    assert_eq!((made.object("brick").friction, made.task.ground.friction), (0.9, 0.2));
    made.has(DecisionKind::Dropped, "globals", "maxContacts");
    made.has(DecisionKind::Dropped, "geometry", "padding");
    made.has(DecisionKind::Dropped, "geometry", "kRestitution: that of the objects");
    made.has(DecisionKind::Problem, "object 'none'", "valid: one of: rigidObject 'brick'");
}

#[test]
fn terrains_of_boxes_are_furniture() {
    // A table top on the ground's level and a shelf above it, of one mesh with two parts.
    let two: String = {
        let corner = |k: i32, low: [f64; 3], high: [f64; 3]| {
            let at = |axis: usize| if k >> axis & 1 == 0 { low[axis] } else { high[axis] };
            format!("{} {} {}\n", at(0), at(1), at(2))
        };
        let low: String = (0..8).map(|k| corner(k, [-0.3, -0.3, 0.0], [0.3, 0.3, 0.4])).collect();
        let high: String = (0..8).map(|k| corner(k, [-0.3, 0.2, 0.7], [0.3, 0.3, 0.72])).collect();
        let faces = |first: i32| -> String {
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
                .map(|face| format!("4 {}\n", face.map(|k| (k + first).to_string()).join(" ")))
                .concat()
        };
        format!("OFF\n16 12 0\n{low}{high}{}{}", faces(0), faces(8))
    };
    let files = [PLANE_FILES[0], PLANE_FILES[1], ("table.off", two.as_str())];
    let table = "<terrain name='table' file='table.off' translation='0.1 0 0'/>";
    let world = format!("{PLANE}{table}{}", brick("position='0.1 0 0.6'", ""));
    let made = Source::new(&world, &files).task();
    let [piece] = made.task.furniture.as_slice() else { panic!("{:?}", made.task.furniture) };
    assert_eq!((piece.name.as_str(), piece.parts.len()), ("table", 2));
    near(Vec3::from_array(piece.parts[0].position), Vec3::new(0.1, 0.0, 0.2), 1e-12);
    near(Vec3::from_array(piece.parts[1].half_extents), Vec3::new(0.3, 0.05, 0.01), 1e-12);
    assert!(
        !made.world.decisions.iter().any(|d| d.text.contains("surfaces;")),
        "the ground is none: {:?}",
        made.world.decisions
    );
    // It began in the air above the table, below the shelf.
    made.has(DecisionKind::Taken, "brick", "begins 0.200 m above");
    near(made.pose("brick").translation, Vec3::new(0.1, 0.0, 0.4), 2e-3);
    let text = String::from_utf8(made.world.files[Path::new("task.toml")].clone()).expect("text");
    assert!(text.contains("position = [0.1, 0, 0.4]\n"), "{text}");
}

#[test]
fn what_a_task_has_no_place_for_is_a_line_each() {
    let slope = "<terrain name='slope' file='cube.off' rotateX='0.3' scale='0.1'/>";
    let others = "<robot name='r' file='r.rob'/><camera/><rigidObject name='gone' file='gone.obj'/>\
        <rigidObject name='vast'><geometry mesh='cube.off' scale='3'/></rigidObject>\
        <rigidObject name='heavy'><geometry mesh='cube.off' scale='0.1'/><physics mass='30'/></rigidObject>\
        <rigidObject name='cloud'><geometry file='c.pcd'/></rigidObject>";
    let simulation =
        "<simulation><globals gravity='0 0 -1.6'/><joint type='hinge'/><state data='x'/></simulation>";
    let mut files = PLANE_FILES.to_vec();
    files.push(("c.pcd", ""));
    let text =
        format!("{PLANE}{slope}{}{others}{simulation}", brick("velocity='1 0 0'", "<physics com='a b c'/>"));
    let made = Source::new(&text, &files).task();
    assert_eq!((made.task.objects.own.len(), made.task.furniture.len()), (1, 0));
    for (kind, element, words) in [
        (DecisionKind::Dropped, "robot 'r'", "palmares hand import"),
        (DecisionKind::Dropped, "camera", "unknown"),
        (DecisionKind::Dropped, "rigidObject 'brick'", "velocity"),
        (DecisionKind::Dropped, "state", "engine"),
        (DecisionKind::Problem, "terrain 'slope'", "no boxes along the axes"),
        (DecisionKind::Problem, "'gone'", "'gone.obj' is not in"),
        (DecisionKind::Problem, "'vast'", "measures 3.000 x 3.000 x 3.000 m"),
        (DecisionKind::Problem, "'heavy'", "weighs 30 kg"),
        (DecisionKind::Problem, "'cloud'", "cloud of points"),
        (DecisionKind::Problem, "physics", "com is 'a b c'; valid: 3 finite numbers"),
        (DecisionKind::Problem, "globals", "gravity is [0.0, 0.0, -1.6]"),
        (DecisionKind::Problem, "joint", "joins bodies"),
    ] {
        made.has(kind, element, words);
    }
    // Every line is a comment in the file.
    let text = String::from_utf8(made.world.files[Path::new("task.toml")].clone()).expect("text");
    for decision in &made.world.decisions {
        assert!(text.contains(&decision.text), "no comment has: {decision}");
    }
}

#[test]
fn a_surface_that_is_no_ground_gets_a_thickness() {
    // A level one of 0.4 m, which is furniture, and one that stands.
    let plate = "4\n0 0 0\n0 0.4 0\n0.4 0 0\n0.4 0.4 0\n2\n0 2 1\n1 2 3\n";
    let files = [PLANE_FILES[0], PLANE_FILES[1], ("plate.tri", plate)];
    let plates = "<terrain name='level' file='plate.tri' position='0 0 0.3'/>\
        <terrain name='wall' file='plate.tri' rotateX='1.57' position='0 1 0'/>";
    let made = Source::new(&format!("{PLANE}{plates}{}", brick("position='0.1 0.1 0.3'", "")), &files).task();
    made.has(DecisionKind::Guessed, "'level'", "1 of its parts are surfaces");
    let [level, wall] = [0, 1].map(|k| made.task.furniture[k].parts[0].clone());
    near(Vec3::from_array(level.position), Vec3::new(0.2, 0.2, 0.295), 1e-12);
    near(Vec3::from_array(wall.half_extents), Vec3::new(0.2, 0.005, 0.2), 1e-3);
    near(Vec3::from_array(wall.position), Vec3::new(0.2, 1.0, 0.2), 1e-3);
    near(made.pose("brick").translation, Vec3::new(0.1, 0.1, 0.3), 2e-3);
}

#[test]
fn limits_of_a_task_are_kept() {
    let many: String = (0..201)
        .map(|k| brick(&format!("position='{} {} 0'", 0.1 * f64::from(k % 15), 0.1 * f64::from(k / 15)), ""))
        .collect();
    let far =
        "<rigidObject name='far' position='0 0 11'><geometry mesh='cube.off' scale='0.1'/></rigidObject>";
    let rough = "<terrain name='rough' file='cube.off' scale='0.1' position='-1 0 0' kFriction='-2'/>";
    let world = Source::new(&format!("{PLANE}{far}{rough}{many}"), &PLANE_FILES).import();
    for (element, words) in [
        ("world", "has 201 objects"),
        ("'far'", "within 10 m"),
        ("'rough'", "kFriction is -2; valid: 0 to 1000"),
    ] {
        let found = world.problems().any(|d| d.element.contains(element) && d.text.contains(words));
        assert!(found, "{words}: {:?}", world.decisions);
    }
    let text = String::from_utf8(world.files[Path::new("task.toml")].clone()).expect("text");
    assert_eq!(text.matches("[[objects.own]]").count(), 200);
    // Names of equal ones differ, and 64 goals are the most.
    assert!(text.contains("name = \"brick_200\"") && text.matches("[[rules.goals]]").count() == 64);
}

#[test]
fn a_world_without_ground_gets_one_below_everything() {
    let made = Source::new(&brick("position='0 0 0.5'", ""), &[]).task();
    made.has(DecisionKind::Guessed, "world", "has no terrain");
    assert_eq!(made.task.ground.height, 0.5);
}

#[test]
fn a_world_without_objects_and_what_is_no_world_are_refused() {
    let refusal = Source::new(PLANE, &PLANE_FILES).refusal();
    assert!(refusal.contains("world.xml") && refusal.contains("has no <rigidObject>"), "{refusal}");
    let refusal = Source::new("<rigidObject name='gone' file='gone.obj'/>", &[]).refusal();
    assert!(refusal.contains("'gone.obj' is not in"), "{refusal}");
    let source = Source::new("", &[]);
    source.write("world.xml", "<robot name='r'/>");
    assert!(source.refusal().contains("root element is <world>"), "{}", source.refusal());
    // A folder with two of them.
    source.write("one.xml", &format!("<world>{}</world>", brick("", "")));
    source.write("two.xml", "<world/>");
    let error = import_world(&source.path(""), None, "mine").expect_err("two").to_string();
    assert!(error.contains("--world chooses one of: one.xml, two.xml"), "{error}");
    assert!(import_world(&source.path(""), Some("one"), "mine").is_ok());
}
