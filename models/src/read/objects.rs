//! The files of the catalogue, `objects/*.toml`: each object's parts become shapes, and both are checked.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use serde::Deserialize;

use super::report::Report;
use crate::catalogue::{Catalogue, Item};
use crate::error::ModelError;
use crate::object::Object;
use crate::shape::Shape;
use crate::{Pose, Rotation, Vec3, rotation};

/// Embedded, so that the program runs from anywhere.
const FILES: [(&str, &str); 2] = [
    ("objects/ycb.toml", include_str!("../../objects/ycb.toml")),
    ("objects/apc.toml", include_str!("../../objects/apc.toml")),
];

/// Largest extent of an object, m.
const LARGEST_M: f64 = 1.0;
/// Heaviest object, kg.
const HEAVIEST_KG: f64 = 20.0;
/// Most convex parts of an object.
const MOST_PARTS: usize = 64;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    source: String,
    object: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    id: String,
    name: String,
    category: String,
    mass: f64,
    friction: f64,
    #[serde(default)]
    rolling_friction: f64,
    color: [f64; 3],
    parts: Vec<Part>,
    #[serde(default)]
    note: String,
}

/// A part as written: full sizes, m; angles, rad.
#[derive(Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
enum Part {
    Sphere {
        radius: f64,
        #[serde(default)]
        at: [f64; 3],
    },
    Box {
        size: [f64; 3],
        #[serde(default)]
        at: [f64; 3],
        #[serde(default)]
        rpy: [f64; 3],
    },
    Cylinder {
        radius: f64,
        height: f64,
        #[serde(default)]
        at: [f64; 3],
        #[serde(default)]
        rpy: [f64; 3],
    },
    /// All points within `radius` of the segment between two ends.
    Capsule { radius: f64, ends: [[f64; 3]; 2] },
    /// The wall of a vessel: a ring of slabs that stands on `at`, with outer radii at the bottom and at the top.
    Wall {
        sides: usize,
        bottom: f64,
        top: f64,
        height: f64,
        thickness: f64,
        #[serde(default)]
        at: [f64; 3],
    },
}

impl Part {
    /// As poses and shapes, or what is wrong.
    fn solids(&self) -> Result<Vec<(Pose, Shape)>, String> {
        let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite() && x.abs() <= LARGEST_M * 10.0);
        let place = |at: &[f64; 3], rpy: &[f64; 3]| {
            if finite(at) && finite(rpy) {
                Ok(Pose::from_parts(Vec3::from_array(*at), rotation::from_rpy(*rpy)))
            } else {
                Err("its place is not finite or too far away".to_owned())
            }
        };
        Ok(match self {
            Part::Sphere { radius, at } => vec![(place(at, &[0.0; 3])?, Shape::Sphere { radius: *radius })],
            Part::Box { size, at, rpy } => {
                let half_extents = size.map(|x| 0.5 * x);
                vec![(place(at, rpy)?, Shape::Box { half_extents, rounding: 0.0 })]
            }
            Part::Cylinder { radius, height, at, rpy } => {
                let shape = Shape::Cylinder { radius: *radius, half_length: 0.5 * height };
                vec![(place(at, rpy)?, shape)]
            }
            Part::Capsule { radius, ends: [a, b] } => {
                let _ = (place(a, &[0.0; 3])?, place(b, &[0.0; 3])?);
                let (a, b) = (Vec3::from_array(*a), Vec3::from_array(*b));
                let along = b - a;
                let length = along.length();
                if length < 1e-6 {
                    return Err("its ends are the same point; a sphere has no ends".to_owned());
                }
                let shape = Shape::Capsule { radius: *radius, half_length: 0.5 * length };
                vec![(Pose::from_parts((a + b) * 0.5, from_z_to(along / length)), shape)]
            }
            Part::Wall { sides, bottom, top, height, thickness, at } => {
                if !(3..=MOST_PARTS).contains(sides) {
                    return Err(format!("sides = {sides}; 3 to {MOST_PARTS} are possible"));
                }
                if !(*height > 0.0 && *thickness > 0.0 && bottom.min(*top) > *thickness) {
                    return Err(
                        "height and thickness must be positive, the radii above the thickness".to_owned()
                    );
                }
                wall(*sides, *bottom, *top, *height, *thickness, place(at, &[0.0; 3])?)
            }
        })
    }
}

