//! `palmares task decompose` and `palmares hand decompose`: cut a mesh into convex pieces, write them next to it, and report
//! how well they fit.

mod files;
mod lines;
mod owner;
mod report;
mod words;

pub use self::owner::MeshOwner;

use self::files::Folder;
use self::lines::places;
use self::report::{FitReport, PieceReport, Report};
use anyhow::{Context, anyhow, bail};
use clap::Args;
use palmares_hand_import::mesh_triangles;
use palmares_models::Vec3;
use palmares_models::error::ModelError;
use palmares_models::pieces::{DecompositionOptions, PiecesError, Stage, TriangleMesh, compare, decompose};
use palmares_models::read::{Limits, MeshUse, mesh_uses, played_points, triangle_mesh};
use palmares_models::shape::hull::{THINNED_DIRECTIONS, thinned};
use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `decompose`.
#[derive(Debug, Args)]
pub struct DecomposeArgs {
    /// An STL file, in or under the folder of the task.toml or URDF that names it; OBJ, COLLADA (.dae), binary glTF (.glb)
    /// and OFF become an STL next to them first
    mesh: PathBuf,
    /// Maximum number of pieces; fewer are written if they suffice. Each costs time in every step [default: 32 for a task,
    /// 16 for a hand]
    #[arg(long, value_name = "N")]
    pieces: Option<u32>,
    /// Voxels along the mesh's longest side; thin walls and narrow holes need more. 200 takes about five
    /// times as long as 100
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(16..=256))]
    resolution: u32,
    /// Metres per unit of the mesh: 0.001 for millimetres [default: the scale in the task.toml or URDF that names the mesh]
    #[arg(long, value_name = "M")]
    scale: Option<f64>,
    /// Replace earlier pieces
    #[arg(long)]
    force: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Cuts the mesh, writes the pieces and prints how well they fit.
