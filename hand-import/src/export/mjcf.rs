//! A hand as an MJCF document: the tree of its URDF, with the numbers of the loaded hand.
//!
//! `<custom>` has what MJCF has no place for and the reader of this crate understands: the motors of a tendon, its constant moment
//! arms where others change with the angle, the name of a link between two joints, effort and velocity of a joint's servo.

use std::collections::BTreeMap;

use palmares_models::hand::path::TendonPath;
use palmares_models::hand::{Coordinate, Hand, Inertia, Tendon};
use palmares_models::mjcf::{Element, Lines};
use palmares_models::shape::Shape;
use palmares_models::{Mat3, Pose, Vec3};

use crate::complete::Complete;
use crate::decision::{At, DecisionKind, Log};
use crate::draft::{Draft, Geometry, Joint, JointKind, Link, LinkShape, Tie, Triangles};
use crate::glance::{STATED, WITH_CORNERS};

/// Spring length beyond every tendon's, m or rad.
const FAR: f64 = 1e9;

/// The document.
pub(super) fn document(complete: &Complete, hand: &Hand, log: &mut Log) -> String {
    let draft = &complete.draft;
    let settings = draft.settings.as_deref().and_then(|text| text.parse().ok()).unwrap_or_default();
    let mut writer = Writer {
        draft,
        hand,
        settings,
        log,
        world: Lines::at(2),
        rest: Lines::at(1),
        meshes: BTreeMap::new(),
        texts: Vec::new(),
    };
    let children: Vec<&str> = draft.joints.iter().map(|joint| joint.child.as_str()).collect();
    let base = draft.links.iter().find(|link| !children.contains(&link.name.as_str()));
    if let Some(base) = base {
        writer.body(base, &Pose::IDENTITY, &[]);
    }
    writer.contacts();
    writer.couplings();
    writer.tendons();
    writer.decide();
    let Writer { world, rest, meshes, texts, .. } = writer;
    let mut out = Lines::at(0);
    out.open(Element::new("mujoco").text("model", &hand.name));
    for decision in log.of(DecisionKind::Dropped) {
        out.comment(&format!("{}: {}", decision.element, decision.text));
    }
    let compiler = Element::new("compiler").text("angle", "radian").text("autolimits", "true");
    out.leaf(compiler.text("inertiafromgeom", "false").text("balanceinertia", "true"));
    // Tendons are stiff and links light. The integrator is implicit in position and velocity, limits and couplings are nearly rigid.
    out.comment("`discrete` needs MuJoCo 4; with an earlier one: implicitfast, and timestep=\"0.0002\"");
    out.comment("at longer steps a cable that is hardly tight can swing between tight and slack without end");
    let option = Element::new("option").number("timestep", 5e-4).text("integrator", "discrete");
    out.open(option.text("cone", "elliptic"));
    out.leaf(Element::new("flag").text("filterparent", "disable"));
    out.close("option");
    out.open(Element::new("default"));
    out.leaf(
        Element::new("joint")
            .numbers("solimplimit", [0.9999, 0.9999, 0.001])
            .numbers("solreflimit", [0.005, 1.0]),
    );
    out.leaf(Element::new("equality").numbers("solimp", [0.999, 0.999, 0.001]));
    out.close("default");
    let mut assets = Lines::at(2);
    for ((file, scale), name) in &meshes {
        assets.leaf(Element::new("mesh").text("name", name).text("file", file).text("scale", scale));
    }
    out.section("asset", assets);
    let mut custom = Lines::at(2);
    for (name, data) in &texts {
        custom.leaf(Element::new("text").text("name", name).text("data", data));
    }
    out.section("custom", custom);
    out.section("worldbody", world);
    out.append(rest);
    out.close("mujoco");
    out.into_text()
}

