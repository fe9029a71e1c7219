//! `palmares task` and tasks of one's own: checked, served, played, and verified where their folder is.

use crate::harness::{Client, Official, RULES, Server, get_bytes, official_reset, program};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

const TASK: &str = include_str!("../../tasks/tests/cube.toml");

/// Exit code and what was printed to stdout and stderr.
fn palmares(arguments: &[&str]) -> (i32, String) {
    let output = Command::new(program()).args(arguments).output().expect("palmares runs");
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8")).concat();
    (output.status.code().expect("it ended by itself"), text)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// A folder with this task.
fn folder(task: &str) -> TempDir {
    let folder = TempDir::new().expect("temporary directory");
    std::fs::write(folder.path().join("task.toml"), task).expect("written");
    folder
}

/// Opens a run of the task, moves, stops; returns the result and its replay in a folder.
async fn played(server: &Server, into: &TempDir) -> (Value, PathBuf) {
    let (mut client, welcome) = Client::greet(server, "crabs").await;
    let known = welcome["tasks"].as_array().expect("a list").iter().any(|task| task["name"] == "cube");
    assert!(known, "{}", welcome["tasks"]);
    let obs = client.ask(json!({"op": "reset", "task": "cube", "hand": "pinch", "seed": 3})).await;
    assert_eq!((&obs["op"], &obs["run"]["task"]), (&json!("obs"), &json!("cube")), "{obs}");
    let names: Vec<&Value> =
        obs["scene"]["bodies"].as_array().expect("a list").iter().map(|body| &body["name"]).collect();
    assert_eq!(names, ["cube", "post", "ground"]);
    let action =
        json!({"base": {"linear": [0.0, 0.0, -0.1], "angular": [0.0, 0.0, 0.0]}, "hand": [0.5, 0.2]});
    let obs = client.ask(json!({"op": "step", "tick": 0, "repeat": 50, "action": action})).await;
    assert_eq!(obs["op"], "obs", "{obs}");
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["op"], "result", "{result}");
    let run_id = result["run_id"].as_str().expect("an id");
    let (status, bytes) = get_bytes(server, &format!("/v1/runs/{run_id}/replay"));
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&bytes));
    let file = into.path().join("run.mcap");
    std::fs::write(&file, bytes).expect("written");
    (result, file)
}

#[tokio::test]
async fn a_task_of_ones_own_is_served_and_verifies_where_its_folder_is() {
    let own = folder(TASK);
    let server = Server::start_with(&["--task", text(own.path())]);
    let into = TempDir::new().expect("temporary directory");
    let (result, file) = played(&server, &into).await;
    drop(server);

    // The folder can be anywhere: a copy is as good.
    let copy = folder(&format!("# The same, with a comment.\n{TASK}"));
    let (code, out) = palmares(&["verify", text(&file), "--task", text(copy.path()), "--json"]);
    assert_eq!(code, 0, "{out}");
    let verdict: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((&verdict["verdict"], &verdict["score"]), (&json!("verified"), &result["score"]), "{out}");

    let (code, out) = palmares(&["verify", text(&file)]);
    assert_eq!(code, 1, "{out}");
    assert!(
        out.contains(
            "refused: other_task: neither the program nor a folder given with --task has a task `cube`"
        ),
        "{out}"
    );

    let heavier = folder(&TASK.replace("mass = 0.2", "mass = 0.21"));
    let (code, out) = palmares(&["verify", text(&file), "--task", text(heavier.path())]);
    assert_eq!(code, 1, "{out}");
    let hash = result["task_hash"].as_str().expect("a hash");
    assert!(out.contains("refused: other_task: the task `cube` is another one here: its hash is "), "{out}");
    assert!(out.contains(&format!("recorded was {hash}")), "{out}");

    let (code, out) = palmares(&["verify", text(&file), "--task", text(into.path())]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("task.toml"), "{out}");

    let pictures = into.path().join("pictures.mcap");
    let film = ["replay", text(&file), "--cameras", "wrist", "--output", text(&pictures)];
    let (_, out) = palmares(&film);
    assert!(out.contains("other_task") && !pictures.exists(), "{out}");
}

