//! `palmares render`: films and pictures of recorded runs.

mod ffmpeg;
mod files;
mod gif_file;
mod recording;

use crate::progress::{Progress, duration};
use anyhow::{Context, bail};
use clap::Args;
use files::{OutputFormat, Sink};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_replay::{self as replay, Replay, VerifyError};
use palmares_senses::camera::Film;
use palmares_tasks::Run;
use palmares_tasks::run::{FILM_SIZE, Still, View, ViewError};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

const EXAMPLES: &str = "\
Examples:
  palmares render run_7c3d8eb479d7f8ab.mcap --output run.mp4
  palmares render run_7c3d8eb479d7f8ab --url http://127.0.0.1:8080 -o run.gif
  palmares render run.mcap -o grasp.png --from 12.5 --size 1280x720
  palmares render run.mcap -o slow.mp4 --from 4 --to 6 --speed 0.25 \\
      --eye 0.4,-0.5,0.3 --target 0,0,0.1";

/// Options of `palmares render`.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct RenderOptions {
    /// The replay: a file, or the id of a run on the server of --url
    #[arg(value_name = "RUN")]
    run: String,
    /// The film (.mp4, .gif) or the picture (.png)
    #[arg(long, short, alias = "out", value_name = "FILE")]
    output: PathBuf,
    /// A camera of the task or the hand; `film` is a place that shows fingers and objects
    #[arg(long, value_name = "NAME", default_value = "film", conflicts_with = "eye")]
    camera: String,
    /// Where a camera of your own is, m
    #[arg(long, value_name = "X,Y,Z", requires = "target", value_parser = point, allow_hyphen_values = true)]
    eye: Option<Vec3>,
    /// The point that it looks at, m
    #[arg(long, value_name = "X,Y,Z", requires = "eye", value_parser = point, allow_hyphen_values = true)]
    target: Option<Vec3>,
    /// Its horizontal field of view, degrees, 1 to 170
    #[arg(long, value_name = "DEG", requires = "eye", default_value_t = 50.0, value_parser = within::<1, 170>)]
    fov: f64,
    /// Pixels: width and height, even numbers for .mp4 [default: 640x480; of a camera of task or hand its own]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// Pictures per second of the film, up to 120; of .gif up to 50
    #[arg(long, value_name = "N", default_value_t = 25.0, value_parser = within::<0, 120>)]
    fps: f64,
    /// Seconds of the run in a second of the film
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = within::<0, 1000>)]
    speed: f64,
    /// Second of the run at which the film begins; the moment of a picture [default: the begin; of a picture, the end]
    #[arg(long, value_name = "S", value_parser = within::<-1, 1_000_000>)]
    from: Option<f64>,
    /// Second of the run at which the film ends [default: the end]
    #[arg(long, value_name = "S", value_parser = within::<0, 1_000_000>)]
    to: Option<f64>,
    /// Your own task, if the run is of one: a folder with a task.toml
    #[arg(long = "task", value_name = "PATH")]
    tasks: Vec<PathBuf>,
    /// The server of a run that is named by its id
    #[arg(long, value_name = "URL", env = "PALMARES_URL", default_value = "http://127.0.0.1:8080")]
    url: String,
    /// A file with certificates (PEM) of authorities that are trusted in addition to the system's, for https
    #[arg(long, value_name = "FILE", env = "PALMARES_CA")]
    ca: Option<PathBuf>,
}

/// Three numbers.
fn point(text: &str) -> Result<Vec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    match numbers.as_deref() {
        Ok([x, y, z]) if [x, y, z].iter().all(|number| number.is_finite()) => Ok(Vec3::new(*x, *y, *z)),
        _ => Err("three numbers, such as 0.4,-0.5,0.3".into()),
    }
}

/// A number that is more than `LOW`, at most `HIGH`.
fn within<const LOW: i32, const HIGH: i32>(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > f64::from(LOW) && number <= f64::from(HIGH) => Ok(number),
        _ => Err(format!("more than {LOW}, at most {HIGH}")),
    }
}

/// Width and height.
fn size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = text.split_once(['x', '×']).unwrap_or_default();
    match (width.parse(), height.parse()) {
        (Ok(width), Ok(height)) if width > 0 && height > 0 => Ok((width, height)),
        _ => Err("width and height in pixels, such as 640x480".into()),
    }
}

/// The film is made, or the reason is printed.
pub(crate) fn render(options: &RenderOptions) -> anyhow::Result<ExitCode> {
    let kind = OutputFormat::of(&options.output)?;
    kind.check(options.fps)?;
    if let (Some(from), Some(to)) = (options.from, options.to)
        && from >= to
    {
        bail!("--from {from} --to {to}: wanted an end after the begin");
    }
    let (name, bytes) = recording::load(&options.run, &options.url, options.ca.as_deref())?;
    // Before the simulation, which takes longer.
    let coder = (kind == OutputFormat::Mp4).then(ffmpeg::find).transpose()?;
    files::check_writable(&options.output)?;
    let tasks = crate::verify::own_tasks(&options.tasks)?;
    let shot = match replay::read(&bytes).and_then(|replay| shoot(&replay, &tasks, options, kind)) {
        Ok(shot) => shot?,
        Err(refused) => {
            eprintln!("{name}: refused: {}: {refused}", refused.name());
            return Ok(ExitCode::FAILURE);
        }
    };
    let lens = *shot.view.lens();
    let mut sink = Sink::new(kind, &options.output, (lens.width, lens.height), options.fps, coder)?;
    let began = Instant::now();
    let drawn = draw(&shot, &mut sink).and_then(|()| sink.finish());
    if let Err(error) = drawn {
        // The file is incomplete.
        let _ = std::fs::remove_file(&options.output);
        return Err(error);
    }
    let count = shot.frames.len();
    let pictures = if count == 1 { "a picture".into() } else { format!("{count} pictures") };
    let (file, time) = (options.output.display(), duration(began.elapsed()));
    println!("{file}: {pictures} of {} × {} pixels in {time}", lens.width, lens.height);
    Ok(ExitCode::SUCCESS)
}

