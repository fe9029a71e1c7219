//! `<compiler>`: units and conventions of the whole document; numbers and orientations in them.

use std::path::{Path, PathBuf};

use super::defaults::Attributes;
use crate::decision::Log;
use crate::numbers::numbers;
use crate::read::element::Element;
use crate::read::element::Notes;
use palmares_models::{Mat3, Rotation, Vec3};

/// Settings of all `<compiler>` elements together.
#[derive(Clone, Debug)]
pub(crate) struct Compiler {
    pub(crate) degrees: bool,
    pub(crate) autolimits: bool,
    pub(crate) euler: String,
    pub(crate) mesh_folder: PathBuf,
    pub(crate) strip_path: bool,
    pub(crate) inertia_from_geom: FromGeom,
    /// Groups of geoms that count for inertia.
    pub(crate) inertia_groups: [i32; 2],
    /// kg; smallest mass of a body.
    pub(crate) bound_mass: f64,
    /// kg·m²; smallest principal inertia of a body.
    pub(crate) bound_inertia: f64,
    /// kg; mass of all bodies together.
    pub(crate) total_mass: Option<f64>,
}

/// Whether a body's inertia is that of its geoms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FromGeom {
    Always,
    /// Where `<inertial>` is missing.
    Missing,
    Never,
}

impl Compiler {
    pub(crate) fn read(root: &Element, problems: &mut Log) -> Compiler {
        let mut compiler = Compiler {
            degrees: true,
            autolimits: true,
            euler: "xyz".to_owned(),
            mesh_folder: PathBuf::new(),
            strip_path: false,
            inertia_from_geom: FromGeom::Missing,
            inertia_groups: [0, 5],
            bound_mass: 0.0,
            bound_inertia: 0.0,
            total_mass: None,
        };
        for element in root.all("compiler") {
            let number = |name: &str| element.get(name).and_then(|text| text.trim().parse::<f64>().ok());
            if let Some(angle) = element.get("angle") {
                compiler.degrees = angle != "radian";
            }
            if let Some(auto) = element.get("autolimits") {
                compiler.autolimits = auto == "true";
            }
            if let Some(sequence) = element.get("eulerseq") {
                if sequence.len() == 3 && sequence.chars().all(|c| "xyzXYZ".contains(c)) {
                    compiler.euler = sequence.to_owned();
                } else {
                    problems.bad(element, format!("eulerseq is '{sequence}'; valid: three of x y z X Y Z"));
                }
            }
            if let Some(folder) = element.get("meshdir").or(element.get("assetdir")) {
                compiler.mesh_folder = PathBuf::from(folder);
            }
            if let Some(strip) = element.get("strippath") {
                compiler.strip_path = strip == "true";
            }
            if element.get("coordinate") == Some("global") {
                problems.bad(
                    element,
                    "coordinate='global': MuJoCo dropped it in version 2.3.4; save the model with an older version first",
                );
            }
            match element.get("inertiafromgeom") {
                Some("true") => compiler.inertia_from_geom = FromGeom::Always,
                Some("false") => compiler.inertia_from_geom = FromGeom::Never,
                Some("auto") => compiler.inertia_from_geom = FromGeom::Missing,
                _ => {}
            }
            if let Some(groups) = element.get("inertiagrouprange") {
                let range: Vec<i32> = groups.split_whitespace().filter_map(|x| x.parse().ok()).collect();
                if let &[low, high] = range.as_slice() {
                    compiler.inertia_groups = [low, high];
                }
            }
            compiler.bound_mass = number("boundmass").unwrap_or(compiler.bound_mass);
            compiler.bound_inertia = number("boundinertia").unwrap_or(compiler.bound_inertia);
            compiler.total_mass = number("settotalmass").filter(|mass| *mass > 0.0).or(compiler.total_mass);
        }
        compiler
    }