#[tokio::test]
async fn a_competition_with_task_files_verifies_its_own_runs() {
    let place = TempDir::new().expect("temporary directory");
    std::fs::create_dir(place.path().join("my-task")).expect("made");
    std::fs::write(place.path().join("my-task/task.toml"), TASK).expect("written");
    let rules = format!("task_files = [\"my-task\"]\n{RULES}");
    let cup = Official::start_on(place, &rules, None);
    cup.open();
    let token = cup.team("crabs");
    let (mut client, _) = cup.greet(&token).await;
    let mut request = official_reset();
    (request["task"], request["hand"]) = ("cube".into(), "pinch".into());
    let obs = client.ask(request).await;
    assert_eq!(obs["op"], "obs", "{obs}");
    client.ask(json!({"op": "step", "tick": 0, "repeat": 30, "action": {"hand": [0.5, 0.2]}})).await;
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["op"], &result["status"]), (&json!("result"), &json!("provisional")), "{result}");
    cup.verified(&result["run_id"]).await;
}

#[test]
fn a_server_refuses_a_task_that_is_wrong_or_has_a_name_that_is_taken() {
    let data = TempDir::new().expect("temporary directory");
    let start = |path: &Path| {
        palmares(&["serve", "--listen", "127.0.0.1:0", "--data-dir", text(data.path()), "--task", text(path)])
    };
    let taken = folder(&TASK.replace("name = \"cube\"\ndescription", "name = \"balls\"\ndescription"));
    let (code, out) = start(taken.path());
    assert_eq!(code, 1, "{out}");
    assert!(
        out.contains("task.toml: name = \"balls\" is that of a task of the program; give it another one"),
        "{out}"
    );
    let wrong = folder(&TASK.replace("inside = \"tray\"", "inside = \"try\""));
    let (code, out) = start(wrong.path());
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("task.toml: rules.goals.inside = \"try\" is no region; regions: tray"), "{out}");
}

#[test]
fn a_task_is_checked_shown_and_played() {
    let own = folder(TASK);
    let (code, out) = palmares(&["task", "check", text(own.path()), "--scenes", "3"]);
    assert_eq!(code, 0, "{out}");
    for part in [
        "cube: made up for a test",
        "in_tray: `cube` in `tray`, upright within 10°",
        "3 scenes built",
        ": usable",
    ] {
        assert!(out.contains(part), "'{part}' is not in:\n{out}");
    }
    let (code, out) = palmares(&["task", "check", text(own.path()), "--json"]);
    let report: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((code, &report["verdict"], &report["scenes"]), (0, &json!("usable"), &json!(10)), "{out}");
    let hash = report["hash"].as_str().expect("a hash").to_owned();
    assert_eq!(report["model"], Value::Null, "{out}");
    let needs = ["task", "check", text(own.path()), "--scenes", "1", "--hand", "pinch", "--model", "--json"];
    let (code, out) = palmares(&needs);
    let model = serde_json::from_str::<Value>(&out).expect("JSON")["model"].take();
    assert_eq!((code, &model["hand"], &model["motors"]), (0, &json!("pinch"), &json!(2)), "{out}");
    // The hand with its joints, the cube and the post.
    assert_eq!((&model["joints"], &model["coordinates"]), (&json!(4), &json!(6 + 4 + 2 * 6)), "{out}");
    let laws = model["laws"].as_array().expect("laws");
    assert!(laws.iter().any(|law| law["name"] == "anchors"), "{out}");
    assert!(
        laws.iter().all(|law| law["part_of_steps"].as_f64().is_some_and(|it| it > 0.0 && it <= 1.0)),
        "{out}"
    );

    let wrong = folder(&TASK.replace("mass = 0.2", "mass = -0.2"));
    let (code, out) = palmares(&["task", "check", text(wrong.path())]);
    assert_eq!(code, 1, "{out}");
    assert!(
        out.contains("task.toml: objects.own `cube`: mass: -0.2 kg") && out.contains("not usable"),
        "{out}"
    );
    let falls = folder(&TASK.replace("[0.3, 0.0, 0.05]", "[0.3, 0.0, 0.35]"));
    let (code, out) = palmares(&["task", "check", text(falls.path())]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("seed 1: ") && out.contains("post did not stay where it was put"), "{out}");
    let low = folder(&TASK.replace("position = [0.0, 0.0, 0.6]", "position = [0.0, 0.0, 0.15]"));
    let (code, out) = palmares(&["task", "check", text(low.path()), "--scenes", "1"]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("does not fit where it starts") && out.contains("no hand fits"), "{out}");
    let (code, out) = palmares(&["task", "check", "no-such-task"]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("balls") && out.contains("no-such-task"), "{out}");

    let into = TempDir::new().expect("temporary directory");
    let picture = into.path().join("pan.png");
    let (code, out) = palmares(&["task", "show", "pan", "--output", text(&picture)]);
    assert_eq!(code, 0, "{out}");
    assert!(std::fs::read(&picture).expect("written").starts_with(b"\x89PNG"));
    let (code, out) = palmares(&["task", "show", text(own.path()), "--output", text(&picture)]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("has no camera"), "{out}");

    let replay = into.path().join("idle.mcap");
    let script =
        ["task", "play", text(own.path()), "--hand", "pinch", "--script", "idle", "--replay", text(&replay)];
    let (code, out) = palmares(&script);
    assert_eq!(code, 0, "{out}");
    assert!(out.contains(": 0 points") && out.contains(&hash), "{out}");
    let (code, out) = palmares(&["verify", text(&replay), "--task", text(own.path())]);
    assert_eq!(code, 0, "{out}");
}

