//! Every error about a description names file, element and valid values.

use std::path::Path;

use crate::error::ModelError;
use crate::hand::{Hand, Pad, PadOn};
use crate::read::{self, InertiaPolicy, Limits, LoadOptions, Loaded};

use super::softhand;

const LINK: &str = r#"<inertial><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision>"#;
const LIMIT: &str = r#"<axis xyz="0 1 0"/><limit lower="0" upper="1" effort="1" velocity="1"/>"#;

/// A base and two links in a row; `a` is the first joint's body, `b` the second's, `more` goes after.
fn urdf(a: &str, b: &str, more: &str) -> String {
    format!(
        r#"<robot name="r"><link name="base">{LINK}</link><link name="one">{LINK}</link><link name="two">{LINK}</link>
        <joint name="a" type="revolute"><parent link="base"/><child link="one"/>{a}</joint>
        <joint name="b" type="revolute"><parent link="one"/><child link="two"/>{b}</joint>{more}</robot>"#
    )
}

fn transmission(joints: &str) -> String {
    format!(
        r#"<transmission name="t"><type>transmission_interface/AdaptiveSynergyTransmission</type>
        {joints}<actuator name="m"/></transmission>"#
    )
}

fn read(urdf: &str, settings: Option<&str>) -> Result<Loaded, ModelError> {
    let settings = settings.map(|s| (Path::new("x/hand.toml"), s));
    read::from_text((Path::new("x/hand.urdf"), urdf), settings, None, &LoadOptions::default())
}

#[track_caller]
fn fails(urdf: &str, settings: Option<&str>, parts: &[&str]) {
    let message = read(urdf, settings).unwrap_err().to_string();
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
}

