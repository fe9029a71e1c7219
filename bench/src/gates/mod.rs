//! Gates: bounds that cases must keep at several steps. A bound follows from a law, a requirement or the spread over many
//! starts, and its comment names it. No gate asserts a time. One file per subject, as in `cases/`.

mod arch;
mod balls;
mod blows;
mod calibration;
mod consistency;
mod dead;
mod dry;
mod extremes;
mod faces;
mod free_motion;
mod friction;
mod grasp;
mod hand_dynamics;
mod hard;
mod held;
mod hold;
mod impact;
mod mechanism;
mod passing;
mod pile;
mod pinch;
mod placed;
mod pour;
mod random;
mod reflex;
mod reversing;
mod rims;
mod robustness;
mod rocking;
mod rolling;
mod rubbing;
mod sleeping;
mod spinning;
mod stacking;
mod synergy;
mod tendon;
mod thin;
mod ties;
mod turning;

use crate::case_report::CaseReport;
use crate::cases::{Setup, run};
use crate::sweep;

/// Steps, s, over which a law has to hold.
const STEPS: [f64; 5] = [0.25e-3, 1e-3, 4e-3, 8e-3, 16e-3];

/// Runs a case of ours without a reference run.
pub(crate) fn report(case: &str, dt_s: f64) -> CaseReport {
    let setup = Setup::own(dt_s);
    run(case, &setup).expect("the case runs").0
}

/// The figure of a case with an analytic answer.
pub(crate) fn error(report: &CaseReport) -> f64 {
    report.error.value.expect("the case has an analytic answer")
}

/// Runs a case at steps, s; every step converges, and the figure is at most the bound of its step.
pub(crate) fn at_most(case: &str, bounds: &[(f64, f64)]) -> Vec<CaseReport> {
    claims(case, bounds.iter().map(|(dt_s, _)| *dt_s));
    let run = |&(dt_s, most): &(f64, f64)| {
        let report = report(case, dt_s);
        converged(&report);
        let (found, unit) = (error(&report), &report.error.unit);
        if let Some(known) = sweep::bound(case, dt_s) {
            assert_eq!(most, known, "the sweep has another bound of {case} at {dt_s}");
        }
        assert!(found <= most, "{case} at {dt_s}: {found:e} {unit}, more than {most:e}");
        report
    };
    bounds.iter().map(run).collect()
}

/// A sweep claims a case from the shortest to the longest step of its gate, within its own range.
pub(crate) fn claims(case: &str, steps_s: impl IntoIterator<Item = f64>) {
    let Some(scene) = sweep::scene(case) else { return };
    let (shortest, longest) = steps_s
        .into_iter()
        .fold((f64::INFINITY, 0.0f64), |(low, high), dt_s| (low.min(dt_s), high.max(dt_s)));
    let (from_s, to_s) = sweep::RANGE_S;
    let played = (shortest.max(from_s), longest.min(to_s));
    assert_eq!(played, scene.claimed_s, "the sweep claims other steps of {case} than its gate plays");
}

/// Energy that appeared from nowhere or, where a case says so, its largest change is at most `most_j`.
pub(crate) fn gains(report: &CaseReport, most_j: f64) {
    let gain = report.invariants.energy_gain_j.expect("the gain is reported");
    assert!(gain <= most_j, "{} at {}: {gain:e} J", report.case, report.dt_s);
}

/// Objects creep by at most `most_mm_s`.
pub(crate) fn creeps(report: &CaseReport, most_mm_s: f64) {
    let creep = report.invariants.slip_mm_s.expect("creep is reported");
    assert!(creep <= most_mm_s, "{} at {}: {creep:e} mm/s", report.case, report.dt_s);
}

/// The object is where the case requires it at the end, mostly in the hand.
pub(crate) fn held(report: &CaseReport) {
    assert_eq!(report.invariants.held, Some(true), "{} at {}", report.case, report.dt_s);
}

/// The figure is within the bound of the case.
pub(crate) fn within(report: &CaseReport) {
    let most = report.error.within.expect("the case has a bound");
    assert!(error(report) <= most, "{} at {}: {} of {most}", report.case, report.dt_s, error(report));
}

/// Every step of the run converged and stayed finite.
pub(crate) fn converged(report: &CaseReport) {
    assert_eq!(report.invariants.newton_unconverged, Some(0), "{}", report.case);
}

#[test]
fn unknown_names_are_refused_with_the_known_ones() {
    let setup = Setup::own(1e-3);
    let message = run("softhand_fre", &setup).err().expect("refused").to_string();
    assert!(message.contains("softhand_free"), "{message}");
}
