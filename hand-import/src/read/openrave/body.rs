//! `<Body>`: its pose, shapes and mass.

use std::f64::consts::{FRAC_PI_2, PI};

use palmares_models::{Mat3, Pose, Rotation, Vec3};

use super::super::element::{Element, Notes};
use super::super::reading::Reading;
use super::model::{Body, Mass, Model, Shape};
use super::text::{attribute, child, is_tag, list, matrix, pose, vector};
use crate::decision::At;
use crate::draft::{Geometry, Mesh, Triangles};
use crate::numbers::numbers;

impl Model {
    /// A body, or more about one that is there.
    pub(super) fn body(&mut self, element: &Element, prefix: &str, depth: usize, reading: &mut Reading<'_>) {
        let stated = attribute(element, "name").unwrap_or_default();
        let name = if stated.is_empty() {
            format!("{prefix}body_{}", self.bodies.len())
        } else {
            format!("{prefix}{stated}")
        };
        // A part that a prefix renamed is called by its whole name.
        let there = self.find(&name).or_else(|| self.find(stated).filter(|_| !stated.is_empty()));
        let k = there.unwrap_or_else(|| {
            self.bodies.push(Body { name, pose: Pose::IDENTITY, shapes: Vec::new(), mass: None });
            self.bodies.len() - 1
        });
        self.unscaled(element, reading);
        if let Some(file) = attribute(element, "file") {
            self.file(element, file, depth, reading, |model, root, reading| {
                model.content(k, root, prefix, reading)
            });
        }
        self.content(k, element, prefix, reading);
    }

    fn content(&mut self, k: usize, element: &Element, prefix: &str, reading: &mut Reading<'_>) {
        for part in element.children.iter().filter(|part| is_tag(part, "geom")) {
            let shapes = self.geom(k, part, reading);
            self.bodies[k].shapes.extend(shapes);
        }
        if let Some(stated) = child(element, "mass") {
            self.bodies[k].mass = mass(stated, &self.bodies[k].shapes, reading);
        }
        self.bodies[k].pose = pose(element, self.bodies[k].pose, reading);
        if let Some(from) = child(element, "offsetfrom") {
            match self.find(&format!("{prefix}{}", from.text)).or_else(|| self.find(&from.text)) {
                Some(other) => self.bodies[k].pose = self.bodies[other].pose * self.bodies[k].pose,
                None => reading
                    .log
                    .bad(from, format!("names the body '{}', which is not there before it", from.text)),
            }
        }
        const KNOWN: [&str; 7] =
            ["geom", "mass", "offsetfrom", "translation", "rotationmat", "rotationaxis", "quat"];
        for other in
            element.children.iter().filter(|other| !KNOWN.contains(&other.name.to_ascii_lowercase().as_str()))
        {
            reading.log.lost(At::Link(self.bodies[k].name.clone()), other, "has no place in a hand");
        }
    }

    /// The shapes of a `<Geom>`: one, or that of a file and its picture.
    fn geom(&mut self, k: usize, element: &Element, reading: &mut Reading<'_>) -> Vec<Shape> {
        let at = pose(element, Pose::IDENTITY, reading);
        let one = |geometry: Geometry, pose: Pose| vec![Shape { pose, geometry, touches: true }];
        let number = |tag: &str, reading: &mut Reading<'_>| {
            child(element, tag).and_then(|child| list::<1>(child, reading)).map(|[x]| x)
        };
        let kind = attribute(element, "type").unwrap_or_default().to_ascii_lowercase();
        match kind.as_str() {
            "box" => {
                let half = child(element, "extents").and_then(|extents| vector(extents, reading));
                if let Some(half) = half {
                    return one(Geometry::Box((half * 2.0).to_array()), at);
                }
            }
            "sphere" => {
                if let Some(radius) = number("radius", reading) {
                    return one(Geometry::Sphere { radius }, at);
                }
            }
            "cylinder" => {
                if let (Some(radius), Some(length)) = (number("radius", reading), number("height", reading)) {
                    // OpenRAVE's cylinders are along y.
                    let along_y = Pose::from_parts(Vec3::ZERO, Rotation::from_axis_angle(Vec3::X, FRAC_PI_2));
                    return one(Geometry::Cylinder { radius, length }, at * along_y);
                }
            }
            "trimesh" => return self.trimesh(k, element, at, reading),
            _ => {}
        }
        let text = format!(
            "of type '{kind}' has no size that is read; valid: box with extents, sphere with radius, cylinder with radius and height, trimesh \
             with data; it is left out"
        );
        reading.log.bad(element, text);
        Vec::new()
    }

    fn trimesh(&mut self, k: usize, element: &Element, at: Pose, reading: &mut Reading<'_>) -> Vec<Shape> {
        let [data, render] = ["data", "render"].map(|tag| child(element, tag));
        let Some(touching) = data.or(render) else {
            reading.log.bad(element, "has no <data> with the name of a file; it is left out");
            return Vec::new();
        };
        let name = self.bodies[k].name.clone();
        let mut shapes = Vec::new();
        // Without a picture of its own the shape is the picture, too.
        for (file, touches) in [(Some(touching), true), (render.or(data), false)] {
            let Some(file) = file else { continue };
            let mut words = file.text.split_whitespace();
            let mesh = words.next().unwrap_or_default();
            let scale = match numbers(&words.collect::<Vec<_>>().join(" ")).as_deref() {
                Some([]) => [1.0; 3],
                Some(&[s]) => [s; 3],
                Some(&[x, y, z]) => [x, y, z],
                _ => {
                    reading.log.bad(file, "has a scale that is neither one nor three numbers; taken is 1");
                    [1.0; 3]
                }
            };
            let label = format!("link '{name}'");
            match reading.source.resolve(&self.folder, mesh) {
                Ok(found) => {
                    if let Some(note) = found.note {
                        reading.log.guessed(At::Link(name.clone()), &label, format!("mesh {note}"));
                    }
                    let geometry = Geometry::Mesh(Mesh { triangles: Triangles::File(found.path), scale });
                    shapes.push(Shape { pose: at, geometry, touches });
                }
                Err(problem) if touches => {
                    let text = format!("mesh {problem}; the shape is left out");
                    reading.log.problem(At::Link(name.clone()), &label, text);
                }
                Err(problem) => {
                    let text = format!("picture: mesh {problem}; the shape is left out");
                    reading.log.dropped(At::Link(name.clone()), &label, text);
                }
            }
        }
        shapes
    }
}