struct Writer<'a> {
    draft: &'a Draft,
    hand: &'a Hand,
    settings: toml::Table,
    log: &'a mut Log,
    /// Bodies.
    world: Lines,
    /// The sections behind them.
    rest: Lines,
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

    fn body(&mut self, link: &'a Link, parent_from_body: &Pose, joints: &[Placed<'a>]) {
        let body = Element::new("body").text("name", &link.name).pose(parent_from_body);
        self.world.open(if self.hand.gravity_compensation { body.text("gravcomp", "1") } else { body });
        for placed in joints {
            self.joint(placed);
        }
        self.inertial(link);
        // MuJoCo takes two points from the pose at which all joints are at 0, where a pin may be open.
        for pin in &self.hand.linkages {
            for ((at, point), name) in pin.links.iter().zip(&pin.points).zip(pin_sites(&pin.name)) {
                if self.hand.links[*at].name == link.name {
                    self.world.leaf(
                        Element::new("site").text("name", &name).vector("pos", *point).text("group", "4"),
                    );
                }
            }
        }
        for part in &link.collisions {
            self.geom(link, part, true);
        }
        for part in &link.visuals {
            self.geom(link, part, false);
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
            self.body(child, &body, &placed);
        }
        self.world.close("body");
    }

    fn joint(&mut self, placed: &Placed<'_>) {
        let Placed { joint, body_from_joint } = placed;
        let kind = if joint.kind == JointKind::Prismatic { "slide" } else { "hinge" };
        let limits = [("effort", joint.effort), ("velocity", joint.velocity)];
        let limits =
            limits.into_iter().filter_map(|(name, x)| Some(format!("{name}={:?}", x.filter(|x| *x > 0.0)?)));
        let limits: Vec<String> = limits.collect();
        if !limits.is_empty() {
            self.texts.push((format!("limit:{}", joint.name), limits.join(" ")));
        }
        let mut out = Element::new("joint").text("name", &joint.name).text("type", kind);
        if body_from_joint.translation != Vec3::ZERO {
            out = out.vector("pos", body_from_joint.translation);
        }
        out = out.vector("axis", body_from_joint.rotation * Vec3::from_array(joint.axis));
        out = match joint.limits.filter(|_| joint.kind != JointKind::Continuous) {
            Some(range) => out.numbers("range", range),
            None => out.text("limited", "false"),
        };
        if let Some(coordinate) = self.coordinate(&joint.name) {
            out = out.number("damping", coordinate.damping);
            if coordinate.friction > 0.0 {
                out = out.number("frictionloss", coordinate.friction);
            }
            if coordinate.stiffness != 0.0 || coordinate.rest != 0.0 {
                out = out.number("stiffness", coordinate.stiffness).number("springref", coordinate.rest);
            }
        }
        self.world.leaf(out);
    }

    /// The loaded hand's inertia where a link is a link of its own, else what its URDF states.
    fn inertial(&mut self, link: &Link) {
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
        if let Some(inertia) = loaded.or(stated).filter(|inertia| inertia.mass > 0.0) {
            self.world.leaf(Element::inertial(&inertia));
        }
    }

    fn geom(&mut self, link: &Link, part: &LinkShape, collides: bool) {
        let shape = match &part.geometry {
            Geometry::Box(size) => Element::geom("box", size.map(|x| x * 0.5)),
            Geometry::Sphere { radius } => Element::geom("sphere", [*radius]),
            Geometry::Cylinder { radius, length } => Element::geom("cylinder", [*radius, 0.5 * length]),
            Geometry::Capsule { radius, length } => Element::geom("capsule", [*radius, 0.5 * length]),
            Geometry::Ellipsoid(radii) => Element::geom("ellipsoid", *radii),
            Geometry::Mesh(mesh) => {
                let Triangles::File(file) = &mesh.triangles else { return };
                let scale = mesh.scale.map(|x| format!("{x:?}")).join(" ");
                let key = (file.display().to_string().replace('\\', "/"), scale);
                let next = format!("mesh_{}", self.meshes.len());
                Element::geom_of_mesh(self.meshes.entry(key).or_insert(next))
            }
        };
        let placed = shape.pose(&part.origin.pose());
        self.world.leaf(if collides {
            placed.numbers("friction", [self.friction(&link.name), 0.005, 0.0001]).text("group", "3")
        } else {
            placed.attributes("contype=\"0\" conaffinity=\"0\" group=\"2\" density=\"0\"")
        });
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

    /// Pairs that never touch: those of the hand, and all neighbours. MuJoCo keeps from each other the neighbours in its own tree,
    /// where joints without a link between them are one step and the base is a part of the world: its filter is off.
    fn contacts(&mut self) {
        let mut out = Lines::at(2);
        let hand = self.hand;
        let solid = self.draft.links.iter().filter(|link| !link.collisions.is_empty());
        let parts: Vec<(&str, usize)> = solid
            .filter_map(|link| Some((link.name.as_str(), hand.link(self.draft.body_of(&link.name))?)))
            .collect();
        let apart = |a: usize, b: usize| {
            let neighbours = hand.links[b].parent == Some(a) || hand.links[a].parent == Some(b);
            neighbours || hand.no_collision.contains(&[a.min(b), a.max(b)])
        };
        let corners = self.touching_with_corners();
        for (place, &(first, a)) in parts.iter().enumerate() {
            for &(second, b) in &parts[place + 1..] {
                let pair = [a.min(b), a.max(b)];
                if apart(a, b) {
                    out.leaf(Element::exclude(first, second));
                } else if corners.contains(&pair) {
                    let name = format!("{WITH_CORNERS}{first}:{second}");
                    out.leaf(Element::exclude(first, second).text("name", &name));
                }
            }
        }
        self.rest.section("contact", out);
    }

    /// Pairs that touch at rest because MJCF's boxes have corners.
    fn touching_with_corners(&self) -> Vec<[usize; 2]> {
        let mut hand = self.hand.clone();
        for geom in hand.links.iter_mut().flat_map(|link| &mut link.geoms) {
            if let Shape::Box { rounding, .. } = &mut geom.shape {
                *rounding = 0.0;
            }
        }
        hand.touching_at_rest()
    }

    fn couplings(&mut self) {
        let mut out = Lines::at(2);
        for coupling in &self.draft.couplings {
            let coefficient = |k: usize| coupling.coefficients.get(k).copied().unwrap_or(0.0);
            let coupled = Element::coupling(&coupling.joint, &coupling.leader);
            out.leaf(coupled.numbers("polycoef", (0..5).map(coefficient)));
        }
        for (joint, leader, polynomial) in self.hand.tendons.iter().filter_map(|tendon| self.curve(tendon)) {
            out.leaf(Element::coupling(joint, leader).numbers("polycoef", polynomial));
        }
        for pin in &self.hand.linkages {
            let [a, b] = pin_sites(&pin.name);
            out.leaf(Element::new("connect").text("name", &pin.name).text("site1", &a).text("site2", &b));
        }
        self.rest.section("equality", out);
    }

    /// A tendon as stiff as a [`Tie`] that only ties a joint to a curve of another's coordinate: the joints' names and the polynomial.
    fn curve(&self, tendon: &Tendon) -> Option<(&'a str, &'a str, [f64; 5])> {
        let ([(joint, arm)], [element]) = (tendon.moment_arms.as_slice(), tendon.elements.as_slice()) else {
            return None;
        };
        let TendonPath::Polynomial(path) = &element.path else { return None };
        let ties = tendon.motors.is_empty() && tendon.both_ways && *joint != element.coordinate;
        if !ties || path.coefficients.len() > 4 || tendon.stiffness < Tie::STIFFNESS.0 {
            return None;
        }
        let mut polynomial = [tendon.rest / arm, 0.0, 0.0, 0.0, 0.0];
        polynomial[1..].iter_mut().zip(&path.coefficients).for_each(|(to, c)| *to = -c / arm);
        let name = |c: usize| self.hand.coordinates[c].name.as_str();
        Some((name(*joint), name(element.coordinate), polynomial))
    }

    fn tendons(&mut self) {
        let (mut tendons, mut actuators) = (Lines::at(2), Lines::at(2));
        let hand = self.hand;
        for tendon in &hand.tendons {
            if self.curve(tendon).is_some() {
                continue;
            }
            let arms = self.arms(tendon);
            let (limit, damping) = (tendon.force_limit, tendon.damping);
            let named = Element::new("fixed").text("name", &tendon.name);
            if tendon.motors.is_empty() {
                let far = if tendon.both_ways { tendon.rest } else { FAR };
                return_spring(&mut tendons, named, &arms, (tendon.stiffness, damping), [tendon.rest, far]);
            } else {
                // The damping is the tendon's: MuJoCo would clamp an actuator's before its implicit step, and oscillate.
                let low = if tendon.both_ways { -limit } else { 0.0 };
                let limited =
                    named.text("actuatorfrclimited", "true").numbers("actuatorfrcrange", [low, limit]);
                let damped = if damping == 0.0 { limited } else { limited.number("damping", damping) };
                tendons.fixed(damped, arms);
            }
            self.actuators(tendon, &mut actuators);
        }
        for spring in &hand.springs {
            let arms: Vec<(&str, f64)> =
                spring.arms.iter().map(|&(c, r)| (hand.coordinates[c].name.as_str(), r)).collect();
            let named = Element::new("fixed").text("name", &spring.name);
            return_spring(&mut tendons, named, &arms, (spring.stiffness, spring.damping), [spring.rest; 2]);
        }
        let drawn = |name: &str| self.draft.tendons.iter().any(|tendon| tendon.name == name);
        // Servos are imported as what they are.
        let listed = |name: &str| self.settings.get("tendons").is_some_and(|own| own.get(name).is_some());
        let stated = hand.tendons.iter().map(|t| t.name.as_str());
        let stated: Vec<&str> = stated.filter(|name| !drawn(name) && listed(name)).collect();
        if !stated.is_empty() {
            self.texts.push((STATED.to_owned(), stated.join(" ")));
        }
        self.rest.section("tendon", tendons);
        self.rest.section("actuator", actuators);
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
        // A text of MJCF has at least one character.
        let exact = if exact.is_empty() { " ".to_owned() } else { exact };
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
    fn actuators(&mut self, tendon: &Tendon, out: &mut Lines) {
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
            let pulls = Element::new("general").text("name", &name).text("tendon", &tendon.name);
            let pulls = pulls.text("ctrlrange", "0 1").number("gainprm", k * weight * motor.scaling);
            out.leaf(if place == 0 {
                pulls.text("biastype", "affine").text("biasprm", &format!("{:?} {:?} 0", k * start, -k))
            } else {
                pulls
            });
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

    /// Decisions on what the format cannot express; `hand.toml` has it.
    fn decide(&mut self) {
        let hand = self.hand;
        let mut lost = Vec::new();
        let rounded = |geom: &palmares_models::hand::Geom| matches!(geom.shape, Shape::Box { rounding, .. } | Shape::Hull { rounding, .. } if rounding > 0.0);
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

/// Names of a pin's points on its two links.
fn pin_sites(pin: &str) -> [String; 2] {
    ["first", "second"].map(|side| format!("{pin}_{side}"))
}

/// A spring that pulls at lengths below the first and above the second; MuJoCo's lengths are positive.
fn return_spring(
    out: &mut Lines,
    tendon: Element,
    arms: &[(&str, f64)],
    (stiffness, damping): (f64, f64),
    [low, high]: [f64; 2],
) {
    let (factor, low, high) =
        if low < 0.0 { (-1.0, if high == low { -low } else { 0.0 }, -low) } else { (1.0, low, high) };
    let spring = tendon.number("stiffness", stiffness).number("damping", damping);
    let arms = arms.iter().map(|(joint, arm)| (*joint, factor * arm));
    out.fixed(spring.numbers("springlength", [low, high]), arms);
}
