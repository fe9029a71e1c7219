//! Klamp't's hands of fingers, whose tendons are in a program beside the `.rob`: the lines that make them.

use std::f64::consts::{FRAC_PI_2, PI};

use super::*;

/// A link: its name, its parent, the axis of its joint, its place in the parent, the range of its joint. A base or a joint without a range
/// is fixed.
type Row = (&'static str, i32, &'static str, &'static str, Option<[f64; 2]>);

/// A `.rob` of these links, each a small box.
fn rob(links: &[Row], drivers: &str) -> Source {
    let column = |of: &dyn Fn(&Row) -> String| links.iter().map(of).collect::<Vec<_>>().join("  ");
    let range = |k: usize| column(&|row: &Row| row.4.unwrap_or_default()[k].to_string());
    let joints: String = links
        .iter()
        .enumerate()
        .map(|(i, row)| format!("joint {} {i}\n", if row.4.is_some() { "normal" } else { "weld" }))
        .collect();
    let text = format!(
        "links {}\nparents {}\naxis {}\nTparent {}\nqmin {}\nqmax {}\ngeometry {}\nmass {}\nautomass\ntorquemax {}\nvelmax {}\n{joints}{drivers}",
        column(&|row| row.0.to_owned()),
        column(&|row| row.1.to_string()),
        column(&|row| row.2.to_owned()),
        column(&|row| format!("1 0 0 0 1 0 0 0 1 {}", row.3)),
        range(0),
        range(1),
        column(&|row| if row.0.starts_with("wire") { "\"\"" } else { "box.off" }.to_owned()),
        column(&|_| "0.03".to_owned()),
        column(&|row| if row.0 == "proximal_3" { "20" } else { "10" }.to_owned()),
        column(&|_| "1".to_owned()),
    );
    let corners: String = (0..8)
        .map(|k| {
            let [x, y, z] = [0, 1, 2].map(|axis| 0.008 * f64::from(k >> axis & 1));
            format!("{x} {y} {z}\n")
        })
        .collect();
    let faces = "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n";
    Source::new(&[("hand.rob", &text), ("box.off", &format!("OFF\n8 6 0\n{corners}{faces}"))])
}

const PROXIMAL: Option<[f64; 2]> = Some([-0.34, 2.83]);
const DISTAL: Option<[f64; 2]> = Some([-PI, PI]);

/// Names, tree, axes and ranges of the ReFlex in the challenge of 2016.
const REFLEX: [Row; 12] = [
    ("base", -1, "0 0 1", "0 0 0", None),
    ("swivel_1", 0, "0 0 -1", "0.0504 -0.026 0.063", Some([0.0, FRAC_PI_2])),
    ("proximal_1", 1, "0 -1 0", "0.01 0 0.0186", PROXIMAL),
    ("distal_1", 2, "0 -1 0", "0.066 0 -0.005", DISTAL),
    ("distal_pad_1", 3, "0 0 1", "0.01 0 0.009", None),
    ("swivel_2", 0, "0 0 -1", "0.0504 0.026 0.063", Some([-FRAC_PI_2, 0.0])),
    ("proximal_2", 5, "0 -1 0", "0.01 0 0.0186", PROXIMAL),
    ("distal_2", 6, "0 -1 0", "0.066 0 -0.005", DISTAL),
    ("proximal_3", 0, "0 1 0", "-0.03 0 0.0816", PROXIMAL),
    ("distal_3", 8, "0 1 0", "-0.066 0 -0.005", DISTAL),
    ("wire_1", 0, "0 0 1", "0 0 0", Some([0.0, 1.0])),
    ("wire_2", 0, "0 0 1", "0 0 0", Some([0.0, 1.0])),
];

const REFLEX_DRIVERS: &str = "driver affine 2  1 5  1.5708 -1.5708  0 0  0 1  0 1  -10 10\ndriver normal 2\ndriver normal 3\n\
    driver normal 6\ndriver normal 7\ndriver normal 8\ndriver normal 9\ndriver normal 10\ndriver normal 11\n\
    servoP 5 5 2 5 2 5 2 25 25\nservoD 0.5 0 0 0 0 0 0 2 2\nviscousFriction 0.5 0.5 0.5 0.5 0.5 0.5 0.5 0.1 0.1\n";

/// A palm with two fingers of three joints.
const CLAW: [Row; 7] = [
    ("palm", -1, "0 0 1", "0 0 0", None),
    ("a1", 0, "0 1 0", "0.03 0 0.02", Some([0.0, 1.5])),
    ("a2", 1, "0 1 0", "0 0 0.03", Some([0.0, 1.2])),
    ("a3", 2, "0 1 0", "0 0 0.02", Some([0.1, 1.0])),
    ("b1", 0, "0 1 0", "-0.03 0 0.02", Some([-1.5, 0.1])),
    ("b2", 4, "0 1 0", "0 0 0.03", Some([-1.2, 0.0])),
    ("b3", 5, "0 1 0", "0 0 0.02", Some([-1.0, 0.0])),
];

/// The hand of the written files after the lines have replaced the servos of the fingers, which have this number of tables.
#[track_caller]
fn with_the_lines(imported: &Imported, tables: usize) -> Hand {
    let mut changed = imported.clone();
    let text = String::from_utf8(imported.files[Path::new("hand.toml")].clone()).expect("text");
    let (before, from_servos) = text.split_once("# Servos of the fingers.").expect("the servos' line");
    let (servos, block) = from_servos.split_once("\n# Tendons\n").expect("the tendons' line");
    assert_eq!(servos.matches("[servos.").count(), tables, "{servos}");
    let lines: Vec<&str> = block
        .lines()
        .map(|line| line.strip_prefix('#').unwrap_or_else(|| panic!("{line}")))
        .map(|line| line.strip_prefix(' ').unwrap_or(line))
        .collect();
    let lines = lines.join("\n") + "\n";
    assert_eq!(Some(&lines), imported.tendon_lines.as_ref());
    changed.files.insert(PathBuf::from("hand.toml"), format!("{before}\n{lines}").into_bytes());
    loaded(&changed)
}

#[test]
fn the_lines_make_the_reflex_of_the_challenge() {
    let imported = rob(&REFLEX, REFLEX_DRIVERS).import("hand.rob");
    no_problems(&imported);
    let servos = loaded(&imported);
    assert_eq!((servos.motors.len(), servos.tendons.len()), (7, 7));
    let hand = with_the_lines(&imported, 6);
    let motors: Vec<&str> = hand.motors.iter().map(|motor| motor.name.as_str()).collect();
    assert_eq!(motors, ["finger_1", "finger_2", "finger_3", "swivel_1"]);
    let cables: Vec<_> = hand.tendons.iter().filter(|tendon| !tendon.both_ways).collect();
    assert_eq!((hand.coordinates.len(), cables.len()), (7, 3));
    // R of the built-in hand is tested against the challenge's formula.
    let other = Hand::builtin("reflex").expect("built in");
    let at = |hand: &Hand, k: usize, proximal: f64, distal: f64| -> Vec<f64> {
        let value = |name: &str| match name.trim_end_matches("_joint") {
            name if name == format!("proximal_{k}") => proximal,
            name if name == format!("distal_{k}") => distal,
            _ => 0.0,
        };
        hand.coordinates.iter().map(|c| value(&c.name)).collect()
    };
    for (k, cable) in (1..=3).zip(cables) {
        let (built, _) =
            (1..=3).zip(&other.tendons).map(|(k, t)| (t, k)).find(|(_, j)| *j == k).expect("three");
        assert_eq!(cable.coordinates().len(), 2);
        for (proximal, distal) in [(-0.34, 0.0), (1.0, 0.6), (2.5, 1.7)] {
            near(
                cable.length(&at(&hand, k, proximal, distal)),
                built.length(&at(&other, k, proximal, distal)),
            );
        }
        // Just taut where the springs rest.
        let motor = &hand.motors[cable.motors[0].0];
        near(cable.rest - motor.scaling * motor.offset, cable.length(&at(&hand, k, -0.34, 0.0)));
    }
    for c in &hand.coordinates {
        let (stiffness, rest) = match c.name.split('_').next() {
            Some("proximal") => (1.0, -0.34),
            Some("distal") => (2.0, 0.0),
            _ => (0.0, 0.0),
        };
        assert_eq!((c.stiffness, c.rest), (stiffness, rest), "{}", c.name);
    }
}

#[test]
fn fingers_of_any_hand_get_lines_whose_numbers_are_to_be_stated() {
    let imported = rob(&CLAW, "").import("hand.rob");
    no_problems(&imported);
    let lines = imported.tendon_lines.clone().expect("lines");
    let numbers = lines.lines().filter(|line| line.contains(" = ") && !line.starts_with('#'));
    let own = ["motors = {", "rest = "];
    for line in numbers.filter(|line| !own.iter().any(|own| line.starts_with(own))) {
        assert!(line.contains("# to state"), "{line}");
    }
    // Equal servos have no tables of their own.
    let hand = with_the_lines(&imported, 0);
    assert_eq!((hand.motors.len(), hand.tendons.len(), hand.coordinates.len()), (2, 2, 6));
    for tendon in &hand.tendons {
        assert!(!tendon.both_ways);
        let motor = &hand.motors[tendon.motors[0].0];
        let wound = |sigma: f64| tendon.rest + motor.scaling * (sigma - motor.offset);
        let (mut open, mut closed) = (vec![0.0; 6], vec![0.0; 6]);
        for &(c, arm) in &tendon.moment_arms {
            let joint = &hand.coordinates[c];
            assert!(joint.stiffness > 0.0 && joint.damping > 0.0);
            open[c] = joint.rest;
            closed[c] = if arm > 0.0 { joint.upper } else { joint.lower };
        }
        // The motor winds from the springs' rest to the limits, here with numbers of four digits.
        assert!((wound(0.0) - tendon.length(&open)).abs() < 2e-3);
        assert!((wound(1.0) - tendon.length(&closed)).abs() < 2e-3);
        assert_eq!(tendon.moment_arms.len(), 3);
    }
}

#[test]
fn joints_that_make_no_fingers_get_no_lines() {
    let mut crossed = CLAW;
    // The last joint turns across the others.
    crossed[3].2 = "1 0 0";
    let mut forked = CLAW;
    // Two links on the first joint.
    forked[6].1 = 4;
    let one = &CLAW[..4];
    for links in [&crossed[..], &forked[..], one] {
        let imported = rob(links, "").import("hand.rob");
        assert_eq!(imported.tendon_lines, None);
        let text = String::from_utf8(imported.files[Path::new("hand.toml")].clone()).expect("text");
        assert!(!text.contains("# Tendons") && !text.contains("# Servos of the fingers"), "{text}");
        assert_eq!(loaded(&imported).motors.len(), links.len() - 1);
    }
    // A URDF states tendons as transmissions: a servo there is one.
    let two = finger("").replace("claw", "two");
    assert_eq!(Source::new(&[("hand.urdf", &two)]).import("hand.urdf").tendon_lines, None);
}
