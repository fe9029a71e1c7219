//! `palmares hand`: hands from folders, archives and files that are wrong.

use crate::harness::{Client, Server, exported_hand, get, program, reset, step};
use serde_json::Value;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;
use zip::write::SimpleFileOptions;

/// Exit code, what was printed to stdout, and to stderr.
fn palmares(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(program()).args(arguments).output().expect("palmares runs");
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
    let code = output.status.code().expect("it ended by itself");
    (code, text(&output.stdout), text(&output.stderr))
}

fn softhand(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/hands/softhand").join(file);
    std::fs::read_to_string(path).expect("the SoftHand's files are part of the source")
}

/// The SoftHand's own folder under another name.
fn folder_of_softhand() -> TempDir {
    let folder = TempDir::new().expect("temporary directory");
    for file in ["hand.urdf", "hand.toml"] {
        std::fs::write(folder.path().join(file), softhand(file)).expect("written");
    }
    folder
}

fn archive(folder: &Path, name: &str, entries: &[(&str, &[u8])]) -> PathBuf {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (path, content) in entries {
        zip.start_file(*path, SimpleFileOptions::default()).expect("entry");
        zip.write_all(content).expect("content");
    }
    let path = folder.join(name);
    std::fs::write(&path, zip.finish().expect("archive").into_inner()).expect("written");
    path
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[test]
fn a_folder_is_checked_and_closes_along_the_closed_form() {
    let folder = folder_of_softhand();
    let (code, out, err) = palmares(&["hand", "check", text(folder.path()), "--sigma", "0.3,1"]);
    assert_eq!(code, 0, "{out}{err}");
    for part in [
        "20 links, 19 coordinates, 1 tendon, 1 motor",
        "├─ index_knuckle: 0.009 kg",
        "Warnings: 0",
        "σ = 1: the closed form does not apply",
        "σ = 1: no prediction applies",
        "'base' touches 'index_distal'",
        "joint 'index_inner' is at its upper limit 0.7854",
        ": usable",
    ] {
        assert!(out.contains(part), "'{part}' is not in:\n{out}");
    }

    let (code, out, _) = palmares(&["hand", "check", text(folder.path()), "--sigma", "0.3,0.5,1", "--json"]);
    assert_eq!(code, 0);
    let report: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(report["verdict"], "usable");
    assert_eq!(report["hand"]["coordinates"].as_array().expect("a list").len(), 19);
    let closures = report["closures"].as_array().expect("a list");
    assert_eq!(closures.len(), 3);
    for closure in closures {
        assert!(closure["unbalanced_nm"].as_f64().expect("a number") < 1e-9, "{closure}");
    }
    for closure in &closures[..2] {
        assert_eq!(closure["beyond"].as_array().map(Vec::len), Some(0), "{closure}");
        assert_eq!(closure["law"], "closed_form");
        assert!(closure["error"].as_f64().expect("a number") < 1e-9, "{closure}");
        assert!(closure["rest_s"].as_f64().is_some());
    }
}

#[test]
fn an_archive_with_meshes_in_a_folder_is_read_without_unpacking() {
    let folder = TempDir::new().expect("temporary directory");
    // A tetrahedron instead of the index fingertip's box.
    let tip = "solid t\n facet normal 0 0 0\n outer loop\n vertex 0 0 0\n vertex 0.03 0 0\n vertex 0 0.01 0\n endloop\n \
               endfacet\n facet normal 0 0 0\n outer loop\n vertex 0 0 0\n vertex 0 0.01 0\n vertex 0 0 0.01\n endloop\n \
               endfacet\n facet normal 0 0 0\n outer loop\n vertex 0.03 0 0\n vertex 0 0.01 0\n vertex 0 0 0.01\n endloop\n \
               endfacet\nendsolid t\n";
    let urdf = softhand("hand.urdf");
    let start = urdf.find("<link name=\"index_distal\">").expect("the link");
    let start = start + urdf[start..].find("<collision>").expect("its collision shape");
    let from = start + urdf[start..].find("<box").expect("its box");
    let to = from + urdf[from..].find("/>").expect("its end") + 2;
    let urdf = format!("{}<mesh filename=\"package://mine/meshes/tip.STL\"/>{}", &urdf[..from], &urdf[to..]);
    let toml = softhand("hand.toml").replace("index_distal = { rounding = 0.004 }", "");
    let entries: [(&str, &[u8]); 4] = [
        ("mine/hand.urdf", urdf.as_bytes()),
        ("mine/hand.toml", toml.as_bytes()),
        ("mine/meshes/tip.STL", tip.as_bytes()),
        ("mine/README.md", b"mine"),
    ];
    let path = archive(folder.path(), "mine.zip", &entries);
    let (code, out, err) = palmares(&["hand", "check", text(&path), "--sigma", "0.3"]);
    assert_eq!(code, 0, "{out}{err}");
    assert!(out.contains("rolling by index_outer; hull"), "{out}");

    // The same without its mesh.
    let path = archive(folder.path(), "less.zip", &entries[..2]);
    let (code, out, _) = palmares(&["hand", "check", text(&path)]);
    assert_eq!(code, 1);
    assert!(out.contains("less.zip/mine/meshes/tip.STL") && out.contains(": not usable"), "{out}");
}

#[test]
fn what_is_wrong_is_named_with_file_and_element() {
    let folder = folder_of_softhand();
    let urdf = folder.path().join("hand.urdf");
    let broken = softhand("hand.urdf").replacen("<mass value=\"", "<mass value=\"-", 1);
    std::fs::write(&urdf, broken).expect("written");
    let (code, out, _) = palmares(&["hand", "check", text(&urdf)]);
    assert_eq!(code, 1);
    for part in ["hand.urdf", "link '", "negative mass", "not usable"] {
        assert!(out.contains(part), "'{part}' is not in:\n{out}");
    }

    let (code, out, _) = palmares(&["hand", "check", "no-such-hand", "--json"]);
    assert_eq!(code, 1);
    let report: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(report["verdict"], "unusable");
    assert!(report["errors"].to_string().contains("no-such-hand"), "{report}");
    assert!(report["errors"].to_string().contains("softhand"), "{report}");

    let slip = archive(folder.path(), "slip.zip", &[("../../hand.urdf", b"<robot/>")]);
    let (code, out, _) = palmares(&["hand", "check", text(&slip)]);
    assert_eq!(code, 1);
    assert!(out.contains("slip.zip: entry '../../hand.urdf': leads out of the archive"), "{out}");

    let (code, _, err) = palmares(&["hand", "check", "softhand", "--sigma", "2"]);
    assert_eq!(code, 2, "a wrong command line");
    assert!(err.contains("0 (open) to 1 (closed)"), "{err}");
}

#[test]
fn an_exported_hand_is_usable_and_its_oddities_are_named() {
    let folder = TempDir::new().expect("temporary directory");
    exported_hand::write(folder.path());
    let (code, out, err) = palmares(&["hand", "check", text(folder.path()), "--sigma", "0.2", "--strict"]);
    assert_eq!(code, 2, "warnings, and --strict: {out}{err}");
    for part in [
        "19 coordinates",
        "exported.urdf: link 'palm': inertia is 1.0",
        "and 18 more like this",
        "closes slowly",
        // The tension f: f (Σ R²/E + 1/K) = s − Σ R q₀, or f · 20.2367 = 7 · 0.2 − 14 · 0.05.
        "0.034591",
        // 14 pairs by name, 14 couplers, 20 inertias, 2 links without mass, and 6 of a kind of their own.
        "usable, with 56 warnings",
    ] {
        assert!(out.contains(part), "'{part}' is not in:\n{out}");
    }
}

#[test]
fn a_pushed_hand_is_drawn_where_the_closed_form_has_it() {
    let folder = TempDir::new().expect("temporary directory");
    let (svg, png) = (folder.path().join("a.svg"), folder.path().join("a.png"));
    let push = ["--sigma", "0.5", "--push", "index_distal:-0.5,0,-0.25"];
    let mut arguments = vec!["hand", "show", "softhand", "--output", text(&svg)];
    arguments.extend(push);
    let (code, out, err) = palmares(&arguments);
    assert_eq!(code, 0, "{out}{err}");
    // Both stages end where the closed form says, under the push with J of the final configuration.
    for stage in ["closed: ", "pushed: "] {
        let line = out.lines().find(|line| line.starts_with(stage)).expect("its line");
        assert!(line.ends_with("(closed form)"), "{line}");
        let error = line.split_whitespace().find_map(|x| x.parse::<f64>().ok()).expect("a number");
        assert!(error < 1e-9, "{line}");
    }
    let picture = std::fs::read_to_string(&svg).expect("written");
    for part in ["<svg", "softhand, σ = 0.5", "pushed on index_distal", "thumb", "little", "tension", "outer"]
    {
        assert!(picture.contains(part), "'{part}' is not in the picture");
    }

    let (code, _, err) =
        palmares(&["hand", "show", "softhand", "--output", text(&png), "--push", "tail:1,0,0"]);
    assert_eq!(code, 1);
    assert!(err.contains("no link `tail`") && err.contains("thumb_distal"), "{err}");
    assert!(!png.exists());
    let (code, _, err) = palmares(&["hand", "show", "softhand", "--output", "a.bmp"]);
    assert_eq!(code, 1);
    assert!(err.contains(".svg or .png"), "{err}");
    assert_eq!(palmares(&["hand", "show", "softhand", "--output", text(&png), "--sigma", "0.2"]).0, 0);
    assert!(std::fs::read(&png).expect("written").starts_with(b"\x89PNG"));
}

#[tokio::test]
async fn a_hand_of_ones_own_plays_like_those_of_the_program() {
    let folder = folder_of_softhand();
    let toml = softhand("hand.toml").replace("name = \"softhand\"", "name = \"mine\"");
    std::fs::write(folder.path().join("hand.toml"), toml).expect("written");
    let server = Server::start_with(&["--hand", text(folder.path())]);
    let hand = get(&server, "/v1/hands/mine").json();
    assert_eq!(hand["coordinates"].as_array().map(Vec::len), Some(19));
    let (mut client, _) = Client::greet(&server, "mine").await;
    let mut ask = reset();
    ask["hand"] = "mine".into();
    assert_eq!(client.ask(ask).await["op"], "obs");
    assert_eq!(client.ask(step(0)).await["op"], "obs");

    // A second hand of the same name would be ambiguous.
    let data = TempDir::new().expect("temporary directory");
    let folder = folder_of_softhand();
    let arguments = ["serve", "--listen", "127.0.0.1:0", "--data-dir", text(data.path()), "--hand"];
    let (code, _, err) = palmares(&[&arguments[..], &[text(folder.path())]].concat());
    assert_eq!(code, 1);
    assert!(err.contains("a hand named `softhand` already"), "{err}");
}

/// The guide shows what the program prints; the last digits of errors are left out.
#[test]
fn the_guide_shows_what_the_program_prints() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let guide = std::fs::read_to_string(root.join("docs/hands.md")).expect("the guide");
    let command = "palmares hand check pinch --sigma 0.1,0.2,0.3";
    let block = guide.split(&format!("$ {command}\n")).nth(1).and_then(|rest| rest.split("```").next());
    let lines: Vec<&str> = block.expect("the guide shows this check").lines().collect();
    // As in the guide: in the folder that `pinch` is in.
    let output = Command::new(program())
        .args(command.split(' ').skip(1))
        .current_dir(root.join("models/hands"))
        .output()
        .expect("palmares runs");
    let printed = String::from_utf8(output.stdout).expect("UTF-8");
    let comparable = |line: &&&str| !line.is_empty() && **line != "..." && !line.contains("e-");
    for line in lines.iter().filter(comparable) {
        assert!(printed.lines().any(|l| l == *line), "not printed: {line}\nbut:\n{printed}");
    }
    assert!(lines.iter().filter(comparable).count() > 20, "the guide lost its output");
}
