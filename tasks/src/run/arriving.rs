//! Actions that arrive late and with errors, in runs for training.

use super::Run;
use crate::action::{Action, BaseTarget};
use palmares_models::Vec3;
use palmares_senses::noise::Sample;

impl Run {
    /// The action that arrives when this one is sent: that of some ticks ago, with errors. Until the first one arrives, the targets of
    /// tick 0 stay.
    pub(super) fn arriving(&mut self, sent: &Action) -> Option<Action> {
        let variation = self.task.variation()?;
        let (delay, noise) = (variation.action_delay(), variation.action_noise());
        if delay == 0 && noise == 0.0 {
            return None;
        }
        self.under_way.push_back(sent.clone());
        let late = self.under_way.len() > delay as usize;
        let mut action =
            if late { self.under_way.pop_front().unwrap_or_default() } else { Action::default() };
        if noise > 0.0 {
            let numbers = variation.action_errors(self.tick);
            let limits = &self.world.model().config().base;
            disturb(
                &mut action,
                [noise * limits.speed_limit, noise * limits.angular_speed_limit, noise],
                numbers,
            );
        }
        Some(action)
    }
}

/// Adds normal errors of these deviations to the velocities of the base and to σ.
fn disturb(action: &mut Action, [linear_error, angular_error, error]: [f64; 3], mut numbers: Sample) {
    let three = |numbers: &mut Sample, deviation| Vec3::from_array(numbers.normal3()) * deviation;
    let errors = (three(&mut numbers, linear_error), three(&mut numbers, angular_error));
    if let Some(BaseTarget::Twist { linear, angular }) = &mut action.base {
        *linear = (Vec3::from_array(*linear) + errors.0).to_array();
        *angular = (Vec3::from_array(*angular) + errors.1).to_array();
    }
    for sigma in action.hand.iter_mut().flatten() {
        *sigma += error * numbers.normal();
    }
}
