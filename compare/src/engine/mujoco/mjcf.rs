//! The same scene as a MuJoCo model.

use super::settings::{ARMATURE, BOXES, CONDIM, SLEEP, Settings};
use super::surface::{Surface, Writing};
use palmares_models::hand::{Hand, HingeKind, Inertia, Link};
use palmares_models::mjcf::{Element, Lines};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Model, Owner, State};

/// A fixed box this large in two directions, m, is a plane.
const PLANE_M: f64 = 1.0;

/// The hold of the base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Base {
    /// No hand.
    None,
    /// Welded to the world.
    Bolted,
    /// Flies.
    Free,
    /// Three slides and three hinges, with the servo's gains as actuators.
    Servo,
}

impl Base {
    pub(super) fn of(model: &Model) -> Base {
        match model.hand() {
            None => Base::None,
            Some(_) if model.config().base.bolted => Base::Bolted,
            Some(_) if model.config().base.stiffness == 0.0 => Base::Free,
            Some(_) => Base::Servo,
        }
    }
}

/// A hinge as MuJoCo numbers it.
pub(super) struct HingeDof {
    pub coordinate: usize,
    pub ratio: f64,
    pub offset: f64,
}

/// A document and the order of its joints.
pub(super) struct Document {
    pub xml: String,
    /// All hinges, in the order of `qpos` after the base.
    pub hinges: Vec<HingeDof>,
    /// The hinge that carries each coordinate.
    pub masters: Vec<usize>,
    /// Owner of the shape of each name: `g` and its place here.
    pub owners: Vec<Owner>,
}

/// A shape that is written under the name `g` and its place in the list.
#[derive(Clone, Copy)]
struct Written {
    owner: Owner,
    surface: Surface,
}

struct Writer<'a> {
    model: &'a Model,
    settings: &'a Settings,
    /// Whether rounded boxes keep their roundings, as meshes.
    rounded: bool,
    surfaces: Writing<'a>,
    /// The surface of most objects.
    common: Option<Surface>,
    written: Vec<Written>,
    hinges: Vec<HingeDof>,
    masters: Vec<Option<usize>>,
    bodies: Lines,
    meshes: Lines,
    hulls: usize,
}

/// Notes on all settings, for the report.
pub(super) fn notes() -> Vec<String> {
    [
        "Newton, default tolerances; joint limits are as soft as contacts",
        "bodies sleep as ours do in scenes without a hand, and beside one with `sleep=enable`; MuJoCo lets neither a hand sleep nor \
         what it touches",
        "rolling joint: two hinges in one body and a joint equality, no coupler mass",
        "tendon: fixed tendon and affine actuator with K and b of the model; its set point is clamped to where the \
         tendon will be and f_max beyond, since MuJoCo would clamp the force before its implicit step",
        "base: three slides and three hinges with the servo's gains; hand weight by gravcomp",
        "restitution e: solref of a spring and damper, stiffness (pi^2 + ln^2 e)/T^2 and damping -2 ln e/T, with T of 8 steps, \
         and a constant impedance of 0.99; MuJoCo has no coefficient, and documents this way",
        "forces on a hand from outside by xfrc_applied; a base servo that is switched off has gains and biases of 0",
        "rounded boxes and hulls are convex meshes with 26 corners for each rounding; wide furniture is a plane",
        "friction of a pair: the geometric mean, as ours, wherever an object takes part: hand and furniture have \
         priority, with that of theirs and most objects'; objects of another friction have explicit pairs. Hand on \
         hand and on furniture have the coefficient that they have on objects; rolling resistance by condim 6, friction against spin by condim 4",
    ]
    .map(String::from)
    .to_vec()
}

