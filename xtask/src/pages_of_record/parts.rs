//! The commands of each part. In the quick form each plays what is shortest.

use super::declared::DeclaredPart;
use super::tools::{Anew, Tools, played};
use crate::apt;
use crate::cargo::build_server;
use crate::pages::{self, Wanted};
use anyhow::{Context, Result};
use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::thread;

/// Makes a part's pages.
type Make = fn(&DeclaredPart, &Tools) -> Result<()>;

/// The parts by name.
pub(super) const COMMANDS: [(&str, Make); 16] = [
    ("report", report),
    ("further", report),
    ("hand_scenes", report),
    ("search", search),
    ("grasps", grasps),
    ("sweep", sweep),
    ("hard", hard),
    ("model", model),
    ("validation", validation),
    ("cameras", cameras),
    ("throughput", throughput),
    ("controllers", controllers),
    ("grasped", grasped),
    ("hands", hands),
    ("training", training),
    ("pictures", pictures),
];

/// Scenes beside MuJoCo's `rollout`: name, task, and the motion of the hand down into the objects.
const SCENES: [(&str, &str, Option<[&str; 2]>); 4] = [
    ("air", "balls", None),
    ("balls", "balls", Some(["1.1", "-0.5"])),
    ("shelf", "shelf", None),
    ("grasp", "grasp", Some(["0.6", "-0.3"])),
];
/// Settings of peers whose grasps are counted.
const GRASP_SETTINGS: &str = "stiff120,stiff120_2_steps,recommended,stiff5,stiff5+condim=4,stiff2,stiff5_multiccd_off,stiff2_multiccd_off";
const MUJOCO: (&str, &str) = ("mujoco", "mujoco>=4,<5");
const MATPLOTLIB: (&str, &str) = ("matplotlib", "matplotlib>=3.9");

/// Runs the commands of a part.
pub(super) fn make(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let (_, make) = COMMANDS
        .into_iter()
        .find(|(name, _)| *name == part.name)
        .with_context(|| format!("no command makes `{}`", part.name))?;
    make(part, tools)
}

/// The folder of a part's page.
fn folder(part: &DeclaredPart, tools: &Tools) -> Result<PathBuf> {
    let page = part.pages.first().context("a part has a page")?;
    Ok(tools.place(page)?.parent().context("a page in a folder")?.to_owned())
}

/// The place of a part's page.
fn page(part: &DeclaredPart, tools: &Tools) -> Result<PathBuf> {
    tools.place(part.pages.first().context("a part has a page")?)
}

/// Number of plays at once, where none is timed.
fn jobs() -> String {
    thread::available_parallelism().map_or(1, usize::from).to_string()
}

fn report(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let mut report = match part.name.as_str() {
        // Each scene of this part has a hand, and Drake plays rigid bodies alone.
        "hand_scenes" => {
            let mut report = tools.compare()?;
            report.args(["report", "--engines", "own,rapier,mujoco"]);
            report
        }
        _ => {
            let mut report = tools.compare_with_drake()?;
            report.arg("report");
            report
        }
    };
    report.args(["--part", &part.name, "--out"]).arg(folder(part, tools)?);
    if tools.quick {
        let case = part.cases.last().context("a report has a case")?;
        report.args(["--quick", "--repeats", "1", "--steps-ms", "4", "--cases", case, "--run-limit-s", "10"]);
        report.arg("--runs").arg(tools.folder.join("quick-report.jsonl"));
        return played(&mut report);
    }
    report.args(["--cases", &part.cases.join(","), "--repeats", "3", "--run-limit-s", "100"]);
    if !part.steps_ms.is_empty() {
        report.args(["--steps-ms", &part.steps_ms]);
    }
    report.args(tools.anew.flag());
    played(&mut report)?;
    claims(tools)
}

fn search(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let mut search = tools.compare()?;
    search.arg("search").arg("--out").arg(folder(part, tools)?);
    if tools.quick {
        search.args(["--cases", "softhand_cylinder", "--steps-ms", "8", "--starts", "1", "--grasps", "1"]);
        search.args(["--expansions", "0", "--run-limit-s", "10"]);
        return played(&mut search);
    }
    search.args(["--jobs", &jobs(), "--minutes", "2"]);
    played(&mut search)?;
    claims(tools)
}

fn grasps(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let mut grasps = tools.compare()?;
    grasps.arg("grasps").arg("--out").arg(folder(part, tools)?);
    if tools.quick {
        grasps.args(["--placements", "1", "--family", "ball", "--hand", "softhand", "--steps-ms", "4"]);
        grasps.args(["--peer-steps-ms", "4", "--settings", "default", "--run-limit-s", "10"]);
        grasps.arg("--runs").arg(tools.folder.join("quick-grasps.jsonl"));
        return played(&mut grasps);
    }
    // The settings left out solve no larger part of their plays in the search.
    grasps.args(["--jobs", &jobs(), "--run-limit-s", "60", "--settings", GRASP_SETTINGS]);
    if tools.anew == Anew::Peers {
        grasps.args(tools.anew.flag());
    }
    played(&mut grasps)?;
    claims(tools)
}

/// README.md and docs/physics.md say what the reports say.
fn claims(tools: &Tools) -> Result<()> {
    played(tools.compare()?.args(["claims", "--write"]))
}

