//! The grasp centre of a hand.

use crate::run::predictor::Predictor;
use palmares_models::Vec3;
use palmares_models::hand::Hand;
use palmares_sim::statics::drives::wound_lengths;
use std::sync::Arc;

/// The grasp centre in the frame of the hand's base, m: amid the fingertips when all motors are half closed and nothing is
/// touched. The mean of the centres of mass of those links that carry no other.
pub fn grasp_centre(hand: &Arc<Hand>) -> Vec3 {
    const HALF: f64 = 0.5;
    let mut q =
        Predictor::new(Arc::clone(hand)).predict(&wound_lengths(hand, &vec![HALF; hand.motors.len()]));
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
    use palmares_models::builtin::builtin_hands;

    /// Position of a ball of 10 cm in the grasp of the example controllers.
    #[test]
    fn it_is_where_the_examples_hold_a_ball() {
        let known = [("softhand", [0.0527, 0.05, 0.2103]), ("reflex", [0.015, 0.0, 0.155])];
        for (name, ball) in known {
            let at = grasp_centre(&Hand::builtin(name).expect("built in"));
            let away = (at - Vec3::from_array(ball)).length();
            assert!(away < 0.05, "{name}: {at} is {away} m from {ball:?}");
        }
    }

    #[test]
    fn the_guide_has_its_numbers() {
        let guide = include_str!("../../../docs/teams.md");
        for hand in builtin_hands() {
            let (name, at) = (&hand.name, grasp_centre(hand) * 1e3);
            // So that no zero is negative.
            let [x, y, z] = at.to_array().map(|x| x.round() as i64);
            let mut rows =
                guide.lines().filter(|line| line.starts_with("| `") && line.matches(" | (").count() == 2);
            let row = rows
                .find(|line| line.contains(&format!("`{name}`")))
                .unwrap_or_else(|| panic!("no row of {name} with ({x}, {y}, {z})"));
            assert!(row.contains(&format!("| ({x}, {y}, {z}) |")), "{name}: {at} mm, the guide has {row}");
        }
    }
}