/// Writes the scene as it is in `state`. The identity of a scene hashes every byte of it ([`crate::scene_id`]): empty sections and double
/// blanks stay, or outcomes that are kept do not count any more.
pub(super) fn document(model: &Model, state: &State, settings: &Settings) -> Option<Document> {
    let config = model.config();
    let coordinates = model.hand().map_or(0, |hand| hand.coordinates.len());
    let mut w = Writer {
        model,
        settings,
        rounded: settings.get(BOXES) != Some("sharp"),
        surfaces: Writing {
            settings,
            condim: settings.get(CONDIM).map_or(Ok(3), str::parse).ok()?,
            step_s: config.step_s,
        },
        common: Surface::common(model.objects()),
        written: Vec::new(),
        hinges: Vec::new(),
        masters: vec![None; coordinates],
        bodies: Lines::at(2),
        meshes: Lines::at(2),
        hulls: 0,
    };
    w.furniture(state)?;
    w.hand(state)?;
    for (k, object) in model.objects().iter().enumerate() {
        w.object(k, object, &state.objects[k]);
    }
    let mut out = Lines::default();
    out.open(Element::new("mujoco").text("model", "palmares"));
    let compiler = Element::new("compiler").text("angle", "radian").text("autolimits", "false");
    out.leaf(compiler.text("inertiafromgeom", "false"));
    let option = Element::new("option").text("timestep", &config.step_s.to_string());
    let option = option.attributes(&settings.option()).vector("gravity", config.gravity);
    out.open(option.text("sleep_tolerance", &config.sleep_linear.to_string()));
    let sleeping = model.hand().is_none() || settings.get(SLEEP) == Some("enable");
    let sleep = if config.sleeping && sleeping { "sleep=\"enable\"" } else { "" };
    out.leaf(Element::new("flag").attributes(&settings.flags()).attributes(sleep));
    out.close("option");
    out.leaf(Element::new("size").text("memory", "256M"));
    out.open(Element::new("default"));
    for tag in ["geom", "pair"] {
        out.leaf(Element::new(tag).attributes(&settings.contact()));
    }
    out.close("default");
    out.around("asset", std::mem::take(&mut w.meshes));
    out.around("worldbody", std::mem::take(&mut w.bodies));
    w.pairs(&mut out);
    w.constraints(&mut out);
    out.close("mujoco");
    let masters = w.masters.into_iter().collect::<Option<Vec<usize>>>()?;
    let owners = w.written.iter().map(|shape| shape.owner).collect();
    Some(Document { xml: out.into_one_line(), hinges: w.hinges, masters, owners })
}