/// The moments of a film.
struct Shot {
    view: View,
    stills: Vec<Still>,
    /// For every picture of the film its still.
    frames: Vec<usize>,
}

/// Ticks of the pictures of a film, one after the other.
fn ticks(options: &RenderOptions, kind: OutputFormat, tick_s: f64, last: u64) -> anyhow::Result<Vec<u64>> {
    let tick = |time_s: f64| (time_s / tick_s).round().max(0.0) as u64;
    let end_s = last as f64 * tick_s;
    if let Some(from) = options.from.filter(|from| tick(*from) > last) {
        bail!("--from {from}: the run ends after {end_s} s");
    }
    if kind == OutputFormat::Png {
        return Ok(vec![options.from.map_or(last, tick)]);
    }
    let from = options.from.unwrap_or(0.0).max(0.0);
    let to = options.to.unwrap_or(end_s).min(end_s);
    let count = ((to - from) * options.fps / options.speed + 1e-9).floor() as usize + 1;
    let time = |k: usize| from + k as f64 * options.speed / options.fps;
    Ok((0..count).map(|k| tick(time(k)).min(last)).collect())
}

/// The view of the options.
fn view(run: &Run, options: &RenderOptions) -> anyhow::Result<View> {
    let view = match (options.eye, options.target) {
        (Some(eye), Some(target)) => {
            let z = (target - eye).normalize_or_zero();
            let aside = if z.cross(Vec3::Z).length() > 1e-6 { Vec3::Z } else { Vec3::Y };
            let x = z.cross(aside).normalize_or_zero();
            if z == Vec3::ZERO {
                bail!("--eye and --target are one point; wanted two");
            }
            let rotation = Rotation::from_mat3(&palmares_models::Mat3::from_cols(x, z.cross(x), z));
            let pose = Pose::from_parts(eye, rotation);
            run.own_view(pose, None, options.fov, options.size.unwrap_or(FILM_SIZE), (0.01, 20.0))
        }
        _ => run.view(&options.camera, options.size),
    };
    view.map_err(|error| match error {
        ViewError::Size { .. } => anyhow::anyhow!("--size: {error}"),
        _ => anyhow::anyhow!("--camera: {error}"),
    })
}

/// Simulates the run again and keeps the moments of the film.
fn shoot(
    replay: &Replay,
    tasks: &[std::sync::Arc<palmares_tasks::Task>],
    options: &RenderOptions,
    kind: OutputFormat,
) -> Result<anyhow::Result<Shot>, VerifyError> {
    let ticks = match ticks(options, kind, replay.header.tick_s, replay.outcome.ticks) {
        Ok(ticks) => ticks,
        Err(error) => return Ok(Err(error)),
    };
    let (mut shown, mut stills, mut wanted) = (None, Vec::new(), ticks.clone());
    wanted.dedup();
    let mut observe = |run: &mut Run| {
        if shown.is_none() {
            shown = Some(view(run, options));
        }
        if wanted.get(stills.len()) == Some(&run.tick()) {
            stills.push(run.still());
        }
    };
    replay::verify_watched(replay, tasks, Some(&mut observe))?;
    let mut frames = Vec::with_capacity(ticks.len());
    for tick in ticks {
        let at = wanted.partition_point(|wanted| *wanted < tick);
        frames.push(at.min(stills.len().saturating_sub(1)));
    }
    let view = shown.context("the run has no tick").and_then(|view| view);
    Ok(view.map(|view| Shot { view, stills, frames }))
}

/// Draws all pictures on all cores, and writes them in their order.
fn draw(shot: &Shot, sink: &mut Sink) -> anyhow::Result<()> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut films: Vec<Film> = (0..cores).map(|_| Film::default()).collect();
    let mut progress = Progress::new(shot.frames.len() > 1, shot.frames.len(), "pictures");
    let (began, mut done) = (Instant::now(), 0);
    // A picture of the same moment as the one before is not drawn again.
    let mut last: Option<(usize, Vec<u8>)> = None;
    for frames in shot.frames.chunks(4 * cores) {
        let mut stills: Vec<usize> = frames.to_vec();
        stills.dedup();
        if last.as_ref().is_some_and(|(still, _)| stills.first() == Some(still)) {
            stills.remove(0);
        }
        let share = stills.len().div_ceil(cores).max(1);
        let drawn: Vec<Vec<u8>> = std::thread::scope(|scope| {
            let mut threads = Vec::new();
            for (stills, film) in stills.chunks(share).zip(&mut films) {
                let mut picture = move |still: &usize| shot.stills[*still].picture(&shot.view, film);
                threads.push(scope.spawn(move || stills.iter().map(&mut picture).collect::<Vec<_>>()));
            }
            threads.into_iter().flat_map(|thread| thread.join().unwrap_or_default()).collect()
        });
        let mut drawn = stills.into_iter().zip(drawn);
        for frame in frames {
            if last.as_ref().is_none_or(|(still, _)| still != frame) {
                last = drawn.next();
            }
            let (_, picture) = last.as_ref().context("a picture failed")?;
            sink.write(picture)?;
            done += 1;
        }
        progress.show(done, None, began.elapsed());
    }
    progress.clear();
    Ok(())
}

#[cfg(test)]
mod tests;
