//! A hand as an MJCF document: the tree of its URDF, with the numbers of the loaded hand.
//!
//! `<custom>` has what MJCF has no place for and the reader of this crate understands: the motors of a tendon, its constant moment
//! arms where others change with the angle, the name of a link between two joints, effort and velocity of a joint's servo.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use palmares_models::hand::{Coordinate, Hand, Inertia, Tendon};
use palmares_models::{Mat3, Pose, Vec3};

use crate::complete::Complete;
use crate::decision::{At, Kind, Log};
use crate::draft::{Draft, Geometry, Joint, JointKind, Link, Part, Triangles};
use crate::format::STATED;

/// Spring length beyond every tendon's, m or rad.
const FAR: f64 = 1e9;

/// The document.
pub(super) fn document(complete: &Complete, hand: &Hand, log: &mut Log) -> String {
    let draft = &complete.draft;
    let settings = draft.settings.as_deref().and_then(|text| text.parse().ok()).unwrap_or_default();
    let mut writer =
        Writer { draft, hand, settings, log, out: String::new(), meshes: BTreeMap::new(), texts: Vec::new() };
    let children: Vec<&str> = draft.joints.iter().map(|joint| joint.child.as_str()).collect();
    let base = draft.links.iter().find(|link| !children.contains(&link.name.as_str()));
    if let Some(base) = base {
        writer.body(base, &Pose::IDENTITY, &[], 2);
    }
    let world = std::mem::take(&mut writer.out);
    writer.contacts();
    writer.couplings();
    writer.tendons();
    writer.decide();
    let Writer { out: rest, meshes, texts, .. } = writer;
    let mut out = format!("<mujoco model=\"{}\">\n", escaped(&hand.name));
    for decision in log.of(Kind::Dropped) {
        // XML comments must not have two hyphens in a row.
        let text = format!("{}: {}", decision.element, decision.text).replace("--", "- -");
        let _ = writeln!(out, "  <!-- {text} -->");
    }
    out.push_str("  <compiler angle=\"radian\" autolimits=\"true\" inertiafromgeom=\"false\" balanceinertia=\"true\"/>\n");
    // Tendons are stiff and links light. The integrator is implicit in position and velocity, limits and couplings are nearly rigid.
    out.push_str(
        "  <!-- `discrete` needs MuJoCo 4; with an earlier one: implicitfast, and timestep=\"0.0002\" -->\n",
    );
    out.push_str("  <option integrator=\"discrete\" cone=\"elliptic\"/>\n");
    out.push_str("  <default>\n    <joint solimplimit=\"0.9999 0.9999 0.001\"/>\n");
    out.push_str("    <equality solimp=\"0.999 0.999 0.001\"/>\n  </default>\n");
    if !meshes.is_empty() {
        out.push_str("  <asset>\n");
        for ((file, scale), name) in &meshes {
            let _ = writeln!(out, "    <mesh name=\"{name}\" file=\"{}\" scale=\"{scale}\"/>", escaped(file));
        }
        out.push_str("  </asset>\n");
    }
    if !texts.is_empty() {
        out.push_str("  <custom>\n");
        for (name, data) in &texts {
            let _ = writeln!(out, "    <text name=\"{}\" data=\"{}\"/>", escaped(name), escaped(data));
        }
        out.push_str("  </custom>\n");
    }
    let _ = write!(out, "  <worldbody>\n{world}  </worldbody>\n{rest}</mujoco>\n");
    out
}

struct Writer<'a> {
    draft: &'a Draft,
    hand: &'a Hand,
    settings: toml::Table,
    log: &'a mut Log,
    out: String,
    /// Names of meshes by file and scale.
    meshes: BTreeMap<(String, String), String>,
    /// `<custom>` texts.
    texts: Vec<(String, String)>,
}

/// A joint of a body, and its frame in the body's.
struct Placed<'a> {
    joint: &'a Joint,
    body_from_joint: Pose,
}

