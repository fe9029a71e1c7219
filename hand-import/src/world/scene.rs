//! Reads a world: its rigid objects and terrains with their poses, surfaces and colours.

use std::path::{Path, PathBuf};

use palmares_models::rotation::from_rpy;
use palmares_models::{Mat3, Pose, Rotation, Vec3};

use super::object_file::{self, Stated, is_stated, matrix};
use super::shape::{Shape, Transform, of_file};
use crate::decision::{At, Log};
use crate::numbers::numbers;
use crate::read::element::Element;
use crate::source::Source;

/// A world's bodies.
#[derive(Clone, Debug, Default)]
pub(super) struct Scene {
    pub(super) objects: Vec<Body>,
    pub(super) terrains: Vec<Body>,
}

/// An object, or a fixed body.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Body {
    /// In the task: unique, of letters, digits, `_`, `-` and `.`.
    pub(super) name: String,
    /// As messages name it.
    pub(super) element: String,
    /// Its name in the world, and its number among those of its kind there.
    in_world: (Option<String>, usize),
    pub(super) shape: Shape,
    /// The file of the shape.
    pub(super) geometry: PathBuf,
    /// Of the body in the world.
    pub(super) pose: Pose,
    /// kg
    pub(super) mass: f64,
    /// In the body's frame; `None`: that of the shape.
    pub(super) com: Option<Vec3>,
    /// About the centre of mass; `None`: that of the shape.
    pub(super) inertia: Option<Mat3>,
    pub(super) friction: f64,
    pub(super) restitution: f64,
    /// sRGB
    pub(super) color: [f64; 3],
}

/// Klamp't's colours of bodies that state none.
const OBJECT_COLOR: [f64; 3] = [0.2, 0.4, 0.8];
const TERRAIN_COLOR: [f64; 3] = [0.8, 0.6, 0.2];
/// Objects and terrains that are read; a task has at most 200 objects, and some of a world may be none.
const MOST_READ: usize = 400;
/// Gravity of a run, m/s²; Klamp't's 9.8 is as good.
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

struct Reader<'a> {
    source: &'a Source,
    file: &'a Path,
    names: Vec<String>,
    log: &'a mut Log,
}

/// Reads the elements of a world.
pub(super) fn read(world: &Element, source: &Source, file: &Path, log: &mut Log) -> Scene {
    let mut reader = Reader { source, file, names: vec!["ground".to_owned()], log };
    let mut scene = Scene::default();
    reader.unread(world, &["name"], &[]);
    let (mut objects, mut terrains) = (0.., 0..);
    for element in &world.children {
        let full = scene.objects.len().max(scene.terrains.len()) >= MOST_READ;
        match element.name.as_str() {
            "rigidObject" | "terrain" if full => {
                let text = format!("has more than {MOST_READ} objects or terrains: the others are not read");
                reader.log.problem(At::Hand, "world", text);
            }
            "rigidObject" => scene.objects.extend(reader.body(element, true, objects.next())),
            "terrain" => scene.terrains.extend(reader.body(element, false, terrains.next())),
            "robot" => {
                let text = "is no part of a task, which any hand can play; `palmares hand import` reads it";
                reader.lost(element, text);
            }
            "display" | "appearance" => reader.lost(element, "only changes the look"),
            "simulation" => {}
            "goal" => reader.lost(
                element,
                "is a point for Klamp't's own programs; rules and regions of the task say what counts",
            ),
            _ => reader.lost(element, "is unknown in a world"),
        }
    }
    for simulation in world.all("simulation") {
        reader.simulation(simulation, &mut scene);
    }
    for body in scene.objects.iter_mut().chain(&mut scene.terrains) {
        for (name, value, most) in
            [("kFriction", &mut body.friction, 1e3), ("kRestitution", &mut body.restitution, 1.0)]
        {
            if !(0.0..=most).contains(value) {
                let text = format!("{name} is {value}; valid: 0 to {most}; taken is the nearest");
                reader.log.problem(At::Hand, &body.element, text);
                *value = value.clamp(0.0, most);
            }
        }
    }
    if !scene.objects.is_empty() {
        let text =
            "two surfaces of different friction have the geometric mean of both, in Klamp't the harmonic one";
        reader.log.taken(At::Hand, "kFriction", text);
    }
    scene
}