impl Writer<'_> {
    /// A shape with its surface.
    fn shape(&mut self, shape: &Shape, pose: &Pose, surface: Written) {
        let geom = match shape {
            Shape::Box { half_extents, rounding } if *rounding > 0.0 && self.rounded => {
                let core = Vec3::from_array(*half_extents) - Vec3::splat(*rounding);
                let corner = |k: u32| {
                    let signs = [4, 2, 1].map(|bit| if k & bit == 0 { -1.0 } else { 1.0 });
                    (core * Vec3::from_array(signs)).to_array()
                };
                let corners: Vec<[f64; 3]> = (0..8).map(corner).collect();
                self.hull(&corners, *rounding)
            }
            _ => Element::geom_of_shape(shape, |points, rounding| self.hull(points, rounding)),
        };
        self.geom(geom, pose, surface);
    }

    /// A hull. MuJoCo moves a mesh to its own centre and principal axes, and the geom with it.
    fn hull(&mut self, points: &[[f64; 3]], rounding: f64) -> Element {
        let name = format!("hull{}", self.hulls);
        self.hulls += 1;
        let mesh = Element::new("mesh").text("name", &name).text("inertia", "convex");
        self.meshes.leaf(mesh.hull(points, rounding));
        Element::geom_of_mesh(&name)
    }

    /// A geom with its name and its surface. MuJoCo takes the larger coefficient of two, or that of the one with
    /// priority: what is no object has that of its pair with most objects.
    fn geom(&mut self, geom: Element, pose: &Pose, shape: Written) {
        let geom = geom.whole_pose(pose).text("name", &format!("g{}", self.written.len()));
        self.written.push(shape);
        let geom = match (shape.owner, self.common) {
            (Owner::Static | Owner::Link(_), Some(common)) => {
                self.surfaces.geom(geom.text("priority", "1"), shape.surface.with(common))
            }
            _ => self.surfaces.geom(geom, shape.surface),
        };
        self.bodies.leaf(geom);
    }

    /// The pairs that shapes of objects with another surface than most make, and those that rub and rebound.
    fn pairs(&self, out: &mut Lines) {
        let Some(common) = self.common else { return };
        let differs = |shape: &Written| {
            let Surface { friction, restitution, .. } = shape.surface;
            let other = friction != common.friction || restitution != common.restitution;
            other && matches!(shape.owner, Owner::Object(_))
        };
        out.open(Element::new("contact"));
        for (j, b) in self.written.iter().enumerate() {
            for (i, a) in self.written[..j].iter().enumerate() {
                let surface = a.surface.with(b.surface);
                if a.owner != b.owner && (differs(a) || differs(b) || surface.rubs_and_rebounds()) {
                    let pair = Element::new("pair").text("geom1", &format!("g{i}"));
                    out.leaf(self.surfaces.pair(pair.text("geom2", &format!("g{j}")), surface));
                }
            }
        }
        out.close("contact");
    }

    fn furniture(&mut self, state: &State) -> Option<()> {
        let middle = state.objects.iter().fold(Vec3::ZERO, |sum, pose| sum + pose.translation)
            / state.objects.len().max(1) as f64;
        for collider in self.model.colliders() {
            if collider.owner != Owner::Static {
                continue;
            }
            let surface = Written { owner: Owner::Static, surface: Surface::hard(collider.friction) };
            let pose = collider.body_from_shape;
            if collider.shape.as_halfspace().is_some() {
                self.geom(Element::plane(), &pose, surface);
            } else if let Some(cuboid) = collider.shape.as_cuboid() {
                let half = cuboid.half_extents.to_array();
                let thin = (0..3).min_by(|a, b| half[*a].total_cmp(&half[*b]))?;
                let wide = (0..3).all(|k| k == thin || half[k] >= PLANE_M);
                let mut axis = [0.0; 3];
                axis[thin] = 1.0;
                let normal = pose.rotation * Vec3::from_array(axis);
                let normal = if normal.dot(middle - pose.translation) < 0.0 { -normal } else { normal };
                if wide {
                    let at = pose.translation + normal * half[thin];
                    let up = palmares_models::Rotation::from_rotation_arc(Vec3::Z, normal);
                    self.geom(Element::plane(), &Pose::from_parts(at, up), surface);
                    continue;
                }
                self.shape(&Shape::Box { half_extents: half, rounding: 0.0 }, &pose, surface);
            } else {
                // Furniture of other shapes than boxes is not in any scene; better refuse than approximate.
                return None;
            }
        }
        Some(())
    }

    fn object(&mut self, k: usize, object: &Object, pose: &Pose) {
        self.bodies.open(Element::new("body").text("name", &format!("object{k}")).whole_pose(pose));
        self.bodies.leaf(Element::new("freejoint"));
        let inertia = Inertia { mass: object.mass, com: Vec3::ZERO, about_com: object.inertia };
        self.bodies.leaf(Element::inertial(&inertia));
        for (at, shape) in &object.parts {
            let central = Pose::from_parts(at.translation - object.com, at.rotation);
            let (owner, surface) = (Owner::Object(k), Surface::of(object));
            self.shape(shape, &central, Written { owner, surface });
        }
        self.bodies.close("body");
    }

    fn hand(&mut self, state: &State) -> Option<()> {
        if self.model.hand().is_some() { self.link(0, &state.base) } else { Some(()) }
    }

    /// A link and all that hangs from it.
    fn link(&mut self, index: usize, world_from_base: &Pose) -> Option<()> {
        let hand = self.model.hand()?.clone();
        let link: &Link = &hand.links[index];
        let hinges = link.joint.as_ref().map_or(&[][..], |joint| &joint.hinges);
        let at = if link.parent.is_none() {
            *world_from_base
        } else {
            hinges.iter().fold(Pose::IDENTITY, |pose, hinge| pose * hinge.parent_from_hinge)
        };
        let body = Element::new("body").text("name", &format!("link{index}")).whole_pose(&at);
        self.bodies.open(body.attributes(if hand.gravity_compensation { "gravcomp=\"1\"" } else { "" }));
        if link.parent.is_none() {
            self.base_joints(world_from_base);
        }
        let mut frame = Pose::IDENTITY;
        for hinge in hinges {
            let coordinate = link.joint.as_ref()?.coordinate;
            frame *= hinge.parent_from_hinge;
            // The hinge in the link's own frame, all hinges at zero.
            let here = at.inverse() * frame;
            self.joint(coordinate, hinge.kind, &here, hinge.axis, hinge.ratio, hinge.offset)?;
        }
        self.bodies.leaf(Element::inertial(&link.inertia));
        for geom in &link.geoms {
            let (owner, surface) = (Owner::Link(index), Surface::hard(geom.friction));
            self.shape(&geom.shape, &geom.link_from_geom, Written { owner, surface });
        }
        for child in 0..hand.links.len() {
            if hand.links[child].parent == Some(index) {
                self.link(child, world_from_base)?;
            }
        }
        self.bodies.close("body");
        Some(())
    }

    fn base_joints(&mut self, world_from_base: &Pose) {
        match Base::of(self.model) {
            Base::None | Base::Bolted => {}
            Base::Free => self.bodies.leaf(Element::new("freejoint")),
            Base::Servo => {
                for kind in ["slide", "hinge"] {
                    for (k, axis) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
                        let joint =
                            Element::new("joint").text("name", &format!("{kind}{k}")).text("type", kind);
                        self.bodies.leaf(joint.vector("axis", world_from_base.rotation.inverse() * axis));
                    }
                }
            }
        }
    }

    fn joint(
        &mut self,
        coordinate: usize,
        kind: HingeKind,
        here: &Pose,
        axis: Vec3,
        ratio: f64,
        offset: f64,
    ) -> Option<()> {
        let kind = match kind {
            HingeKind::Revolute => "hinge",
            HingeKind::Prismatic => "slide",
        };
        let index = self.hinges.len();
        self.hinges.push(HingeDof { coordinate, ratio, offset });
        let mut out = Element::new("joint").text("name", &format!("j{index}")).text("type", kind);
        out = out.vector("pos", here.translation).vector("axis", here.rotation * axis);
        if let Some(armature) = self.settings.get(ARMATURE) {
            out = out.text("armature", armature);
        }
        if self.masters[coordinate].is_none() && ratio != 0.0 {
            self.masters[coordinate] = Some(index);
            let c = &self.model.hand()?.coordinates[coordinate];
            let square = ratio * ratio;
            out = out.number("stiffness", c.stiffness / square).number("springref", ratio * c.rest + offset);
            out = out.number("damping", c.damping / square);
            if c.friction > 0.0 {
                out = out.number("frictionloss", c.friction / ratio.abs());
            }
            let ends = [ratio * c.lower + offset, ratio * c.upper + offset];
            if ends.iter().all(|x| x.abs() < 100.0) {
                let range = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                out = out.text("limited", "true").numbers("range", range).attributes(&self.settings.limits());
            }
        }
        self.bodies.leaf(out);
        Some(())
    }

    /// Everything behind the bodies: filters, couplings, tendons, actuators.
    fn constraints(&self, out: &mut Lines) {
        let Some(hand) = self.model.hand() else { return };
        let allowed = |a: usize, b: usize| {
            self.model.self_pairs().iter().any(|(x, y)| {
                let owners =
                    [self.model.colliders()[*x as usize].owner, self.model.colliders()[*y as usize].owner];
                owners == [Owner::Link(a), Owner::Link(b)] || owners == [Owner::Link(b), Owner::Link(a)]
            })
        };
        out.open(Element::new("contact"));
        for a in 0..hand.links.len() {
            for b in a + 1..hand.links.len() {
                let shapes = !hand.links[a].geoms.is_empty() && !hand.links[b].geoms.is_empty();
                if shapes && !allowed(a, b) {
                    out.leaf(Element::exclude(&format!("link{a}"), &format!("link{b}")));
                }
            }
        }
        out.close("contact");
        out.open(Element::new("equality"));
        for (i, hinge) in self.hinges.iter().enumerate() {
            let Some(m) = self.masters[hinge.coordinate].filter(|m| *m != i) else { continue };
            let slope = hinge.ratio / self.hinges[m].ratio;
            let shift = hinge.offset - slope * self.hinges[m].offset;
            let coupled = Element::coupling(&format!("j{i}"), &format!("j{m}"));
            let coupled = coupled.text("polycoef", &format!("{shift:?} {slope:?} 0 0 0"));
            out.leaf(coupled.attributes(&self.settings.coupling()));
        }
        out.close("equality");
        self.tendons(hand, out);
    }

    /// Tendons, and the actuators of base and tendons.
    fn tendons(&self, hand: &Hand, out: &mut Lines) {
        let (mut tendons, mut actuators) = (Lines::at(2), Lines::at(2));
        let servo = |on: &str, name: &str, k: f64, d: f64| {
            let servo = Element::new("general").text(on, name).number("gainprm", k);
            servo.text("biastype", "affine").text("biasprm", &format!("0 {:?} {:?}", -k, -d))
        };
        if Base::of(self.model) == Base::Servo {
            let s = &self.model.config().base;
            for (kind, k, d, limit) in [
                ("slide", s.stiffness, s.damping, s.force_limit.min(1e9)),
                ("hinge", s.angular_stiffness, s.angular_damping, s.torque_limit.min(1e9)),
            ] {
                for axis in 0..3 {
                    let servo = servo("joint", &format!("{kind}{axis}"), k, d).text("forcelimited", "true");
                    actuators.leaf(servo.numbers("forcerange", [-limit, limit]));
                }
            }
        }
        for (t, tendon) in hand.tendons.iter().enumerate() {
            let name = format!("t{t}");
            let arm =
                |&(c, r): &(usize, f64)| self.masters[c].map(|m| (format!("j{m}"), r / self.hinges[m].ratio));
            let arms = tendon.moment_arms.iter().filter_map(arm);
            tendons.fixed(Element::new("fixed").text("name", &name), arms);
            actuators.leaf(servo("tendon", &name, tendon.stiffness, tendon.damping));
        }
        out.around("tendon", tendons);
        out.around("actuator", actuators);
    }
}

