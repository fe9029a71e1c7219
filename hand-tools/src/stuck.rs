//! Joints that rub more than their motors pull.

use palmares_models::hand::Hand;

/// A reason for each joint whose dry friction is above the force of all motors on it: it never moves, whatever they do.
pub(crate) fn stuck(hand: &Hand) -> Vec<String> {
    let middle: Vec<f64> = hand.coordinates.iter().map(|c| c.rest.clamp(c.lower, c.upper)).collect();
    let mut force = vec![0.0; hand.coordinates.len()];
    for tendon in hand.tendons.iter().filter(|tendon| !tendon.motors.is_empty()) {
        tendon.gradient(&middle, |c, arm| force[c] += arm.abs() * tendon.force_limit);
    }
    let joints = hand.coordinates.iter().zip(force).filter(|(c, force)| *force > 0.0 && c.friction >= *force);
    joints
        .map(|(c, force)| {
            format!(
                "hand '{}': joint '{}' never moves: its dry friction of {} is not below the {force:.6} of its motors; lower \
                 `friction`, or raise the motors' `force_limit`",
                hand.name, c.name, c.friction
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_is_stuck_from_the_force_of_its_motors_on() {
        let hand = Hand::builtin("leap").expect("built in");
        assert!(stuck(&hand).is_empty());
        let servo = hand.tendons.iter().find(|tendon| tendon.moment_arms.len() == 1).expect("a servo");
        let (c, arm) = servo.moment_arms[0];
        let force = arm.abs() * servo.force_limit;
        let mut rubs = (*hand).clone();
        for (friction, count) in [(0.99 * force, 0), (1.01 * force, 1)] {
            rubs.coordinates[c].friction = friction;
            let found = stuck(&rubs);
            assert_eq!(found.len(), count, "{found:?}");
            assert!(found.iter().all(|why| why.contains(&rubs.coordinates[c].name)), "{found:?}");
        }
    }
}
