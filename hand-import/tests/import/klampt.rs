//! Klamp't's `.rob`.

use super::*;
use palmares_models::Vec3;

const ROBOT: &str = "\
# two fingers on a base
links base swivel near far  \"wire 1\"
parents -1 0 1 2 0
axis 0 0 1  0 0 1  0 -1 0  0 -1 0  0 0 1
jointtype r r r r r
Tparent 1 0 0  0 1 0  0 0 1  0 0 0 \\
        0 -1 0  1 0 0  0 0 1  0.02 0 0.06 \\
        1 0 0  0 1 0  0 0 1  0.01 0 0.02 \\
        1 0 0  0 1 0  0 0 1  0.06 0 0 \\
        1 0 0  0 1 0  0 0 1  0 0 0
qmin 0 0 -0.34 -3 0
qmaxdeg 0 90 160 170 60
geometry cube.off cube.off \"cube.off\" cube.tri \"\"
geomscale 1 1 1 2 1
geomtransform 3  1 0 0 0.01  0 1 0 0  0 0 1 0.007  0 0 0 1
mass 0.5 0.05 0.03 0.03 0.001
automass
torquemax inf 10 5 5 10
velmax 0 1 2 3 1
joint weld 0
joint normal 1
joint normal 2
joint normal 3
joint normal 4
driver affine 2  1 2  1.5708 -0.7854  0 0.1  0 1  0 1 -10 10
driver normal 3
driver normal 4
servoP 5 2 1
servoI 0 0.1 0
servoD 0.5 0 0
dryFriction 0.1 0 0
viscousFriction 0.5 0.4 0.1
noselfcollision 0 2  far base
property sensors \"sensors.xml\"
";

fn cube() -> (String, String) {
    let points = "0 0 0 0.02 0 0 0 0.02 0 0.02 0.02 0 0 0 0.02 0.02 0 0.02 0 0.02 0.02 0.02 0.02 0.02";
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let off: String = faces.iter().map(|[a, b, c, d]| format!("4 {a} {b} {c} {d}\n")).collect();
    let tri: String = faces.iter().map(|[a, b, c, d]| format!("{a} {b} {c}\n{a} {c} {d}\n")).collect();
    (format!("OFF\n8 6 0\n{points}\n{off}"), format!("8\n{points}\n12\n{tri}"))
}

fn source() -> Source {
    let (off, tri) = cube();
    Source::new(&[("gripper.rob", ROBOT), ("cube.off", &off), ("cube.tri", &tri)])
}

#[test]
fn links_joints_and_drivers_are_read() {
    let imported = source().import("gripper.rob");
    no_problems(&imported);
    has(&imported, DecisionKind::Taken, "`automass`", "from the shapes");
    has(&imported, DecisionKind::Dropped, "`servoI`", "integral");
    has(&imported, DecisionKind::Dropped, "`property sensors`", "Klamp't");
    has(&imported, DecisionKind::Dropped, "wire 1", "no shape");
    has(&imported, DecisionKind::Taken, "driver 0", "in proportion, near");
    let hand = loaded(&imported);
    let joint = |link: &str| {
        let link = hand.links.iter().find(|other| other.name == link).expect("the link");
        link.joint.clone().expect("a joint").hinges[0].clone()
    };
    let swivel = joint("swivel");
    near((swivel.parent_from_hinge.translation - Vec3::new(0.02, 0.0, 0.06)).length(), 0.0);
    // A rotation is given by its rows: x of the link is y of the base.
    near((swivel.parent_from_hinge.rotation * Vec3::X - Vec3::new(0.0, 1.0, 0.0)).length(), 0.0);
    // q = scale x + offset for both links of the affine driver.
    let near_link = joint("near");
    near(near_link.ratio, -0.5);
    near(near_link.offset, 0.1);
    assert_eq!(hand.coordinates.len(), 2);
    assert_eq!(hand.motors.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["swivel", "far"]);
    let swivel = &hand.tendons[0];
    // Klamp't applies the driver's torque times its scale to each joint, and no joint has more than its own torque:
    // 10 N·m here and 5 at half the ratio.
    near(swivel.stiffness, 5.0 * 1.25);
    near(swivel.force_limit, 12.5);
    // With the gram of the wire, which moves no shape and is fixed.
    near(hand.links.iter().map(|link| link.inertia.mass).sum(), 0.611);
    near(hand.coordinates[0].damping, 0.5 * 1.25);
}