/// The shortest turn of z to a unit vector.
fn from_z_to(d: Vec3) -> Rotation {
    if d.z < -1.0 + 1e-12 {
        return Rotation::from_xyzw(1.0, 0.0, 0.0, 0.0);
    }
    Rotation::from_xyzw(-d.y, d.x, 0.0, 1.0 + d.z).normalize()
}

fn wall(sides: usize, bottom: f64, top: f64, height: f64, thickness: f64, at: Pose) -> Vec<(Pose, Shape)> {
    let step = core::f64::consts::TAU / sides as f64;
    let lean = libm::atan2(top - bottom, height);
    let slant = libm::sqrt(height * height + (top - bottom) * (top - bottom));
    // As wide as the outer polygon's side halfway up.
    let middle = 0.5 * (bottom + top);
    let half_width = middle * libm::tan(0.5 * step);
    let half_extents = [0.5 * thickness, half_width, 0.5 * slant];
    let (s, c) = libm::sincos(lean);
    // From the middle of the outer face inwards by half the thickness.
    let slab = Vec3::new(middle - 0.5 * thickness * c, 0.0, 0.5 * height + 0.5 * thickness * s);
    (0..sides)
        .map(|k| {
            let yaw = step * k as f64;
            let turned = Pose::from_parts(Vec3::ZERO, rotation::from_rpy([0.0, 0.0, yaw]));
            let leaned = Pose::from_parts(slab, rotation::from_rpy([0.0, lean, 0.0]));
            (at * turned * leaned, Shape::Box { half_extents, rounding: 0.0 })
        })
        .collect()
}

impl Entry {
    fn item(self, at: &Report, source: &str) -> Result<Item, ModelError> {
        let bad = |element: &str, problem: String, valid: &str| {
            at.bad(format!("object '{}'{element}", self.id), problem, valid)
        };
        let mut parts = Vec::new();
        for (k, part) in self.parts.iter().enumerate() {
            let element = format!(", part {k}");
            let valid = "finite sizes in m, angles in rad";
            parts.extend(part.solids().map_err(|problem| bad(&element, problem, valid))?);
        }
        if parts.len() > MOST_PARTS {
            let valid = format!("at most {MOST_PARTS}, a wall's slabs counted one by one");
            return Err(bad("", format!("has {} convex parts", parts.len()), &valid));
        }
        if self.mass > HEAVIEST_KG {
            return Err(bad("", format!("mass = {}", self.mass), "at most 20 kg"));
        }
        if !self.color.iter().all(|c| (0.0..=1.0).contains(c)) {
            return Err(bad("", format!("color = {:?}", self.color), "three numbers from 0 to 1"));
        }
        let object = Object::new(&self.id, parts, self.mass, self.friction, self.rolling_friction)?;
        let (low, high) = object.bounds();
        let size = (high - low).to_array();
        if size.iter().any(|x| *x > LARGEST_M) {
            return Err(bad("", format!("measures {size:?} m"), "at most 1 m along each axis"));
        }
        Ok(Item {
            object: Arc::new(object),
            title: self.name,
            category: self.category,
            source: source.to_owned(),
            note: self.note,
            color: self.color,
            size,
        })
    }
}

impl Catalogue {
    /// Reads one file's objects.
    ///
    /// # Errors
    /// The file, the object and what would be valid.
    pub fn parse(file: &str, text: &str) -> Result<Catalogue, ModelError> {
        let at = Report::new(Path::new(file));
        let read: File = toml::from_str(text).map_err(|error| at.syntax("TOML", error))?;
        let mut catalogue = Catalogue::default();
        for entry in read.object {
            let item = entry.item(&at, &read.source)?;
            catalogue.add(file, item)?;
        }
        Ok(catalogue)
    }

    /// The objects that come with the program, loaded once.
    ///
    /// # Panics
    /// Never in a build whose tests pass: the files are part of the program, and a test loads them all.
    pub fn builtin() -> &'static Catalogue {
        static ALL: OnceLock<Catalogue> = OnceLock::new();
        ALL.get_or_init(|| {
            let mut all = Catalogue::default();
            for (file, text) in FILES {
                let added = Catalogue::parse(file, text).and_then(|part| {
                    part.items().iter().try_for_each(|item| all.add(file, (**item).clone()))
                });
                if let Err(error) = added {
                    panic!("embedded objects: {error}");
                }
            }
            all
        })
    }
}