#[cfg(test)]
mod tests {
    use super::super::SETTINGS;
    use super::*;
    use palmares_bench::rigs::softhand;
    use palmares_models::content::ContentHash;
    use palmares_sim::Config;
    use std::sync::Arc;

    /// Two objects of unlike friction and a hand.
    fn written(settings: &Settings) -> String {
        let mut model =
            Model::new(Config::with_step(1e-3), Some(softhand().expect("built in"))).expect("sound");
        for friction in [0.5, 0.8] {
            let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.03 })];
            let ball = Object::new("ball", parts, 0.1, friction, 0.0).expect("sound");
            model.add_object(Arc::new(ball)).expect("it fits");
        }
        let poses = [0.2, 0.4].map(|x| Pose::translation(x, 0.0, 0.0));
        let state = State::at_rest(&model, Pose::IDENTITY, &poses);
        document(&model, &state, settings).expect("it can be written").xml
    }

    /// Three balls on a floor, with a friction and a coefficient of restitution each.
    fn balls(surfaces: [(f64, f64); 3]) -> String {
        let mut model = Model::new(Config::with_step(1e-3), None).expect("sound");
        model.add_ground(0.0, 0.5);
        for (friction, restitution) in surfaces {
            let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.03 })];
            let ball = Object::new("ball", parts, 0.1, friction, 0.0).expect("sound");
            model.add_object(Arc::new(ball.with_restitution(restitution))).expect("it fits");
        }
        let poses = [0.2, 0.4, 0.6].map(|x| Pose::translation(x, 0.0, 0.03));
        let state = State::at_rest(&model, Pose::IDENTITY, &poses);
        document(&model, &state, &SETTINGS[0]).expect("it can be written").xml
    }

    #[test]
    fn without_rebounds_the_text_of_a_scene_is_what_it_was() {
        // Outcomes of MuJoCo that are kept belong to these texts. The hashes are those of the texts before there were rebounds.
        for (text, known) in [
            (written(&SETTINGS[0]), "314c8c45c2572732"),
            (balls([(0.5, 0.0), (0.8, 0.0), (0.8, 0.0)]), "8d2b44d23c2d7c73"),
        ] {
            assert_eq!(ContentHash::of(&text).to_hex()[..16], *known, "{text}");
        }
    }

    #[test]
    fn rebounds_are_springs_of_eight_steps() {
        // ln 0.8 = -0.2231: stiffness (9.8696 + 0.0498)/(8e-3 s)^2, damping 2 * 0.22314/(8e-3 s).
        let spring = "solref='-154990.58";
        let xml = balls([(0.0, 0.8), (0.0, 0.8), (0.0, 0.8)]);
        assert_eq!(xml.matches(spring).count(), 4, "the floor and three balls: {xml}");
        assert_eq!(xml.matches(" -55.78").count(), 4, "{xml}");
        assert!(!xml.contains("<pair geom1"), "no pair needs its own: {xml}");
        // Of two coefficients the larger one; a geom alone would have the floor's, which is that of most.
        let xml = balls([(0.0, 0.8), (0.0, 0.0), (0.0, 0.0)]);
        assert_eq!(xml.matches("<pair geom1").count(), 3, "the first ball with all others: {xml}");
        assert_eq!(xml.matches(spring).count(), 4, "its own, and its pairs': {xml}");
        assert!(!xml.contains("solreffriction"), "{xml}");
        let xml = balls([(0.3, 0.8), (0.3, 0.8), (0.3, 0.8)]);
        assert_eq!(
            xml.matches("solreffriction='0.02 1'").count(),
            6,
            "what rubs is damped as elsewhere: {xml}"
        );
    }

    #[test]
    fn beside_a_hand_objects_of_unlike_friction_have_their_pairs() {
        let xml = written(&SETTINGS[0]);
        let mu = (0.5f64 * 0.8).sqrt();
        assert!(xml.contains(&format!("friction='{mu:?} {mu:?} 0.0 0.0 0.0'")), "the pair of the two balls");
        assert!(xml.contains("<exclude ") && xml.contains("<fixed "), "and the hand has what it had");
    }

    #[test]
    fn named_settings_reach_the_document() {
        let of = |name: &str| written(SETTINGS.iter().find(|it| it.name == name).expect("there are such"));
        let default = of("default");
        assert!(default.contains("<geom solref='0.02 1' solimp='0.9 0.95 0.001'/>"), "{}", &default[..600]);
        assert!(default.contains("solreflimit='0.02 1'") && default.contains("impratio='1'"));
        let implicit = of("recommended_implicitfast");
        assert!(implicit.contains("integrator='implicitfast'") && implicit.contains("impratio='10'"));
        assert!(!default.contains("sleep='enable'"), "nothing sleeps beside a hand");
        assert!(of("stiff5_multiccd_off").contains("<flag multiccd='disable' />"));
    }

    #[test]
    fn changed_options_reach_the_document() {
        let stiff5 = SETTINGS.iter().find(|it| it.name == "stiff5").expect("there are such");
        let changes = &[
            ("solref", "-1000 -10"),
            ("condim", "4"),
            ("noslip_iterations", "10"),
            ("armature", "1e-6"),
            ("sleep", "enable"),
        ];
        let settings = stiff5.with("changed", "changed", changes).expect("all of these are options");
        let xml = written(&settings);
        for said in [
            "<geom solref='-1000 -10' solimp='0.99 0.999 0.001'/>",
            "solreflimit='-1000 -10'",
            "noslip_iterations='10'",
            "condim='4' friction='0.5 0.005 0.0'",
            "armature='1e-6'",
            "sleep='enable'",
        ] {
            assert!(xml.contains(said), "{said}");
        }
    }
}