///
/// # Errors
/// The mesh cannot be read or has no pieces, pieces are there already, or nothing can be written.
pub fn run(args: &DecomposeArgs, owner: MeshOwner) -> anyhow::Result<ExitCode> {
    let most = args.pieces.unwrap_or(owner.default_pieces());
    if !(1..=owner.max_pieces()).contains(&most) {
        let valid = match owner {
            MeshOwner::Task => "1 to 64, the limit for an object",
            MeshOwner::Hand => "1 to 32, the limit for a link",
        };
        bail!("--pieces {most}; valid: {valid}");
    }
    let file = as_stl(args)?;
    let uses = mesh_uses(&file);
    let scale = scale(args, &file, &uses)?;
    let limits = Limits::default();
    let mesh = triangle_mesh(&file, scale, &limits).map_err(|error| match error {
        ModelError::Element { .. } => anyhow!("{error}; for a mesh in millimetres use --scale 0.001"),
        error => error.into(),
    })?;
    let folder = Folder::beside(&file)?;
    folder.check(args.force)?;

    let mut progress = Progress::new(args.resolution);
    // In units of the file, so that pieces and mesh coincide in any program.
    let in_units = triangle_mesh(&file, Vec3::ONE, &Limits { length_m: f64::MAX, ..limits })?;
    let options = DecompositionOptions { pieces: most, resolution: args.resolution };
    // The library may panic; that is caught, and must not print a message.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| ()));
    let pieces = decompose(&in_units, options, &mut |stage| progress.show(stage));
    std::panic::set_hook(hook);
    let pieces = pieces.map_err(|error| match error {
        PiecesError::Leaks { edges, voxel_m } => {
            PiecesError::Leaks { edges, voxel_m: voxel_m * scale.x.abs() }
        }
        error => error,
    });
    let named = || file.display().to_string();
    let pieces = pieces.with_context(named)?;
    progress.show(Stage::Comparing);
    // Compares the mesh with the pieces as a task or hand reads them from the files.
    let about = format!("a convex piece of {}", folder.mesh_name());
    let files = pieces.iter().filter_map(|points| Some(TriangleMesh::hull(points)?.to_stl(&about)));
    let (files, placed): (Vec<Vec<u8>>, Vec<Vec<Vec3>>) =
        files.filter_map(|bytes| played_points(&bytes, scale).map(|points| (bytes, points))).unzip();
    if placed.is_empty() {
        let (low, high) = mesh.bounds();
        let size = (high - low).max_element() * 1e3;
        bail!(
            "{}: its size is {size:.1e} mm, and its pieces have no volume; set the unit with --scale",
            named()
        );
    }
    let fit = compare(&mesh, &placed).context("a piece has no volume").with_context(named)?;
    let hull = thinned(&mesh.vertices, THINNED_DIRECTIONS);
    let hull = compare(&mesh, &[hull]).context("the mesh has no volume").with_context(named)?;
    progress.end();

    let names = folder.names(placed.len());
    let files: Vec<(String, Vec<u8>)> = names.iter().cloned().zip(files).collect();
    folder.write(&files)?;

    let report = Report {
        mesh: named(),
        triangles: mesh.triangles.len(),
        surface: words::surface(&mesh),
        scale: scale.to_array(),
        size_m: {
            let (low, high) = mesh.bounds();
            (high - low).to_array()
        },
        hull: FitReport::from(&hull),
        fit: FitReport::from(&fit),
        pieces: names.iter().zip(&placed).map(|(name, points)| PieceReport::new(name, points)).collect(),
        folder: folder.path().display().to_string(),
        places: places(owner, &file, &uses, scale.to_array(), folder.name(), &names),
    };
    let mut out = std::io::stdout().lock();
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        write!(out, "{}", words::report(&report, &fit, &hull))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The mesh as an STL file: itself, or what another format becomes next to it.
fn as_stl(args: &DecomposeArgs) -> anyhow::Result<PathBuf> {
    let is_stl = |kind: &std::ffi::OsStr| kind.eq_ignore_ascii_case("stl");
    if !args.mesh.is_file() || args.mesh.extension().is_none_or(is_stl) {
        return Ok(args.mesh.clone());
    }
    let file = args.mesh.with_extension("stl");
    if file.exists() && !args.force {
        bail!("{} is there already; decompose that, or replace it with --force", file.display());
    }
    let corners = mesh_triangles(&args.mesh)?;
    let name = args.mesh.file_name().unwrap_or_default().to_string_lossy();
    let stl = TriangleMesh::new(&corners).to_stl(&format!("the triangles of {name}"));
    std::fs::write(&file, stl).with_context(|| file.display().to_string())?;
    eprintln!("wrote {}: the triangles of {name}", file.display());
    Ok(file)
}

/// Metres per unit of the mesh along each axis: from --scale, or from the places that name the mesh.
fn scale(args: &DecomposeArgs, mesh: &Path, uses: &[MeshUse]) -> anyhow::Result<Vec3> {
    if let Some(scale) = args.scale {
        if !(scale.is_finite() && scale > 0.0) {
            bail!("--scale {scale}; valid: a number above 0, such as 0.001 for millimetres");
        }
        return Ok(Vec3::splat(scale));
    }
    let Some(first) = uses.first() else { return Ok(Vec3::ONE) };
    if let Some(other) = uses.iter().find(|other| other.scale != first.scale) {
        bail!(
            "{} names {} with the scales {:?} and {:?}; choose one with --scale",
            other.file.display(),
            mesh.display(),
            first.scale,
            other.scale
        );
    }
    Ok(Vec3::from_array(first.scale))
}

/// Shows progress on a terminal; silent elsewhere.
struct Progress {
    resolution: u32,
    shown: bool,
}

impl Progress {
    fn new(resolution: u32) -> Self {
        Progress { resolution, shown: std::io::stderr().is_terminal() }
    }

    fn show(&mut self, stage: Stage) {
        let text = match stage {
            Stage::Cutting => format!("cutting at {} voxels along the longest side ...", self.resolution),
            Stage::Joining(left) => format!("joining parts: {left} left"),
            Stage::Comparing => "comparing pieces and mesh ...".to_owned(),
        };
        self.line(&text);
    }

    fn end(&mut self) {
        self.line("");
    }

    /// Replaces the line; write errors are ignored.
    fn line(&self, text: &str) {
        if self.shown {
            let _ = write!(std::io::stderr(), "\r\x1b[K{text}");
        }
    }
}
