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

/// Options of `palmares task show`.
#[derive(Debug, Args)]
pub(crate) struct ShowArgs {
    /// A folder with a task.toml, that file, or the name of a built-in task
    task: String,
    /// Seed of the scene
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write the image of a camera at tick 0; a name that ends in .png
    #[arg(long, short, alias = "out", value_name = "FILE")]
    output: Option<PathBuf>,
    /// The camera [default: the task's first]
    #[arg(long, requires = "output", value_name = "NAME")]
    camera: Option<String>,
    /// The hand in the image, by name or path
    #[arg(long, requires = "output", value_name = "HAND", default_value = "softhand")]
    hand: String,
}

/// Prints the task, and writes the image.
pub(super) fn show(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let (task, warnings) = load_task(&args.task)?;
    let built = build(&task, None, Seed::from_u64(args.seed));
    let scene = built.map_err(|error| anyhow!(scene_error(&error, &warnings)))?.scene;
    let mut out = std::io::stdout().lock();
    write!(out, "{}\nScene of seed {}\n{}", describe(&task), args.seed, bodies(&scene))?;
    for warning in warnings {
        writeln!(out, "{warning}")?;
    }
    if let Some(file) = &args.output {
        write_image(&task, args, file)?;
        writeln!(out, "\nwrote {}", file.display())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn write_image(task: &Arc<Task>, args: &ShowArgs, file: &Path) -> anyhow::Result<()> {
    if !file.extension().is_some_and(|end| end.eq_ignore_ascii_case("png")) {
        bail!("{}: the image's name must end in .png", file.display());
    }
    let Some(camera) = args.camera.as_deref().or(task.cameras.first().map(|camera| camera.name.as_str()))
    else {
        bail!("task `{}` has no camera; add [[cameras]] to task.toml", task.name);
    };
    let mut run = Run::new(task.clone(), load_hand(&args.hand)?, Seed::from_u64(args.seed))?;
    let shots = run.shots(&[format!("{camera}.rgb")], Sensing::Truth)?;
    let taken = run.expose(&shots);
    let image = taken.first().context("the camera gave no image")?.render();
    let pixels = image.rgb.as_ref().context("the image has no colours")?;
    let failed = || format!("cannot write {}", file.display());
    let to = BufWriter::new(std::fs::File::create(file).with_context(failed)?);
    let mut encoder = png::Encoder::new(to, image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels.0)).with_context(failed)
}
