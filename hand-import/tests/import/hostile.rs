//! A source can come from a stranger: nothing outside it is read, and no file makes the import fail badly.

use super::*;

#[test]
fn no_path_leaves_the_source() {
    let outside = tempfile::tempdir().expect("a folder");
    let secret = outside.path().join("secret.stl");
    fs::write(&secret, super::urdf::cube_stl(0.02)).expect("written");
    let up = "../".repeat(20) + &secret.display().to_string()[1..];
    for name in [
        secret.display().to_string(),
        up,
        format!("file://{}", secret.display()),
        "package://../secret.stl".to_owned(),
    ] {
        let text = finger("").replace("<box size='0.02 0.02 0.04'/>", &format!("<mesh filename='{name}'/>"));
        let source = Source::new(&[("claw.urdf", &text)]);
        let imported = source.import("claw.urdf");
        has(&imported, DecisionKind::Problem, "link 'palm'", "is not in");
        assert!(imported.files.keys().all(|file| !file.starts_with("meshes")), "{name}");
    }
}

#[cfg(unix)]
#[test]
fn a_link_that_leads_out_is_not_followed() {
    let outside = tempfile::tempdir().expect("a folder");
    fs::write(outside.path().join("secret.stl"), super::urdf::cube_stl(0.02)).expect("written");
    let text = finger("").replace("<box size='0.02 0.02 0.04'/>", "<mesh filename='part.stl'/>");
    let source = Source::new(&[("claw.urdf", &text)]);
    std::os::unix::fs::symlink(outside.path().join("secret.stl"), source.path("part.stl")).expect("linked");
    has(&source.import("claw.urdf"), DecisionKind::Problem, "link 'palm'", "lies outside the folder");
}

#[test]
fn garbage_is_refused_or_a_problem() {
    let robots = [finger(""), "<robot type='Hand'><palm>p</palm></robot>".to_owned()];
    let klampt =
        "links a b\nparents -1 7\naxis 0 0\ndriver affine 9 1 2\nmount 0 x.rob\njoint weld z\nmass 1 x\n";
    for text in robots.iter().map(String::as_str).chain([klampt, "<mujoco>", "links a\naxis\nparents"]) {
        // Cut and doubled anywhere: no panic.
        for k in (0..text.len()).step_by(61) {
            let cut = String::from_utf8_lossy(&text.as_bytes()[..k]).into_owned();
            let doubled = format!("{cut}{cut}{}", String::from_utf8_lossy(&text.as_bytes()[k..]));
            for changed in [cut, doubled] {
                let source = Source::new(&[("claw.xml", &changed)]);
                if let Ok(imported) = import(&source.path("claw.xml"), &ImportOptions::default()) {
                    every_decision_is_a_comment(&imported);
                }
            }
        }
    }
}

#[test]
fn a_robot_of_very_many_links_is_refused_at_once() {
    let links: String = (0..6000).map(|k| format!("<link name='l{k}'/>")).collect();
    let joint = |k: usize| {
        let parent = k / 2;
        format!(
            "<joint name='j{k}' type='fixed'><parent link='l{parent}'/><child link='l{0}'/></joint>",
            k + 1
        )
    };
    let joints: String = (0..5999).map(joint).collect();
    let source = Source::new(&[("claw.urdf", &format!("<robot name='r'>{links}{joints}</robot>"))]);
    let refusal = source.refusal("claw.urdf");
    assert!(refusal.contains("6000 links and 5999 joints") && refusal.contains("--root"), "{refusal}");
    let options = ImportOptions { root: Some("l5000".to_owned()), ..ImportOptions::default() };
    has(&source.import_with("claw.urdf", &options), DecisionKind::Taken, "robot", "1 of 6000 links");
}
