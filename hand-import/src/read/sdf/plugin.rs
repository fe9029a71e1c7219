//! Plugins: controllers of joints are motors.

use super::collect::{Found, Reader};
use super::draft::plain;
use crate::decision::At;
use crate::draft::{Actuator, Control, Draft, Drive};
use crate::read::element::Notes;

impl Reader<'_> {
    /// A controller of a joint is a motor; other plugins are left out by name.
    pub(super) fn plugin(&mut self, found: &Found, draft: &mut Draft) {
        let element = &found.element;
        let file = element.get("filename").unwrap_or_default().to_lowercase().replace(['-', '_'], "");
        let position = file.contains("jointpositioncontroller");
        let path = file.contains("jointtrajectorycontroller");
        let speed = !position && file.contains("jointcontroller");
        if !position && !speed && !path {
            let name = element.get("filename").unwrap_or("without a file");
            self.log.lost(At::Hand, element, format!("plugin {name} is a program; it is left out"));
            return;
        }
        let joints: Vec<String> = element.all("joint_name").map(|name| name.text.clone()).collect();
        if joints.is_empty() {
            self.log.bad(element, "names no <joint_name>; it is left out");
        }
        // A trajectory's controller states each gain once for each joint.
        let kind = if path { "position_" } else { "" };
        let gain = |name: &str, k: usize| {
            let all = element.all(name).nth(if path { k } else { 0 })?.text.parse().ok();
            all.filter(|gain: &f64| gain.is_finite() && *gain > 0.0)
        };
        for (k, name) in joints.iter().enumerate() {
            let joint = plain(&format!("{}{name}", found.around.prefix));
            self.log.kept(At::Motor(joint.clone()), element, format!("drives joint '{joint}'"));
            draft.actuators.push(Actuator {
                control: Some(if speed { Control::Velocity } else { Control::Position }),
                gain: gain(&format!("{kind}p_gain"), k).filter(|_| !speed),
                damping: gain(&format!("{kind}d_gain"), k).filter(|_| !speed),
                force_limit: gain(&format!("{kind}cmd_max"), k),
                ..Actuator::of(&joint, Drive::Joint(joint.clone()))
            });
        }
    }
}
