//! From an MJCF document to the [`Draft`] of a hand.

use std::collections::BTreeSet;

use palmares_models::hand::CoordinateSettings;
use palmares_models::read::Limits;
use palmares_models::{Pose, Vec3};

use super::frames::Frames;
use super::mesh::Mesh;
use super::model::{Geom, GeomShape, Joint, JointKind, Law, Model};
use super::{start, tendons};
use crate::decision::{At, Log};
use crate::draft;
use crate::draft::{Coupling, Draft, Geometry, Inertial, Link, LinkShape, Loop, Origin, Triangles};
use crate::read::element::Notes;

/// Maps the hand in a document.
pub(crate) fn draft(model: &Model, meshes: &[Mesh], log: &mut Log) -> Draft {
    let frames = Frames::choose(model, log);
    let mut mapper = Mapper { model, meshes, frames: &frames, log, draft: Draft::default() };
    mapper.draft.name.clone_from(&model.name);
    for &body in &frames.bodies {
        mapper.body(body);
    }
    mapper.equalities();
    let mut draft = mapper.draft;
    for &[a, b] in &model.excludes {
        if frames.has(a) && frames.has(b) {
            let pair = [a, b].map(|body| model.bodies[body].name.clone());
            // Neighbours never touch.
            if !draft.are_neighbours(&pair) {
                draft.exclusions.push(pair);
            }
        }
    }
    never_touch(model, &frames, &mut draft, log);
    let commands = tendons::map(model, &frames, &mut draft, log);
    start::start(model, &frames, &commands, &mut draft, log);
    if model.geoms.iter().any(|geom| frames.has(geom.body) && geom.collides) {
        let text = "MuJoCo takes the larger friction of two surfaces, Palmares the geometric mean of both";
        log.taken(At::Hand, "geom", text);
    }
    draft
}

/// Bodies whose masks keep them from each other.
fn never_touch(model: &Model, frames: &Frames, draft: &mut Draft, log: &mut Log) {
    let solid = |&body: &usize| model.bodies[body].geoms.iter().any(|&g| model.geoms[g].collides);
    let bodies: Vec<usize> = frames.bodies.iter().copied().filter(|&body| body != 0).filter(solid).collect();
    // A hand has no more links.
    if bodies.len() > Limits::default().links {
        return;
    }
    let masks: Vec<[u32; 2]> = bodies.iter().map(|&body| model.masks(body)).collect();
    let pairs: BTreeSet<[usize; 2]> =
        model.pairs.iter().map(|pair| pair.map(|g| model.geoms[g].body)).collect();
    let mut found = 0;
    for (k, &a) in bodies.iter().enumerate() {
        for (l, &b) in bodies.iter().enumerate().skip(k + 1) {
            let ([types, with], [others, their]) = (masks[k], masks[l]);
            let touch = types & their != 0 || others & with != 0;
            let touch = touch || pairs.contains(&[a, b]) || pairs.contains(&[b, a]);
            let pair = [a, b].map(|body| model.bodies[body].name.clone());
            // Neighbours never touch.
            let near = model.bodies[b].parent == a || model.bodies[a].parent == b;
            if !near && !touch && !draft.exclusions.contains(&pair) {
                draft.exclusions.push(pair);
                found += 1;
            }
        }
    }
    if found > 0 {
        let text =
            format!("contype and conaffinity keep {found} pairs of links from each other: no_collision");
        log.taken(At::Hand, "geom", text);
    }
}

struct Mapper<'a> {
    model: &'a Model,
    meshes: &'a [Mesh],
    frames: &'a Frames,
    log: &'a mut Log,
    draft: Draft,
}