impl<'a> Writer<'a> {
    fn coordinate(&self, joint: &str) -> Option<&'a Coordinate> {
        self.hand.coordinates.iter().find(|coordinate| coordinate.name == joint)
    }

    /// Name of the joint that carries the coordinate of this one.
    fn leader(&self, joint: &'a str) -> &'a str {
        let mut at = joint;
        for _ in 0..self.draft.couplings.len() {
            match self.draft.couplings.iter().find(|coupling| coupling.joint == at) {
                Some(coupling) => at = &coupling.leader,
                None => break,
            }
        }
        at
    }

    /// The link behind a joint, whether it is only the middle of a joint with two hinges, and then the second joint.
    fn middle(&self, joint: &'a Joint) -> Option<&'a Joint> {
        let link = self.draft.links.iter().find(|link| link.name == joint.child)?;
        let mut next = self.draft.joints.iter().filter(|next| next.parent == link.name);
        let second = next.next().filter(|second| second.kind != JointKind::Fixed)?;
        let light = link.inertial.is_none_or(|inertial| inertial.mass == 0.0);
        let rolls = self.leader(&joint.name) == self.leader(&second.name);
        let bare = link.collisions.is_empty() && next.next().is_none() && (light || rolls);
        (bare && joint.kind != JointKind::Fixed).then_some(second)
    }

    fn body(&mut self, link: &'a Link, parent_from_body: &Pose, joints: &[Placed<'a>], depth: usize) {
        let indent = "  ".repeat(depth);
        let floats = if self.hand.gravity_compensation { " gravcomp=\"1\"" } else { "" };
        let place = place(parent_from_body);
        let _ = writeln!(self.out, "{indent}<body name=\"{}\"{place}{floats}>", escaped(&link.name));
        for placed in joints {
            self.joint(placed, &indent);
        }
        self.inertial(link, &indent);
        for part in &link.collisions {
            self.geom(link, part, true, &indent);
        }
        for part in &link.visuals {
            self.geom(link, part, false, &indent);
        }
        let draft = self.draft;
        for joint in draft.joints.iter().filter(|joint| joint.parent == link.name) {
            let mut joints = vec![joint];
            while let Some(second) = joints.last().and_then(|last| self.middle(last)) {
                joints.push(second);
            }
            let Some(child) = draft.links.iter().find(|l| Some(&l.name) == joints.last().map(|j| &j.child))
            else {
                continue;
            };
            let mut frames: Vec<Pose> = Vec::new();
            for joint in &joints {
                frames.push(frames.last().copied().unwrap_or(Pose::IDENTITY) * joint.origin.pose());
            }
            let body = frames.last().copied().unwrap_or(Pose::IDENTITY);
            for joint in &joints[..joints.len() - 1] {
                self.texts.push((format!("link_of:{}", joint.name), joint.child.clone()));
            }
            let placed = joints.iter().zip(&frames).filter(|(joint, _)| joint.kind != JointKind::Fixed);
            let placed: Vec<Placed<'a>> = placed
                .map(|(joint, frame)| Placed { joint, body_from_joint: body.inverse() * *frame })
                .collect();
            self.body(child, &body, &placed, depth + 1);
        }
        let _ = writeln!(self.out, "{indent}</body>");
    }

    fn joint(&mut self, placed: &Placed<'_>, indent: &str) {
        let Placed { joint, body_from_joint } = placed;
        let kind = if joint.kind == JointKind::Prismatic { "slide" } else { "hinge" };
        let axis = body_from_joint.rotation * Vec3::from_array(joint.axis);
        let _ = write!(self.out, "{indent}  <joint name=\"{}\" type=\"{kind}\"", escaped(&joint.name));
        if body_from_joint.translation != Vec3::ZERO {
            let _ = write!(self.out, " pos=\"{}\"", vector(body_from_joint.translation));
        }
        let limits = [("effort", joint.effort), ("velocity", joint.velocity)];
        let limits =
            limits.into_iter().filter_map(|(name, x)| Some(format!("{name}={:?}", x.filter(|x| *x > 0.0)?)));
        let limits: Vec<String> = limits.collect();
        if !limits.is_empty() {
            self.texts.push((format!("limit:{}", joint.name), limits.join(" ")));
        }
        let _ = write!(self.out, " axis=\"{}\"", vector(axis));
        match joint.limits.filter(|_| joint.kind != JointKind::Continuous) {
            Some([low, high]) => {
                let _ = write!(self.out, " range=\"{low:?} {high:?}\"");
            }
            None => self.out.push_str(" limited=\"false\""),
        }
        if let Some(coordinate) = self.coordinate(&joint.name) {
            let _ = write!(self.out, " damping=\"{:?}\"", coordinate.damping);
            if coordinate.friction > 0.0 {
                let _ = write!(self.out, " frictionloss=\"{:?}\"", coordinate.friction);
            }
            if coordinate.stiffness != 0.0 || coordinate.rest != 0.0 {
                let (stiffness, rest) = (coordinate.stiffness, coordinate.rest);
                let _ = write!(self.out, " stiffness=\"{stiffness:?}\" springref=\"{rest:?}\"");
            }
        }
        self.out.push_str("/>\n");
    }

    /// The loaded hand's inertia where a link is a link of its own, else what its URDF states.
    fn inertial(&mut self, link: &Link, indent: &str) {
        let fixed = |joint: &&Joint| {
            joint.kind == JointKind::Fixed && (joint.parent == link.name || joint.child == link.name)
        };
        let alone = !self.draft.joints.iter().any(|joint| fixed(&joint));
        let loaded = self.hand.link(&link.name).filter(|_| alone).map(|index| self.hand.links[index].inertia);
        let stated = link.inertial.map(|inertial| {
            let [xx, xy, xz, yy, yz, zz] = inertial.inertia;
            let about_com =
                Mat3::from_cols(Vec3::new(xx, xy, xz), Vec3::new(xy, yy, yz), Vec3::new(xz, yz, zz));
            Inertia { mass: inertial.mass, com: Vec3::ZERO, about_com }.moved(&inertial.origin.pose())
        });
        let Some(inertia) = loaded.or(stated).filter(|inertia| inertia.mass > 0.0) else { return };
        let (x, y, z) = (inertia.about_com.x_axis, inertia.about_com.y_axis, inertia.about_com.z_axis);
        let _ = writeln!(
            self.out,
            "{indent}  <inertial pos=\"{}\" mass=\"{:?}\" fullinertia=\"{:?} {:?} {:?} {:?} {:?} {:?}\"/>",
            vector(inertia.com),
            inertia.mass,
            x.x,
            y.y,
            z.z,
            x.y,
            x.z,
            y.z
        );
    }

    fn geom(&mut self, link: &Link, part: &Part, collides: bool, indent: &str) {
        let shape = match &part.geometry {
            Geometry::Box(size) => format!("type=\"box\" size=\"{}\"", vector(Vec3::from_array(*size) * 0.5)),
            Geometry::Sphere { radius } => format!("type=\"sphere\" size=\"{radius:?}\""),
            Geometry::Cylinder { radius, length } => {
                format!("type=\"cylinder\" size=\"{radius:?} {:?}\"", 0.5 * length)
            }
            Geometry::Capsule { radius, length } => {
                format!("type=\"capsule\" size=\"{radius:?} {:?}\"", 0.5 * length)
            }
            Geometry::Ellipsoid(radii) => {
                format!("type=\"ellipsoid\" size=\"{}\"", vector(Vec3::from_array(*radii)))
            }
            Geometry::Mesh(mesh) => {
                let Triangles::File(file) = &mesh.triangles else { return };
                let key =
                    (file.display().to_string().replace('\\', "/"), vector(Vec3::from_array(mesh.scale)));
                let next = format!("mesh_{}", self.meshes.len());
                format!("type=\"mesh\" mesh=\"{}\"", self.meshes.entry(key).or_insert(next))
            }
        };
        let surface = if collides {
            let friction = self.friction(&link.name);
            format!(" friction=\"{friction:?} 0.005 0.0001\" group=\"3\"")
        } else {
            " contype=\"0\" conaffinity=\"0\" group=\"2\" density=\"0\"".to_owned()
        };
        let place = place(&part.origin.pose());
        let _ = writeln!(self.out, "{indent}  <geom {shape}{place}{surface}/>");
    }

    /// Coefficient of a link's surface: that of `hand.toml`, else the source's.
    fn friction(&self, link: &str) -> f64 {
        let number = |value: &toml::Value| value.as_float().or(value.as_integer().map(|x| x as f64));
        let links = self.settings.get("links").and_then(|links| links.get(link));
        let own = links.and_then(|link| link.get("friction")).and_then(number);
        let of_hand = || self.settings.get("friction").and_then(number);
        let drawn = || self.draft.links.iter().find(|l| l.name == link).and_then(|l| l.friction);
        own.or_else(of_hand).or_else(drawn).or(self.draft.friction).unwrap_or(1.0)
    }

    /// Pairs that never touch.
    fn contacts(&mut self) {
        let mut out = String::new();
        for &[a, b] in &self.hand.no_collision {
            let [a, b] = [a, b].map(|index| escaped(&self.hand.links[index].name));
            let _ = writeln!(out, "    <exclude body1=\"{a}\" body2=\"{b}\"/>");
        }
        self.section("contact", &out);
    }

    fn section(&mut self, name: &str, content: &str) {
        if !content.is_empty() {
            let _ = write!(self.out, "  <{name}>\n{content}  </{name}>\n");
        }
    }

    fn couplings(&mut self) {
        let mut out = String::new();
        for coupling in &self.draft.couplings {
            let mut c = coupling.coefficients.clone();
            c.resize(5, 0.0);
            let _ = writeln!(
                out,
                "    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{:?} {:?} {:?} {:?} {:?}\"/>",
                escaped(&coupling.joint),
                escaped(&coupling.leader),
                c[0],
                c[1],
                c[2],
                c[3],
                c[4]
            );
        }
        let hand = self.hand;
        for pin in &hand.linkages {
            let [a, b] = pin.links.map(|link| escaped(&hand.links[link].name));
            let (name, anchor) = (escaped(&pin.name), vector(pin.points[0]));
            let _ = writeln!(
                out,
                "    <connect name=\"{name}\" body1=\"{a}\" body2=\"{b}\" anchor=\"{anchor}\"/>"
            );
        }
        self.section("equality", &out);
    }

    fn tendons(&mut self) {
        let (mut tendons, mut actuators) = (String::new(), String::new());
        let hand = self.hand;
        for tendon in &hand.tendons {
            let arms = self.arms(tendon);
            let limit = tendon.force_limit;
            let more = if tendon.motors.is_empty() {
                let far = if tendon.both_ways { tendon.rest } else { FAR };
                return_spring(tendon.stiffness, tendon.damping, tendon.rest, far)
            } else {
                // The damping is the tendon's: MuJoCo would clamp an actuator's before its implicit step, and oscillate.
                let (low, damping) = (if tendon.both_ways { -limit } else { 0.0 }, tendon.damping);
                let damping =
                    if damping == 0.0 { String::new() } else { format!(" damping=\"{damping:?}\"") };
                (1.0, format!(" actuatorfrclimited=\"true\" actuatorfrcrange=\"{low:?} {limit:?}\"{damping}"))
            };
            fixed(&mut tendons, &tendon.name, &arms, more);
            self.actuators(tendon, &mut actuators);
        }
        for spring in &hand.springs {
            let arms: Vec<(&str, f64)> =
                spring.arms.iter().map(|&(c, r)| (hand.coordinates[c].name.as_str(), r)).collect();
            let more = return_spring(spring.stiffness, spring.damping, spring.rest, spring.rest);
            fixed(&mut tendons, &spring.name, &arms, more);
        }
        let drawn = |name: &str| self.draft.tendons.iter().any(|tendon| tendon.name == name);
        // Servos are imported as what they are.
        let listed = |name: &str| self.settings.get("tendons").is_some_and(|own| own.get(name).is_some());
        let stated = hand.tendons.iter().map(|t| t.name.as_str());
        let stated: Vec<&str> = stated.filter(|name| !drawn(name) && listed(name)).collect();
        if !stated.is_empty() {
            self.texts.push((STATED.to_owned(), stated.join(" ")));
        }
        self.section("tendon", &tendons);
        self.section("actuator", &actuators);
    }

    /// Moment arms; those that change with the angle by their mean over the joint's range.
    fn arms(&mut self, tendon: &Tendon) -> Vec<(&'a str, f64)> {
        let hand = self.hand;
        let name = |c: usize| hand.coordinates[c].name.as_str();
        let mut arms: Vec<(&str, f64)> = tendon.moment_arms.iter().map(|&(c, r)| (name(c), r)).collect();
        // A transmission may list a joint without an arm, for its spring.
        let draft = self.draft;
        let listed = draft.tendons.iter().filter(|other| other.name == tendon.name).flat_map(|t| &t.joints);
        for (joint, _) in listed {
            if !arms.iter().any(|(other, _)| other == joint) {
                arms.push((joint, 0.0));
            }
        }
        if tendon.elements.is_empty() {
            return arms;
        }
        let exact = arms.iter().map(|(joint, r)| format!("{joint}={r:?}")).collect::<Vec<_>>().join(" ");
        self.texts.push((format!("arms:{}", tendon.name), exact));
        for element in &tendon.elements {
            let c = &hand.coordinates[element.coordinate];
            let length = |q: f64| element.path.length(q).value;
            let mean = (length(c.upper) - length(c.lower)) / (c.upper - c.lower);
            let text = format!(
                "its moment arm on joint '{}' changes with the angle; MJCF's fixed tendon has the mean, {mean:.6}; hand.toml has the law",
                c.name
            );
            self.log.dropped(At::Tendon(tendon.name.clone()), format!("tendon '{}'", tendon.name), text);
            match arms.iter_mut().find(|(joint, _)| *joint == c.name) {
                Some((_, arm)) => *arm += mean,
                None => arms.push((&c.name, mean)),
            }
        }
        arms
    }

    /// ctrl is σ: f = K (rest + Σ w scaling (σ − offset) − s). The first motor has the cable's law, the others only pull.
    fn actuators(&mut self, tendon: &Tendon, out: &mut String) {
        let hand = self.hand;
        let drawn = self.draft.tendons.iter().find(|other| other.name == tendon.name);
        let of_tendon: Vec<&str> = tendon.motors.iter().map(|&(m, _)| hand.motors[m].name.as_str()).collect();
        let alone =
            |motor: usize| hand.tendons.iter().filter(|other| other.weight(motor) != 0.0).count() == 1;
        let wound_by =
            drawn.map_or(of_tendon.clone(), |t| t.motors.iter().map(|(name, _)| name.as_str()).collect());
        if wound_by != of_tendon || tendon.motors.len() > 1 || !tendon.motors.iter().all(|&(m, _)| alone(m)) {
            let text = wound_by.iter().map(|name| format!("{name}=1")).collect::<Vec<_>>().join(" ");
            self.texts.push((format!("motors:{}", tendon.name), text));
        }
        let k = tendon.stiffness;
        let start = tendon.wound(&hand.motors, |_| 0.0);
        for (place, &(m, weight)) in tendon.motors.iter().enumerate() {
            let motor = &hand.motors[m];
            let name =
                if alone(m) { motor.name.clone() } else { format!("{}_of_{}", motor.name, tendon.name) };
            let law = if place == 0 {
                format!(" biastype=\"affine\" biasprm=\"{:?} {:?} 0\"", k * start, -k)
            } else {
                String::new()
            };
            let _ = writeln!(
                out,
                "    <general name=\"{}\" tendon=\"{}\" ctrlrange=\"0 1\" gainprm=\"{:?}\"{law}/>",
                escaped(&name),
                escaped(&tendon.name),
                k * weight * motor.scaling,
            );
        }
        if !tendon.guides.is_empty() {
            let text = "friction of a cable on its guides, which grows with the tension (capstan), is not in MJCF: a tendon's frictionloss is constant; hand.toml has it";
            self.log.dropped(At::Tendon(tendon.name.clone()), format!("tendon '{}'", tendon.name), text);
        }
        if tendon.hold_limit.is_some() {
            let text =
                "a drive that holds what it cannot move, and a clutch, are not in MJCF; hand.toml has them";
            self.log.dropped(At::Tendon(tendon.name.clone()), format!("tendon '{}'", tendon.name), text);
        }
    }

    /// What the format cannot say; `hand.toml` has it.
    fn decide(&mut self) {
        let hand = self.hand;
        let mut lost = Vec::new();
        let rounded = |geom: &palmares_models::hand::Geom| {
            use palmares_models::shape::Shape;
            matches!(geom.shape, Shape::Box { rounding, .. } | Shape::Hull { rounding, .. } if rounding > 0.0)
        };
        if hand.links.iter().flat_map(|link| &link.geoms).any(rounded) {
            lost.push("rounded edges: boxes and meshes are sharp");
        }
        if !hand.pads.is_empty() {
            lost.push("soft pads");
        }
        if !hand.tactile.is_empty() {
            lost.push("tactile patches");
        }
        lost.push("sensors and their errors, speed limits of motors");
        for text in lost {
            self.log.dropped(At::Hand, "hand", format!("MJCF has no {text}; hand.toml has them"));
        }
        let text = "friction of a pair: MuJoCo takes the larger coefficient, Palmares the geometric mean";
        self.log.taken(At::Hand, "hand", text);
        let text = "ctrl of an actuator is σ from 0 to 1; MuJoCo does not limit its speed";
        self.log.taken(At::Hand, "hand", text);
    }
}

