//! Reasons why a case is beyond its bound, for the page.

/// Case, and its reason in one sentence.
const REASONS: &[(&str, &str)] = &[
    (
        "bounce_zeno",
        "known error: below 5 cm/s nothing rebounds, which leaves out up to 0.05 s of 4.06 s, 1.26 %",
    ),
    (
        "hard_spin",
        "known error: a body that spins on a round end is stepped in first order, and its energy drifts by some percent",
    ),
];

/// The reason of a case.
pub(crate) fn reason(case: &str) -> Option<&'static str> {
    REASONS.iter().find(|(name, _)| *name == case).map(|(_, reason)| *reason)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::played::scene;

    #[test]
    fn reasons_are_of_scenes() {
        for (name, reason) in REASONS {
            assert!(scene(name).is_some() && !reason.is_empty(), "{name}");
        }
    }
}