impl Mapper<'_> {
    fn body(&mut self, index: usize) {
        let body = &self.model.bodies[index];
        let Some(link_from_body) = self.frames.link_from_body[index] else { return };
        let mut link = Link { name: body.name.clone(), ..Link::default() };
        if body.inertia.mass > 0.0 {
            let (com, i) = (link_from_body * body.inertia.com, body.inertia.about_com);
            link.inertial = Some(Inertial {
                origin: Origin::at(com.to_array()),
                mass: body.inertia.mass,
                inertia: [i.x_axis.x, i.x_axis.y, i.x_axis.z, i.y_axis.y, i.y_axis.z, i.z_axis.z],
            });
        }
        let base = index == self.frames.base();
        // Shapes that are fixed to the world around a hand are scenery.
        let geoms = if index == 0 { &[][..] } else { &body.geoms };
        for geom in geoms.iter().map(|&g| &self.model.geoms[g]) {
            let Some(geometry) = self.geometry(geom, &body.name) else { continue };
            let part = LinkShape { origin: Origin::from_pose(&(link_from_body * geom.pose)), geometry };
            if geom.collides {
                let differs = link.friction.is_some_and(|friction| friction != geom.friction);
                if differs {
                    let text = format!(
                        "friction {}; a link has one coefficient, that of its first shape is taken",
                        geom.friction
                    );
                    self.log.lost(At::Link(body.name.clone()), &geom.element, text);
                }
                link.friction = link.friction.or(Some(geom.friction));
                link.collisions.push(part);
            } else {
                link.visuals.push(part);
            }
        }
        if !base {
            self.joints(index);
        }
        self.draft.links.push(link);
    }

    /// The joints between a body's parent and the body: several follow each other, with links without shapes between them.
    fn joints(&mut self, index: usize) {
        let body = &self.model.bodies[index];
        let parent = &self.model.bodies[body.parent];
        let mut from = parent.name.clone();
        let mut origin = self.frames.link_from_body[body.parent].unwrap_or(Pose::IDENTITY) * body.pose;
        let own: Vec<&Joint> = body.joints.iter().map(|&j| &self.model.joints[j]).collect();
        let own: Vec<&Joint> = own.into_iter().filter(|joint| joint.kind != JointKind::Free).collect();
        if own.is_empty() {
            let mut joint = draft::Joint::fixed(format!("{}_mount", body.name), from, body.name.clone());
            joint.origin = Origin::from_pose(&origin);
            self.draft.joints.push(joint);
            return;
        }
        for (k, joint) in own.iter().enumerate() {
            let last = k + 1 == own.len();
            let between = || {
                let stated = self.model.texts.get(&format!("link_of:{}", joint.name)).cloned();
                stated.unwrap_or_else(|| format!("{}_{}", body.name, joint.name))
            };
            let to = if last { body.name.clone() } else { between() };
            let mut mapped = self.joint(joint, &from, &to);
            mapped.origin = Origin::from_pose(&(origin * Pose::from_translation(joint.at)));
            self.draft.joints.push(mapped);
            if !last {
                self.draft.links.push(Link { name: to.clone(), ..Link::default() });
            }
            origin = Pose::from_translation(-joint.at);
            from = to;
        }
    }

    fn joint(&mut self, joint: &Joint, parent: &str, child: &str) -> draft::Joint {
        let at = At::Joint(joint.name.clone());
        if joint.reference != 0.0 {
            let text = format!("ref {}: coordinates count from there", joint.reference);
            self.log.kept(at.clone(), &joint.element, text);
        }
        let limits = joint.range.map(|range| range.map(|x| x - joint.reference));
        let some = |x: f64| (x != 0.0).then_some(x);
        let stated = self.model.stated(&format!("limit:{}", joint.name)).unwrap_or_default();
        let stated = |name: &str| stated.iter().find(|(other, _)| other == name).map(|(_, x)| *x);
        let (kind, limits) = match (joint.kind, limits) {
            (JointKind::Hinge, None) => (draft::JointKind::Continuous, None),
            (JointKind::Hinge, limits) => (draft::JointKind::Revolute, limits),
            (JointKind::Ball, limits) => (draft::JointKind::Ball, limits.map(|r| [-r[1], r[1]])),
            (_, limits) => (draft::JointKind::Prismatic, limits),
        };
        draft::Joint {
            kind,
            axis: joint.axis.to_array(),
            limits,
            effort: stated("effort"),
            velocity: stated("velocity"),
            armature: some(joint.armature),
            stated: CoordinateSettings {
                stiffness: some(joint.stiffness),
                damping: some(joint.damping),
                rest: (joint.stiffness != 0.0 || joint.rest != 0.0).then_some(joint.rest - joint.reference),
                friction: some(joint.friction),
            },
            ..draft::Joint::fixed(joint.name.clone(), parent, child)
        }
    }

    fn geometry(&mut self, geom: &Geom, link: &str) -> Option<Geometry> {
        Some(match &geom.shape {
            GeomShape::Sphere(radius) => Geometry::Sphere { radius: *radius },
            GeomShape::Capsule(radius, half) => Geometry::Capsule { radius: *radius, length: 2.0 * half },
            GeomShape::Cylinder(radius, half) => Geometry::Cylinder { radius: *radius, length: 2.0 * half },
            GeomShape::Box(half) => Geometry::Box((*half * 2.0).to_array()),
            GeomShape::Ellipsoid(half) => Geometry::Ellipsoid(half.to_array()),
            GeomShape::Mesh(index) => {
                let mesh = &self.meshes[*index];
                if mesh.triangles.is_empty() {
                    return None;
                }
                let (triangles, scale) = match &mesh.file {
                    Some(file) => (Triangles::File(file.clone()), mesh.scale),
                    None => {
                        let corners = mesh.triangles.clone();
                        (Triangles::Inline { name: mesh.name.clone(), corners }, [1.0; 3])
                    }
                };
                Geometry::Mesh(draft::Mesh { triangles, scale })
            }
            GeomShape::Other(kind) => {
                let text = format!("a {kind} is scenery; it is left out");
                self.log.lost(At::Link(link.to_owned()), &geom.element, text);
                return None;
            }
        })
    }

    fn equalities(&mut self) {
        for equality in &self.model.equalities {
            match &equality.law {
                Law::Joint(first, second, coefficients) => {
                    let follower = &self.model.joints[*first];
                    if !self.frames.moves(follower.body) {
                        continue;
                    }
                    let Some(second) = second else {
                        self.hold(follower, coefficients[0]);
                        continue;
                    };
                    let used = coefficients.iter().rposition(|c| *c != 0.0).map_or(1, |last| last + 1).max(2);
                    self.draft.couplings.push(Coupling {
                        joint: follower.name.clone(),
                        leader: self.model.joints[*second].name.clone(),
                        coefficients: coefficients[..used].to_vec(),
                    });
                }
                Law::Connect(bodies, points) => self.pin(equality, *bodies, *points, false),
                Law::Weld(bodies, points) => self.pin(equality, *bodies, *points, true),
            }
        }
    }

    /// A joint that an equality holds at one position is fixed there.
    fn hold(&mut self, joint: &Joint, x: f64) {
        let Some(mapped) = self.draft.joints.iter_mut().find(|mapped| mapped.name == joint.name) else {
            return;
        };
        mapped.kind = draft::JointKind::Fixed;
        let centred = Joint { at: Vec3::ZERO, ..joint.clone() };
        mapped.origin = Origin::from_pose(&(mapped.origin.pose() * centred.motion(x)));
        self.log.kept(
            At::Joint(joint.name.clone()),
            &joint.element,
            format!("an equality holds it at {x}: it is fixed"),
        );
    }

    fn pin(
        &mut self,
        equality: &super::model::Equality,
        bodies: [usize; 2],
        points: [Vec3; 2],
        welded: bool,
    ) {
        let frames = bodies.map(|body| self.frames.link_from_body[body]);
        let [Some(first), Some(second)] = frames else {
            self.log.lost(At::Hand, &equality.element, "joins a body outside the hand; it is left out");
            return;
        };
        self.draft.loops.push(Loop {
            name: equality.name.clone(),
            links: bodies.map(|body| self.model.bodies[body].name.clone()),
            points: [(first * points[0]).to_array(), (second * points[1]).to_array()],
            welded,
        });
    }
}