/// `<mass>`: of a box, a ball, of the shapes, or stated.
fn mass(element: &Element, shapes: &[Shape], reading: &mut Reading<'_>) -> Option<Mass> {
    let mut number = |tag: &str| {
        child(element, tag).and_then(|child| list::<1>(child, reading)).map(|[x]| x).filter(|x| *x > 0.0)
    };
    let (total, density, radius) = (number("total"), number("density"), number("radius"));
    let extents = child(element, "extents").and_then(|extents| vector(extents, reading));
    let kind = attribute(element, "type").unwrap_or_default().to_ascii_lowercase();
    // Half the sides, as of boxes.
    let of_box = |mass: f64, Vec3 { x, y, z }: Vec3| {
        let diagonal = Vec3::new(y * y + z * z, x * x + z * z, x * x + y * y);
        Mass { mass, com: Vec3::ZERO, inertia: Mat3::from_diagonal(diagonal * (mass / 3.0)) }
    };
    let of_ball = |mass: f64, r: f64| Mass {
        mass,
        com: Vec3::ZERO,
        inertia: Mat3::from_diagonal(Vec3::splat(0.4 * mass * r * r)),
    };
    let of_shapes = |mass: f64| Mass { mass, com: Vec3::ZERO, inertia: Mat3::ZERO };
    match (kind.as_str(), total, density) {
        ("custom", Some(mass), _) => {
            let com = child(element, "com").and_then(|com| vector(com, reading)).unwrap_or(Vec3::ZERO);
            let inertia = child(element, "inertia").and_then(|inertia| list::<9>(inertia, reading));
            Some(Mass { mass, com, inertia: inertia.map(matrix).unwrap_or_default() })
        }
        ("box", Some(mass), _) => Some(extents.map_or_else(|| of_shapes(mass), |half| of_box(mass, half))),
        ("box", None, Some(density)) => {
            extents.map(|half| of_box(8.0 * density * half.to_array().iter().product::<f64>(), half))
        }
        ("sphere", Some(mass), _) => Some(radius.map_or_else(|| of_shapes(mass), |r| of_ball(mass, r))),
        ("sphere", None, Some(density)) => radius.map(|r| of_ball(density * 4.0 / 3.0 * PI * r.powi(3), r)),
        (_, Some(mass), _) => Some(of_shapes(mass)),
        ("mimicgeom", None, Some(density)) => {
            let volume: f64 =
                shapes.iter().filter(|shape| shape.touches).map(|shape| volume(&shape.geometry)).sum();
            (volume > 0.0).then(|| of_shapes(density * volume))
        }
        _ => {
            let text = "has no `total` or `density` above 0 of a box, sphere, mimicgeom or custom: it is as if it were not stated";
            reading.log.bad(element, text);
            None
        }
    }
}

/// Volume of a primitive; that of a mesh is not known here.
fn volume(geometry: &Geometry) -> f64 {
    match geometry {
        Geometry::Box([a, b, c]) => a * b * c,
        Geometry::Sphere { radius } => 4.0 / 3.0 * PI * radius.powi(3),
        Geometry::Cylinder { radius, length } => PI * radius.powi(2) * length,
        _ => 0.0,
    }
}
