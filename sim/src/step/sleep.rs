//! Sleep: an island without the hand that has been still for long stops, and costs nothing until it is touched.

use crate::model::Model;
use crate::solver::island::Island;
use crate::state::State;

/// Counts the steps an island has been still, and stops it when they are enough.
pub(super) fn update(model: &Model, state: &mut State, island: &Island) {
    let config = model.config();
    if !config.sleeping {
        return;
    }
    let enough = (config.sleep_after_s / config.step_s).ceil() as u32;
    let mut all = !island.hand && !island.pairs.is_empty();
    for &k in &island.objects {
        let (linear, angular) = state.object_velocity(model, k);
        let still = linear.length_squared() < config.sleep_linear.powi(2)
            && angular.length_squared() < config.sleep_angular.powi(2);
        let sleep = &mut state.sleep[k];
        sleep.still_steps = if still { (sleep.still_steps + 1).min(enough) } else { 0 };
        all &= sleep.still_steps == enough;
    }
    if all {
        for &k in &island.objects {
            let at = model.object_dofs(k);
            state.v[at..at + 6].fill(0.0);
            state.sleep[k].asleep = true;
            state.sleep[k].still_steps = 0;
        }
    }
}
