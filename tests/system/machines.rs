//! Hands that are machines: refused with number, bound and place, or shown to the organizer with their numbers.

use crate::harness::{Official, RULES, Response, bearer, program, send};
use serde_json::{Value, json};
use std::io::{Cursor, Write};
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// A base of some boxes (place and size, m) and one finger that a tendon bends.
fn urdf(boxes: &[([f64; 3], [f64; 3])]) -> String {
    let shapes: String = boxes
        .iter()
        .map(|([x, y, z], [a, b, c])| {
            format!(
                "<collision><origin xyz=\"{x} {y} {z}\"/><geometry><box size=\"{a} {b} {c}\"/></geometry></collision>\n"
            )
        })
        .collect();
    format!(
        r#"<robot name="machine">
  <link name="base"><inertial><mass value="0.5"/>
    <inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" iyz="0" izz="1e-3"/></inertial>
    {shapes}</link>
  <link name="tip"><inertial><origin xyz="0 0 0.03"/><mass value="0.02"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
    <collision><origin xyz="0 0 0.03"/><geometry><capsule radius="0.01" length="0.04"/></geometry></collision></link>
  <joint name="bend" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0.06 0"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <transmission name="close"><type>transmission_interface/AdaptiveSynergyTransmission</type>
    <actuator name="pull"/><joint name="bend"><mechanicalReduction>1</mechanicalReduction>
    <mechanicalElasticity>0.5</mechanicalElasticity></joint></transmission>
</robot>"#
    )
}

const SETTINGS: &str = "name = \"machine\"\ninertia = \"from_geometry\"\nfriction = 0.9\n\
    [motors.pull]\nscaling = 1.0\nspeed_limit = 2.0\n\
    [tendons.close]\nstiffness = 300.0\nforce_limit = 2.0\n\
    [coordinates.bend]\ndamping = 0.03\n";

/// In the shelf task's start pose base (x, y, z) is world (x, z, 0.85 − y): a beam under the shelf's roof, a plate behind
/// the objects, and a chute from the shelf's edge down over the box.
const ATTACK: [([f64; 3], [f64; 3]); 5] = [
    ([0.0, -0.13, 0.39], [0.02, 0.01, 0.79]),
    ([0.0, 0.0, 0.785], [0.38, 0.26, 0.01]),
    ([0.0, 0.35, 0.2], [0.5, 0.01, 0.4]),
    ([-0.25, 0.25, 0.2], [0.01, 0.3, 0.4]),
    ([0.25, 0.25, 0.2], [0.01, 0.3, 0.4]),
];

/// The same idea within every limit: a rake of 28 cm.
const RAKE: [([f64; 3], [f64; 3]); 2] =
    [([0.0, -0.05, 0.14], [0.02, 0.01, 0.28]), ([0.0, 0.0, 0.275], [0.28, 0.15, 0.01])];

fn archive(urdf: &str, settings: &str) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in [("hand.urdf", urdf), ("hand.toml", settings)] {
        zip.start_file(name, SimpleFileOptions::default()).expect("entry");
        zip.write_all(text.as_bytes()).expect("text");
    }
    zip.finish().expect("archive").into_inner()
}

/// Exit code and what was printed to stdout and stderr.
fn palmares(arguments: &[&str]) -> (i32, String) {
    let output = Command::new(program()).args(arguments).output().expect("palmares runs");
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
    (output.status.code().expect("it ended by itself"), text(&output.stdout) + &text(&output.stderr))
}

/// `palmares hand check` reports these parts of a hand and exits with 1.
#[track_caller]
fn unusable(urdf: &str, settings: &str, parts: &[&str]) {
    let folder = TempDir::new().expect("temporary directory");
    let path = folder.path().join("machine.zip");
    std::fs::write(&path, archive(urdf, settings)).expect("written");
    let (code, out) = palmares(&["hand", "check", path.to_str().expect("UTF-8"), "--sigma", "0.5"]);
    assert_eq!(code, 1, "{out}");
    for part in parts.iter().chain(&["not usable"]) {
        assert!(out.contains(part), "'{part}' is not in:\n{out}");
    }
}