    /// An angle of the document, rad.
    pub(crate) fn angle(&self, angle: f64) -> f64 {
        if self.degrees { angle.to_radians() } else { angle }
    }

    /// The orientation that an element states by one of five attributes.
    pub(crate) fn orientation(&self, at: &Attributes<'_>, problems: &mut Log) -> Rotation {
        let (name, text) = match at.first_of(&["quat", "axisangle", "xyaxes", "zaxis", "euler"]) {
            Some(found) => found,
            None => return Rotation::IDENTITY,
        };
        let numbers = numbers(text);
        let wanted = match name {
            "quat" | "axisangle" => 4,
            "xyaxes" => 6,
            _ => 3,
        };
        let Some(x) = numbers.filter(|x| x.len() == wanted) else {
            problems.bad(at.element, format!("{name} is '{text}'; valid: {wanted} numbers"));
            return Rotation::IDENTITY;
        };
        let usable = match name {
            "quat" => Rotation::from_xyzw(x[1], x[2], x[3], x[0]).length() > 1e-9,
            "euler" => true,
            "xyaxes" => {
                let (a, b) = (Vec3::new(x[0], x[1], x[2]), Vec3::new(x[3], x[4], x[5]));
                a.cross(b).length() > 1e-9
            }
            _ => Vec3::new(x[0], x[1], x[2]).length() > 1e-12,
        };
        if !usable {
            problems.bad(at.element, format!("{name} is '{text}', which has no direction"));
            return Rotation::IDENTITY;
        }
        match name {
            "quat" => Rotation::from_xyzw(x[1], x[2], x[3], x[0]).normalize(),
            "axisangle" => about(Vec3::new(x[0], x[1], x[2]), self.angle(x[3])),
            "xyaxes" => {
                let along = Vec3::new(x[0], x[1], x[2]).normalize();
                let y = Vec3::new(x[3], x[4], x[5]);
                let y = (y - along * along.dot(y)).normalize();
                Rotation::from_mat3(&Mat3::from_cols(along, y, along.cross(y)))
            }
            "zaxis" => z_to(Vec3::new(x[0], x[1], x[2])),
            _ => self.euler_angles([x[0], x[1], x[2]]),
        }
    }

    /// Lower-case axes turn with the frame, upper-case ones are fixed.
    pub(crate) fn euler_angles(&self, angles: [f64; 3]) -> Rotation {
        self.euler.chars().zip(angles).fold(Rotation::IDENTITY, |turned, (axis, angle)| {
            let unit = match axis.to_ascii_lowercase() {
                'x' => Vec3::X,
                'y' => Vec3::Y,
                _ => Vec3::Z,
            };
            let turn = about(unit, self.angle(angle));
            if axis.is_ascii_lowercase() { turned * turn } else { turn * turned }
        })
    }
}

/// The shortest rotation that takes z to this direction.
pub(crate) fn z_to(direction: Vec3) -> Rotation {
    let direction = direction.normalize();
    let axis = Vec3::Z.cross(direction);
    let (sin, cos) = (axis.length(), direction.z);
    if sin < 1e-12 {
        return if cos > 0.0 { Rotation::IDENTITY } else { about(Vec3::X, std::f64::consts::PI) };
    }
    about(axis, libm::atan2(sin, cos))
}

/// Rotation by an angle, rad, about an axis of any length.
pub(crate) fn about(axis: Vec3, angle: f64) -> Rotation {
    let (sin, cos) = libm::sincos(0.5 * angle);
    let v = axis.normalize() * sin;
    Rotation::from_xyzw(v.x, v.y, v.z, cos)
}

/// A path of the document, in the folder of the compiler.
pub(crate) fn asset_path(compiler: &Compiler, file: &str) -> PathBuf {
    let file = Path::new(file);
    let file = if compiler.strip_path { file.file_name().map(Path::new).unwrap_or(file) } else { file };
    compiler.mesh_folder.join(file)
}
