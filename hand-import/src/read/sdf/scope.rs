//! Frames of a document: poses relative to each other.

use std::collections::BTreeMap;

use palmares_models::Pose;

/// Models inside each other.
pub(super) const MAX_DEPTH: usize = 32;

/// Everything that has a pose, by its full name.
#[derive(Default)]
pub(super) struct Scope {
    pub(super) frames: BTreeMap<String, Frame>,
    /// The link that moves with the frame of each model, by the model's full name; that of the outermost one is empty.
    pub(super) canonical: BTreeMap<String, String>,
}

/// A pose relative to another frame.
pub(super) struct Frame {
    pub(super) pose: Pose,
    /// Full name; `None`: the outermost model.
    pub(super) relative_to: Option<String>,
    /// Full name of the frame, joint, model or link that it moves with; empty: the outermost model.
    pub(super) attached_to: String,
}

impl Scope {
    /// The frame of that name. Older files have joints with the names of links: links come first.
    pub(super) fn get(&self, name: &str) -> Option<&Frame> {
        self.frames.get(name).or_else(|| self.frames.get(&joint_key(name)))
    }

    /// Pose in the outermost model.
    pub(super) fn pose(&self, name: &str) -> Option<Pose> {
        self.pose_in(name, None)
    }

    /// Pose in a frame that it is relative to, directly or through others; `None`: the outermost model.
    pub(super) fn pose_in(&self, name: &str, root: Option<&str>) -> Option<Pose> {
        let mut pose = Pose::IDENTITY;
        let mut at = Some(name);
        // Longer than all frames together: a circle.
        for _ in 0..=self.frames.len() {
            if at == root {
                return Some(pose);
            }
            let frame = self.get(at?)?;
            pose = frame.pose * pose;
            at = frame.relative_to.as_deref();
        }
        None
    }
}

/// Name under which a joint's frame is found.
pub(super) fn joint_key(name: &str) -> String {
    format!("{name}#joint")
}