/// The server's answer to the upload.
fn post(cup: &Official, token: &str, bytes: &[u8]) -> Response {
    send(&cup.server, "POST", "/v1/hands", &bearer(token), bytes)
}

#[tokio::test]
async fn a_machine_behind_the_objects_is_refused_by_its_size_and_then_by_its_place() {
    let machine = archive(&urdf(&ATTACK), SETTINGS);
    let cup = Official::start();
    let token = cup.team("crabs");
    let answer = post(&cup, &token, &machine);
    answer.assert_problem(400, "bad_request");
    for part in [
        "hand.zip/hand.urdf: link 'base': largest edge of a link's shapes is 0.795 m; valid: at most 0.3 m",
        "hand_limits.size_m",
        "hand_limits.reach_m",
    ] {
        assert!(answer.body.contains(part), "'{part}' is not in {}", answer.body);
    }
    // Even with an organizer's endless limits on size, no hand starts among the objects.
    let rules =
        format!("{}[hand_limits]\nsize_m = inf\nreach_m = inf\nlink_size_m = inf\nvolume_m3 = inf\n", RULES);
    let cup = Official::start_on(TempDir::new().expect("temporary directory"), &rules, None);
    let token = cup.team("crabs");
    let answer = post(&cup, &token, &machine);
    answer.assert_problem(422, "hand_in_the_way");
    let expected = "task `shelf`: where the hand starts, link `base` reaches into region `shelf`";
    assert!(answer.body.contains(expected), "{}", answer.body);
    assert_eq!(cup.get("/v1/admin/hands", &cup.organizer).json()["hands"], json!([]));
}

#[test]
fn a_server_does_not_start_with_a_machine() {
    let folder = TempDir::new().expect("temporary directory");
    let path = folder.path().join("machine.zip");
    std::fs::write(&path, archive(&urdf(&ATTACK), SETTINGS)).expect("written");
    let (data, path) = (folder.path().join("data"), path.to_str().expect("UTF-8"));
    let data = data.to_str().expect("UTF-8");
    let (code, out) = palmares(&["serve", "--listen", "127.0.0.1:0", "--data-dir", data, "--hand", path]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("[hand_limits]") && out.contains("hand_limits.link_size_m"), "{out}");
}