/// A spring that pulls at lengths below the first and above the second; MuJoCo's lengths are positive. The factor of the moment
/// arms, and the attributes.
fn return_spring(stiffness: f64, damping: f64, low: f64, high: f64) -> (f64, String) {
    let (factor, low, high) =
        if low < 0.0 { (-1.0, if high == low { -low } else { 0.0 }, -low) } else { (1.0, low, high) };
    let text =
        format!(" stiffness=\"{stiffness:?}\" damping=\"{damping:?}\" springlength=\"{low:?} {high:?}\"");
    (factor, text)
}

/// A fixed tendon.
fn fixed(out: &mut String, name: &str, arms: &[(&str, f64)], (factor, more): (f64, String)) {
    let _ = writeln!(out, "    <fixed name=\"{}\"{more}>", escaped(name));
    for (joint, arm) in arms {
        let _ = writeln!(out, "      <joint joint=\"{}\" coef=\"{:?}\"/>", escaped(joint), factor * arm);
    }
    out.push_str("    </fixed>\n");
}

fn vector(v: Vec3) -> String {
    format!("{:?} {:?} {:?}", v.x, v.y, v.z)
}

fn place(pose: &Pose) -> String {
    let mut out = String::new();
    if pose.translation != Vec3::ZERO {
        let _ = write!(out, " pos=\"{}\"", vector(pose.translation));
    }
    let q = pose.rotation;
    if q != palmares_models::Rotation::IDENTITY {
        let _ = write!(out, " quat=\"{:?} {:?} {:?} {:?}\"", q.w, q.x, q.y, q.z);
    }
    out
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
