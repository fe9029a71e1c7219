//! From the elements of a document to its [`Model`]: defaults, units, frames and names are resolved.

use std::path::Path as FilePath;

use palmares_models::{Mat3, Pose, Vec3};

use super::compiler::{Compiler, FromGeom, z_to};
use super::defaults::{Attributes, Defaults};
use super::inertia::{self, dof_inertia};
use super::mesh::{Mesh, read_meshes};
use super::model::{
    Actuator, Body, Equality, Geom, GeomShape, Joint, JointKind, Key, Law, Mass, Model, Path, Site, Target,
    Tendon, Way,
};
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
    let mut reader =
        Reader { compiler: &compiler, defaults: &defaults, meshes: &meshes, log, model: Model::default() };
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
    reader.pairs(root);
    reader.masses();
    reader.springs_and_dampers();
    reader.tendons(root);
    reader.actuators(root);
    reader.equalities(root);
    reader.excludes(root);
    reader.keys(root);
    for dropped in ["deformable", "flex", "extension"] {
        for element in root.all(dropped) {
            reader.log.lost(
                At::Hand,
                element,
                "a hand has rigid links: deformable parts and plugins are left out",
            );
        }
    }
    (reader.model, meshes)
}

struct Reader<'a> {
    compiler: &'a Compiler,
    defaults: &'a Defaults,
    meshes: &'a [Mesh],
    log: &'a mut Log,
    model: Model,
}

