//! Arms with hands: the import says that `--root` reads the hand alone.

use super::*;

/// An arm of so many joints with a flange, and on it a palm with two fingers of two joints.
fn robot(joints: usize, fingers: usize) -> String {
    let link = |name: &str| {
        format!(
            "<link name='{name}'><inertial><mass value='0.1'/><inertia ixx='1e-4' iyy='1e-4' izz='1e-4' ixy='0' ixz='0' iyz='0'/></inertial>\
             <collision><geometry><box size='0.02 0.02 0.04'/></geometry></collision></link>"
        )
    };
    let joint = |kind: &str, parent: &str, child: &str, xyz: &str| {
        format!(
            "<joint name='to_{child}' type='{kind}'><parent link='{parent}'/><child link='{child}'/><origin xyz='{xyz}'/><axis xyz='1 0 0'/>\
             <limit lower='-0.5' upper='1' effort='1' velocity='1'/></joint>"
        )
    };
    let mut text = link("base");
    let mut last = "base".to_owned();
    for k in 1..=joints {
        let name = format!("arm_{k}");
        text += &(link(&name) + &joint("revolute", &last, &name, "0 0 0.05"));
        last = name;
    }
    text += &(link("flange") + &joint("fixed", &last, "flange", "0 0 0.02"));
    text += &(link("palm") + &joint("fixed", "flange", "palm", "0 0 0.02"));
    // A fixed part beside the fingers is no way to them.
    text += &(link("camera") + &joint("fixed", "palm", "camera", "0 0.05 0"));
    for k in 0..fingers {
        let (near, far) = (format!("near_{k}"), format!("far_{k}"));
        text += &(link(&near) + &joint("revolute", "palm", &near, &format!("0.0{k} 0 0.04")));
        text += &(link(&far) + &joint("revolute", &near, &far, "0 0 0.05"));
    }
    format!("<robot name='whole'>{text}</robot>")
}

fn hints(imported: &Imported) -> Vec<String> {
    let hints = imported.decisions.iter().filter(|decision| decision.text.contains("--root"));
    hints.map(|decision| decision.text.clone()).collect()
}

#[test]
fn an_arm_with_a_hand_names_the_link_of_the_hand() {
    let source = Source::new(&[("robot.urdf", &robot(6, 2))]);
    let imported = source.import("robot.urdf");
    let [hint] = hints(&imported).try_into().expect("one line");
    assert!(hint.starts_with("6 joints in a row lead to link 'palm'"), "{hint}");
    assert!(hint.contains("--root palm reads only the hand"), "{hint}");
    assert!(imported.decisions[0].text == hint, "it comes first");
    // What it says is so.
    let options = ImportOptions { root: Some("palm".to_owned()), ..ImportOptions::default() };
    let hand = source.import_with("robot.urdf", &options);
    assert_eq!(loaded(&hand).coordinates.len(), 4);
    assert!(!hints(&hand).iter().any(|text| text.contains("in a row")));
}

#[test]
fn each_arm_of_a_robot_has_its_hand() {
    let one = robot(5, 2);
    let inside = one.split_once('>').expect("a root").1.trim_end_matches("</robot>");
    let other = inside.replace("name='", "name='b_").replace("link='", "link='b_");
    let torso = "<joint name='torso' type='fixed'><parent link='base'/><child link='b_base'/></joint>";
    let text = format!("<robot name='both'>{inside}{other}{torso}</robot>");
    let imported = Source::new(&[("robot.urdf", &text)]).import("robot.urdf");
    let [hint] = hints(&imported).try_into().expect("one line");
    assert!(hint.contains("'palm'") && hint.contains("also: b_palm"), "{hint}");
}

#[test]
fn a_wrist_and_a_finger_are_no_arm() {
    for (joints, fingers) in [(0, 2), (3, 3), (8, 1), (8, 0)] {
        let imported = Source::new(&[("robot.urdf", &robot(joints, fingers))]).import("robot.urdf");
        assert_eq!(hints(&imported), Vec::<String>::new(), "{joints} joints, {fingers} fingers");
    }
}

#[test]
fn joints_that_follow_are_none_of_an_arm() {
    let whole = robot(4, 2);
    let followed = |k: usize| {
        let mimic = format!("<mimic joint='to_arm_{}'/>", k - 1);
        let (before, after) = whole.split_once(&format!("<joint name='to_arm_{k}'")).expect("the joint");
        format!(
            "{before}<joint name='to_arm_{k}'{}",
            after.replacen("</joint>", &format!("{mimic}</joint>"), 1)
        )
    };
    assert_eq!(hints(&Source::new(&[("robot.urdf", &whole)]).import("robot.urdf")).len(), 1);
    assert_eq!(hints(&Source::new(&[("robot.urdf", &followed(3))]).import("robot.urdf")).len(), 0);
}