impl Reader<'_> {
    fn lost(&mut self, element: &Element, text: &str) {
        self.log.dropped(At::Hand, element.label(), text);
    }

    /// The numbers of an attribute; anything else is a problem.
    fn list<const N: usize>(&mut self, element: &Element, attribute: &str) -> Option<[f64; N]> {
        let text = element.get(attribute)?;
        let list = numbers(text).and_then(|found| <[f64; N]>::try_from(found).ok());
        if list.is_none() {
            let shown: String = text.chars().take(40).collect();
            let text = format!(
                "{attribute} is '{shown}'; valid: {N} finite numbers with spaces between them; not read"
            );
            self.log.problem(At::Hand, element.label(), text);
        }
        list
    }

    fn number(&mut self, element: &Element, attribute: &str) -> Option<f64> {
        self.list::<1>(element, attribute).map(|[x]| x)
    }

    fn vector(&mut self, element: &Element, attribute: &str) -> Option<Vec3> {
        self.list(element, attribute).map(Vec3::from_array)
    }

    fn body(&mut self, element: &Element, moves: bool, number: Option<usize>) -> Option<Body> {
        let label = element.label();
        let geometry = element.child("geometry");
        let own = match element.get("file") {
            Some(file) => Some(object_file::read(self.source, self.file, file, &label, self.log)),
            None => None,
        };
        let shape = geometry.and_then(|geometry| geometry.get("file").or(geometry.get("mesh")));
        let stated = match (own, shape) {
            (Some(Err(problem)), _) => Err(problem),
            (Some(Ok(own)), None) => Ok(own),
            (own, Some(name)) => self.source.resolve(self.file, name).and_then(|found| {
                let shape = of_file(self.source, &found.path);
                let shape = shape.map_err(|problem| format!("{} {problem}", found.path.display()))?;
                Ok(match own {
                    Some(Ok(own)) => Stated { shape, geometry: found.path, ..own },
                    _ => Stated::new(shape, found.path),
                })
            }),
            (None, None) => Err("names no file, and has no <geometry> with one".to_owned()),
        };
        let mut stated = match stated {
            Ok(stated) => stated,
            Err(problem) => {
                self.log.problem(At::Hand, label, format!("{problem}; it is left out"));
                return None;
            }
        };
        if let Some(geometry) = geometry {
            stated.shape = stated.shape.transformed(&self.transform(geometry)).simplest();
            self.unread(geometry, &["file", "mesh", "scale"], &POSE);
        }
        let placed = self.pose(element);
        if !moves {
            // A terrain's shape is transformed where it stands.
            stated.shape = stated.shape.transformed(&self.transform(element)).simplest();
            stated.friction = self.number(element, "kFriction").unwrap_or(stated.friction);
        } else if let Some(placed) = placed {
            stated.pose = placed;
        }
        if let Some(physics) = element.child("physics").filter(|_| moves) {
            self.physics(physics, &mut stated);
        }
        let own = if moves { &["name", "file"][..] } else { &["name", "file", "scale", "kFriction"] };
        self.unread(element, own, &POSE);
        let mut color = None;
        for child in &element.children {
            match child.name.as_str() {
                "display" | "appearance" => color = color.or(self.color(child)),
                "geometry" => {}
                "physics" if moves => {}
                _ => self.lost(child, &format!("is unknown in {label}")),
            }
        }
        let Stated { shape, geometry, pose, mass, com, inertia, friction, restitution } = stated;
        let inertia = inertia.filter(is_stated);
        Some(Body {
            name: self.free_name(element.get("name"), &geometry),
            element: label,
            in_world: (element.get("name").map(str::to_owned), number.unwrap_or_default()),
            shape,
            geometry,
            pose: if moves { pose } else { Pose::IDENTITY },
            mass,
            // Klamp't's default beside a stated inertia is the origin.
            com: com.or(inertia.map(|_| Vec3::ZERO)),
            inertia,
            friction,
            restitution,
            color: color.unwrap_or(if moves { OBJECT_COLOR } else { TERRAIN_COLOR }),
        })
    }

    /// A unique name that tasks may have.
    fn free_name(&mut self, name: Option<&str>, geometry: &Path) -> String {
        let stem = geometry.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let name = name.map(str::to_owned).or(stem).unwrap_or_default();
        let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '_' | '-') { c } else { '_' };
        let name: String = name.chars().map(plain).take(48).collect();
        let name = if name.is_empty() { "body".to_owned() } else { name };
        let known = palmares_models::catalogue::Catalogue::builtin();
        let free = |name: &String| !self.names.contains(name) && known.get(name).is_none();
        let numbered = (2..).map(|k| format!("{name}_{k}"));
        let name = std::iter::once(name.clone()).chain(numbered).find(free).unwrap_or(name);
        self.names.push(name.clone());
        name
    }

    fn physics(&mut self, physics: &Element, stated: &mut Stated) {
        stated.mass = self.number(physics, "mass").unwrap_or(stated.mass);
        stated.com = self.vector(physics, "com").or(stated.com);
        stated.inertia = self.list::<9>(physics, "inertia").map(|list| matrix(&list)).or(stated.inertia);
        if physics.get("automass").is_some_and(|on| on.trim() != "0") {
            (stated.com, stated.inertia) = (None, None);
        }
        if self.number(physics, "automassSurfaceFraction").is_some_and(|part| part > 0.0) {
            self.lost(physics, "automassSurfaceFraction: the mass is spread evenly over the volume");
        }
        self.surface(physics, (&mut stated.friction, &mut stated.restitution));
        let read = ["mass", "com", "inertia", "automass", "automassSurfaceFraction"];
        self.unread(physics, &read, &SURFACE);
    }

    /// `kFriction` and `kRestitution`; contacts here are hard.
    fn surface(&mut self, element: &Element, (friction, restitution): (&mut f64, &mut f64)) {
        *friction = self.number(element, "kFriction").unwrap_or(*friction);
        *restitution = self.number(element, "kRestitution").unwrap_or(*restitution);
        for name in ["kStiffness", "kDamping"].into_iter().filter(|name| element.get(name).is_some()) {
            self.lost(element, &format!("{name}: contacts of this program are hard; hands have soft pads"));
        }
    }

    fn color(&mut self, display: &Element) -> Option<[f64; 3]> {
        let name = ["color", "faceColor"].into_iter().find(|name| display.get(name).is_some());
        self.unread(display, &["color", "faceColor"], &[]);
        let text = display.get(name?)?;
        match numbers(text).as_deref() {
            Some(&[r, g, b] | &[r, g, b, _]) => Some([r, g, b].map(|x| x.clamp(0.0, 1.0))),
            _ => {
                self.log.problem(
                    At::Hand,
                    display.label(),
                    "its colour is no list of 3 or 4 numbers; not read",
                );
                None
            }
        }
    }

    /// A line for all attributes that are in neither list.
    fn unread(&mut self, element: &Element, read: &[&str], also: &[&str]) {
        let others = element.attributes.iter().map(|(name, _)| name.as_str());
        let others: Vec<&str> = others.filter(|name| !read.contains(name) && !also.contains(name)).collect();
        if !others.is_empty() {
            self.lost(element, &format!("{}: has no place in a task", others.join(", ")));
        }
    }

    /// The pose that the attributes of an element state, if they state one.
    fn pose(&mut self, element: &Element) -> Option<Pose> {
        POSE.iter().any(|name| element.get(name).is_some()).then(|| {
            let t = self.transform(element);
            Pose::from_parts(t.translation, t.rotation)
        })
    }

    /// As `ReadTransform` of Klamp't's `XmlWorld.cpp`: rotations one after the other, about the axes of the world.
    fn transform(&mut self, element: &Element) -> Transform {
        let place = POSE[..3].iter().find(|name| element.get(name).is_some());
        let translation = place.and_then(|name| self.vector(element, name)).unwrap_or(Vec3::ZERO);
        let mut rotation = Rotation::IDENTITY;
        if let Some(rpy) = self.list(element, "rotateRPY") {
            rotation = from_rpy(rpy);
        }
        if let Some(moment) = self.vector(element, "rotateMoment") {
            rotation = Rotation::from_scaled_axis(moment);
        }
        for (name, axis) in [("rotateX", Vec3::X), ("rotateY", Vec3::Y), ("rotateZ", Vec3::Z)] {
            if let Some(angle) = self.number(element, name) {
                rotation = Rotation::from_axis_angle(axis, angle) * rotation;
            }
        }
        let scale = match element.get("scale").map(|text| text.split_whitespace().count()) {
            Some(3) => self.vector(element, "scale"),
            Some(_) => self.number(element, "scale").map(Vec3::splat),
            None => None,
        };
        Transform { rotation, scale: scale.unwrap_or(Vec3::ONE), translation }
    }

    /// `<simulation>`: surfaces that it states anew. Klamp't's engine and its state have no place.
    fn simulation(&mut self, simulation: &Element, scene: &mut Scene) {
        for element in &simulation.children {
            match element.name.as_str() {
                "globals" => self.globals(element),
                "terrain" => {
                    let bounces = |geometry: &&Element| geometry.get("kRestitution").is_some();
                    if let Some(geometry) = element.all("geometry").find(bounces) {
                        self.lost(geometry, "kRestitution: that of the objects counts in a task");
                    }
                    self.anew(element, &mut scene.terrains);
                }
                "rigidObject" | "object" => self.anew(element, &mut scene.objects),
                "robot" => self.lost(element, "belongs to the robot, which is no part of a task"),
                "joint" => {
                    let text = "joins bodies, and the objects of a task are free: they are apart";
                    self.log.problem(At::Hand, element.label(), text);
                }
                "state" => {
                    self.lost(element, "is a state of Klamp't's engine; the objects begin at their poses")
                }
                _ => self.lost(element, "is unknown in <simulation>"),
            }
        }
    }

    fn globals(&mut self, globals: &Element) {
        if let Some(gravity) = self.list::<3>(globals, "gravity")
            && (Vec3::from_array(gravity) - Vec3::from_array(GRAVITY)).length() > 0.05
        {
            let text = format!("gravity is {gravity:?} m/s²; that of every task is {GRAVITY:?}");
            self.log.problem(At::Hand, globals.label(), text);
        }
        let others: Vec<&str> = globals
            .attributes
            .iter()
            .map(|(name, _)| name.as_str())
            .filter(|name| *name != "gravity")
            .collect();
        if !others.is_empty() {
            self.lost(globals, &format!("{}: settings of Klamp't's engine", others.join(", ")));
        }
    }

    /// Surface of a body that is known by its name or its number.
    fn anew(&mut self, element: &Element, bodies: &mut [Body]) {
        let number = element.get("index").and_then(|index| index.parse::<usize>().ok());
        let name = element.get("name");
        let meant = |body: &&mut Body| {
            let (own, k) = &body.in_world;
            if name.is_some() { own.as_deref() == name } else { number == Some(*k) }
        };
        let valid: Vec<String> = bodies.iter().map(|body| body.element.clone()).collect();
        let found = bodies.iter_mut().find(meant);
        let Some(body) = found else {
            let text = format!(
                "names no body of the world by `name` or `index`; valid: one of: {}",
                valid.join(", ")
            );
            self.log.problem(At::Hand, element.label(), text);
            return;
        };
        for geometry in element.all("geometry") {
            self.surface(geometry, (&mut body.friction, &mut body.restitution));
            self.unread(geometry, &[], &SURFACE);
        }
    }
}

/// Attributes of a pose.
const POSE: [&str; 8] =
    ["translation", "position", "translate", "rotateRPY", "rotateMoment", "rotateX", "rotateY", "rotateZ"];
/// Attributes of a surface.
const SURFACE: [&str; 4] = ["kFriction", "kRestitution", "kStiffness", "kDamping"];