impl Reader<'_> {
    fn pose(&mut self, at: &Attributes<'_>) -> Pose {
        let position = at.array::<3>("pos", self.log).map_or(Vec3::ZERO, Vec3::from_array);
        Pose::from_parts(position, self.compiler.orientation(at, self.log))
    }

    /// What is in a body or a frame; `frame` is that of the enclosing frames in the body.
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
                    let name = child.get("name").unwrap_or_default().to_owned();
                    self.model.sites.push(Site { name, body, pose: frame * pose });
                }
                "joint" if body != 0 => self.joint(child, body, frame, class),
                "freejoint" if body != 0 => self.free(child, body),
                "replicate" | "composite" | "flexcomp" | "attach" => {
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

    fn body(&mut self, element: &Element, parent: usize, frame: Pose, class: Option<&str>) {
        let inner = element.get("childclass").or(class);
        let at = self.defaults.of(element, "body", None, self.log);
        let pose = frame * self.pose(&at);
        let index = self.model.bodies.len();
        let name = element.get("name").map_or_else(|| format!("body_{index}"), str::to_owned);
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
        let name = element.get("name").map_or_else(
            || {
                let own = &self.model.bodies[body];
                let number = own.joints.len();
                if number == 0 {
                    format!("{}_joint", own.name)
                } else {
                    format!("{}_joint_{number}", own.name)
                }
            },
            str::to_owned,
        );
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
            name: element.get("name").map(str::to_owned),
            body,
            pose: frame * pose,
            shape,
            collides: contact != [0, 0],
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
            for name in ["geom1", "geom2"] {
                let named = pair.get(name);
                let found = self.model.geoms.iter_mut().find(|geom| geom.name.as_deref() == named);
                if let Some(geom) = found {
                    geom.collides = true;
                }
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
        let stated =
            element.child("inertial").filter(|_| self.compiler.inertia_from_geom != FromGeom::Always);
        let mut mass = match stated {
            Some(stated) => self.inertial(stated),
            None if self.compiler.inertia_from_geom == FromGeom::Never => Mass::default(),
            None => {
                let [low, high] = self.compiler.inertia_groups;
                let geoms = body.geoms.iter().map(|&g| &self.model.geoms[g]);
                let counted: Vec<&Geom> = geoms.filter(|g| (low..=high).contains(&g.group)).collect();
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

    /// `springdamper`: time constant and damping ratio instead of stiffness and damping.
    fn springs_and_dampers(&mut self) {
        for index in 0..self.model.joints.len() {
            let element = self.model.joints[index].element.clone();
            let Some(text) = element.get("springdamper") else { continue };
            let Some(&[time, ratio]) = super::numbers::numbers(text).as_deref() else { continue };
            if time > 0.0 && ratio > 0.0 {
                let inertia = dof_inertia(&self.model, index);
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

    fn tendons(&mut self, root: &Element) {
        for element in root.all("tendon").flat_map(|tendon| &tendon.children) {
            let path = match element.name.as_str() {
                "fixed" => self.fixed(element),
                "spatial" => self.spatial(element),
                _ => continue,
            };
            let Some(path) = path else { continue };
            let at = self.defaults.of(element, "tendon", None, self.log);
            let range = at.array::<2>("range", self.log);
            let limited = limited(at.get("limited"), range, self.compiler.autolimits);
            let spring = at.list("springlength", self.log).and_then(|list| match *list.as_slice() {
                [both] if both >= 0.0 => Some([both, both]),
                [low, high, ..] if low >= 0.0 => Some([low, high]),
                _ => None,
            });
            let mut first =
                |name: &str| at.list(name, self.log).and_then(|l| l.first().copied()).unwrap_or(0.0);
            let (stiffness, damping, friction) =
                (first("stiffness"), first("damping"), first("frictionloss"));
            let force = at.array::<2>("actuatorfrcrange", self.log);
            let index = self.model.tendons.len();
            self.model.tendons.push(Tendon {
                name: element.get("name").map_or_else(|| format!("tendon_{index}"), str::to_owned),
                path,
                stiffness,
                spring_length: spring,
                damping,
                friction,
                range: range.filter(|_| limited),
                force_range: force.filter(|r| r[0] < r[1]),
                element: element.clone(),
            });
        }
    }

    fn fixed(&mut self, element: &Element) -> Option<Path> {
        let mut joints = Vec::new();
        for part in element.all("joint") {
            let index = self.named(part, "joint", |model, name| model.joint(name))?;
            let coefficient = part.get("coef").and_then(|text| text.trim().parse().ok());
            let Some(coefficient) = coefficient else {
                self.log.bad(part, "has no coef that is a number");
                continue;
            };
            joints.push((index, coefficient));
        }
        Some(Path::Fixed(joints))
    }

    fn spatial(&mut self, element: &Element) -> Option<Path> {
        let site = |model: &Model, name: &str| model.sites.iter().position(|site| site.name == name);
        let mut ways = Vec::new();
        for part in &element.children {
            ways.push(match part.name.as_str() {
                "site" => Way::Site(self.named(part, "site", site)?),
                "geom" => {
                    let geom = self.named(part, "geom", |model, name| {
                        model.geoms.iter().position(|geom| geom.name.as_deref() == Some(name))
                    })?;
                    let side = match part.get("sidesite") {
                        Some(_) => Some(self.named(part, "sidesite", site)?),
                        None => None,
                    };
                    Way::Wrap(geom, side)
                }
                "pulley" => {
                    let divisor = part.get("divisor").and_then(|text| text.trim().parse().ok());
                    Way::Pulley(divisor.filter(|divisor: &f64| *divisor > 0.0).unwrap_or(1.0))
                }
                _ => continue,
            });
        }
        Some(Path::Spatial(ways))
    }

    /// The index that an attribute names.
    fn named(
        &mut self,
        element: &Element,
        attribute: &str,
        find: impl FnOnce(&Model, &str) -> Option<usize>,
    ) -> Option<usize> {
        let Some(name) = element.get(attribute) else {
            self.log.bad(element, format!("has no {attribute}"));
            return None;
        };
        let found = find(&self.model, name);
        if found.is_none() {
            self.log.bad(element, format!("names {attribute} '{name}', which is not there"));
        }
        found
    }

    fn actuators(&mut self, root: &Element) {
        for element in root.all("actuator").flat_map(|actuator| &actuator.children) {
            let mut spec = self.defaults.actuator(element, self.log);
            let target = if let Some(name) = element.get("joint").or(element.get("jointinparent")) {
                self.model.joint(name).map(Target::Joint)
            } else if let Some(name) = element.get("tendon") {
                self.model.tendons.iter().position(|tendon| tendon.name == name).map(Target::Tendon)
            } else {
                self.log.lost(At::Hand, element, "drives neither a joint nor a tendon; it is left out");
                continue;
            };
            let Some(target) = target else {
                self.log.bad(element, "names a joint or tendon that is not there");
                continue;
            };
            self.limits(element, &mut spec, target);
            let index = self.model.actuators.len();
            let name = element.get("name").map_or_else(|| format!("actuator_{index}"), str::to_owned);
            self.model.actuators.push(Actuator { name, target, spec, element: element.clone() });
        }
    }

    fn limits(&mut self, element: &Element, spec: &mut super::actuator::ActuatorSpec, target: Target) {
        let auto = self.compiler.autolimits;
        let on = |flag: Option<bool>, range: Option<[f64; 2]>| {
            range.filter(|r| flag.unwrap_or(auto) && r[0] < r[1])
        };
        let mut range = on(spec.ctrl_limited, spec.ctrl_range);
        if spec.inherit_range > 0.0 && range.is_none() {
            let moved = match target {
                Target::Joint(j) => self.model.joints[j].range,
                Target::Tendon(t) => self.model.tendons[t].range,
            };
            range = moved.map(|[low, high]| {
                let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * spec.inherit_range);
                [middle - half, middle + half]
            });
        }
        spec.ctrl_range = range;
        let own = on(spec.force_limited, spec.force_range);
        let (of_target, gear) = match target {
            Target::Joint(j) => (self.model.joints[j].force_range, spec.gear),
            Target::Tendon(t) => (self.model.tendons[t].force_range, spec.gear),
        };
        // The other limit counts behind the gear.
        let behind = of_target.filter(|_| gear != 0.0).map(|r| {
            let [a, b] = r.map(|x| x / gear);
            [a.min(b), a.max(b)]
        });
        spec.force_range = match (own, behind) {
            (Some(a), Some(b)) => Some([a[0].max(b[0]), a[1].min(b[1])]),
            (one, other) => one.or(other),
        };
        if let Some(ratio) = spec.damping_ratio.take() {
            let inertia = match target {
                Target::Joint(j) => dof_inertia(&self.model, j) / (spec.gear * spec.gear),
                Target::Tendon(t) => match &self.model.tendons[t].path {
                    Path::Fixed(joints) => joints
                        .iter()
                        .filter(|(_, c)| *c != 0.0)
                        .map(|&(j, c)| dof_inertia(&self.model, j) / (c * c * spec.gear * spec.gear))
                        .sum(),
                    Path::Spatial(_) => 0.0,
                },
            };
            spec.bias[2] = -ratio * 2.0 * (spec.gain.max(0.0) * inertia).sqrt();
            self.log.kept(
                At::Hand,
                element,
                format!("dampratio {ratio} at the inertia of the start pose: kv = {:.6}", -spec.bias[2]),
            );
        }
    }

    fn equalities(&mut self, root: &Element) {
        let poses = self.model.world_from_bodies(&vec![0.0; self.model.joints.len()]);
        for element in root.all("equality").flat_map(|equality| &equality.children) {
            let at = self.defaults.of(element, "equality", None, self.log);
            if at.get("active") == Some("false") {
                self.log.lost(At::Hand, element, "is not active; it is left out");
                continue;
            }
            let law = match element.name.as_str() {
                "joint" => self.joint_law(element, &at),
                "connect" | "weld" => self.body_law(element, &at, &poses),
                _ => {
                    self.log.lost(
                        At::Hand,
                        element,
                        format!("<{}> has no counterpart; it is left out", element.name),
                    );
                    None
                }
            };
            let Some(law) = law else { continue };
            let index = self.model.equalities.len();
            let name = element.get("name").map_or_else(|| format!("loop_{index}"), str::to_owned);
            self.model.equalities.push(Equality { name, law, element: element.clone() });
        }
    }

    fn joint_law(&mut self, element: &Element, at: &Attributes<'_>) -> Option<Law> {
        let first = self.named(element, "joint1", |model, name| model.joint(name))?;
        let second = match element.get("joint2") {
            Some(_) => Some(self.named(element, "joint2", |model, name| model.joint(name))?),
            None => None,
        };
        let mut coefficients = [0.0, 1.0, 0.0, 0.0, 0.0];
        if let Some(list) = at.list("polycoef", self.log) {
            list.iter().take(5).enumerate().for_each(|(k, x)| coefficients[k] = *x);
        }
        Some(Law::Joint(first, second, coefficients))
    }

    fn body_law(&mut self, element: &Element, at: &Attributes<'_>, poses: &[Pose]) -> Option<Law> {
        let welded = element.name == "weld";
        if element.get("site1").is_some() {
            let site = |model: &Model, name: &str| model.sites.iter().position(|site| site.name == name);
            let sites = [self.named(element, "site1", site)?, self.named(element, "site2", site)?];
            let bodies = sites.map(|s| self.model.sites[s].body);
            let points = sites.map(|s| self.model.sites[s].pose.translation);
            return Some(if welded { Law::Weld(bodies, points) } else { Law::Connect(bodies, points) });
        }
        let first = self.named(element, "body1", |model, name| model.body(name))?;
        let second = match element.get("body2") {
            Some(_) => self.named(element, "body2", |model, name| model.body(name))?,
            None => 0,
        };
        let anchor = at.array::<3>("anchor", self.log).map_or(Vec3::ZERO, Vec3::from_array);
        let first_from_second = poses[first].inverse() * poses[second];
        // A connect's anchor is in the first body's frame, a weld's in the second's.
        Some(if welded {
            Law::Weld([first, second], [first_from_second * anchor, anchor])
        } else {
            Law::Connect([first, second], [anchor, first_from_second.inverse() * anchor])
        })
    }

    fn excludes(&mut self, root: &Element) {
        for element in root.all("contact").flat_map(|contact| contact.all("exclude")) {
            let find = |model: &Model, name: &str| model.body(name);
            let first = self.named(element, "body1", find);
            let second = self.named(element, "body2", find);
            if let (Some(a), Some(b)) = (first, second) {
                self.model.excludes.push([a, b]);
            }
        }
    }

    fn keys(&mut self, root: &Element) {
        for element in root.all("keyframe").flat_map(|keyframe| keyframe.all("key")) {
            let Some(qpos) = element.get("qpos").and_then(super::numbers::numbers) else { continue };
            let name = element.get("name").unwrap_or_default().to_owned();
            let width = |joint: &Joint| match joint.kind {
                JointKind::Free => 7,
                JointKind::Ball => 4,
                JointKind::Hinge | JointKind::Slide => 1,
            };
            let wanted: usize = self.model.joints.iter().map(width).sum();
            if qpos.len() != wanted {
                self.log.bad(element, format!("qpos has {} numbers; the joints have {wanted}", qpos.len()));
                continue;
            }
            let mut rest = qpos.as_slice();
            let mut values = Vec::new();
            for joint in &self.model.joints {
                let (own, others) = rest.split_at(width(joint));
                values.push(if own.len() == 1 { own[0] - joint.reference } else { 0.0 });
                rest = others;
            }
            self.model.keys.push(Key { name, x: values });
        }
    }
}

/// Whether a range counts.
fn limited(flag: Option<&str>, range: Option<[f64; 2]>, auto: bool) -> bool {
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
