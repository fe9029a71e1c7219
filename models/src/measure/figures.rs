//! Figures of a hand: sizes, masses, forces, speeds. They are compared with the limits of a competition and
//! shown to its organizer.

use std::f64::consts::PI;
use std::fmt;

use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::shape::SharedShape;

use super::limits::{Bound, SPECS, Spec};
use crate::hand::{Geom, Hand, Hinge, HingeKind, Link, Tendon};
use crate::shape::{Shape, inertia};
use crate::{Mat3, Pose, Vec3};

/// Steps in which a driven chain closes.
const DRIVE_STEPS: usize = 20;
/// A pin with a smaller gap is closed, m.
const CLOSED_PIN_M: f64 = 1e-6;
/// Samples of a moment arm over the range of its joint.
const ARM_SAMPLES: usize = 65;

/// The part of a hand that a figure belongs to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HandPart {
    /// The hand as a whole.
    Hand,
    /// A link.
    Link(String),
    /// An independent joint.
    Joint(String),
    /// A tendon, by the name of its transmission.
    Tendon(String),
    /// A motor, by the name of its actuator.
    Motor(String),
}

impl fmt::Display for HandPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            HandPart::Hand => write!(f, "robot"),
            HandPart::Link(name) => write!(f, "link '{name}'"),
            HandPart::Joint(name) => write!(f, "joint '{name}'"),
            HandPart::Tendon(name) => write!(f, "transmission '{name}'"),
            HandPart::Motor(name) => write!(f, "actuator '{name}'"),
        }
    }
}

/// A measured number: the worst of the hand, and the part with that value.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// The figure.
    pub spec: &'static Spec,
    /// Value in the unit of `spec`.
    pub value: f64,
    /// Part with that value.
    pub part: HandPart,
    /// The field of `hand.toml` that may state it; empty if none does.
    pub field: &'static str,
    /// Whether it is the size of a mesh.
    pub of_mesh: bool,
}