#[tokio::test]
async fn a_rake_within_the_limits_is_shown_with_its_numbers_and_earns_nothing_by_itself() {
    let cup = Official::start();
    let token = cup.team("crabs");
    let rake = archive(&urdf(&RAKE), &SETTINGS.replace("friction = 0.9", "friction = 2.4"));
    let sent = post(&cup, &token, &rake);
    assert_eq!(sent.status, 201, "{}", sent.body);
    let warnings = sent.json()["warnings"].to_string();
    assert!(warnings.contains("beyond the program's hands: hand.zip/hand.toml: friction: "), "{warnings}");
    assert!(warnings.contains("is 2.4 (friction; 0.7 (robotiq_2f85) to 1.5 (reflex))"), "{warnings}");
    let id = sent.json()["hand_id"].as_str().expect("an id").to_owned();

    let address = format!("/v1/admin/hands/{id}");
    cup.get(&address, &token).assert_problem(403, "forbidden");
    cup.get(&format!("{address}/archive"), &token).assert_problem(403, "forbidden");
    cup.get("/v1/admin/hands/hand_0", &cup.organizer).assert_problem(404, "not_found");
    let shown = cup.get(&address, &cup.organizer).json();
    let row = |name: &str| -> Value {
        let rows = shown["figures"].as_array().expect("a list");
        rows.iter().find(|row| row["figure"] == name).expect(name).clone()
    };
    let size = row("link_size_m");
    let value = size["value"].as_f64().expect("a number");
    assert!((value - 0.28).abs() < 1e-9 && size["limit"] == json!(0.3), "{size}");
    assert_eq!((&size["allowed"], &size["beyond_others"]), (&json!(true), &json!(true)), "{size}");
    // All built-in hands but the one with a skin, whose sizes are those of another.
    assert_eq!(size["others"].as_object().map(serde_json::Map::len), Some(16), "{size}");
    assert_eq!(shown["in_the_way"], json!([]));

    let folder = TempDir::new().expect("temporary directory");
    let picture = folder.path().join("sides.png");
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
    let out = cup.admin(&["hand", "show", &id, "-o", picture.to_str().expect("UTF-8")]);
    let printed = text(&out.stdout);
    assert!(out.status.success(), "{printed}{}", text(&out.stderr));
    let line =
        |name: &str| printed.lines().find(|l| l.trim_start().starts_with(name)).expect(name).to_owned();
    for part in ["0.28", "≤ 0.3", "beyond all"] {
        assert!(line("link_size_m").contains(part), "{printed}");
    }
    let head = line("figure");
    assert!(
        ["machine", "least of others", "most of others", "limit"].iter().all(|word| head.contains(word)),
        "{head}"
    );
    assert!(std::fs::read(&picture).expect("written").starts_with(b"\x89PNG"));

    let out = cup.admin(&["hand", "show", &id, "--json"]);
    let shown: Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert_eq!(shown["hand"]["status"], "pending", "{shown}");
    assert!(shown["figures"].as_array().is_some_and(|rows| !rows.is_empty()), "{shown}");

    let out = cup.admin(&["hand", "try", &id]);
    let printed = text(&out.stdout);
    assert!(out.status.success(), "{printed}{}", text(&out.stderr));
    let idle: Vec<&str> = printed.lines().filter(|line| line.contains(" idle ")).collect();
    assert_eq!(idle.len(), 5, "one line for each task: {printed}");
    for line in idle {
        assert_eq!(line.split_whitespace().nth(2), Some("0"), "{printed}");
    }
    assert!(!printed.contains("LOOK") && !printed.contains("NOT PLAYED"), "{printed}");

    let out = cup.admin(&["hand", "approve", &id]);
    assert!(out.status.success());
    let printed = text(&out.stderr);
    assert!(printed.contains("beyond the program's hands: ") && printed.contains("(friction; "), "{printed}");
}

#[tokio::test]
async fn a_hand_that_new_limits_shut_out_is_not_played_but_can_be_looked_at() {
    let cup = Official::start();
    let token = cup.team("crabs");
    let sent = post(&cup, &token, &archive(&urdf(&RAKE), SETTINGS)).json();
    let id = sent["hand_id"].as_str().expect("an id").to_owned();
    cup.order("hand/approve", json!({"hand_id": id}));
    let (folder, rules) = cup.killed();
    let rules = format!("{rules}[hand_limits]\nlink_size_m = 0.2\n");
    let cup = Official::start_on(folder, &rules, None);
    cup.open();
    let (mut client, _) = cup.greet(&token).await;
    let refused =
        client.refused(json!({"op": "reset", "task": "shelf", "hand": "machine"}), "unknown_hand").await;
    assert!(refused.to_string().contains("hand_limits.link_size_m"), "{refused}");
    let shown = cup.get(&format!("/v1/admin/hands/{id}"), &cup.organizer).json();
    let rows = shown["figures"].as_array().expect("a list");
    let size = rows.iter().find(|row| row["figure"] == "link_size_m").expect("a row");
    assert_eq!(size["allowed"], json!(false), "{size}");
}