/// The guide shows the files of a task and the program's output about it.
#[test]
fn the_guide_shows_a_task_that_is_usable() {
    let guide = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/tasks.md"))
        .expect("the guide");
    let block =
        guide.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a task.toml");
    let own = folder(block);
    let needs = ["--hand", "softhand", "--model"];
    for (command, more) in [
        ("$ palmares task check my-task/\n", &[][..]),
        ("$ palmares task check my-task/ --hand softhand --model\n", &needs),
    ] {
        let check = ["task", "check", text(own.path()), "--scenes", "2"];
        let (code, out) = palmares(&[&check[..], more].concat());
        assert_eq!(code, 0, "{out}");
        let shown = guide.split(command).nth(1).and_then(|rest| rest.split("```").next());
        let lines =
            shown.expect("the guide shows a check").lines().filter(|line| !line.is_empty() && *line != "...");
        // Times are those of a machine.
        let differs = ["my-task/", "scenes", "µs a step"];
        for line in
            lines.filter(|line| !line.starts_with("hash ") && !differs.iter().any(|it| line.contains(it)))
        {
            assert!(out.lines().any(|printed| printed == line), "not printed: {line}\nbut:\n{out}");
        }
    }
}

/// Every built-in task can be a start: its copy is a usable task of one's own.
#[test]
fn a_copy_of_each_task_is_a_task_of_ones_own() {
    let into = TempDir::new().expect("temporary directory");
    for task in ["balls", "shelf", "grasp", "pan", "peg"] {
        let own = into.path().join(format!("my-{task}"));
        let (code, printed) = palmares(&["task", "copy", task, text(&own)]);
        assert_eq!(code, 0, "{printed}");
        let (code, printed) = palmares(&["task", "check", text(&own), "--scenes", "1"]);
        assert!(code == 0 && printed.contains(&format!("my-{task}")), "{printed}");
        let file = own.join("task.toml");
        std::fs::write(&file, "changed since").expect("written");
        let (code, printed) = palmares(&["task", "copy", task, text(&own)]);
        assert!(code != 0 && printed.contains("exists already; nothing was written"), "{printed}");
        assert_eq!(std::fs::read_to_string(&file).expect("read"), "changed since");
    }
}

#[test]
fn a_copy_needs_a_task_of_the_program_and_a_name_of_its_own() {
    let into = TempDir::new().expect("temporary directory");
    let own = into.path().join("mine");
    for (arguments, expected) in [
        (["task", "copy", "bals", text(&own)].as_slice(), "balls, shelf, grasp, pan, peg"),
        (&["task", "copy", "balls", text(&own), "--name", "pan"], "`pan` is a built-in task"),
        (&["task", "copy", "balls", text(&own), "--name", "a\"b"], "valid: 1 to 64 letters"),
    ] {
        let (code, printed) = palmares(arguments);
        assert!(code != 0 && printed.contains(expected), "{printed}");
        assert!(!own.exists(), "nothing is written");
    }
}

/// The corners of a ring's triangles, mm, as an STL file in text.
fn ring() -> String {
    let at = |i: u32, k: u32| {
        let (turn, round) = (f64::from(i % 32), f64::from(k % 12));
        let (sin, cos) = (turn * std::f64::consts::TAU / 32.0).sin_cos();
        let (s, c) = (round * std::f64::consts::TAU / 12.0).sin_cos();
        let r = 40.0 + 10.0 * c;
        format!("vertex {} {} {}\n", r * cos, r * sin, 10.0 + 10.0 * s)
    };
    let mut text = "solid ring\n".to_owned();
    for (i, k) in (0..32).flat_map(|i| (0..12).map(move |k| (i, k))) {
        let (a, b, c, d) = (at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1));
        for corners in [[&a, &b, &c], [&a, &c, &d]] {
            text += &format!(
                "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n",
                corners.map(String::as_str).concat()
            );
        }
    }
    text + "endsolid ring\n"
}

