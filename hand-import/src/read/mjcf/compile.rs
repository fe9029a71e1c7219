//! From the elements of a document to its [`Model`]: defaults, units, frames and names are resolved.

use std::path::Path as FilePath;

use palmares_models::{Mat3, Pose, Vec3};

use super::compiler::{Compiler, FromGeom, z_to};
use super::copies::{Copies, MOST_COPIES, copies, size};
use super::defaults::{Attributes, Defaults};
use super::inertia::{self, Response};
use super::mesh::{Mesh, read_meshes};
use super::model::{Body, Geom, GeomShape, Joint, JointKind, Mass, Model, Site};
use crate::decision::{At, Log};
use crate::read::element::{Element, Notes};
use crate::source::Source;

/// Density of a geom that states none, kg/m³: MuJoCo's default, water.
const DENSITY: f64 = 1000.0;

/// Reads a document whose includes are already replaced.
pub(crate) fn compile(source: &Source, main: &FilePath, root: &Element, log: &mut Log) -> (Model, Vec<Mesh>) {
    let compiler = Compiler::read(root, log);
    let defaults = Defaults::read(root, log);
    let meshes = read_meshes(source, main, root, &compiler, &defaults, log);
    let mut reader = Reader {
        compiler: &compiler,
        defaults: &defaults,
        meshes: &meshes,
        log,
        model: Model::default(),
        copies: Copies::default(),
        response: None,
    };
    for text in root.all("custom").flat_map(|custom| custom.all("text")) {
        if let (Some(name), Some(data)) = (text.get("name"), text.get("data")) {
            reader.model.texts.insert(name.to_owned(), data.to_owned());
        }
    }
    reader.model.name = root.get("model").unwrap_or("MuJoCo Model").to_owned();
    reader.model.bodies.push(Body {
        name: "world".to_owned(),
        parent: 0,
        pose: Pose::IDENTITY,
        joints: Vec::new(),
        geoms: Vec::new(),
        inertia: Mass::default(),
        element: None,
    });
    for world in root.all("worldbody") {
        reader.content(world, 0, Pose::IDENTITY, None);
    }
    let sections = reader.copies.expanded(root);
    reader.pairs(&sections);
    reader.masses();
    reader.springs_and_dampers();
    reader.tendons(&sections);
    reader.actuators(&sections);
    reader.equalities(&sections);
    reader.narrow_ranges();
    reader.excludes(&sections);
    reader.keys(root);
    for dropped in ["deformable", "flex", "extension"] {
        let pid = |plugin: &Element| plugin.get("plugin") == Some("mujoco.pid");
        for element in root.all(dropped).filter(|element| !element.children.iter().all(pid)) {
            reader.log.lost(
                At::Hand,
                element,
                "a hand has rigid links: deformable parts and plugins are left out",
            );
        }
    }
    (reader.model, meshes)
}

pub(super) struct Reader<'a> {
    pub(super) compiler: &'a Compiler,
    pub(super) defaults: &'a Defaults,
    pub(super) meshes: &'a [Mesh],
    pub(super) log: &'a mut Log,
    pub(super) model: Model,
    pub(super) copies: Copies,
    /// Once something needs it.
    response: Option<Response>,
}