/// Each was once called usable, or the error named the wrong file.
#[test]
fn what_is_no_hand_is_not_called_usable() {
    let plain = urdf(&[([0.0, 0.0, 0.0], [0.08, 0.08, 0.04])]);
    let with = |from: &str, to: &str| {
        assert!(plain.contains(from) || SETTINGS.contains(from), "{from}");
        (plain.replace(from, to), SETTINGS.replace(from, to))
    };
    for (from, to, part) in [
        ("friction = 0.9", "friction = 1e9", "Coulomb coefficient of a surface is 1e9; valid: at most 2.5"),
        ("0.08 0.08 0.04", "9 0.08 0.04", "link 'base': largest edge of a link's shapes is 9 m"),
        (
            "<mass value=\"0.02\"/>",
            "<mass value=\"1e-300\"/>",
            "link 'tip': mass of the lightest link is 1e-300 kg",
        ),
        ("force_limit = 2.0", "force_limit = 1e9", "(hand_limits.joint_torque_nm)"),
        ("stiffness = 300.0", "stiffness = 1e9", "(hand_limits.tendon_stiffness)"),
        ("<mechanicalReduction>1<", "<mechanicalReduction>1e9<", "(hand_limits.moment_arm)"),
        ("speed_limit = 2.0", "speed_limit = 1e9", "(hand_limits.motor_speed_per_s)"),
        ("scaling = 1.0", "scaling = 1e8", "(hand_limits.motor_scaling)"),
        (
            "<mechanicalElasticity>0.5<",
            "<mechanicalElasticity>-0.5<",
            "hand.urdf: transmission 'close', joint 'bend': <mechanicalElasticity> is the negative stiffness",
        ),
        ("<mechanicalReduction>1<", "<mechanicalReduction>0<", "hand.urdf: transmission 'close': every"),
        ("force_limit = 2.0", "force_limit = 0", "hand.toml: [tendons.close]: has force_limit 0; valid"),
    ] {
        let (urdf, settings) = with(from, to);
        unusable(&urdf, &settings, &[part]);
    }
    // A heavy finger on a weak spring, with nothing to brake it: it swings for minutes.
    let swinging = plain
        .replace("<mechanicalElasticity>0.5<", "<mechanicalElasticity>0.0003<")
        .replace("<mass value=\"0.02\"/>", "<mass value=\"0.3\"/>");
    let settings = SETTINGS
        .replace("damping = 0.03", "damping = 0.0")
        .replace("force_limit = 2.0", "force_limit = 0.00012");
    unusable(
        &swinging,
        &settings,
        &["joint 'bend' still moves after 60 s", "too little or far too much damping"],
    );
}

#[test]
fn a_mesh_in_millimetres_is_refused_with_the_cure() {
    let folder = TempDir::new().expect("temporary directory");
    // A fingertip of 9 x 6 x 6 mm, read as metres.
    let corner = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 6.0]];
    let mut stl = "solid tip\n".to_owned();
    for face in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
        stl += "facet normal 0 0 0\nouter loop\n";
        for k in face {
            let [x, y, z]: [f64; 3] = corner[k];
            stl += &format!("vertex {x} {y} {z}\n");
        }
        stl += "endloop\nendfacet\n";
    }
    stl += "endsolid tip\n";
    let urdf = urdf(&[([0.0, 0.0, 0.0], [0.08, 0.08, 0.04])])
        .replace("<capsule radius=\"0.01\" length=\"0.04\"/>", "<mesh filename=\"tip.stl\"/>");
    for (name, text) in [("hand.urdf", urdf.as_str()), ("hand.toml", SETTINGS), ("tip.stl", stl.as_str())] {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let path: &Path = folder.path();
    let (code, out) = palmares(&["hand", "check", path.to_str().expect("UTF-8")]);
    assert_eq!(code, 1, "{out}");
    let cure = "valid: at most 0.3 m (hand_limits.link_size_m); a mesh in millimetres needs scale=\"0.001 0.001 0.001\"";
    let line = out.lines().find(|line| line.ends_with(cure)).unwrap_or_else(|| panic!("{out}"));
    assert!(line.contains("hand.urdf: link 'tip': largest edge of a link's shapes is "), "{line}");
}