#[test]
fn a_mesh_with_a_hole_is_reported_decomposed_and_used() {
    let part = "{ shape = \"mesh\", file = \"ring.stl\", scale = [0.001, 0.001, 0.001] }";
    let with = |parts: &str| {
        TASK.replace("{ shape = \"box\", size = [0.04, 0.04, 0.04] }", parts)
            .replace("position = [0.0, 0.0, 0.02]", "position = [0.0, 0.0, 0.0]")
    };
    let own = folder(&with(part));
    let mesh = own.path().join("ring.stl");
    std::fs::write(&mesh, ring()).expect("written");
    let (code, out) = palmares(&["task", "check", text(own.path()), "--scenes", "1"]);
    assert_eq!(code, 0, "{out}");
    assert!(out.contains("part 0: mesh 'ring.stl': its convex hull has 1.9 times its volume ("), "{out}");
    assert!(out.contains(&format!("`palmares task decompose {}`", mesh.display())), "{out}");
    let (code, _) = palmares(&["task", "check", text(own.path()), "--scenes", "1", "--strict"]);
    assert_eq!(code, 2);

    // If it cannot stay, the hull may be the reason.
    let aloft = folder(&with(part).replace("position = [0.0, 0.0, 0.0]", "position = [0.0, 0.0, 0.3]"));
    std::fs::write(aloft.path().join("ring.stl"), ring()).expect("written");
    for arguments in [&["task", "check", text(aloft.path())][..], &["task", "play", text(aloft.path())]] {
        let (code, out) = palmares(arguments);
        assert_eq!(code, 1, "{out}");
        assert!(
            out.contains("did not stay") && out.contains("A possible cause: objects.own `cube`: part 0"),
            "{out}"
        );
    }

    let decompose = |more: &[&str]| palmares(&[&["task", "decompose", text(&mesh)], more].concat());
    let (code, out) = decompose(&["--pieces", "100"]);
    assert!(code == 1 && out.contains("--pieces 100; valid: 1 to 64"), "{out}");
    let (code, out) = decompose(&["--scale", "-1"]);
    assert!(code != 0, "{out}");
    assert!(!own.path().join("ring_pieces").exists(), "nothing was written");
    let (code, out) = decompose(&["--json", "--pieces", "16", "--resolution", "48"]);
    assert_eq!(code, 0, "{out}");
    let report: Value = serde_json::from_str(&out).expect("JSON");
    let number = |name: &str| report["fit"][name].as_f64().expect("a number");
    assert!(number("volume_error").abs() < 0.05 && number("beyond_m") < 3e-3, "{out}");
    assert!(number("uncovered_m") < 2e-3 && number("inertia_error") < 0.1, "{out}");
    assert!(report["hull"]["beyond_m"].as_f64().expect("a number") > 0.02, "{out}");
    assert_eq!(report["scale"], json!([0.001, 0.001, 0.001]), "as the task.toml says");
    let pieces = report["pieces"].as_array().expect("a list");
    assert!((4..=16).contains(&pieces.len()), "{out}");
    let bytes =
        |k: usize| std::fs::read(own.path().join(format!("ring_pieces/ring_{k:02}.stl"))).expect("there");
    let (first, last) = (bytes(1), bytes(pieces.len()));

    // A mesh of another format becomes an STL first.
    let block = own.path().join("block.obj");
    let corners = [[0, 0, 0], [9, 0, 0], [9, 9, 0], [0, 9, 0], [0, 0, 9], [9, 0, 9], [9, 9, 9], [0, 9, 9]];
    let corners = corners.iter().map(|[x, y, z]| format!("v 0.00{x} 0.00{y} 0.00{z}\n")).collect::<String>();
    let faces = "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    std::fs::write(&block, corners + faces).expect("written");
    let (code, out) = palmares(&["task", "decompose", text(&block), "--resolution", "16"]);
    assert!(code == 0 && out.contains("block.stl") && out.contains("closed, 0.73 cm³"), "{out}");
    assert!(own.path().join("block_pieces/block_01.stl").exists(), "{out}");
    let (code, out) = palmares(&["task", "decompose", text(&block)]);
    assert!(code == 1 && out.contains("block.stl is there already"), "{out}");

    let (code, out) = decompose(&[]);
    assert!(code == 1 && out.contains("ring_pieces exists; nothing was written"), "{out}");
    let (code, out) = decompose(&["--force", "--pieces", "16", "--resolution", "48"]);
    assert_eq!(code, 0, "{out}");
    assert_eq!((bytes(1), bytes(pieces.len())), (first, last), "the same mesh, the same pieces");
    for expected in [
        "objects.own `cube`: in `parts`, replace the part with file = \"ring.stl\"",
        "of the mesh not covered",
    ] {
        assert!(out.contains(expected), "'{expected}' is not in:\n{out}");
    }

    // The printed lines, in place of the part.
    let lines: Vec<&str> = out.lines().map(str::trim).filter(|line| line.starts_with("{ shape")).collect();
    assert_eq!(lines.len(), pieces.len(), "{out}");
    std::fs::write(own.path().join("task.toml"), with(&lines.join("\n"))).expect("written");
    let (code, out) = palmares(&["task", "check", text(own.path()), "--scenes", "3", "--strict"]);
    assert_eq!(code, 0, "{out}");
    assert!(out.contains(": usable") && !out.contains("Warnings"), "{out}");
}

