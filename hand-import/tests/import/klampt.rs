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
    has(&imported, Kind::Taken, "`automass`", "from the shapes");
    has(&imported, Kind::Dropped, "`servoI`", "integral");
    has(&imported, Kind::Dropped, "`property sensors`", "Klamp't");
    has(&imported, Kind::Dropped, "wire 1", "no shape");
    has(&imported, Kind::Taken, "driver 0", "in proportion, near");
    let hand = loaded(&imported);
    let joint = |link: &str| {
        let link = hand.links.iter().find(|other| other.name == link).expect("the link");
        link.joint.clone().expect("a joint").hinges[0].clone()
    };
    let swivel = joint("swivel");
    near((swivel.parent_from_hinge.translation - Vec3::new(0.02, 0.0, 0.06)).length(), 0.0);
    // A rotation is given by its columns: x of the link is -y of the base.
    near((swivel.parent_from_hinge.rotation * Vec3::X - Vec3::new(0.0, -1.0, 0.0)).length(), 0.0);
    // q = scale x + offset for both links of the affine driver.
    let near_link = joint("near");
    near(near_link.ratio, -0.5);
    near(near_link.offset, 0.1);
    assert_eq!(hand.coordinates.len(), 2);
    assert_eq!(hand.motors.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["swivel", "far"]);
    let swivel = &hand.tendons[0];
    near(swivel.stiffness, 5.0);
    near(swivel.force_limit, 10.0);
    // With the gram of the wire, which moves no shape and is fixed.
    near(hand.links.iter().map(|link| link.inertia.mass).sum(), 0.611);
    near(hand.coordinates[0].damping, 0.5);
}

#[test]
fn a_mounted_robot_is_fixed_to_its_link() {
    let source = source();
    source.write("finger.urdf", finger("").as_bytes());
    let mount = format!("{ROBOT}mount 0 \"finger.urdf\" 1 0 0 0 1 0 0 0 1 0 0 0.1 as \"thumb\"\n");
    source.write("gripper.rob", mount.as_bytes());
    let imported = source.import("gripper.rob");
    has(&imported, Kind::Taken, "`mount", "fixed to the link");
    assert!(imported.decisions.iter().all(|decision| !decision.text.contains("not there")));
    let hand = loaded(&imported);
    assert!(hand.links.iter().any(|link| link.name == "thumb:proximal"));
}
