//! World poses of all bodies, from the pose messages of a replay.

use crate::frames::{FrameTransforms, WORLD};
use palmares_models::Pose;
use prost::{DecodeError, Message};
use std::collections::BTreeMap;

struct Body {
    name: String,
    /// Index of its parent; `None` for a body in the world frame.
    parent: Option<usize>,
    local: Pose,
    world: Pose,
    moved: bool,
}

/// All bodies of the messages that were read.
#[derive(Default)]
pub struct Trajectory {
    /// Parents come before their children.
    bodies: Vec<Body>,
    /// Their indices by name: a file from anybody may have a hundred thousand of them.
    indices: BTreeMap<String, usize>,
}

impl Trajectory {
    /// Reads the next message: the bytes of a `foxglove.FrameTransforms`. Returns name and world pose of every body
    /// that moved, by itself or with its parent.
    ///
    /// # Errors
    /// The bytes are not a `foxglove.FrameTransforms`.
    pub fn next(&mut self, message: &[u8]) -> Result<impl Iterator<Item = (&str, Pose)>, DecodeError> {
        for body in &mut self.bodies {
            body.moved = false;
        }
        for (parent, name, local) in FrameTransforms::decode(message)?.poses() {
            match self.indices.get(name) {
                Some(&k) => (self.bodies[k].local, self.bodies[k].moved) = (local, true),
                None => {
                    let parent = if parent == WORLD { None } else { self.indices.get(parent).copied() };
                    let name = name.to_owned();
                    self.indices.insert(name.clone(), self.bodies.len());
                    self.bodies.push(Body { name, parent, local, world: local, moved: true });
                }
            }
        }
        for k in 0..self.bodies.len() {
            let above = self.bodies[k].parent.map(|parent| &self.bodies[parent]);
            let (carried, base) = above.map_or((false, Pose::IDENTITY), |above| (above.moved, above.world));
            let body = &mut self.bodies[k];
            body.moved |= carried;
            if body.moved {
                body.world = base * body.local;
            }
        }
        Ok(self.bodies.iter().filter(|body| body.moved).map(|body| (body.name.as_str(), body.world)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Frames;
    use crate::poses::ChangedPoses;
    use crate::recorder::pose_frame;
    use palmares_models::hand::Hand;
    use palmares_tasks::{Action, BaseTarget, Run, Seed, Task};
    use std::collections::BTreeMap;

    #[test]
    fn poses_of_moved_bodies_give_the_pose_of_every_link() {
        let hand = Hand::builtin("softhand").expect("it is built in");
        let mut run = Run::new(Task::builtin().remove(0), hand.clone(), Seed::from_u64(5)).expect("scene");
        let (mut frames, mut shown) = (Frames::of(&run), ChangedPoses::new(hand.clone()));
        let links = hand.links.iter().map(|link| format!("hand/{}", link.name));
        let balls = run.scene().bodies.iter().filter(|body| body.free).map(|body| body.name.clone());
        let names: Vec<String> = links.chain(balls).collect();
        let (mut trajectory, mut world) = (Trajectory::default(), BTreeMap::new());
        let mut counts = Vec::new();
        for tick in 0..90 {
            let now = pose_frame(&run);
            let changes = shown.changes(&now);
            counts.push(changes.len());
            let mut bytes = Vec::new();
            frames.write(tick, &changes, &mut bytes).expect("memory grows");
            let moved = trajectory.next(&bytes).expect("it was just written");
            world.extend(moved.map(|(name, pose)| (name.to_owned(), pose)));
            let links = hand.base_from_links(&now.q).into_iter().map(|link| now.base * link);
            for (name, pose) in names.iter().zip(links.chain(now.objects)) {
                let found = world[name];
                assert!((found.translation - pose.translation).length() < 1e-4, "{name}");
                assert!(found.rotation.dot(pose.rotation).abs() > 1.0 - 1e-6, "{name}");
            }
            // Down with an open hand, then it closes.
            let (z, sigma) = if tick < 45 { (0.7 - 0.002 * tick as f64, 0.0) } else { (0.6, 0.5) };
            let base = BaseTarget::Pose { position: [0.0, 0.0, z], quat_xyzw: [0.0, 1.0, 0.0, 0.0] };
            run.step(&Action { base: Some(base), hand: Some(vec![sigma]), effort: None }).expect("valid");
        }
        assert_eq!(counts[0], names.len());
        assert!(counts[60] >= 15, "the fingers move: {counts:?}");
        assert!(
            counts[20..40].iter().sum::<usize>() < counts[60..80].iter().sum::<usize>() / 2,
            "{counts:?}"
        );
    }

    #[test]
    fn all_of_many_bodies_are_read() {
        const BODIES: usize = 20_000;
        let mut bytes = Vec::new();
        for k in 0..BODIES {
            // Field 3 of a `foxglove.FrameTransform` is the name.
            let name = format!("{k:08}");
            bytes.extend([0x0a, 2 + name.len() as u8, 0x1a, name.len() as u8]);
            bytes.extend(name.as_bytes());
        }
        let mut trajectory = Trajectory::default();
        assert_eq!(trajectory.next(&bytes).expect("a message").count(), BODIES);
    }
}
