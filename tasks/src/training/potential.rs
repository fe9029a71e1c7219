//! How far a run has got, as one number that has a slope everywhere on the way.

use super::grasp_centre::grasp_centre;
use crate::run::Run;
use crate::task::Rewards;
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
    /// For the objects that are in the goal: each has all of the above.
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

/// Where an object was at tick 0.
#[derive(Clone, Copy, Debug)]
struct Begun {
    /// Height of its centre of mass, m.
    height: f64,
    /// Distance of the same from the goal, m.
    away: f64,
}

/// The potential Φ of a run's states: a function of where hand and objects are and what of the hand touches which object.
///
/// Each object that is not in the goal has a value, the sum of the terms of [`Rewards`]; Φ is the largest of these values,
/// and for each object in the goal what the terms are at most. So it climbs from the hand's way to an object over grasp,
/// lift and transport to the goal, and then from there with the next. What the referee thinks takes no part in it.
#[derive(Clone, Debug)]
pub struct Potential {
    rewards: Rewards,
    /// In the frame of the hand's base.
    grasp_centre: Vec3,
    goal: Option<(Vec3, Vec3)>,
    begun: Vec<Begun>,
    /// What the terms of an object are at most.
    full: f64,
    /// Of each object, a bit for each link that touches it.
    touching: Vec<u64>,
}

impl Potential {
    /// For a run of a task that has rewards, at whatever tick.
    pub fn new(run: &Run) -> Option<Self> {
        let rewards = run.task().training.rewards.clone()?;
        let goal = run.task().rules.goal().and_then(|name| run.task().region(name));
        let goal = goal.map(|(low, high)| (Vec3::from_array(low), Vec3::from_array(high)));
        let begun = run.scene().bodies.iter().filter(|body| body.free).map(|body| {
            let ([x, y, z, w], at) =
                (body.quat_xyzw.unwrap_or([0.0, 0.0, 0.0, 1.0]), body.position.unwrap_or_default());
            let pose = Pose::from_parts(Vec3::from_array(at), Rotation::from_xyzw(x, y, z, w));
            let com = pose.transform_point(Vec3::from_array(body.com));
            Begun { height: com.z, away: goal.map_or(0.0, |goal| away(goal, com)) }
        });
        let begun: Vec<Begun> = begun.collect();
        let weights = [
            rewards.distance.map(|term| term.weight),
            rewards.contact.map(|term| term.weight),
            rewards.lift.map(|term| term.weight),
            rewards.transport.map(|term| term.weight),
        ];
        Some(Potential {
            full: weights.into_iter().flatten().sum(),
            grasp_centre: grasp_centre(run.hand()),
            touching: vec![0; begun.len()],
            goal,
            begun,
            rewards,
        })
    }

    /// Φ now, term by term.
    pub fn at(&mut self, run: &Run) -> Terms {
        let state = run.world().state();
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
        let (mut best, mut brought) = (Terms::default(), 0);
        for ((object, begun), links) in state.objects.iter().zip(&self.begun).zip(&self.touching) {
            let at = object.translation;
            let to_goal = self.goal.map(|goal| away(goal, at));
            if to_goal == Some(0.0) {
                brought += 1;
                continue;
            }
            let terms = terms(&self.rewards, begun, centre, at, to_goal, links.count_ones());
            if terms.object() > best.object() {
                best = terms;
            }
        }
        Terms { brought: f64::from(brought) * self.full, ..best }
    }
}

fn terms(
    rewards: &Rewards,
    begun: &Begun,
    centre: Vec3,
    at: Vec3,
    to_goal: Option<f64>,
    links: u32,
) -> Terms {
    let near = |d: f64, scale: f64| scale / (scale + d);
    let part = |x: f64| x.clamp(0.0, 1.0);
    let transport = |away: f64| if begun.away > 0.0 { part(1.0 - away / begun.away) } else { 0.0 };
    Terms {
        distance: rewards.distance.map_or(0.0, |it| it.weight * near((centre - at).length(), it.scale_m)),
        contact: rewards
            .contact
            .map_or(0.0, |it| it.weight * part(f64::from(links) / f64::from(it.links.max(1)))),
        lift: rewards.lift.map_or(0.0, |it| it.weight * part((at.z - begun.height) / it.height_m)),
        transport: rewards.transport.map_or(0.0, |it| it.weight * to_goal.map_or(0.0, transport)),
        brought: 0.0,
    }
}

/// How far a point is from a region, m; 0 in it.
fn away((low, high): (Vec3, Vec3), at: Vec3) -> f64 {
    (low - at).max(at - high).max(Vec3::ZERO).length()
}
