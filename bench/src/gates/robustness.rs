//! Scenes that break simulators hold at every step length.

use super::{converged, error, report, within};

const STEPS: [f64; 6] = [0.25e-3, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3];

#[test]
fn deep_overlaps_part_slowly() {
    for dt in STEPS {
        let report = report("deep_overlap", dt);
        converged(&report);
        within(&report);
    }
}

#[test]
fn five_kilograms_lie_on_four_grams() {
    for dt in STEPS {
        let report = report("heavy_on_grams", dt);
        converged(&report);
        // m g/(4 k) = 1.23e-5 mm.
        assert!(error(&report) <= 1.24e-5, "at {dt}: {} mm", error(&report));
    }
}

#[test]
fn spinning_boxes_gain_no_energy_in_a_chamber() {
    // To the fourth order of h between impacts.
    for (dt, percent) in [(0.25e-3, 1e-6), (1e-3, 1e-6), (4e-3, 1e-4), (16e-3, 2e-3)] {
        let report = report("spin_and_tumble", dt);
        converged(&report);
        assert!(error(&report) <= percent, "at {dt}: {} %", error(&report));
    }
}

#[test]
fn a_wedged_box_does_not_move() {
    for dt in STEPS {
        let report = report("wedged_box", dt);
        converged(&report);
        // Four contact points yield 2 N/k and turn it by as much: 11 µm.
        assert!(error(&report) <= 0.015, "at {dt}: {} mm", error(&report));
    }
}

#[test]
fn a_rod_in_painleves_paradox_stops_with_a_bounded_impulse() {
    for dt in STEPS {
        let report = report("painleve_rod", dt);
        converged(&report);
        within(&report);
        let gain = report.invariants.energy_gain_j.expect("the gain is reported");
        // Of 12.3 J; the books know what its contact springs hold to a part in ten thousand.
        assert!(gain <= 1.2e-3, "at {dt}: {gain:e} J");
    }
}

#[test]
fn thirty_objects_fall_into_a_box_and_none_leaves_it() {
    for dt in [0.25e-3, 1e-3, 2e-3, 4e-3, 8e-3] {
        let report = report("thirty_objects", dt);
        converged(&report);
        within(&report);
        let gain = report.invariants.energy_gain_j.expect("the gain is reported");
        // Of some 60 J that fall and are kicked.
        assert!(gain <= 1e-2, "at {dt}: {gain:e} J");
    }
}

#[test]
fn every_contact_keeps_to_signorini_and_coulomb() {
    for dt in [1e-3, 4e-3] {
        let report = report("contact_residuals", dt);
        converged(&report);
        // Newton stops at a millionth of the momenta.
        assert!(error(&report) <= 1e-5, "at {dt}: {:e}", error(&report));
    }
}

#[test]
fn friction_opposes_slip() {
    let report = report("contact_dissipation", 1e-3);
    converged(&report);
    assert!(error(&report) <= 0.7, "{} %", error(&report));
}

#[test]
fn a_contact_that_slides_off_and_on_carries_little_at_a_gap() {
    // 2.4 mm while a point that had carried nothing was taken for stuck.
    let report = report("contact_hover", 1e-3);
    converged(&report);
    assert!(error(&report) <= 0.8, "{} mm", error(&report));
}
