//! The hard cases.

use crate::sweep::RANGE_S;

/// A hard case.
#[derive(Clone, Copy, Debug)]
pub(super) struct HardCase {
    /// What makes it hard, in a word or two; cases of one kind follow each other.
    pub(super) kind: &'static str,
    /// Name of the case.
    pub(super) case: &'static str,
    /// What is hard, in a sentence.
    pub(super) hard: &'static str,
    /// Unit of its figure.
    pub(super) unit: &'static str,
    /// File of its gate in `bench/src/gates/`, without the ending.
    pub(super) gate: &'static str,
    /// Its starts.
    pub(super) starts: Starts,
    /// Shorter and longer steps are left out, because they take minutes, s.
    pub(super) steps_s: (f64, f64),
}

/// The starts of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Starts {
    /// Eight: in seven of them every object is up to a tenth of a millimetre aside.
    Many,
    /// Two, because it is long.
    Two,
    /// One, because it is long.
    Long,
    /// One: with its objects elsewhere the answer is another one.
    Exact,
    /// One: nothing in it can be placed elsewhere.
    Alone,
}

impl Starts {
    /// Number of starts.
    pub(super) fn count(self) -> u32 {
        match self {
            Starts::Many => 8,
            Starts::Two => 2,
            Starts::Long | Starts::Exact | Starts::Alone => 1,
        }
    }

    /// The number, and the reason for less than eight.
    pub(super) fn words(self) -> &'static str {
        match self {
            Starts::Many => "8",
            Starts::Two => "2, long",
            Starts::Long => "1, long",
            Starts::Exact => "1, exact",
            Starts::Alone => "1, no object",
        }
    }
}

const fn hard(
    kind: &'static str,
    case: &'static str,
    hard: &'static str,
    (unit, gate): (&'static str, &'static str),
) -> HardCase {
    HardCase { kind, case, hard, unit, gate, starts: Starts::Many, steps_s: RANGE_S }
}

impl HardCase {
    const fn starts(self, starts: Starts) -> Self {
        HardCase { starts, ..self }
    }

    const fn only(self, shortest_s: f64, longest_s: f64) -> Self {
        HardCase { steps_s: (shortest_s, longest_s), ..self }
    }
}

