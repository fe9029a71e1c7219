//! The result of a run of a case.

use palmares_bench::case_report::{CaseReport, Figure, Invariants};
use palmares_bench::overlap;
use serde::{Deserialize, Serialize};

/// A run that ended, and whether it solves the scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Played {
    /// The case's figure; without a value if that is not finite, because JSON has no infinities.
    pub error: Figure,
    /// Its checks.
    pub invariants: Invariants,
    /// The reason why it does not solve the scene, if so.
    pub trouble: Option<String>,
}

impl Played {
    /// From the report of a case.
    pub fn of(report: CaseReport) -> Self {
        let CaseReport { error, invariants, .. } = report;
        let trouble = trouble(&error, &invariants);
        let value = error.value.filter(|x| x.is_finite());
        Played { error: Figure { value, ..error }, invariants, trouble }
    }
}

/// The reason why a run that ended does not solve the scene, if there is one: numbers that are not finite,
/// steps that failed, a lost object, a broken bound, bodies sunk into each other, or an error beyond any use.
/// The difference from the engine's own fine run is no reason.
pub fn trouble(error: &Figure, invariants: &Invariants) -> Option<String> {
    if error.value.is_some_and(|x| !x.is_finite()) {
        return Some("not finite".into());
    }
    if let Some(bad) = invariants.newton_unconverged.filter(|n| *n > 0) {
        return Some(format!("{bad} steps failed"));
    }
    if invariants.held == Some(false) {
        return Some("object lost".into());
    }
    if let (Some(part), Some(bound)) =
        (invariants.overlap_of_bound.filter(|part| *part > 1.0), invariants.overlap_bound_mm)
    {
        return Some(format!("overlap {:.1} mm > {bound:.1} mm", part * bound));
    }
    let value = error.value.filter(|_| !error.from_own_fine_run)?;
    if let Some(most) = error.within {
        return (value > most).then(|| format!("more than {most} {}", error.unit));
    }
    let Some(most) = useless(&error.unit) else {
        return Some(format!("nothing bounds an error in {}", error.unit));
    };
    (value.abs() > most).then(|| format!("error {:.2} {}", value.abs(), error.unit))
}

/// The rules by which [`trouble`] judges runs of a case with this figure: another figure or bound makes other outcomes.
pub fn rules(figure: Option<&Figure>) -> String {
    let of_figure = figure.map_or(String::new(), |figure| {
        let Figure { name, unit, within, from_own_fine_run, .. } = figure;
        format!("{name} [{unit}], {within:?}, {from_own_fine_run}, {:?}; ", useless(unit))
    });
    format!("{of_figure}overlap {} {}", overlap::PART, overlap::DEEPER)
}

/// Errors whose unit says nothing about their size: unit, the only case that has it, and half of that case's scale, squared.
const OF_ONE_CASE: [(&str, &str, f64); 4] = [
    // Half of the 24,034.5 J that the balls have.
    ("J^2", "bounce_elastic", 12_017.25 * 12_017.25),
    // Half of the 50 kg m/s that the ball has.
    ("(kg m/s)^2", "momentum_inelastic_hit", 25.0 * 25.0),
    // Half of the speeds: bodies that do not move at all have 3.15.
    ("(m/s)^2", "rolling_box_balls", 3.15 / 4.0),
    // Each of 216 spheres in another one by half of its width of 0.2 m.
    ("m^2", "six_cubed", 216.0 * 0.1 * 0.1),
];

/// The error from which on a run is useless: half of what is measured, or a length or an angle that no grasp bears. None for a
/// unit of which it is unknown.
fn useless(unit: &str) -> Option<f64> {
    const RAD: f64 = 0.2;
    const MM: f64 = 30.0;
    Some(match unit {
        "rad" => RAD,
        "°" => RAD.to_degrees(),
        "mm" => MM,
        "m" => 1e-3 * MM,
        "um" | "µm" => 1e3 * MM,
        // Creep, measured over two seconds and more.
        "mm/s" => MM / 2.0,
        // Of bodies at rest: the bound of those that are pushed out of each other.
        "m/s" => 1.0,
        percent if percent.starts_with('%') => 50.0,
        part if part.starts_with("of ") => 0.5,
        // The order of convergence and the longest step that keeps a grasp are no errors: more is better.
        "" | "ms" => f64::INFINITY,
        _ => OF_ONE_CASE.iter().find(|(of, ..)| *of == unit)?.2,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::path::Path;

    /// Source and unit of every figure of every case that is no figure with a bound of its own. To play them all takes hours.
    fn figures() -> Vec<(String, String)> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bench/src/cases");
        let mut figures = Vec::new();
        for file in fs::read_dir(folder).expect("the cases are there") {
            let text = fs::read_to_string(file.expect("a file").path()).expect("a text");
            for made in ["Figure::new(", "Figure::from_own_fine_run("] {
                for (at, _) in text.match_indices(made) {
                    let mut open = 1;
                    let inside = text[at + made.len()..].chars().take_while(|c| {
                        open += i32::from(*c == '(') - i32::from(*c == ')');
                        open > 0
                    });
                    let inside: String = inside.collect();
                    let unit = inside.rsplit('"').nth(1).expect("its unit is its last argument");
                    figures.push((text.clone(), unit.to_owned()));
                }
            }
        }
        figures
    }

    #[test]
    fn every_unit_of_a_figure_has_a_bound() {
        let figures = figures();
        assert!(figures.len() > 80, "only {} figures were found", figures.len());
        for (_, unit) in &figures {
            assert!(useless(unit).is_some(), "from which error in {unit} on is a run useless?");
        }
        for (unit, case, _) in OF_ONE_CASE {
            let of: Vec<_> = figures.iter().filter(|(_, of)| of == unit).collect();
            assert_eq!(of.len(), 1, "{unit} is the unit of {case} alone");
            assert!(of[0].0.contains(&format!("\"{case}\"")), "{unit} is the unit of {case}");
        }
    }

    #[test]
    fn an_error_as_large_as_its_scale_solves_nothing() {
        let said = |value: f64, unit: &str| trouble(&Figure::new("e", value, unit), &Invariants::default());
        for (unit, useful, nonsense) in [
            // The ball's whole momentum is 50 kg m/s.
            ("(kg m/s)^2", 0.11, 2.5e3),
            // Balls that stay on the floor have lost all but 2 % of their energy.
            ("J^2", 7.2e4, 5.5e8),
            ("(m/s)^2", 7e-3, 3.1),
            ("m^2", 0.38, 9.0),
            ("of |L|", 0.01, 1.0),
            ("mm/s", 1.0, 40.0),
            ("m/s", 0.1, 3.0),
            ("mm", 10.0, 31.0),
        ] {
            assert_eq!(said(useful, unit), None, "{useful} {unit}");
            assert!(said(nonsense, unit).is_some(), "{nonsense} {unit}");
        }
        assert_eq!(said(0.0, "furlong").as_deref(), Some("nothing bounds an error in furlong"));
    }
}