impl Reader<'_> {
    fn pose(&mut self, at: &Attributes<'_>) -> Pose {
        let position = at.array::<3>("pos", self.log).map_or(Vec3::ZERO, Vec3::from_array);
        Pose::from_parts(position, self.compiler.orientation(at, self.log))
    }

    /// Reads the content of a body or a frame; `frame` is the pose of the enclosing frames in the body.
    fn content(&mut self, element: &Element, body: usize, frame: Pose, class: Option<&str>) {
        let class = element.get("childclass").or(class);
        for child in &element.children {
            match child.name.as_str() {
                "body" => self.body(child, body, frame, class),
                "frame" => {
                    let at = self.defaults.of(child, "frame", class, self.log);
                    let inner = frame * self.pose(&at);
                    self.content(child, body, inner, class);
                }
                "geom" => self.geom(child, body, frame, class),
                "site" => {
                    let at = self.defaults.of(child, "site", class, self.log);
                    let pose = match at.array::<6>("fromto", self.log) {
                        Some([a, b, c, d, e, f]) => {
                            Pose::from_translation((Vec3::new(a, b, c) + Vec3::new(d, e, f)) * 0.5)
                        }
                        None => self.pose(&at),
                    };
                    let name = self.tree_name(child).unwrap_or_default();
                    self.model.sites.push(Site { name, body, pose: frame * pose });
                }
                "joint" if body != 0 => self.joint(child, body, frame, class),
                "freejoint" if body != 0 => self.free(child, body),
                "replicate" => self.replicate(child, body, frame, class),
                "composite" | "flexcomp" | "attach" => {
                    self.log.bad(
                        child,
                        format!(
                            "<{}> is not read; save the compiled model (`mj_saveLastXML`) and import that",
                            child.name
                        ),
                    );
                }
                _ => {}
            }
        }
    }

    /// Copies of the content, each moved by the same step; their names end with their number.
    fn replicate(&mut self, element: &Element, body: usize, frame: Pose, class: Option<&str>) {
        let at = self.defaults.of(element, "replicate", None, self.log);
        let count = copies(element);
        if self.copies.suffix.is_empty() {
            self.copies.made = self.copies.made.saturating_add(size(element));
        }
        if count == 0 || self.copies.made > MOST_COPIES {
            self.log
                .bad(element, format!("count is {count}; valid: 1 to {MOST_COPIES} elements in all copies"));
            return;
        }
        let offset = at.array::<3>("offset", self.log).map_or(Vec3::ZERO, Vec3::from_array);
        // MuJoCo takes this orientation here: each copy turns by its number times the angles.
        let angles = at.array::<3>("euler", self.log).unwrap_or_default();
        let separator = element.get("sep").unwrap_or_default();
        let digits = count.to_string().len();
        let (outer, mut position) = (self.copies.suffix.clone(), Vec3::ZERO);
        for number in 0..count {
            self.copies.suffix = format!("{separator}{number:0digits$}{outer}");
            let turn = self.compiler.euler_angles(angles.map(|angle| number as f64 * angle));
            self.content(element, body, frame * Pose::from_parts(position, turn), class);
            position += turn * offset;
        }
        self.copies.suffix = outer;
    }

    /// The name of an element of the tree; a copy's ends with its number.
    fn tree_name(&mut self, element: &Element) -> Option<String> {
        element.get("name").map(|name| self.copies.name(name))
    }

    fn body(&mut self, element: &Element, parent: usize, frame: Pose, class: Option<&str>) {
        let inner = element.get("childclass").or(class);
        let at = self.defaults.of(element, "body", None, self.log);
        let pose = frame * self.pose(&at);
        let index = self.model.bodies.len();
        let name = self.tree_name(element).unwrap_or_else(|| format!("body_{index}"));
        if self.model.body(&name).is_some() {
            self.log.bad(element, "has the name of another body");
        }
        self.model.bodies.push(Body {
            name,
            parent,
            pose,
            joints: Vec::new(),
            geoms: Vec::new(),
            inertia: Mass::default(),
            element: Some(element.clone()),
        });
        self.content(element, index, Pose::IDENTITY, inner);
    }

    fn free(&mut self, element: &Element, body: usize) {
        self.push_joint(element, body, JointKind::Free, Vec3::ZERO, Vec3::Z);
    }

    fn push_joint(&mut self, element: &Element, body: usize, kind: JointKind, at: Vec3, axis: Vec3) -> usize {
        let index = self.model.joints.len();
        let name = self.tree_name(element).unwrap_or_else(|| {
            let own = &self.model.bodies[body];
            let number = own.joints.len();
            if number == 0 { format!("{}_joint", own.name) } else { format!("{}_joint_{number}", own.name) }
        });
        self.model.joints.push(Joint {
            name,
            body,
            kind,
            at,
            axis,
            reference: 0.0,
            range: None,
            stiffness: 0.0,
            rest: 0.0,
            damping: 0.0,
            armature: 0.0,
            friction: 0.0,
            force_range: None,
            element: element.clone(),
        });
        self.model.bodies[body].joints.push(index);
        index
    }

    fn joint(&mut self, element: &Element, body: usize, frame: Pose, class: Option<&str>) {
        let at = self.defaults.of(element, "joint", class, self.log);
        let kind = match at.get("type").unwrap_or("hinge") {
            "hinge" => JointKind::Hinge,
            "slide" => JointKind::Slide,
            "ball" => JointKind::Ball,
            "free" => JointKind::Free,
            other => {
                self.log.bad(element, format!("type is '{other}'; valid: hinge, slide, ball, free"));
                return;
            }
        };
        let place = at.array::<3>("pos", self.log).map_or(Vec3::ZERO, Vec3::from_array);
        let axis = at.array::<3>("axis", self.log).map_or(Vec3::Z, Vec3::from_array);
        let axis = if axis.length() < 1e-9 {
            self.log.bad(element, "axis has no direction; taken is z");
            Vec3::Z
        } else {
            axis.normalize()
        };
        let place = frame * place;
        let index = self.push_joint(element, body, kind, place, frame.rotation * axis);
        let turns = matches!(kind, JointKind::Hinge | JointKind::Ball);
        let angle = |x: f64| if turns { self.compiler.angle(x) } else { x };
        let (reference, rest) = (at.number("ref", self.log), at.number("springref", self.log));
        let range = at.array::<2>("range", self.log);
        let limited = limited(at.get("limited"), range, self.compiler.autolimits);
        let mut first = |name: &str| {
            let list = at.list(name, self.log).unwrap_or_default();
            if list.iter().skip(1).any(|x| *x != 0.0) {
                self.log.lost(
                    At::Joint(String::new()),
                    element,
                    format!("{name} is a polynomial; its linear term is taken"),
                );
            }
            list.first().copied().unwrap_or(0.0)
        };
        let (stiffness, damping) = (first("stiffness"), first("damping"));
        let (armature, friction) = (first("armature"), first("frictionloss"));
        let force = at.array::<2>("actuatorfrcrange", self.log);
        let joint = &mut self.model.joints[index];
        joint.reference = angle(reference.unwrap_or(0.0));
        joint.rest = angle(rest.unwrap_or(0.0));
        joint.range = range.filter(|_| limited).map(|r| r.map(angle));
        (joint.stiffness, joint.damping, joint.armature, joint.friction) =
            (stiffness, damping, armature, friction);
        joint.force_range = force.filter(|r| r[0] < r[1]);
    }

    fn geom(&mut self, element: &Element, body: usize, frame: Pose, class: Option<&str>) {
        let at = self.defaults.of(element, "geom", class, self.log);
        let mut pose = self.pose(&at);
        let mut size = at.list("size", self.log).unwrap_or_default();
        size.resize(3.max(size.len()), 0.0);
        let mesh = at.get("mesh").and_then(|name| {
            let found = self.meshes.iter().position(|mesh| mesh.name == name);
            if found.is_none() {
                self.log.bad(element, format!("names mesh '{name}', which is not there"));
            }
            found
        });
        let default_kind = if at.get("mesh").is_some() { "mesh" } else { "sphere" };
        let mut kind = at.get("type").unwrap_or(default_kind);
        if at.get("mesh").is_some() && at.element.get("type").is_none() && kind == "sphere" {
            kind = "mesh";
        }
        if let Some([a, b, c, d, e, f]) = at.array::<6>("fromto", self.log)
            && ["capsule", "cylinder", "box", "ellipsoid"].contains(&kind)
        {
            let (from, to) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
            let along = to - from;
            if along.length() > 0.0 {
                pose = Pose::from_parts((from + to) * 0.5, z_to(along));
            }
            let half = 0.5 * along.length();
            size = if kind == "capsule" || kind == "cylinder" {
                vec![size[0], half, 0.0]
            } else {
                vec![size[0], size[0], half]
            };
        }
        if let (Some(index), true) = (mesh, kind != "mesh") {
            // A primitive that is fitted to a mesh: that of the same inertia.
            let scale = at.number("fitscale", self.log).unwrap_or(1.0);
            if let Some((half, place)) = self.meshes[index].inertia_box() {
                pose *= place;
                size = fitted(kind, half * scale);
                self.log.kept(At::Hand, element, "is the shape with its mesh's inertia, as MuJoCo fits it");
            }
        }
        let shape = match kind {
            "sphere" => GeomShape::Sphere(size[0]),
            "capsule" => GeomShape::Capsule(size[0], size[1]),
            "cylinder" => GeomShape::Cylinder(size[0], size[1]),
            "box" => GeomShape::Box(Vec3::new(size[0], size[1], size[2])),
            "ellipsoid" => GeomShape::Ellipsoid(Vec3::new(size[0], size[1], size[2])),
            "mesh" => match mesh {
                Some(index) => GeomShape::Mesh(index),
                None => return,
            },
            other => GeomShape::Other(other.to_owned()),
        };
        let bits = |name: &str, log: &mut Log| at.number(name, log).unwrap_or(1.0) as u32;
        let contact = [bits("contype", self.log), bits("conaffinity", self.log)];
        let friction = at.list("friction", self.log).and_then(|list| list.first().copied());
        let geom = Geom {
            name: self.tree_name(element),
            body,
            pose: frame * pose,
            shape,
            collides: contact != [0, 0],
            masks: contact,
            group: at.number("group", self.log).unwrap_or(0.0) as i32,
            friction: friction.unwrap_or(1.0),
            mass: at.number("mass", self.log),
            density: at.number("density", self.log).unwrap_or(DENSITY),
            shell: at.get("shellinertia") == Some("true"),
            element: element.clone(),
        };
        self.model.bodies[body].geoms.push(self.model.geoms.len());
        self.model.geoms.push(geom);
    }

    /// Geoms of an explicit pair touch, whatever their masks say.
    fn pairs(&mut self, root: &Element) {
        for pair in root.all("contact").flat_map(|contact| contact.all("pair")) {
            let geom = |model: &Model, name: &str| {
                model.geoms.iter().position(|geom| geom.name.as_deref() == Some(name))
            };
            let found = ["geom1", "geom2"].map(|name| self.named(pair, name, geom));
            if let [Some(a), Some(b)] = found {
                self.model.pairs.push([a, b]);
                [a, b].into_iter().for_each(|g| self.model.geoms[g].collides = true);
            }
        }
    }

    fn masses(&mut self) {
        for index in 1..self.model.bodies.len() {
            let mass = self.mass(index);
            self.model.bodies[index].inertia = mass;
        }
        let total: f64 = self.model.bodies.iter().map(|body| body.inertia.mass).sum();
        if let Some(wanted) = self.compiler.total_mass
            && total > 0.0
        {
            for body in &mut self.model.bodies {
                body.inertia.mass *= wanted / total;
                body.inertia.about_com *= wanted / total;
            }
        }
    }

    fn mass(&mut self, index: usize) -> Mass {
        let body = self.model.bodies[index].clone();
        let Some(element) = &body.element else { return Mass::default() };
        let [low, high] = self.compiler.inertia_groups;
        let geoms = body.geoms.iter().map(|&g| &self.model.geoms[g]);
        let counted: Vec<&Geom> = geoms.filter(|g| (low..=high).contains(&g.group)).collect();
        let from_geoms = self.compiler.inertia_from_geom;
        let stated =
            element.child("inertial").filter(|_| from_geoms != FromGeom::Always || counted.is_empty());
        let mut mass = match stated {
            Some(stated) => self.inertial(stated),
            None if from_geoms == FromGeom::Never => Mass::default(),
            None => {
                if let Some(shell) = counted.iter().find(|geom| geom.shell) {
                    self.log.bad(&shell.element, "shellinertia: the inertia is computed as that of a solid");
                }
                inertia::sum(counted.iter().filter_map(|geom| inertia::of_geom(geom, self.meshes)))
            }
        };
        mass.mass = mass.mass.max(self.compiler.bound_mass);
        if self.compiler.bound_inertia > 0.0 {
            mass.about_com = inertia::bounded(&mass.about_com, self.compiler.bound_inertia);
        }
        mass
    }

    fn inertial(&mut self, element: &Element) -> Mass {
        let at = self.defaults.of(element, "inertial", None, self.log);
        let pose = self.pose(&at);
        let mass = at.number("mass", self.log).unwrap_or(0.0);
        let own = if let Some([xx, yy, zz, xy, xz, yz]) = at.array::<6>("fullinertia", self.log) {
            Mat3::from_cols(Vec3::new(xx, xy, xz), Vec3::new(xy, yy, yz), Vec3::new(xz, yz, zz))
        } else {
            let [x, y, z] = at.array::<3>("diaginertia", self.log).unwrap_or([0.0; 3]);
            Mat3::from_cols(Vec3::X * x, Vec3::Y * y, Vec3::Z * z)
        };
        Mass { mass, com: pose.translation, about_com: inertia::turned(&own, pose.rotation) }
    }

    /// Inertia in the start pose against a force on hinges and slides.
    pub(super) fn inertia(&mut self, levers: &[(usize, f64)]) -> f64 {
        let model = &self.model;
        self.response.get_or_insert_with(|| Response::of(model)).inertia(levers)
    }

    /// `springdamper`: time constant and damping ratio instead of stiffness and damping.
    fn springs_and_dampers(&mut self) {
        for index in 0..self.model.joints.len() {
            let element = self.model.joints[index].element.clone();
            let Some(text) = element.get("springdamper") else { continue };
            let Some(&[time, ratio]) = crate::numbers::numbers(text).as_deref() else { continue };
            if time > 0.0 && ratio > 0.0 {
                let inertia = self.inertia(&[(index, 1.0)]);
                let joint = &mut self.model.joints[index];
                joint.stiffness = inertia / (time * time * ratio * ratio);
                joint.damping = 2.0 * inertia / time;
                self.log.kept(
                    At::Joint(joint.name.clone()),
                    &element,
                    format!(
                        "springdamper {time} {ratio} at the inertia of the start pose: stiffness {:.6}, damping {:.6}",
                        joint.stiffness, joint.damping
                    ),
                );
            }
        }
    }
}

/// Whether a range counts.
pub(super) fn limited(flag: Option<&str>, range: Option<[f64; 2]>, auto: bool) -> bool {
    match flag {
        Some("true") => true,
        Some("false") => false,
        _ => auto && range.is_some_and(|r| r[0] < r[1]),
    }
}

/// Sizes of a primitive whose box of equal inertia has these half edges.
fn fitted(kind: &str, half: Vec3) -> Vec<f64> {
    let round = 0.5 * (half.x + half.y);
    match kind {
        "sphere" => vec![(half.x + half.y + half.z) / 3.0, 0.0, 0.0],
        "capsule" => vec![round, (half.z - 0.5 * round).max(0.0), 0.0],
        "cylinder" => vec![round, half.z, 0.0],
        _ => half.to_array().to_vec(),
    }
}
