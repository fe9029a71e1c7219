//! Klamp't's files of objects (`.obj`) and terrains (`.env`): a keyword and its values a line, among them the file of the geometry.

use std::path::{Path, PathBuf};

use palmares_models::{Mat3, Pose, Vec3};

use super::shape::{Shape, Transform, of_file};
use crate::decision::{At, Log};
use crate::read::klampt::lines::{Line, lines, number};
use crate::read::klampt::rotation::{columns, rotation};
use crate::source::Source;

/// What a file states about a body; what it does not state is Klamp't's default.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stated {
    pub(super) shape: Shape,
    /// The file of the geometry.
    pub(super) geometry: PathBuf,
    pub(super) pose: Pose,
    pub(super) mass: f64,
    pub(super) com: Option<Vec3>,
    /// About the centre of mass.
    pub(super) inertia: Option<Mat3>,
    pub(super) friction: f64,
    pub(super) restitution: f64,
}

impl Stated {
    pub(super) fn new(shape: Shape, geometry: PathBuf) -> Stated {
        Stated {
            shape,
            geometry,
            pose: Pose::IDENTITY,
            mass: 1.0,
            com: None,
            inertia: None,
            friction: 0.5,
            restitution: 0.5,
        }
    }
}

/// Reads the file that `element` names: a body's own file, or one of geometry alone.
///
/// # Errors
/// Its problem, in words.
pub(super) fn read(
    source: &Source,
    from: &Path,
    name: &str,
    element: &str,
    log: &mut Log,
) -> Result<Stated, String> {
    let path = found(source, from, name, element, log)?;
    let shown = path.display().to_string();
    let with_file = |problem: String| format!("{shown} {problem}");
    let kind = path.extension().map(|kind| kind.to_string_lossy().to_lowercase()).unwrap_or_default();
    let text = || source.text(&path, element).map_err(|error| error.to_string());
    let own = match kind.as_str() {
        "env" => Some(lines(&text()?)),
        // Wavefront's files have the same ending.
        "obj" => Some(lines(&text()?)).filter(|lines| lines.iter().any(|line| line.keyword == "mesh")),
        _ => None,
    };
    let Some(own) = own else {
        return Ok(Stated::new(of_file(source, &path).map_err(with_file)?, path));
    };
    let mesh = own.iter().find(|line| line.keyword == "mesh").and_then(|line| line.words.first());
    let mesh = mesh.ok_or_else(|| with_file("names no `mesh`".to_owned()))?;
    let geometry = found(source, &path, mesh, element, log)?;
    let shape = of_file(source, &geometry).map_err(|problem| format!("{} {problem}", geometry.display()))?;
    let mut stated = Stated::new(shape, geometry);
    let (mut scale, mut place) = (Vec3::ONE, Vec3::ZERO);
    for line in &own {
        keyword(line, &mut stated, &mut scale, &mut place, &format!("{element}, {shown}"), log);
    }
    stated.shape = stated.shape.transformed(&Transform::IDENTITY.after(scale, place)).simplest();
    Ok(stated)
}

/// The file that another one names.
fn found(source: &Source, from: &Path, name: &str, element: &str, log: &mut Log) -> Result<PathBuf, String> {
    let found = source.resolve(from, name)?;
    if let Some(note) = found.note {
        log.guessed(At::Hand, element, format!("file {note}"));
    }
    Ok(found.path)
}

fn keyword(
    line: &Line,
    stated: &mut Stated,
    scale: &mut Vec3,
    place: &mut Vec3,
    element: &str,
    log: &mut Log,
) {
    let list: Vec<f64> = line.words.iter().filter_map(|word| number(word)).collect();
    let whole = list.len() == line.words.len();
    let vector = |v: &[f64]| Vec3::new(v[0], v[1], v[2]);
    match (line.keyword.as_str(), list.as_slice()) {
        ("mesh", _) => {}
        ("geomscale", &[s]) => *scale = Vec3::splat(s),
        ("geomscale", v @ [_, _, _]) => *scale = vector(v),
        ("geomtranslate", v @ [_, _, _]) => *place = vector(v),
        ("t", v @ [..]) if v.len() == 12 || v.len() == 16 => {
            let rows: Vec<f64> = if v.len() == 12 { v.to_vec() } else { by_columns(v) };
            match rotation(columns(&rows)) {
                Some(rotation) => stated.pose = Pose::from_parts(vector(&rows[9..]), rotation),
                None => log.problem(At::Hand, element, "`T` has no rotation; taken is none"),
            }
        }
        ("position", v @ [_, _, _]) => stated.pose.translation = vector(v),
        ("mass", &[mass]) => stated.mass = mass,
        ("com", v @ [_, _, _]) => stated.com = Some(vector(v)),
        ("inertia", v @ [_, _, _]) => stated.inertia = Some(Mat3::from_diagonal(vector(v))),
        ("inertia", v) if v.len() == 9 => stated.inertia = Some(matrix(v)),
        ("automass", _) => (stated.com, stated.inertia) = (None, None),
        ("kfriction" | "friction", &[mu]) => stated.friction = mu,
        ("kfriction" | "friction", &[first, ..]) if whole => {
            stated.friction = first;
            let text =
                format!("`{}` differs between triangles; taken is the first one, {first}", line.keyword);
            log.guessed(At::Hand, element, text);
        }
        ("krestitution", &[e]) => stated.restitution = e,
        ("kstiffness" | "kdamping", _) => {
            let text = format!("`{}`: contacts of this program are hard; hands have soft pads", line.keyword);
            log.dropped(At::Hand, element, text);
        }
        ("velocity" | "angularvelocity", v) => {
            if v.iter().any(|x| *x != 0.0) {
                log.dropped(At::Hand, element, format!("`{}`: objects begin at rest", line.keyword));
            }
        }
        (keyword, _) => {
            let shown: String = line.words.join(" ").chars().take(40).collect();
            log.problem(
                At::Hand,
                element,
                format!("`{keyword} {shown}` is not read: it has no meaning there"),
            );
        }
    }
}

/// Rows of the rotation and then the place, of a homogeneous matrix by rows.
fn by_columns(m: &[f64]) -> Vec<f64> {
    [0, 1, 2, 4, 5, 6, 8, 9, 10, 3, 7, 11].map(|k| m[k]).to_vec()
}

/// A matrix given row by row; symmetric, so that it is its transpose.
pub(super) fn matrix(v: &[f64]) -> Mat3 {
    let column = |k: usize| Vec3::new(v[k], v[3 + k], v[6 + k]);
    Mat3::from_cols(column(0), column(1), column(2))
}

/// Whether a matrix can be an inertia, which Klamp't leaves at 0 where nothing is stated.
pub(super) fn is_stated(inertia: &Mat3) -> bool {
    [inertia.x_axis.x, inertia.y_axis.y, inertia.z_axis.z].iter().all(|x| x.is_finite() && *x > 0.0)
}