/// All of them.
pub(super) const CASES: &[HardCase] = &[
    hard(
        "mass ratio",
        "mass_ratio",
        "a cube on one a million times lighter, at rest and dragged",
        ("mm", "stacking"),
    ),
    hard("stack", "sphere_stack", "columns of up to 15 spheres, each on one point", ("mm", "stacking"))
        .starts(Starts::Exact),
    hard("stack", "kapla", "a tower of 102 planks in 34 crossed layers", ("mm", "stacking"))
        .starts(Starts::Two),
    hard("stack", "hull_on_ground", "prisms of up to 64 sides at rest on their faces", ("mm", "faces")),
    hard(
        "arch",
        "arch",
        "eleven loose stones: friction alone keeps the thick arch, and the thin one must fall",
        ("mm", "arch"),
    )
    .starts(Starts::Exact),
    hard(
        "closed chain",
        "closed_chain",
        "a four-bar with a pin of 1e7 N/m, whose motor reverses at once",
        ("mm", "reversing"),
    )
    .starts(Starts::Alone),
    hard(
        "sudden reversal",
        "sudden_reversals",
        "a drive of 10 N on 1 kg reverses within a step",
        ("mm", "reversing"),
    )
    .starts(Starts::Alone),
    hard(
        "sudden reversal",
        "hard_flip",
        "the command of a closed hand flips between its ends each 20 ms",
        ("m/s", "hard"),
    ),
    hard(
        "sudden reversal",
        "hard_teleport",
        "the set point of the base jumps by 0.5 m and a quarter turn",
        ("m/s", "hard"),
    ),
    hard(
        "singular arm",
        "singular_arm",
        "two bars swing through straight and folded, where their Jacobian is singular",
        ("%", "mechanism"),
    )
    .starts(Starts::Alone),
    hard("spinning", "hard_spin", "a capsule at 100 rad/s on its round end", ("%", "hard")),
    hard(
        "spinning",
        "spin_and_tumble",
        "three boxes at 20 rad/s in a chamber without friction",
        ("%", "robustness"),
    ),
    hard("spinning", "top_momentum", "a top at 250 rad/s on a tip of 1 mm", ("%", "spinning")),
    hard("spinning", "coin_rim", "a coin that rolls on its rim", ("%", "spinning")),
    hard("thin", "thin_plate", "spinning rods of 2 g thrown at a free plate of 1 mm", ("of 40", "thin")),
    hard(
        "thin",
        "thin_things",
        "needles, bars, discs and hulls thrown at plates of 0.5 mm",
        ("of 280", "thin"),
    ),
    hard("heavy on light", "heavy_on_grams", "5 kg on four bodies of a gram", ("mm", "robustness")),
    hard("heavy on light", "hard_heavy_object", "fingers of 24 g close on 5 kg and lift", ("m/s", "hard")),
    hard(
        "heavy on light",
        "hard_pressed_fingers",
        "5 kg fall on the open fingers of a hand",
        ("m/s", "hard"),
    ),
    hard("500 poured", "poured_500", "500 balls, boxes, cylinders and hulls fall into a box", ("mm", "pour"))
        .starts(Starts::Long)
        .only(2e-3, 4e-3),
    hard(
        "friction 0 and 3",
        "friction_ends",
        "a plate on slopes without friction, and held by a friction of 3",
        ("% of g cos", "extremes"),
    ),
    hard(
        "wedge",
        "wedged_box",
        "a box tilted between planes of friction 0.9: its inner force is open",
        ("mm", "robustness"),
    )
    .starts(Starts::Exact),
    hard(
        "wedge",
        "painleve_rod",
        "a rod sliding on its tip where rigid bodies have no solution",
        ("N s", "robustness"),
    ),
    hard("1 mm and 2 m", "small_and_large", "cubes of 1 mg and of 8 t slide to a stop", ("%", "extremes")),
    hard(
        "exactly touching",
        "touching_faces",
        "cylinders, boxes and prisms face to face without a gap",
        ("m/s", "faces"),
    )
    .starts(Starts::Exact),
    hard(
        "exactly touching",
        "newton_cradle_touching",
        "five elastic spheres without gaps",
        ("% of v0", "impact"),
    )
    .starts(Starts::Exact),
    hard(
        "placed inside",
        "deep_overlap",
        "bodies that start half inside each other, a wall or the floor",
        ("m/s", "robustness"),
    ),
    hard("placed inside", "hard_overlap", "a hand that starts 3 cm deep in a ball", ("m/s", "hard")),
    hard(
        "placed inside",
        "placed_inside",
        "bodies placed 2 to 30 mm inside tables and the ground",
        ("m/s", "placed"),
    )
    .starts(Starts::Alone),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::{Setup, run};
    use crate::sweep::scene;
    use std::fs;
    use std::path::Path;

    #[test]
    fn every_case_has_a_bound_and_its_gate() {
        let gates = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/gates");
        for hard in CASES {
            assert!(scene(hard.case).is_some(), "{} has no bound", hard.case);
            let gate = fs::read_to_string(gates.join(format!("{}.rs", hard.gate))).expect("a file of gates");
            // A gate may call the case's function.
            let named = gate.contains(&format!("\"{}\"", hard.case))
                || gate.contains(&format!("case {}`", hard.case));
            assert!(named, "gates/{}.rs has none of {}", hard.gate, hard.case);
        }
    }

    #[test]
    fn units_are_those_of_the_cases() {
        // To pour takes a minute.
        for hard in CASES.iter().filter(|hard| hard.starts != Starts::Long) {
            let (report, _) = run(hard.case, &Setup::own(16e-3)).expect("the case runs");
            assert_eq!(report.error.unit, hard.unit, "{}", hard.case);
        }
    }
}