fn sweep(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let mut sweep = tools.bench();
    sweep.arg("sweep").arg("--write").arg(page(part, tools)?);
    sweep.args(["--threads", &jobs()]);
    if tools.quick {
        sweep.args(["bowling", "top_momentum", "--steps", "5"]);
        sweep.arg("--runs").arg(tools.folder.join("quick-sweep.jsonl"));
    } else {
        sweep.args(["--steps", "50"]);
    }
    played(&mut sweep)
}

fn hard(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let mut hard = tools.bench();
    hard.arg("hard-cases").arg("--write").arg(page(part, tools)?);
    if tools.quick {
        hard.args(["touching_faces", "singular_arm", "--steps", "2"]);
        hard.arg("--runs").arg(tools.folder.join("quick-sweep.jsonl"));
    }
    played(&mut hard)
}

fn model(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let mut model = tools.bench();
    model.arg("model").arg("--write").arg(page(part, tools)?);
    if tools.quick {
        model.args(["free_flight", "slide_stop"]);
        model.arg("--runs").arg(tools.folder.join("quick-model.jsonl"));
    }
    played(&mut model)
}

fn validation(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let mut validation = tools.compare()?;
    validation.arg("validate").arg("--out").arg(folder(part, tools)?);
    if tools.quick {
        validation.arg("--quick");
    }
    played(&mut validation)
}

fn cameras(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    if !apt::osmesa() {
        println!(
            "MuJoCo has no OSMesa (Debian's package libosmesa6) to draw with: the page is without its pictures"
        );
    }
    let mut cameras = tools.compare()?;
    cameras.arg("cameras").arg("--out").arg(page(part, tools)?);
    if tools.quick {
        cameras.args(["--repeats", "1"]);
    }
    played(&mut cameras)
}

fn throughput(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let scenes = tools.folder.join("mjcf");
    for (name, task, down) in SCENES {
        for settings in ["recommended+sleep=enable", "stiff5+sleep=enable"] {
            let mut scene = tools.compare()?;
            scene.args(["mjcf", "--task", task, "--settings", settings, "--out"]);
            scene.arg(scenes.join(name).join(settings));
            if let Some([time_s, speed_m_s]) = down {
                scene.args(["--lead-in-s", time_s, &format!("--lead-in-m-s={speed_m_s}")]);
            }
            played(&mut scene)?;
        }
    }
    let out = page(part, tools)?;
    let short: &[&str] = if tools.quick {
        &["--blocks", "2", "--ticks", "2", "--worlds", "4", "--scene", "air", "--hand", "softhand"]
    } else {
        &["--blocks", "5", "--ticks", "50"]
    };
    let mut python = tools.benchmark("throughput.py", &[MUJOCO])?;
    python.arg("--server").arg("--mjcf").arg(scenes).args(short).arg("--output").arg(out);
    played(&mut python)
}

fn controllers(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    // A score of the page is the score on every processor, or the page is not written.
    let mut alike = tools.benchmark("processors.py", &[])?;
    if tools.quick {
        alike.args(["--sim-s", "2", "--only", "grasp_sensors"]);
    }
    played(&mut alike)?;
    let mut python = tools.benchmark("controllers.py", &[])?;
    python.arg("--output").arg(page(part, tools)?);
    if tools.quick {
        python.args(["--only", "balls_softhand", "--seeds", "5001-5001"]);
    }
    played(&mut python)
}

fn grasped(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let mut python = tools.benchmark("grasped_objects.py", &[])?;
    python.arg("--output").arg(page(part, tools)?);
    if tools.quick {
        python.args(["--only", "055_baseball"]);
    }
    played(&mut python)
}

fn hands(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let mut python = tools.benchmark("hand_grasps.py", &[])?;
    python.arg("--output").arg(page(part, tools)?);
    if tools.quick {
        python.args(["--hand", "pinch"]);
    }
    played(&mut python)
}

fn training(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let pictures = tools.place("docs/pictures/README.md")?;
    let pictures = pictures.parent().context("a folder")?;
    // stable-baselines3 is not installed unasked: PyTorch, which it needs, has gigabytes.
    let mut python = tools.benchmark("learning_curves.py", &[MATPLOTLIB])?;
    python.args(["--train", "sample", "--folder"]).arg(folder(part, tools)?);
    python.arg("--output").arg(pictures);
    if tools.quick {
        python.args(["--seeds", "1-1", "--updates", "1"]);
    }
    played(&mut python)
}

fn pictures(part: &DeclaredPart, tools: &Tools) -> Result<()> {
    let page = page(part, tools)?;
    let folder = page.parent().context("a page in a folder")?;
    // The shortest picture is that of the hands.
    pages::run(Wanted::Pictures, Some((folder, tools.quick.then_some("each hand"))))?;
    let mut cup = tools.benchmark("stacking_cup.py", &[MATPLOTLIB])?;
    played(cup.arg("--output").arg(folder.join("stacking_cup.svg")))?;
    let mut pinch = Command::new(build_server(true)?);
    pinch.args(["hand", "show", "pinch", "--sigma", "0.3,0.35", "--push", "left_distal:0,0.4,0", "--output"]);
    played(pinch.arg(folder.join("pinch.svg")))?;
    let record = tools.record(&part.name)?;
    let text = format!(
        "# Pictures of README and docs\n\n{record}\n\n`cargo xtask pages-of-record --only pictures` takes them.\n"
    );
    fs::write(&page, text).with_context(|| format!("cannot write {}", page.display()))
}
