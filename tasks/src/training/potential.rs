//! Progress of a run as one number, with a slope everywhere on the way.

use super::grasp_centre::grasp_centre;
use crate::run::Run;
use crate::scene::SceneBody;
use crate::task::{self, Rewards, Task};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::Owner;

/// The parts of a potential, points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms {
    /// For the hand being near the object.
    pub distance: f64,
    /// For the hand touching it.
    pub contact: f64,
    /// For its height.
    pub lift: f64,
    /// For its way to the goal.
    pub transport: f64,
    /// For the objects that are in the goal, or the goals that have been reached: each has all of the above.
    pub brought: f64,
}

impl Terms {
    /// Φ.
    pub fn sum(&self) -> f64 {
        self.object() + self.brought
    }

    fn object(&self) -> f64 {
        self.distance + self.contact + self.lift + self.transport
    }
}

/// An aim of an object, with its place at tick 0.
#[derive(Clone, Debug)]
struct Aim {
    /// In scene order.
    object: usize,
    /// The point that must reach the target, in the object's frame, m; None: its centre of mass.
    point: Option<Vec3>,
    target: Option<TargetBox>,
    /// Height of its centre of mass at tick 0, m.
    height: f64,
    /// Distance of the point from the target then, m.
    away: f64,
}

/// Target of an object.
#[derive(Clone, Copy, Debug)]
struct TargetBox {
    /// Index of the object in whose frame it is given, in scene order; None: the world.
    on: Option<usize>,
    low: Vec3,
    high: Vec3,
}

/// The potential Φ of a run's states: a function of where hand and objects are and what of the hand touches which object.
///
/// An object has a value, the sum of the terms of [`Rewards`]. If all objects belong in one region, Φ is the largest value of the
/// objects outside of it, plus the maximum of the terms for each object in it. If goals have an order, Φ is the value of the next
/// goal's object, plus the maximum of the terms for each reached goal. So Φ climbs through approach, grasp, lift and transport of
/// one object, and continues with the next.
#[derive(Clone, Debug)]
pub struct Potential {
    rewards: Rewards,
    /// In the frame of the hand's base.
    grasp_centre: Vec3,
    aims: Vec<Aim>,
    /// One after the other, as the referee has noted; else in whatever order, by where the objects are.
    in_turn: bool,
    /// Maximum of the terms of an object.
    full: f64,
    /// For each object, a bit for each link that touches it.
    touching: Vec<u64>,
}

impl Potential {
    /// For a run of a task that has rewards, at whatever tick.
    pub fn new(run: &Run) -> Option<Self> {
        let task = run.task();
        let rewards = task.training.rewards.clone()?;
        let objects: Vec<(Pose, Vec3)> =
            run.scene().bodies.iter().filter(|body| body.free).map(at_tick_0).collect();
        let mut aims = aims(task);
        for aim in &mut aims {
            let (_, com) = objects.get(aim.object)?;
            aim.height = com.z;
            aim.away = aim.away(|k| objects[k]).unwrap_or_default();
        }
        let weights = [
            rewards.distance.map(|term| term.weight),
            rewards.contact.map(|term| term.weight),
            rewards.lift.map(|term| term.weight),
            rewards.transport.map(|term| term.weight),
        ];
        Some(Potential {
            full: weights.into_iter().flatten().sum(),
            grasp_centre: grasp_centre(run.hand()),
            touching: vec![0; objects.len()],
            in_turn: task.rules.in_order(),
            aims,
            rewards,
        })
    }

    /// Φ now, term by term.
    pub fn at(&mut self, run: &Run) -> Terms {
        let (model, state) = (run.world().model(), run.world().state());
        self.touching.fill(0);
        for contact in run.world().contact_forces() {
            if let (Owner::Link(link), Owner::Object(k)) | (Owner::Object(k), Owner::Link(link)) =
                (contact.a, contact.b)
                && let Some(links) = self.touching.get_mut(k)
            {
                *links |= 1 << link.min(63);
            }
        }
        let centre = state.base.transform_point(self.grasp_centre);
        let object = |k: usize| (state.object_pose(model, k), state.objects[k].translation);
        let value = |aim: &Aim, away: Option<f64>| {
            let links = self.touching[aim.object].count_ones();
            terms(&self.rewards, aim, centre, state.objects[aim.object].translation, away, links)
        };
        let (mut best, mut brought) = (Terms::default(), 0);
        if self.in_turn {
            brought = run.count().in_goal as usize;
            if let Some(aim) = self.aims.get(brought) {
                best = value(aim, aim.away(object));
            }
        } else {
            for aim in &self.aims {
                let away = aim.away(object);
                if away == Some(0.0) {
                    brought += 1;
                    continue;
                }
                let terms = value(aim, away);
                if terms.object() > best.object() {
                    best = terms;
                }
            }
        }
        Terms { brought: brought as f64 * self.full, ..best }
    }
}

impl Aim {
    /// Distance of the object from its target, m; `object` gives poses of frames and centres of mass.
    fn away(&self, object: impl Fn(usize) -> (Pose, Vec3)) -> Option<f64> {
        let TargetBox { on, low, high } = self.target?;
        let (frame, com) = object(self.object);
        let point = self.point.map_or(com, |point| frame.transform_point(point));
        let point = on.map_or(point, |on| object(on).0.inverse().transform_point(point));
        Some((low - point).max(point - high).max(Vec3::ZERO).length())
    }
}

/// Aims of the objects under the rules of a task; heights and distances are not set yet.
fn aims(task: &Task) -> Vec<Aim> {
    let (corner, region) = (Vec3::from_array, |name: &str| task.region(name));
    let target = |target| match target {
        task::Destination::Region(name) => {
            region(name).map(|(min, max)| TargetBox { on: None, low: corner(min), high: corner(max) })
        }
        task::Destination::Box { object, min, max } => {
            Some(TargetBox { on: Some(object), low: corner(min), high: corner(max) })
        }
    };
    let aims = task.rules.aims(&task.objects).into_iter();
    aims.map(|task::Aim { object, point, target: goal }| Aim {
        object,
        point: point.map(Vec3::from_array),
        target: goal.and_then(target),
        height: 0.0,
        away: 0.0,
    })
    .collect()
}

/// Frame and centre of mass of a body at tick 0.
fn at_tick_0(body: &SceneBody) -> (Pose, Vec3) {
    let ([x, y, z, w], at) =
        (body.quat_xyzw.unwrap_or([0.0, 0.0, 0.0, 1.0]), body.position.unwrap_or_default());
    let frame = Pose::from_parts(Vec3::from_array(at), Rotation::from_xyzw(x, y, z, w));
    (frame, frame.transform_point(Vec3::from_array(body.com)))
}

fn terms(rewards: &Rewards, aim: &Aim, centre: Vec3, at: Vec3, to_goal: Option<f64>, links: u32) -> Terms {
    let near = |d: f64, scale: f64| scale / (scale + d);
    let part = |x: f64| x.clamp(0.0, 1.0);
    let transport = |away: f64| if aim.away > 0.0 { part(1.0 - away / aim.away) } else { 0.0 };
    Terms {
        distance: rewards.distance.map_or(0.0, |it| it.weight * near((centre - at).length(), it.scale_m)),
        contact: rewards
            .contact
            .map_or(0.0, |it| it.weight * part(f64::from(links) / f64::from(it.links.max(1)))),
        lift: rewards.lift.map_or(0.0, |it| it.weight * part((at.z - aim.height) / it.height_m)),
        transport: rewards.transport.map_or(0.0, |it| it.weight * to_goal.map_or(0.0, transport)),
        brought: 0.0,
    }
}