#[test]
fn a_mesh_that_has_no_pieces_is_refused_by_name() {
    let place = TempDir::new().expect("temporary directory");
    let file = |name: &str, bytes: &str| {
        let path = place.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    };
    let whole = ring();
    let open: Vec<&str> = whole.split_inclusive("endfacet\n").collect();
    // Every second triangle.
    let open: String = open.iter().enumerate().filter(|(k, _)| k % 2 == 0).map(|(_, facet)| *facet).collect();
    let flat = whole.lines().map(|line| match line.strip_prefix("vertex ") {
        Some(rest) => format!("vertex {} 0\n", rest.rsplit_once(' ').expect("three numbers").0),
        None => format!("{line}\n"),
    });
    let scale = ["--scale", "0.001"];
    for (path, more, expected) in [
        (file("open.stl", &open), &scale[..], "the mesh is not closed: "),
        (file("flat.stl", &flat.collect::<String>()), &scale, "the mesh spans no volume"),
        (file("mm.stl", &whole), &[], "for a mesh in millimetres use --scale 0.001"),
        (file("text.stl", "no mesh"), &[], "not valid STL"),
        (place.path().join("none.stl"), &[], "none.stl"),
    ] {
        let (code, out) = palmares(&[&["hand", "decompose", text(&path)], more].concat());
        let name = path.file_name().and_then(|name| name.to_str()).expect("a name");
        assert!(code == 1 && out.contains(expected) && out.contains(name), "{name}: {out}");
    }
    assert_eq!(std::fs::read_dir(place.path()).expect("there").count(), 4, "nothing was written");
}

/// A world of Klamp't becomes a task that can be used; what it has no place for is printed.
#[test]
fn a_world_of_klampt_becomes_a_task() {
    let world = TempDir::new().expect("temporary directory");
    let file = world.path().join("world.xml");
    let content = "<world><robot name='r' file='r.rob'/><terrain file='floor.tri'/>\
        <rigidObject name='ball' position='0.1 0 0.03'><geometry file='ball.geom' scale='0.03'/><physics mass='0.1'/></rigidObject></world>";
    for (name, text) in [
        ("world.xml", content),
        ("floor.tri", "4\n-5 -5 0\n-5 5 0\n5 -5 0\n5 5 0\n2\n0 2 1\n1 2 3\n"),
        ("ball.geom", "Primitive\nSphere\n0 0 0 1\n"),
    ] {
        std::fs::write(world.path().join(name), text).expect("written");
    }
    let own = world.path().join("my-task");
    let import = ["task", "import", text(&file), "--out", text(&own)];
    let (code, printed) = palmares(&import);
    assert!(code == 0 && printed.contains("robot 'r': is no part of a task"), "{printed}");
    let (code, printed) = palmares(&["task", "check", text(&own), "--scenes", "2", "--hand", "pinch"]);
    assert!(code == 0 && printed.contains("raised_ball"), "{printed}");
    let (code, printed) = palmares(&import);
    assert!(code == 1 && printed.contains("nothing was written"), "{printed}");
    for (name, expected) in [("pan", "`pan` is a built-in task"), ("a\"b", "valid: 1 to 64 letters")] {
        let (code, printed) = palmares(&[&import[..], &["--force", "--name", name]].concat());
        assert!(code == 1 && printed.contains(expected), "{printed}");
    }
    // An object of 2 m is left out, and the other one is there.
    let vast = content
        .replace("</world>", "<rigidObject name='vast'><geometry file='ball.geom'/></rigidObject></world>");
    std::fs::write(&file, vast).expect("written");
    let (code, printed) = palmares(&[&import[..], &["--force"]].concat());
    assert!(code == 2 && printed.contains("rigidObject 'vast': measures 2.000"), "{printed}");
}
