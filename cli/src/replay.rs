//! `palmares replay`: the content of a replay.

use super::verify::{load, own_tasks};
use anyhow::{Context, bail};
use clap::Args;
use palmares_protocol::text::printable;
use palmares_protocol::utc;
use palmares_replay::{self as replay, Replay, Trajectory, word};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "\
Examples:
  palmares replay run_7c3d8eb479d7f8ab.mcap
  palmares replay run_7c3d8eb479d7f8ab.mcap --csv > trajectories.csv
  palmares replay run_7c3d8eb479d7f8ab.mcap --like run_04aa1b0c9d63e711.mcap
  palmares replay run_7c3d8eb479d7f8ab.mcap --cameras wrist,box_a.rgb \\
      --output images.mcap";

/// Options of `palmares replay`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReplayOptions {
    /// The replay's file
    #[arg(value_name = "RUN.mcap")]
    file: PathBuf,
    /// Print the trajectories as CSV: a line for every body that moved, at 30 frames per second
    #[arg(long, conflicts_with = "cameras")]
    csv: bool,
    /// Simulate this run and that of another file again, and print how alike their movements are: docs/organizers.md
    #[arg(long, value_name = "OTHER.mcap", conflicts_with_all = ["csv", "cameras"])]
    like: Option<PathBuf>,
    /// Simulate the run again and write the images of these cameras to --output: names of cameras of the task or the hand for
    /// depth images, or name.depth, name.rgb, name.bodies
    #[arg(long, value_delimiter = ',', value_name = "CAMERAS", requires = "output")]
    cameras: Vec<String>,
    /// Your own task, if the run is of one: a folder with a task.toml
    #[arg(long = "task", value_name = "PATH")]
    tasks: Vec<PathBuf>,
    /// File for the images: MCAP with foxglove.RawImage and foxglove.CameraCalibration
    #[arg(long, short, alias = "out", value_name = "FILE", requires = "cameras")]
    output: Option<PathBuf>,
    /// Frame rate of cameras without noise; those with noise have a rate of their own
    #[arg(long, value_name = "HZ", default_value_t = 30.0, value_parser = rate)]
    rate_hz: f64,
}