/// A number for display: five significant digits, or fewer.
pub fn number(x: f64) -> String {
    let magnitude = x.abs();
    if x != 0.0 && x.is_finite() && !(1e-3..1e6).contains(&magnitude) {
        return format!("{x:.3e}").replace(".000e", "e");
    }
    let decimals = [1e4, 1e3, 1e2, 1e1].iter().filter(|power| magnitude < **power).count();
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Keeps the worst of each figure.
#[derive(Default)]
struct Worst(Vec<Figure>);

impl Worst {
    fn see(&mut self, name: &str, value: f64, part: impl FnOnce() -> HandPart, field: &'static str) {
        let Some(spec) = SPECS.iter().find(|spec| spec.name == name) else { return };
        let worse = |known: &Figure| match spec.bound {
            Bound::Most => value > known.value,
            Bound::Least => value < known.value,
        };
        match self.0.iter_mut().find(|known| known.spec.name == name) {
            Some(known) if worse(known) => {
                (known.value, known.part, known.field) = (value, part(), field);
            }
            Some(_) => {}
            None => self.0.push(Figure { spec, value, part: part(), field, of_mesh: false }),
        }
    }
}

impl Hand {
    /// The hand's figures, in the order of [`SPECS`]. A figure that does not apply, such as the stroke of a
    /// hand without sliding joints, is omitted.
    pub fn figures(&self) -> Vec<Figure> {
        let mut worst = Worst::default();
        self.sizes(&mut worst);
        self.masses(&mut worst);
        self.joints(&mut worst);
        self.drives(&mut worst);
        let count = |n: usize| n as f64;
        let shapes: usize = self.links.iter().map(|l| l.geoms.len()).sum();
        for (name, n) in [
            ("links", self.links.len()),
            ("shapes", shapes),
            ("joints", self.coordinates.len()),
            ("tendons", self.tendons.len()),
            ("motors", self.motors.len()),
        ] {
            worst.see(name, count(n), || HandPart::Hand, "");
        }
        let order = |figure: &Figure| SPECS.iter().position(|spec| spec.name == figure.spec.name);
        worst.0.sort_by_key(order);
        for figure in &mut worst.0 {
            figure.of_mesh = figure.spec.unit == "m" && self.is_mesh(&figure.part);
        }
        worst.0
    }

    fn is_mesh(&self, part: &HandPart) -> bool {
        let of = |link: &&Link| match part {
            HandPart::Hand => true,
            HandPart::Link(name) => link.name == *name,
            _ => false,
        };
        self.links.iter().filter(of).flat_map(|l| &l.geoms).any(|g| matches!(g.shape, Shape::Hull { .. }))
    }

    /// The open hand: springs at rest, or at the limit that stops them, and chains closed.
    pub fn open(&self) -> Vec<f64> {
        let mut open: Vec<f64> = self.coordinates.iter().map(|c| c.rest.clamp(c.lower, c.upper)).collect();
        self.close_chains(&mut open);
        open
    }

    /// The coordinates with which a run begins.
    pub fn beginning(&self) -> Vec<f64> {
        if self.start.q.is_empty() { self.open() } else { self.start.q.clone() }
    }

    /// The closed hand: every joint where its tendons pull it, within its limits and as far as the pins of closed chains let it; half a
    /// turn where there is no limit.
    pub fn closed(&self) -> Vec<f64> {
        let open = self.open();
        let mut pull = vec![0.0; open.len()];
        for tendon in &self.tendons {
            tendon.gradient(&open, |c, arm| pull[c] += arm);
        }
        let end = |limit: f64, without: f64| if limit.is_finite() { limit } else { without };
        let ends = self.coordinates.iter().zip(&open).zip(&pull);
        let ends: Vec<Option<f64>> = ends
            .map(|((c, &open), &pull)| match pull {
                p if p > 0.0 => Some(end(c.upper, open + PI)),
                p if p < 0.0 => Some(end(c.lower, open - PI)),
                _ => None,
            })
            .collect();
        if self.linkages.is_empty() {
            return ends.iter().zip(&open).map(|(end, open)| end.unwrap_or(*open)).collect();
        }
        self.drive_chains(open, &ends)
    }

    /// Moves driven coordinates to their ends in small steps while springs pull the others to their rest and pins hold the chains
    /// closed. Pins win over the drive, the drive over springs.
    fn drive_chains(&self, open: Vec<f64>, ends: &[Option<f64>]) -> Vec<f64> {
        let held = |q: &[f64]| self.linkages.iter().all(|pin| pin.at(self, q).gap.length() < CLOSED_PIN_M);
        let mobility = |c: usize| match ends[c] {
            Some(_) => 1e-6,
            None if self.coordinates[c].stiffness > 0.0 => 1e-3,
            None => 1.0,
        };
        let (mut q, mut closed) = (open.clone(), open.clone());
        for step in 1..=DRIVE_STEPS {
            let part = step as f64 / DRIVE_STEPS as f64;
            for (i, c) in self.coordinates.iter().enumerate() {
                match ends[i] {
                    Some(end) => q[i] = open[i] + part * (end - open[i]),
                    None if c.stiffness > 0.0 => q[i] = c.rest.clamp(c.lower, c.upper),
                    None => {}
                }
            }
            self.close_chains_by(&mut q, mobility);
            if !held(&q) {
                // A joint at its limit: the others share its part.
                self.close_chains(&mut q);
            }
            if !held(&q) {
                break;
            }
            closed.clone_from(&q);
        }
        closed
    }

    /// Smallest box along the base's axes around all shapes at coordinates q; `None` without shapes.
    pub fn bounding_box(&self, q: &[f64]) -> Option<(Vec3, Vec3)> {
        let poses = self.base_from_links(q);
        let boxes =
            self.links.iter().zip(&poses).filter_map(|(link, pose)| bounds(&solid(&link.geoms), pose));
        boxes.reduce(|a, b| a.merged(&b)).map(|b| (b.mins, b.maxs))
    }

    fn sizes(&self, worst: &mut Worst) {
        for q in [self.open(), self.closed()] {
            let Some((low, high)) = self.bounding_box(&q) else { continue };
            worst.see("size_m", (high - low).max_element(), || HandPart::Hand, "");
        }
        let mut from_base: Vec<f64> = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let to_link = link.joint.iter().flat_map(|joint| {
                let c = &self.coordinates[joint.coordinate];
                joint.hinges.iter().map(move |hinge| {
                    let along = |q: f64| (hinge.ratio * q + hinge.offset).abs();
                    let slid = match hinge.kind {
                        HingeKind::Prismatic => along(c.lower).max(along(c.upper)),
                        HingeKind::Revolute => 0.0,
                    };
                    hinge.parent_from_hinge.translation.length() + slid
                })
            });
            let to_link: f64 = to_link.sum();
            let origin = link.parent.map_or(0.0, |parent| from_base[parent]) + to_link;
            from_base.push(origin);
            let part = || HandPart::Link(link.name.clone());
            for geom in &link.geoms {
                let far = farthest(&geom.shape, &geom.link_from_geom);
                worst.see("reach_m", origin + far, part, "");
                worst.see("friction", geom.friction, part, "friction");
            }
            if let Some(size) = link.size() {
                worst.see("link_size_m", size.max_element(), part, "");
            }
        }
        let volume: f64 =
            self.links.iter().flat_map(|l| &l.geoms).map(|geom| inertia::volume(&geom.shape)).sum();
        worst.see("volume_m3", volume, || HandPart::Hand, "");
    }

    fn masses(&self, worst: &mut Worst) {
        for link in &self.links {
            for name in ["link_mass_kg", "least_link_mass_kg"] {
                worst.see(name, link.inertia.mass, || HandPart::Link(link.name.clone()), "mass");
            }
        }
        worst.see("mass_kg", self.links.iter().map(|l| l.inertia.mass).sum(), || HandPart::Hand, "");
    }

    /// Whether a coordinate slides: its unit is the metre. It is the motion of the joint that carries it; joints
    /// that follow may be of the other kind, with a ratio in m/rad or rad/m.
    pub fn slides(&self, coordinate: usize) -> bool {
        let moved = self.links.iter().filter_map(|link| link.joint.as_ref());
        let mut moved = moved.filter(|joint| joint.coordinate == coordinate);
        let name = self.coordinates.get(coordinate).map(|c| c.name.as_str());
        let first = moved.clone().next();
        let own = moved.find(|joint| Some(joint.name.as_str()) == name).or(first);
        own.and_then(|joint| joint.hinges.first()).is_some_and(|hinge| hinge.kind == HingeKind::Prismatic)
    }

    fn hinges(&self, coordinate: usize) -> impl Iterator<Item = &Hinge> {
        let joints = self.links.iter().filter_map(|link| link.joint.as_ref());
        joints.filter(move |joint| joint.coordinate == coordinate).flat_map(|joint| &joint.hinges)
    }

    fn joints(&self, worst: &mut Worst) {
        let inertias = self.joint_inertias(&self.open());
        for (i, c) in self.coordinates.iter().enumerate() {
            let part = || HandPart::Joint(c.name.clone());
            for hinge in self.hinges(i) {
                let name = match hinge.kind {
                    HingeKind::Revolute => "joint_range_rad",
                    HingeKind::Prismatic => "joint_stroke_m",
                };
                let range = hinge.ratio.abs() * (c.upper - c.lower);
                // A continuous joint has no range to compare.
                if range.is_finite() || hinge.kind == HingeKind::Prismatic {
                    worst.see(name, range, part, "");
                }
            }
            let slides = self.slides(i);
            let name = |turns: &'static str, slid: &'static str| if slides { slid } else { turns };
            if !slides {
                worst.see("least_joint_inertia_kgm2", inertias[i], part, "");
            }
            worst.see(name("joint_stiffness_nm_rad", "slide_stiffness_n_m"), c.stiffness, part, "stiffness");
            worst.see(name("joint_damping_nms_rad", "slide_damping_ns_m"), c.damping, part, "damping");
            let bent = [c.lower, c.upper].into_iter().filter(|q| q.is_finite()).map(|q| (q - c.rest).abs());
            let spring = c.stiffness * bent.fold(0.0, f64::max);
            worst.see(name("joint_torque_nm", "slide_force_n"), spring, part, "stiffness");
            let pulled: f64 = self.tendons.iter().map(|t| t.force_limit * self.largest_arm(t, i)).sum();
            worst.see(name("joint_torque_nm", "slide_force_n"), pulled, part, "");
        }
    }

    /// Largest |R| of a tendon on a coordinate over the coordinate's range, within half a turn.
    fn largest_arm(&self, tendon: &Tendon, coordinate: usize) -> f64 {
        let c = &self.coordinates[coordinate];
        let (low, high) = (c.lower.max(-PI), c.upper.min(PI));
        let constant: f64 = tendon.moment_arms.iter().filter(|(i, _)| *i == coordinate).map(|(_, r)| r).sum();
        let mut largest = constant.abs();
        for element in tendon.elements.iter().filter(|e| e.coordinate == coordinate) {
            for k in 0..ARM_SAMPLES {
                let q = low + (high - low) * k as f64 / (ARM_SAMPLES - 1) as f64;
                largest = largest.max((constant + element.path.length(q).slope).abs());
            }
        }
        largest
    }

    fn drives(&self, worst: &mut Worst) {
        for tendon in &self.tendons {
            let part = || HandPart::Tendon(tendon.name.clone());
            for c in tendon.coordinates() {
                worst.see("moment_arm", self.largest_arm(tendon, c), part, "");
            }
            worst.see("tendon_stiffness", tendon.stiffness, part, "stiffness");
            worst.see("tendon_damping", tendon.damping, part, "stiffness");
            worst.see("tendon_force", tendon.force_limit, part, "stiffness");
        }
        for (m, motor) in self.motors.iter().enumerate() {
            let part = || HandPart::Motor(motor.name.clone());
            let pull: f64 = self.tendons.iter().map(|t| t.weight(m).abs() * t.force_limit).sum();
            worst.see("motor_scaling", motor.scaling.abs(), part, "scaling");
            worst.see("motor_offset", motor.offset.abs(), part, "scaling");
            worst.see("motor_speed_per_s", motor.speed_limit, part, "scaling");
            worst.see("motor_power_w", motor.largest_power(pull), part, "scaling");
        }
    }

    /// Inertia that each coordinate alone moves at coordinates q, with a fixed base: the diagonal of the mass
    /// matrix.
    fn joint_inertias(&self, q: &[f64]) -> Vec<f64> {
        let base_from_links = self.base_from_links(q);
        (0..self.coordinates.len()).map(|c| self.joint_inertia(c, q, &base_from_links)).collect()
    }

    fn joint_inertia(&self, coordinate: usize, q: &[f64], base_from_links: &[Pose]) -> f64 {
        // Velocity of each link at unit speed of the coordinate: of the point at the base's origin, and angular.
        let mut twists: Vec<(Vec3, Vec3)> = Vec::with_capacity(self.links.len());
        let mut sum = 0.0;
        for (link, base_from_link) in self.links.iter().zip(base_from_links) {
            let parent = link.parent.unwrap_or(0);
            let (mut linear, mut angular) =
                if link.parent.is_some() { twists[parent] } else { (Vec3::ZERO, Vec3::ZERO) };
            if let Some(joint) = link.joint.as_ref().filter(|joint| joint.coordinate == coordinate) {
                let mut before = base_from_links[parent];
                for hinge in &joint.hinges {
                    let at = before * hinge.parent_from_hinge;
                    let axis = at.rotation * hinge.axis * hinge.ratio;
                    match hinge.kind {
                        HingeKind::Revolute => {
                            angular += axis;
                            linear += at.translation.cross(axis);
                        }
                        HingeKind::Prismatic => linear += axis,
                    }
                    before *= hinge.pose(q[coordinate]);
                }
            }
            twists.push((linear, angular));
            let com = base_from_link.transform_point(link.inertia.com);
            let r = Mat3::from_quat(base_from_link.rotation);
            let about_com = r * link.inertia.about_com * r.transpose();
            let velocity = linear + angular.cross(com);
            sum += link.inertia.mass * velocity.dot(velocity) + angular.dot(about_com * angular);
        }
        sum
    }
}

