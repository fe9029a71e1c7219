//! The scenes of a sweep with the bounds of their gates. A gate of such a case fails if its bound is another one.

/// Shortest and longest step of a sweep, s.
pub const RANGE_S: (f64, f64) = (0.25e-3, 16e-3);

/// A case, its bounds and the steps at which they are claimed.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// Name of the case.
    pub name: &'static str,
    /// Steps, s, ascending, and the bound of the figure there. Without any the case states its bound itself.
    pub bounds: &'static [(f64, f64)],
    /// Shortest and longest step of its gate, s, within the range of a sweep: the bounds hold from the one to the other.
    pub claimed_s: (f64, f64),
}

const fn at(name: &'static str, bounds: &'static [(f64, f64)]) -> Scene {
    Scene { name, bounds, claimed_s: RANGE_S }
}

/// A bound for every step.
macro_rules! flat {
    ($name:literal, $most:expr) => {
        at($name, &[(1e-3, $most)])
    };
}

impl Scene {
    /// Its gate begins at this step.
    const fn from(self, shortest_s: f64) -> Self {
        Scene { claimed_s: (shortest_s, self.claimed_s.1), ..self }
    }

    /// Its gate ends at this step.
    const fn until(self, longest_s: f64) -> Self {
        Scene { claimed_s: (self.claimed_s.0, longest_s), ..self }
    }

    /// Whether its gate covers a step.
    pub fn claims(&self, dt_s: f64) -> bool {
        // A step of a sweep may be off by rounding.
        let (low, high) = self.claimed_s;
        (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(&dt_s)
    }
}

/// Dry friction in second order: 2 % at 4 ms.
const DRY: &[(f64, f64)] = &[(4e-3, 2.0), (8e-3, 8.0), (16e-3, 32.0)];

/// The scenes.
pub const SCENES: &[Scene] = &[
    flat!("blows_box", 1e-9),
    flat!("blows_gain", 1e-9),
    flat!("glancing", 1.0),
    flat!("glancing_weight", 1.0),
    flat!("passing_sleeve", 1e-6),
    flat!("passing_edge", 1e-6),
    flat!("turning_palm", 1.0).until(8e-3),
    flat!("turning_palm_servo", 1.0).until(8e-3),
    flat!("turntable", 1e-3),
    flat!("turning_grip", 1e-3),
    flat!("slope_return", 1.0),
    at("roly_poly", &[(1e-3, 1.0), (4e-3, 10.0), (8e-3, 10.0), (16e-3, 20.0)]),
    flat!("asleep_presses", 0.1),
    flat!("ball_spin", 1e-6),
    flat!("top_momentum", 0.1).until(8e-3),
    flat!("coin_rim", 0.5),
    flat!("rim_kinds", 0.5),
    flat!("rim_place", 1e-6),
    flat!("break_mirror", 1e-9),
    flat!("break_energy", 1e-9),
    flat!("tied_blows", 1e-5),
    at("dry_joint", DRY),
    at("dry_contact", DRY),
    at("dry_contact_joint", DRY),
    flat!("dead_plate", 0.5),
    flat!("dead_rod", 0.5),
    flat!("dead_chain", 0.5),
    flat!("dead_heap", 0.5),
    flat!("dead_hand", 0.5),
    flat!("dead_impact", 0.5),
    flat!("placed_inside", 0.3),
    flat!("rocking_block", 2.5).until(4e-3),
    flat!("sliding_impact", 1.0),
    at("bounce_zeno", &[(4e-3, 1.0), (16e-3, 5.0)]),
    flat!("bounce_elastic", 0.5),
    flat!("newton_cradle", 1e-3),
    flat!("newton_cradle_touching", 1e-3),
    flat!("free_flight", 1e-6),
    flat!("rolling_cylinder", 2e-3),
    flat!("incline_sphere", 0.03),
    flat!("bowling", 0.01),
    at("rolling_box_balls", &[(1e-3, 2e-9), (4e-3, 2e-8), (16e-3, 5e-7)]),
    at("slide_stop", &[(1e-3, 0.05), (8e-3, 0.2)]).until(8e-3),
    flat!("tip_or_slide", 0.5),
    flat!("hull_on_ground", 0.1),
    flat!("hull_on_slope", 1e-3),
    flat!("internal_edges", 1.0).until(8e-3),
    flat!("touching_faces", 1e-6),
    flat!("slow_start", 1.0),
    flat!("patch_spin", 5.0).until(8e-3),
    flat!("round_tips", 5.0),
    flat!("disc_contensou", 5.0),
    flat!("capstan", 1.0),
    flat!("capstan_loop", 1.0),
    flat!("heavy_on_grams", 1.24e-5),
    at("spin_and_tumble", &[(1e-3, 1e-6), (4e-3, 1e-4), (16e-3, 2e-3)]),
    flat!("wedged_box", 0.015),
    flat!("mass_ratio", 0.06),
    flat!("sphere_stack", 3.2e-5),
    flat!("rest_penetration", 1e-2),
    flat!("thin_plate", 0.0),
    flat!("thin_things", 0.0),
    flat!("shaken_grasp", 1.0),
    flat!("roller_on_palm", 1.0),
    flat!("soft_tip_creep", 1.0),
    flat!("softhand_closing", 6.0),
    flat!("softhand_balls", 0.0),
    flat!("syn_joint_blocked", 1e-8),
    flat!("hard_spin", 10.0),
    at("deep_overlap", &[]),
    at("hard_heavy_object", &[]),
    at("hard_pressed_fingers", &[]),
    at("hard_tendons", &[]),
    at("hard_springs", &[]),
    at("hard_pressed_base", &[]),
    at("hard_overlap", &[]),
    at("hard_teleport", &[]),
    at("hard_flip", &[]),
    flat!("arch", 0.02),
    flat!("closed_chain", 0.025),
    flat!("singular_arm", 0.01),
    at("sudden_reversals", &[]),
    flat!("friction_ends", 0.1),
    at("small_and_large", &[(1e-3, 0.05), (4e-3, 0.118), (16e-3, 1.884)]),
    at("painleve_rod", &[]),
];

/// Scenes with gates that a sweep leaves out, because they are long.
pub(super) const LONG: &[Scene] =
    &[at("kapla", &[(16e-3, 0.05)]).from(16e-3), at("poured_500", &[]).from(4e-3).until(4e-3)];