/// Prints a summary or the trajectories, or writes images.
pub(crate) fn replay(options: &ReplayOptions) -> anyhow::Result<ExitCode> {
    let bytes = load(&options.file)?;
    match (replay::read(&bytes), &options.like) {
        (Ok(replay), Some(other)) => return likeness(&replay, other, options),
        (Ok(replay), None) if options.csv => csv(&replay, &bytes)?,
        (Ok(replay), None) if !options.cameras.is_empty() => return images(&replay, options),
        (Ok(replay), None) => summary(&replay)?,
        (Err(refused), _) => {
            eprintln!("{}: refused: {}: {refused}", options.file.display(), refused.name());
            return Ok(ExitCode::FAILURE);
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(rate) if rate > 0.0 && rate <= 1000.0 => Ok(rate),
        _ => Err("more than 0, at most 1000".into()),
    }
}

fn likeness(one: &Replay, other: &Path, options: &ReplayOptions) -> anyhow::Result<ExitCode> {
    let tasks = own_tasks(&options.tasks)?;
    let compared =
        replay::read(&load(other)?).and_then(|other| replay::likeness::likeness(one, &other, &tasks));
    match compared {
        Ok(Some(found)) => println!(
            "alike      {:.0} % of the shorter path\ndistance   {:.2} mm\noffset     {:.2} mm\nlater      {:.1} s",
            (100.0 * found.share).floor(),
            found.distance_mm,
            found.offset_mm,
            found.shift_s
        ),
        Ok(None) => println!("alike      0 % of the shorter path"),
        Err(refused) => {
            eprintln!("refused: {}: {refused}", refused.name());
            return Ok(ExitCode::FAILURE);
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn images(replay: &Replay, options: &ReplayOptions) -> anyhow::Result<ExitCode> {
    let Some(out) = &options.output else { bail!("--output FILE is missing") };
    let tasks = own_tasks(&options.tasks)?;
    let file = File::create(out).with_context(|| format!("cannot write {}", out.display()))?;
    let written = replay::export_images(replay, &tasks, &options.cameras, options.rate_hz, file);
    let count = match written {
        Ok(count) => count,
        Err(error) => {
            // The file is incomplete.
            let _ = std::fs::remove_file(out);
            eprintln!("{}: {error}", options.file.display());
            return Ok(ExitCode::FAILURE);
        }
    };
    println!("{}: {count} images of {} s", out.display(), replay.outcome.sim_time_s);
    Ok(ExitCode::SUCCESS)
}

fn summary(replay: &Replay) -> std::io::Result<()> {
    let header = &replay.header;
    let outcome = &replay.outcome;
    let mut out = BufWriter::new(std::io::stdout().lock());
    let mut line = |name: &str, value: String| writeln!(out, "{name:<10} {value}");
    line("run", format!("{} ({}, {})", header.run_id, word(&header.mode), word(&header.pacing)))?;
    line("team", printable(&header.team).into_owned())?;
    line("started", utc(i64::try_from(header.started_unix_ms).unwrap_or(i64::MAX)))?;
    line("task", format!("{} {}", header.task, header.task_hash))?;
    let attached = if header.hand_attached { ", attached" } else { "" };
    let drawn = if header.hand_drawn.is_some() { ", its numbers drawn by the seed" } else { "" };
    line("hand", format!("{} {}{attached}{drawn}", header.hand, header.hand_hash))?;
    line("sensing", format!("{}, noise {}", word(&header.sensing), word(&header.noise)))?;
    let number = header.seed_number.map_or(String::new(), |number| format!(" (number {number})"));
    let k = header.k.map_or(String::new(), |k| format!(", run {k} of the team in this task"));
    line("seed", format!("{}{number}{k}", header.seed.to_hex()))?;
    line("engine", format!("{}, server {} ({})", header.engine, header.server_version, header.build_hash))?;
    line("physics", header.physics_hash.clone())?;
    line(
        "length",
        format!(
            "{} ticks, {} s, {} states, {} frames, {} samples of the hand's telemetry",
            outcome.ticks,
            outcome.sim_time_s,
            replay.states(),
            replay.pose_messages,
            replay.telemetry
        ),
    )?;
    line(
        "score",
        format!(
            "{}: {} in the goal, {} outside, {}",
            outcome.score,
            outcome.in_goal,
            outcome.outside,
            word(&outcome.reason)
        ),
    )?;
    line("final", outcome.state_hash.clone())?;
    line("signed by", replay.key.to_string())?;
    line("file", format!("{} bytes, SHA-256 {}", replay.bytes, replay.sha256))?;
    for event in &outcome.events {
        let object = event.object.map_or(String::new(), |object| format!(" {object}"));
        line("event", format!("tick {}: {}{object}", event.tick, event.kind))?;
    }
    line("", "Not simulated again: `palmares verify` does that.".into())?;
    out.flush()
}

fn csv(replay: &Replay, bytes: &[u8]) -> anyhow::Result<()> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    writeln!(out, "time_s,body,x,y,z,qx,qy,qz,qw")?;
    let start = replay.header.started_unix_ms.saturating_mul(1_000_000);
    let (mut trajectory, mut wrong) = (Trajectory::default(), None);
    replay::each_pose_message(bytes, &mut |time_ns, message| {
        let mut print = || -> anyhow::Result<()> {
            let time_s = time_ns.saturating_sub(start) as f64 * 1e-9;
            for (name, pose) in trajectory.next(message)? {
                // Names come from files: a comma or a quote must not make another column.
                let body = name.replace(['"', ',', '\n', '\r'], "_");
                let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation.to_array(), pose.rotation.to_array());
                write!(out, "{time_s:.3},{body},{x:.5},{y:.5},{z:.5},")?;
                writeln!(out, "{qx:.5},{qy:.5},{qz:.5},{qw:.5}")?;
            }
            Ok(())
        };
        if wrong.is_none() {
            wrong = print().err();
        }
    })?;
    match wrong {
        Some(error) => Err(error),
        None => Ok(out.flush()?),
    }
}