impl Link {
    /// Edges of the smallest box along the link's axes around its shapes; `None` without shapes.
    pub fn size(&self) -> Option<Vec3> {
        bounds(&solid(&self.geoms), &Pose::IDENTITY).map(|around| around.extents())
    }
}

/// Smallest box along the axes of a link around its shapes; `None` without shapes.
pub(crate) fn bounding_box(geoms: &[Geom]) -> Option<(Vec3, Vec3)> {
    bounds(&solid(geoms), &Pose::IDENTITY).map(|b| (b.mins, b.maxs))
}

/// The parry shapes of a link and their poses in its frame.
fn solid(geoms: &[Geom]) -> Vec<(SharedShape, Pose)> {
    let placed = geoms.iter().filter_map(|g| {
        let (shape, upright) = g.shape.to_parry()?;
        Some((shape, g.link_from_geom * upright))
    });
    placed.collect()
}

fn bounds(shapes: &[(SharedShape, Pose)], pose: &Pose) -> Option<Aabb> {
    let boxes = shapes.iter().map(|(shape, at)| shape.compute_aabb(&(*pose * *at)));
    boxes.reduce(|a, b| a.merged(&b))
}

/// Distance of a shape's farthest point from the origin of the frame that it is placed in.
fn farthest(shape: &Shape, pose: &Pose) -> f64 {
    let point = |p: Vec3| pose.transform_point(p).length();
    match shape {
        Shape::Sphere { radius } => pose.translation.length() + radius,
        Shape::Capsule { radius, half_length } => {
            let end = |z: f64| point(Vec3::new(0.0, 0.0, z));
            end(*half_length).max(end(-half_length)) + radius
        }
        Shape::Cylinder { radius, half_length } => {
            let axis = pose.rotation * Vec3::Z;
            let rim = |z: f64| {
                let centre = pose.transform_point(Vec3::new(0.0, 0.0, z));
                let along = centre.dot(axis);
                let across = (centre - axis * along).length() + radius;
                (along * along + across * across).sqrt()
            };
            rim(*half_length).max(rim(-half_length))
        }
        Shape::Box { half_extents: [x, y, z], rounding } => {
            let r = rounding;
            let sign = |k: usize, bit: usize| if k & (1 << bit) == 0 { -1.0 } else { 1.0 };
            let corner =
                |k: usize| Vec3::new(sign(k, 0) * (x - r), sign(k, 1) * (y - r), sign(k, 2) * (z - r));
            (0..8).map(|k| point(corner(k))).fold(0.0, f64::max) + r
        }
        Shape::Hull { points, rounding } => {
            points.iter().map(|p| point(Vec3::from_array(*p))).fold(0.0, f64::max) + rounding
        }
    }
}