#[test]
fn the_plain_case_loads() {
    let text = urdf(LIMIT, LIMIT, &transmission(r#"<joint name="a"/>"#));
    let Loaded { hand, warnings, .. } = read(&text, None).unwrap();
    assert_eq!((hand.links.len(), hand.coordinates.len(), hand.tendons.len()), (3, 2, 1));
    assert_eq!(warnings.iter().filter(|w| w.message.contains("no [")).count(), 2, "{warnings:?}");
}

#[test]
fn files_that_are_not_there_too_large_or_not_text() {
    let missing = read::hand(Path::new("/no/such/hand.urdf"), &LoadOptions::default()).unwrap_err();
    assert!(
        matches!(&missing, ModelError::Read { .. }) && missing.to_string().contains("/no/such/hand.urdf")
    );
    assert!(std::error::Error::source(&missing).is_none(), "a chain of errors would name the reason twice");

    let ours = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/hands/softhand/hand.urdf"));
    let with = |limits: Limits| read::hand(ours, &LoadOptions { limits, ..LoadOptions::default() });
    let default = Limits::default;
    for (limits, what) in [
        (Limits { text_bytes: 1000, ..default() }, "bytes"),
        (Limits { links: 10, ..default() }, "links"),
        (Limits { depth: 5, ..default() }, "links in one chain"),
        (Limits { xml_depth: 3, ..default() }, "nested XML elements"),
        (Limits { xml_nodes: 100, ..default() }, "XML nodes and more"),
    ] {
        let error = with(limits).unwrap_err();
        assert!(matches!(&error, ModelError::TooLarge { what: w, .. } if *w == what), "{error}");
    }

    fails("<robot", None, &["x/hand.urdf", "not valid XML"]);
    fails("<sdf/>", None, &["not <robot>"]);
    fails("<robot name='r'><link/></robot>", None, &["not valid URDF"]);
    let deep = format!("<robot name='r'>{}{}</robot>", "<a>".repeat(50_000), "</a>".repeat(50_000));
    fails(&deep, None, &["nested XML elements"]);
    let entities = "<!DOCTYPE r [<!ENTITY a 'b'>]><robot name='r'/>";
    fails(entities, None, &["not valid XML"]);
}

#[test]
fn trees_that_are_none() {
    fails("<robot name='r'/>", None, &["0 links are no joint's child"]);
    let twice = format!("<link name=\"one\">{LINK}</link>");
    fails(&urdf(LIMIT, LIMIT, &twice), None, &["link 'one'", "appears twice"]);
    let orphan = format!("<link name=\"three\">{LINK}</link>");
    fails(&urdf(LIMIT, LIMIT, &orphan), None, &["\"three\"", "exactly one root"]);
    let third = |p: &str, c: &str, name: &str| {
        format!(r#"<joint name="{name}" type="fixed"><parent link="{p}"/><child link="{c}"/></joint>"#)
    };
    fails(&urdf(LIMIT, LIMIT, &third("base", "two", "c")), None, &["link 'two'", "child of two joints"]);
    fails(&urdf(LIMIT, LIMIT, &third("two", "base", "c")), None, &["0 links are no joint's child"]);
    fails(&urdf(LIMIT, LIMIT, &third("two", "elsewhere", "c")), None, &["joint 'c'", "link 'elsewhere'"]);
    let separate_loop =
        format!("<link name='x'/><link name='y'/>{}{}", third("x", "y", "c"), third("y", "x", "d"));
    fails(&urdf(LIMIT, LIMIT, &separate_loop), None, &["2 links form a loop"]);
    fails(&urdf(LIMIT, LIMIT, &third("two", "one", "a")), None, &["joint 'a'", "appears twice"]);
}

#[test]
fn joints_that_cannot_be_meant() {
    let floating = urdf(LIMIT, LIMIT, "").replacen("revolute", "floating", 1);
    fails(&floating, None, &["joint 'a'", "Floating", "fixed, revolute, continuous or prismatic"]);
    let no_axis = r#"<axis xyz="0 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/>"#;
    fails(&urdf(no_axis, LIMIT, ""), None, &["joint 'a'", "axis 0 0 0"]);
    let swapped = r#"<limit lower="1" upper="0" effort="1" velocity="1"/>"#;
    fails(&urdf(swapped, LIMIT, ""), None, &["joint 'a'", "limits 1 to 0", "lower < upper"]);
    fails(&urdf("", LIMIT, ""), None, &["joint 'a'", "limits 0 to 0"]);
    let infinite = r#"<origin xyz="inf 0 0"/>"#;
    fails(&urdf(&format!("{infinite}{LIMIT}"), LIMIT, ""), None, &["joint 'a'", "finite"]);
    let limp = format!(r#"{LIMIT}<dynamics damping="-1"/>"#);
    fails(&urdf(&limp, LIMIT, ""), None, &["joint 'a'", "damping -1"]);
    let heavy = urdf(LIMIT, LIMIT, "").replacen("0.1", "-0.1", 1);
    fails(&heavy, None, &["link 'base'", "negative mass"]);
    let weightless = urdf(LIMIT, LIMIT, "").replacen("\"0.1\"", "\"1\"", 1).replace("\"0.1\"", "\"0\"");
    fails(&weightless, None, &["x/hand.urdf: link 'one'", "moves but has no mass"]);
    let base = urdf(LIMIT, LIMIT, "").replacen("\"0.1\"", "\"0\"", 1);
    fails(&base, None, &["x/hand.urdf", "link 'base'", "no mass"]);
    let flat = urdf(LIMIT, LIMIT, "").replacen("0.05", "0", 1);
    fails(&flat, None, &["link 'base'", "not positive"]);
}

#[test]
fn mimics_that_lead_nowhere() {
    let mimic = |of: &str, c: &str| format!(r#"{LIMIT}<mimic joint="{of}" multiplier="{c}"/>"#);
    fails(&urdf(LIMIT, &mimic("none", "1"), ""), None, &["joint 'b'", "mimics 'none'"]);
    fails(&urdf(LIMIT, &mimic("b", "1"), ""), None, &["joint 'b'", "another, moving joint"]);
    let still = mimic("a", "0");
    let moved = still.replace("multiplier", "offset=\"0.1\" multiplier");
    fails(&urdf(LIMIT, &moved, ""), None, &["joint 'b'", "multiplier 0"]);
    // One that never moves is fixed.
    let Loaded { hand, warnings, .. } = read(&urdf(LIMIT, &still, ""), None).unwrap();
    assert_eq!((hand.links.len(), hand.coordinates.len()), (2, 1));
    assert!(warnings.iter().any(|w| w.to_string().contains("joint 'b': mimics 'a' with multiplier 0")));
    fails(&urdf(&mimic("b", "1"), &mimic("a", "1"), ""), None, &["circle"]);
}

#[test]
fn mimics_are_folded_with_ratio_offset_limits_and_damping() {
    let a = r#"<axis xyz="0 1 0"/><limit lower="-1" upper="3" effort="1" velocity="1"/><dynamics damping="0.1"/>"#;
    let b = r#"<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/><dynamics damping="0.1"/>
        <mimic joint="a" multiplier="-0.5" offset="0.25"/>"#;
    let hand = read(&urdf(a, b, ""), None).unwrap().hand;
    assert_eq!(hand.coordinates.len(), 1);
    let joint = hand.links[2].joint.as_ref().unwrap();
    assert_eq!((joint.coordinate, joint.hinges[0].ratio, joint.hinges[0].offset), (0, -0.5, 0.25));
    let c = &hand.coordinates[0];
    // -1 <= 0.25 - q/2 <= 1 is -1.5 <= q <= 2.5.
    assert_eq!((c.lower, c.upper), (-1.0, 2.5));
    assert!((c.damping - (0.1 + 0.25 * 0.1)).abs() < 1e-15);
}

#[test]
fn transmissions_that_name_what_is_not_there() {
    let t = |joints: &str| urdf(LIMIT, LIMIT, &transmission(joints));
    fails(&t(""), None, &["transmission 't'", "lists no joints"]);
    fails(&t(r#"<joint name="z"/>"#), None, &["transmission 't'", "names joint 'z'"]);
    fails(&t(r#"<joint name="a"/><joint name="a"/>"#), None, &["'a' twice"]);
    let strange = r#"<joint name="a"><mechanicalReduction>much</mechanicalReduction></joint>"#;
    fails(&t(strange), None, &["joint 'a'", "<mechanicalReduction> is 'much'", "finite number"]);
    let unknown = urdf(LIMIT, LIMIT, "<transmission name='s'><type>SimpleTransmission</type></transmission>");
    assert!(read(&unknown, None).unwrap().warnings.iter().any(|w| w.message.contains("SimpleTransmission")));
}

#[test]
fn settings_that_fit_nothing() {
    let good = urdf(LIMIT, LIMIT, &transmission(r#"<joint name="a"/>"#));
    fails(&good, Some("= 1"), &["x/hand.toml", "not valid TOML"]);
    fails(&good, Some("colour = 'red'"), &["x/hand.toml", "unknown field", "colour"]);
    fails(&good, Some("[coordinates.z]\ndamping = 1"), &["[coordinates.z]", "one of: a, b"]);
    fails(&good, Some("[links.z]\nmass = 1"), &["[links.z]", "one of: base, one, two"]);
    fails(&good, Some("[motors.z]\nscaling = 1\nspeed_limit = 1"), &["[motors.z]", "one of: m"]);
    fails(
        &good,
        Some("[motors.m]\nscaling = 0\nspeed_limit = 1"),
        &["x/hand.toml: [motors.m]: has scaling 0", "other than 0"],
    );
    let slack = "[tendons.t]\nstiffness = -1\nforce_limit = 1";
    fails(&good, Some(slack), &["x/hand.toml: [tendons.t]: has stiffness -1", "more than 0"]);
    fails(
        &good,
        Some("[coordinates.a]\nstiffness = -1"),
        &["x/hand.toml: [coordinates.a]: has stiffness -1", "at least 0"],
    );
    fails(&good, Some("[links.one]\nmass = nan"), &["x/hand.toml", "[links.one]", "mass NaN"]);
    fails(&good, Some("friction = -1"), &["x/hand.toml: settings: has friction -1", "at least 0"]);
    for name in ["", "a b", "<b>", "../x", "é"] {
        fails(&good, Some(&format!("name = '{name}'")), &["x/hand.toml: name of the hand", "letters"]);
    }
    let unnamed = good.replacen("name=\"r\"", "name=\"a/b\"", 1);
    fails(&unnamed, None, &["x/hand.urdf: name of the hand", "'a/b'"]);
    read(&unnamed, Some("name = 'mine'")).unwrap();
}

#[test]
fn meshes_stay_in_their_folder() {
    let with = |name: &str| {
        urdf(LIMIT, LIMIT, "").replacen(
            "<sphere radius=\"0.05\"/>",
            &format!("<mesh filename=\"{name}\"/>"),
            1,
        )
    };
    fails(&with("a.stl"), None, &["link 'base'", "has no folder"]);
    let folder = std::env::temp_dir().join(format!("palmares-models-meshes-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("hand.urdf");
    let load = |name: &str| {
        std::fs::write(&file, with(name)).unwrap();
        read::hand(&file, &LoadOptions::default()).unwrap_err().to_string()
    };
    for outside in ["../a.stl", "/etc/a.stl", "file:///etc/a.stl", "package://p/../../a.stl", "a.dae"] {
        let message = load(outside);
        assert!(message.contains("in the folder of the file that names it, or under it"), "{message}");
    }
    assert!(load("package://p/a.stl").contains("a.stl"));
    std::fs::write(folder.join("a.stl"), "not a mesh").unwrap();
    assert!(load("package://p/a.stl").contains("not valid STL"));
    std::fs::write(folder.join("a.stl"), [0_u8; 84]).unwrap();
    assert!(load("a.stl").contains("spans no volume"));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn hands_that_contradict_themselves() {
    #[track_caller]
    fn broken(change: impl FnOnce(&mut Hand), part: &str) {
        let mut hand = softhand::load_with(InertiaPolicy::FromFile).hand;
        change(&mut hand);
        let message = hand.validate().unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    broken(|h| h.links[3].parent = Some(7), "stands before it");
    broken(|h| h.links[3].name = "base".to_owned(), "appears twice");
    broken(|h| h.links.clear(), "");
    broken(|h| h.links[1].inertia.mass = 0.0, "no mass");
    broken(|h| h.links[1].geoms[0].friction = f64::NAN, "friction");
    let soft = |link, modulus| PadOn { link, geom: 0, pad: Pad { thickness: None, modulus } };
    broken(|h| h.pads.push(soft(1000, 1e6)), "shape 0 of link 1000 is not there");
    broken(|h| h.pads.push(soft(1, f64::NAN)), "modulus is not more than 0");
    broken(|h| h.coordinates[0].lower = 9.0, "limits");
    broken(
        |h| {
            (h.motors[0].stall_force, h.motors[0].power_limit) = (None, None);
            h.tendons[0].motors[0].0 = 1;
        },
        "names motor 1",
    );
    broken(|h| h.tendons[0].moment_arms.swap(0, 1), "ascending");
    broken(|h| h.motors[0].speed_limit = 0.0, "speed limit");
    broken(|h| h.no_collision.push([5, 2]), "no_collision");
}
