//! Where a hand holds what it holds.

use crate::run::predictor::Predictor;
use palmares_models::Vec3;
use palmares_models::hand::Hand;
use std::sync::Arc;

/// The grasp centre in the frame of the hand's base, m: amid the fingertips when all motors are half closed and nothing is
/// touched. The mean of the centres of mass of those links that carry no other.
pub fn grasp_centre(hand: &Arc<Hand>) -> Vec3 {
    const HALF: f64 = 0.5;
    let mut q = Predictor::new(Arc::clone(hand)).predict(|_| HALF);
    if q.is_empty() {
        q = hand.coordinates.iter().map(|c| c.rest).collect();
    }
    let carries = |k: usize| hand.links.iter().any(|link| link.parent == Some(k));
    let base_from_links = hand.base_from_links(&q);
    let tips = hand.links.iter().zip(&base_from_links).enumerate().filter(|(k, _)| !carries(*k));
    let at = tips.map(|(_, (link, pose))| pose.transform_point(link.inertia.com));
    let (sum, count) = at.fold((Vec3::ZERO, 0.0), |(sum, count), point| (sum + point, count + 1.0));
    if count > 0.0 { sum / count } else { Vec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the example controllers have a ball of 10 cm when the fingers close around it, and what the pinch hand's
    /// pads meet on.
    #[test]
    fn it_is_where_the_examples_hold_a_ball() {
        let known = [("softhand", [0.0527, 0.05, 0.2103]), ("reflex", [0.015, 0.0, 0.155])];
        for (name, ball) in known {
            let at = grasp_centre(&Hand::builtin(name).expect("built in"));
            let away = (at - Vec3::from_array(ball)).length();
            println!("{name}: {at}, {away} m");
            assert!(away < 0.05, "{name}: {at} is {away} m from {ball:?}");
        }
    }

    #[test]
    fn a_symmetric_hand_has_it_in_the_middle() {
        let at = grasp_centre(&Hand::builtin("pinch").expect("built in"));
        println!("pinch: {at}");
        assert!(at.x.abs() < 1e-9 || at.y.abs() < 1e-9, "{at}");
        assert!(at.z > 0.05, "{at}");
    }
}
