//! Frames of a document: poses relative to each other.

use std::collections::BTreeMap;

use palmares_models::Pose;

/// Models inside each other, and frames relative to each other.
pub(super) const MAX_DEPTH: usize = 32;

/// Everything that has a pose, by its full name.
#[derive(Default)]
pub(super) struct Scope {
    pub(super) frames: BTreeMap<String, Frame>,
}

/// A pose relative to another frame.
pub(super) struct Frame {
    pub(super) pose: Pose,
    /// Full name; `None`: the outermost model.
    pub(super) relative_to: Option<String>,
}

impl Scope {
    /// What has that name. Older files have joints with the names of links, which come first.
    pub(super) fn get(&self, name: &str) -> Option<&Frame> {
        self.frames.get(name).or_else(|| self.frames.get(&joint_key(name)))
    }

    /// Pose in the outermost model.
    pub(super) fn pose(&self, name: &str) -> Option<Pose> {
        let mut pose = Pose::IDENTITY;
        let mut at = Some(name);
        for _ in 0..MAX_DEPTH {
            let Some(name) = at else { return Some(pose) };
            let frame = self.get(name)?;
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
