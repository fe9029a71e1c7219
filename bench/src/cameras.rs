//! How long pictures take, by pixels and by what is in the scene, on one thread.

use anyhow::{Context, Result};
use clap::Args;
use palmares_models::hand::Hand;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_senses::camera::{Body, Geometry, Intrinsics, Picture, draw, plain_depth, shade, stereo_depth};
use palmares_senses::noise::Noise;
use palmares_tasks::{Run, Seed, Task};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

/// What is measured and where it goes.
#[derive(Args, Debug)]
pub struct Options {
    /// Write the table to this file as well.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Pictures of which the median counts.
    #[arg(long, default_value_t = 41)]
    repeats: usize,
}

/// A scene as cameras see it.
struct Scene {
    name: String,
    bodies: Vec<Body>,
    poses: Vec<Pose>,
    colors: Vec<[f64; 3]>,
    camera: palmares_models::camera::Camera,
}

/// A task's scene with the SoftHand at its start, of whose objects the first `most` are left.
fn scene(task: &str, camera: &str, most: usize) -> Result<Scene> {
    let task = Task::builtin().into_iter().find(|known| known.name == task).context("a task")?;
    let hand = Hand::builtin("softhand").context("a hand")?;
    let run = Run::new(task.clone(), hand, Seed::from_u64(1))?;
    let placed = |position: [f64; 3], [x, y, z, w]: [f64; 4]| {
        Pose::from_parts(Vec3::from_array(position), Rotation::from_xyzw(x, y, z, w))
    };
    let (mut bodies, mut poses, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    let parts = |parts: &[palmares_tasks::scene::ScenePart]| {
        parts.iter().map(|part| (placed(part.position, part.quat_xyzw), part.shape.clone())).collect()
    };
    let mut objects = 0;
    for body in &run.scene().bodies {
        objects += usize::from(body.free);
        if body.free && objects > most {
            continue;
        }
        bodies.push(Body { parts: parts(&body.parts), endless: body.endless });
        let (position, quat) = (body.position.context("told")?, body.quat_xyzw.context("told")?);
        poses.push(placed(position, quat));
        colors.push(body.color);
    }
    let first = run.scene().bodies.len();
    let links = run.hand_bodies();
    for (id, pose) in run.poses().filter(|(id, _)| *id >= first) {
        bodies.push(Body { parts: parts(&links[id - first].parts), endless: false });
        poses.push(pose);
        colors.push([0.3; 3]);
    }
    let found = task.cameras.iter().find(|known| known.name == camera).context("a camera")?;
    let name = format!("{}, {} objects", task.name, objects.min(most));
    Ok(Scene { name, bodies, poses, colors, camera: found.clone() })
}

fn median_ms(repeats: usize, mut work: impl FnMut()) -> f64 {
    work();
    let mut times: Vec<f64> = (0..repeats.max(1))
        .map(|_| {
            let begun = Instant::now();
            work();
            1e3 * begun.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Measures and prints.
///
/// # Errors
/// A scene cannot be built, or the file cannot be written.
pub fn run(options: &Options) -> Result<()> {
    let mut table = String::from(
        "| scene, camera | pixels | depth and bodies, ms | with normals, ms | and colours, ms | stereo errors, ms |\n\
         |---|---|---|---|---|---|\n",
    );
    let scenes =
        [("balls", "box_a", 0), ("balls", "box_a", 10), ("shelf", "shelf", 0), ("shelf", "shelf", 10)];
    for (task, camera, most) in scenes {
        let scene = scene(task, camera, most)?;
        let geometry = Geometry::new(&scene.bodies);
        for (width, height) in [(160, 120), (320, 240), (640, 480)] {
            let camera = palmares_models::camera::Camera { width, height, ..scene.camera.clone() };
            let lens = Intrinsics::of(&camera);
            let mut picture = Picture::default();
            let plain = median_ms(options.repeats, || {
                draw(&geometry, &scene.poses, camera.pose(), &lens, &mut picture);
                std::hint::black_box(plain_depth(&picture, &camera));
            });
            picture.with_normals(true);
            let mut normals = || draw(&geometry, &scene.poses, camera.pose(), &lens, &mut picture);
            let with_normals = median_ms(options.repeats, &mut normals);
            let coloured = median_ms(options.repeats, || {
                draw(&geometry, &scene.poses, camera.pose(), &lens, &mut picture);
                std::hint::black_box(plain_depth(&picture, &camera));
                std::hint::black_box(shade(&picture, &lens, &scene.colors));
            });
            let sensor = Noise::new(&[1; 32]).sensor("camera");
            let errors = median_ms(options.repeats, || {
                std::hint::black_box(stereo_depth(&picture, &lens, &camera, &mut sensor.sample(1)));
            });
            writeln!(
                table,
                "| {}, `{}` | {width} × {height} | {plain:.2} | {with_normals:.2} | {coloured:.2} | {errors:.2} |",
                scene.name, camera.name
            )?;
        }
    }
    print!("{table}");
    if let Some(out) = &options.out {
        let text = format!(
            "# What pictures take\n\n`palmares-bench cameras`: median of {} on one thread, with the SoftHand at its start.\n\n{table}",
            options.repeats
        );
        std::fs::write(out, text).with_context(|| format!("cannot write {}", out.display()))?;
    }
    Ok(())
}
