//! Times of pictures on one thread, by pixels and by the content of the scene.

mod peer;
mod scene;

use anyhow::{Context, Result};
use clap::Args;
use palmares_bench::record::Record;
use palmares_models::camera::Camera;
use palmares_senses::camera::{GBuffer, Geometry, Intrinsics, draw, plain_depth, shade, stereo_depth};
use palmares_senses::noise::Noise;
use scene::scene;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

/// Repeats and output of the measurement.
#[derive(Args, Debug)]
pub struct CameraOptions {
    /// Write the table to this file as well.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Number of pictures; their median counts.
    #[arg(long, default_value_t = 41)]
    repeats: usize,
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

/// Over the pixels where both see something: the median difference of the depths, m, and the part of the
/// pixels with more than 5 mm.
fn depth_difference(picture: &GBuffer, depth: &[f32]) -> (f64, f64) {
    let pairs = picture.depth.iter().zip(depth).filter(|(z, _)| z.is_finite());
    let mut differences: Vec<f64> = pairs.map(|(z, other)| (z - f64::from(*other)).abs()).collect();
    differences.sort_by(f64::total_cmp);
    let far = differences.iter().filter(|difference| **difference > 5e-3).count();
    let count = differences.len().max(1);
    (differences.get(count / 2).copied().unwrap_or_default(), far as f64 / count as f64)
}

/// Measures and prints.
///
/// # Errors
/// A scene cannot be built, or the file cannot be written.
pub fn run(options: &CameraOptions) -> Result<()> {
    let mut table = String::from(
        "| scene, camera | pixels | depth and bodies, ms | depth and colours, ms | stereo errors, ms more \
         | MuJoCo: depth, ms | and bodies, ms | depth and colours, ms | depths apart: median, beyond 5 mm |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    let mut version = None;
    let cases = [
        ("balls", "box_a", 0),
        ("balls", "box_a", 5),
        ("balls", "box_a", 10),
        ("shelf", "shelf", 0),
        ("shelf", "shelf", 5),
        ("shelf", "shelf", 10),
        ("balls", "wrist", 10),
    ];
    for (task, camera, most) in cases {
        let scene = scene(task, camera, most)?;
        let geometry = Geometry::new(&scene.bodies);
        for (width, height) in [(160, 120), (320, 240), (640, 480)] {
            let camera = Camera { width, height, ..scene.camera.clone() };
            let lens = Intrinsics::of(&camera);
            let mut picture = GBuffer::default();
            let plain = median_ms(options.repeats, || {
                draw(&geometry, &scene.poses, camera.pose(), &lens, &mut picture);
                std::hint::black_box(plain_depth(&picture, &camera));
            });
            picture.with_normals(true);
            let coloured = median_ms(options.repeats, || {
                draw(&geometry, &scene.poses, camera.pose(), &lens, &mut picture);
                std::hint::black_box(plain_depth(&picture, &camera));
                std::hint::black_box(shade(&picture, &lens, &scene.colors));
            });
            let sensor = Noise::new(&[1; 32]).sensor("camera");
            let errors = median_ms(options.repeats, || {
                std::hint::black_box(stereo_depth(&picture, &lens, &camera, &mut sensor.sample(1)));
            });
            let theirs = match peer::draw(&scene, &lens, options.repeats) {
                Ok(theirs) => {
                    let (median, far) = depth_difference(&picture, &theirs.depth);
                    version.get_or_insert(theirs.version);
                    let [depth, bodies, rgb] = [
                        theirs.depth_ms,
                        theirs.depth_ms + theirs.bodies_ms,
                        theirs.depth_ms + theirs.rgb_ms,
                    ];
                    let (median, far) = (1e3 * median, 100.0 * far);
                    format!("{depth:.1} | {bodies:.1} | {rgb:.1} | {median:.2} mm, {far:.1} %")
                }
                Err(error) => {
                    eprintln!("MuJoCo's renderer is skipped: {error:#}");
                    "– | – | – | –".into()
                }
            };
            let row = format!(
                "| {}, `{}` | {width} × {height} | {plain:.2} | {coloured:.2} | {errors:.2} | {theirs} |",
                scene.name, camera.name
            );
            println!("{row}");
            writeln!(table, "{row}")?;
        }
    }
    if let Some(out) = &options.out {
        let peer = version.map_or_else(
            || "MuJoCo was not there.".to_owned(),
            |version| {
                format!(
                    "MuJoCo {version} draws the same scene by OSMesa on one thread, in the same run; boxes have sharp \
                     edges there and roundings of hulls are facets, which is why depths differ at edges."
                )
            },
        );
        let record = Record::now("cameras")?.line();
        let text = format!(
            "# What pictures take\n\n{record}\n\n`palmares-compare cameras`: median of {} on one thread, with the SoftHand at its start \
             (19 of its links are drawn as bodies of their own). {peer}\n\n{table}",
            options.repeats
        );
        std::fs::write(out, text).with_context(|| format!("cannot write {}", out.display()))?;
    }
    Ok(())
}
