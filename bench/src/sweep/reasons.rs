//! Reasons why a case is beyond its bound, for the page.

/// Case, and its reason in one sentence.
const REASONS: &[(&str, &str)] = &[
    (
        "hard_spin",
        "known error: what spins on a round end in contact is integrated in first order, so that its energy drifts by some percent",
    ),
    (
        "bowling",
        "known error: between 2.5 and 3 ms the rigid ball's normal force may alternate from step to step while it slides",
    ),
    ("slide_stop", "known error: the step in which a body stops is not resolved, `a h²/2`"),
    ("patch_spin", "known error: the step in which spin stops is not resolved"),
    ("turning_palm", "known error: a palm that turns by a twentieth of a radian in a step"),
    ("turning_palm_servo", "known error: a palm that turns by a twentieth of a radian in a step"),
    ("top_momentum", "known error: a top that turns by some radians in a step falls"),
];

/// The reason of a case.
pub(super) fn reason(case: &str) -> Option<&'static str> {
    REASONS.iter().find(|(name, _)| *name == case).map(|(_, reason)| *reason)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::scene;

    #[test]
    fn reasons_are_of_scenes() {
        for (name, reason) in REASONS {
            assert!(scene(name).is_some() && !reason.is_empty(), "{name}");
        }
    }
}
