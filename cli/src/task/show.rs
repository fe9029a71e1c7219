//! `palmares task show`.

use super::describe::{bodies, describe};
use super::load::{load_hand, load_task, scene_error};
use anyhow::{Context, anyhow, bail};
use clap::Args;
use palmares_tasks::build::build;
use palmares_tasks::{Run, Seed, Sensing, Task};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Which task, and what to show of it.
#[derive(Debug, Args)]
pub(crate) struct ShowArgs {
    /// A folder with a task.toml, that file, or the name of a task that comes with the program
    task: String,
    /// Which scene
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write what a camera sees at tick 0; a name that ends in .png
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// The camera; left out, the task's first one
    #[arg(long, requires = "out", value_name = "NAME")]
    camera: Option<String>,
    /// The hand in the picture, by name or path
    #[arg(long, requires = "out", value_name = "HAND", default_value = "softhand")]
    hand: String,
}

/// Prints, and draws.
pub(super) fn show(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let (task, warnings) = load_task(&args.task)?;
    let built = build(&task, None, Seed::from_u64(args.seed));
    let scene = built.map_err(|error| anyhow!(scene_error(&error, &warnings)))?.scene;
    let mut out = std::io::stdout().lock();
    write!(out, "{}\nScene of seed {}\n{}", describe(&task), args.seed, bodies(&scene))?;
    for warning in warnings {
        writeln!(out, "{warning}")?;
    }
    if let Some(file) = &args.out {
        picture(&task, args, file)?;
        writeln!(out, "\nwrote {}", file.display())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn picture(task: &Arc<Task>, args: &ShowArgs, file: &Path) -> anyhow::Result<()> {
    if !file.extension().is_some_and(|end| end.eq_ignore_ascii_case("png")) {
        bail!("{}: the picture's name must end in .png", file.display());
    }
    let Some(camera) = args.camera.as_deref().or(task.cameras.first().map(|camera| camera.name.as_str()))
    else {
        bail!("task `{}` has no camera: give it one, [[cameras]] in task.toml", task.name);
    };
    let mut run = Run::new(task.clone(), load_hand(&args.hand)?, Seed::from_u64(args.seed))?;
    let shots = run.shots(&[format!("{camera}.rgb")], Sensing::Truth)?;
    let taken = run.expose(&shots);
    let image = taken.first().context("the camera took no picture")?.render();
    let pixels = image.rgb.as_ref().context("the camera sees no colours")?;
    let failed = || format!("cannot write {}", file.display());
    let to = BufWriter::new(std::fs::File::create(file).with_context(failed)?);
    let mut encoder = png::Encoder::new(to, image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels.0)).with_context(failed)
}