#[test]
fn a_base_that_moves_is_on_a_link_of_its_own() {
    let (off, _) = cube();
    let robot = |more: &str| {
        format!(
            "links one two\nparents -1 0\naxis 0 0 1 0 1 0\ntparent 1 0 0 0 1 0 0 0 1 0 0 0 1 0 0 0 1 0 0 0 1 0 0 0.1\n\
             qmin -1 -1\nqmax 1 1\ngeometry cube.off cube.off\ngeomscale 0.5\nmass 0.1 0.1\nautomass\n{more}"
        )
    };
    let import = |more: &str| {
        let source = Source::new(&[("two.rob", &robot(more)), ("cube.off", &off)]);
        let imported = source.import("two.rob");
        no_problems(&imported);
        let hand = loaded(&imported);
        (imported, hand)
    };
    // Without `joint` lines every link moves, and has a driver.
    let (imported, hand) = import("drivers turn bend\nservoP 3 4\n");
    assert_eq!(hand.coordinates.len(), 2);
    assert_eq!(hand.motors.iter().map(|motor| motor.name.as_str()).collect::<Vec<_>>(), ["turn", "bend"]);
    near(hand.tendons[1].stiffness, 4.0);
    has(&imported, DecisionKind::Guessed, "robot", "states no inertia for 2 links");
    // One size counts for all shapes.
    let text = String::from_utf8(imported.files[Path::new("hand.urdf")].clone()).expect("text");
    assert_eq!(text.matches("scale=\"0.5 0.5 0.5\"").count(), 4, "{text}");
    let (_, hand) = import("joint weld 0\njoint normal 1\n");
    assert_eq!(hand.coordinates.len(), 1);
}

#[test]
fn what_klampt_states_and_a_hand_has_not_is_named() {
    let source = source();
    let more = "accmax 1 1 1 1 1\nq 0 0.1 0 0 0\ngeommargin 0\nnocollision base\ndriver rotation 0 1\ndriver custom 1\n\
                noselfcollision 0 9\n";
    source.write("gripper.rob", format!("{ROBOT}{more}").as_bytes());
    let imported = source.import("gripper.rob");
    for (element, text) in [("`accmax`", "force"), ("`q`", "[start]"), ("`nocollision`", "world")] {
        has(&imported, DecisionKind::Dropped, element, text);
    }
    has(&imported, DecisionKind::Dropped, "driver 3", "base");
    has(&imported, DecisionKind::Problem, "driver 4", "valid: normal");
    has(&imported, DecisionKind::Problem, "`noselfcollision`", "'0 9'");
    assert!(imported.decisions.iter().all(|decision| decision.element != "`geommargin`"));
}

#[test]
fn pairs_that_touch_are_those_of_selfcollision() {
    let source = source();
    source.write("gripper.rob", format!("{ROBOT}selfcollision 0 3\n").as_bytes());
    let imported = source.import("gripper.rob");
    has(&imported, DecisionKind::Taken, "`selfcollision`", "only 1 pairs");
    let hand = loaded(&imported);
    let pair = |a: &str, b: &str| {
        let index = |name: &str| hand.links.iter().position(|link| link.name == name).expect("is there");
        let (a, b) = (index(a), index(b));
        hand.no_collision.contains(&[a.min(b), a.max(b)])
    };
    assert!(pair("swivel", "far") && pair("base", "swivel"));
}

#[test]
fn a_mounted_shape_is_one_of_its_link() {
    let source = source();
    // Turned by 90° about z: rows of the rotation, then the place.
    let mount = "mount 3 \"cube.off\" 0 -1 0 1 0 0 0 0 1 0.1 0 0\n";
    source.write("gripper.rob", format!("{ROBOT}{mount}").as_bytes());
    let imported = source.import("gripper.rob");
    no_problems(&imported);
    let text = String::from_utf8(imported.files[Path::new("hand.urdf")].clone()).expect("text");
    let far =
        text.split("<link name=\"far\">").nth(1).and_then(|rest| rest.split("</link>").next()).expect("far");
    assert_eq!(far.matches("<collision>").count(), 2, "{far}");
    assert!(far.contains("xyz=\"0.1 0 0\"") && far.contains(" 1.57079632679489"), "{far}");
}

#[test]
fn a_mounted_robot_is_fixed_to_its_link() {
    let source = source();
    source.write("finger.urdf", finger("").as_bytes());
    let mount = format!("{ROBOT}mount 0 \"finger.urdf\" 1 0 0 0 1 0 0 0 1 0 0 0.1 as \"thumb\"\n");
    source.write("gripper.rob", mount.as_bytes());
    let imported = source.import("gripper.rob");
    has(&imported, DecisionKind::Taken, "`mount", "fixed to the link");
    assert!(imported.decisions.iter().all(|decision| !decision.text.contains("not there")));
    let hand = loaded(&imported);
    assert!(hand.links.iter().any(|link| link.name == "thumb:proximal"));
}

#[test]
fn the_only_robot_of_a_world_is_read_and_of_several_one_is_to_be_named() {
    let source = source();
    let robot = source.import("gripper.rob");
    let world = |more: &str| {
        format!("<world><robot name='r' file='gripper.rob'/><rigidObject file='o.obj'/>{more}</world>")
    };
    source.write("world.xml", world("").as_bytes());
    assert_eq!(source.import("world.xml").files, robot.files);
    source.write("world.xml", world("<robot file='other.rob'/>").as_bytes());
    let refusal = source.refusal("world.xml");
    assert!(
        refusal.contains("2 robots (gripper.rob, other.rob)") && refusal.contains("name the file of one"),
        "{refusal}"
    );
}
