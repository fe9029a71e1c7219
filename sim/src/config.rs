//! Constants of the physics that a world may choose, with unit, default and reason; they are part of a run's
//! hash. A constant of one method is next to that method, and the engine's fingerprint (`tasks/golden/`) changes
//! with it.

use palmares_models::Vec3;
use palmares_models::content::ContentHash;

/// Constants of a world. Where a constant bounds an error, its comment gives the formula, the usual value,
/// and the effect of values outside. h is the step, v a velocity at its end, φ a gap (negative where shapes
/// overlap).
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Length of a step h, s. Usual: 0.25 to 4 ms; 1 ms keeps object errors in a grasp below half a millimetre. Longer steps
    /// stay stable and are less exact.
    pub step_s: f64,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Normal stiffness k of a contact, N/m: `f_n = k (−φ − τ φ̇)`, never negative. At rest 1 kg on one contact sinks
    /// `m g / k` = 0.05 mm. Usual: 2e5 for hands, 1e9 for bodies that stand for rigid ones; softer contacts let heavy
    /// objects sink in.
    pub contact_stiffness: f64,
    /// Tangential stiffness k_t of a stiction anchor, N/m: `f_t = −k_t (x + τ ẋ)` for a stretch x. Equal to the normal one,
    /// as for similar materials (Mindlin 1949 has 2/3 to 1). Softer, objects at rest yield before they stick.
    pub anchor_stiffness: f64,
    /// Dissipation time τ of contacts and anchors, s. Critical, `τ = 2 √(m/k)`, for a fifth of a kilogram. Below h/2 it is
    /// lost in the damping of implicit Euler, which is of that size.
    pub contact_dissipation_s: f64,
    /// Dissipation grows from nothing to full over this depth, m. At 0 contacts that barely touch flicker.
    pub contact_onset_m: f64,
    /// Onset of joint limits, rad: as `contact_onset_m`.
    pub limit_onset_rad: f64,
    /// Contacts are searched where `φ < contact_margin_m + approach_speed · h`, m. With a smaller margin,
    /// fast bodies are found only once they overlap; with a larger one, there is more to find and solve.
    pub contact_margin_m: f64,
    /// Approach speed that contact detection assumes for bodies at rest, m/s; for moving bodies it uses their
    /// own speed.
    pub approach_speed: f64,
    /// Largest approach of two parts of the hand within a step that is assumed from rest, m. A larger value
    /// would leave contacts to search between the fingers at all times with long steps.
    pub self_approach_m: f64,
    /// Slip speed |v_t| below which de Saxcé's term `μ |v_t|` is dropped, m/s. At 0, stacks limit-cycle. A
    /// body that slides more slowly floats `μ |v_t| (h + τ)` off its surface: at most 6 µm with μ = 1 and the
    /// defaults.
    pub de_saxce_deadband: f64,
    /// The term uses the slip before the step. Where this lagged slip puts a surface `μ |Δv_t| (h + τ)`
    /// farther off than this, m, the step is solved again with the new slip; that of a lone object is off by
    /// this much then, without a jump. Usual: 1e-5 to 1e-4. With larger
    /// values objects hop when they begin to slide; with smaller ones steps are solved twice for nothing.
    pub de_saxce_tolerance_m: f64,
    /// The same tolerance for contacts of the hand, m: in a hand some contact begins to slide at nearly every
    /// step.
    pub hand_de_saxce_tolerance_m: f64,
    /// Points of a contact closer to each other than this are merged, m. At 0, a point that parry finds twice
    /// counts twice in one step and once in the next, and grasps fall into a limit cycle.
    pub coincident_m: f64,
    /// A cached manifold is reused while its points have moved less than this, m. Contact forces move by as
    /// much; at 0 every step computes every contact again.
    pub manifold_reuse_m: f64,
    /// Turn of the normals up to which a manifold is reused, rad.
    pub manifold_reuse_rad: f64,
    /// Tighter reuse for cylinders and capsules on furniture, m: otherwise they would rest on their old point
    /// and topple. In the hand, reuse keeps their points from flickering.
    pub round_reuse_m: f64,
    /// The same for the turn of the normals, rad.
    pub round_reuse_rad: f64,
    /// Shapes first found with a deeper overlap than this, m, were placed so, and are separated slowly. With
    /// a smaller value, an impact at `overlap_m / h` would count as such a placement.
    pub overlap_m: f64,
    /// Speed of this separation, m/s; the contact springs would throw the shapes apart.
    pub separation_speed: f64,
    /// Surfaces with restitution rebound when they meet faster than this, m/s; slower contacts act as
    /// springs. At 0 a ball would bounce for ever in ever shorter hops (Zeno).
    pub rebound_speed: f64,
    /// Stiffness of joint limits, N·m/rad.
    pub limit_stiffness: f64,
    /// Relative speed over which rolling resistance builds up, rad/s. Slower rotations creep as in a viscous fluid; at 0
    /// resistance would jump.
    pub rolling_deadband: f64,
    /// Newton stops where `‖∇ℓ‖ ≤ tolerance · max(‖A v*‖, ‖Jᵀ γ‖)` in the norm `‖x‖² = Σ xᵢ²/Aᵢᵢ`; islands at
    /// rest use a tenth of it. Without unit. Forces stay out of balance by this part.
    pub tolerance: f64,
    /// Largest number of iterations; beyond it the step reports that it has not converged. A step of
    /// `thirty_objects` at 8 ms took 115.
    pub max_iterations: usize,
    /// Whether bodies at rest sleep: they stay in place, bit for bit, until something touches them.
    pub sleeping: bool,
    /// Speed below which a body may sleep, m/s. With a larger value creeping bodies are stopped.
    pub sleep_linear: f64,
    /// Angular speed below which it may sleep, rad/s.
    pub sleep_angular: f64,
    /// Acceleration below which it may sleep, m/s²: a ball on a slope of 1e-4 starts with 7e-4.
    pub sleep_acceleration: f64,
    /// Angular acceleration below which it may sleep, rad/s²: a cube of 10 cm that is 0.01° off its edge
    /// starts with 2e-2.
    pub sleep_angular_acceleration: f64,
    /// Time for which all this must hold, s.
    pub sleep_after_s: f64,
    /// Servo of the hand's base.
    pub base: BaseConfig,
}

/// The free-flying servo that carries the hand: the moving base of the 2016 challenge.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseConfig {
    /// Whether the base is bolted to its set point instead: no force moves it, and the springs, dampers and
    /// limits below have no effect.
    pub bolted: bool,
    /// N/m
    pub stiffness: f64,
    /// N·s/m
    pub damping: f64,
    /// N·m/rad
    pub angular_stiffness: f64,
    /// N·m·s/rad
    pub angular_damping: f64,
    /// Per axis, N.
    pub force_limit: f64,
    /// Per axis, N·m.
    pub torque_limit: f64,
    /// m/s
    pub speed_limit: f64,
    /// rad/s
    pub angular_speed_limit: f64,
    /// m/s²
    pub acceleration_limit: f64,
    /// rad/s²
    pub angular_acceleration_limit: f64,
}

impl Default for BaseConfig {
    fn default() -> Self {
        BaseConfig {
            bolted: false,
            stiffness: 2e4,
            damping: 4e2,
            angular_stiffness: 5e2,
            angular_damping: 1e1,
            force_limit: 500.0,
            torque_limit: 50.0,
            speed_limit: 2.0,
            angular_speed_limit: 3.0,
            acceleration_limit: 4.0,
            angular_acceleration_limit: 4.0,
        }
    }
}

impl Default for Config {
    fn default() -> Self {
        Config {
            step_s: 1e-3,
            gravity: Vec3::new(0.0, 0.0, -9.81),
            contact_stiffness: 2e5,
            anchor_stiffness: 2e5,
            contact_dissipation_s: 2e-3,
            contact_onset_m: 1e-4,
            limit_onset_rad: 1e-2,
            contact_margin_m: 2e-3,
            approach_speed: 1.0,
            self_approach_m: 5e-3,
            de_saxce_deadband: 2e-3,
            de_saxce_tolerance_m: 2e-5,
            hand_de_saxce_tolerance_m: 1e-4,
            coincident_m: 1e-6,
            manifold_reuse_m: 1e-5,
            manifold_reuse_rad: 3.5e-4,
            round_reuse_m: 1e-7,
            round_reuse_rad: 1e-6,
            overlap_m: 1e-3,
            separation_speed: 0.2,
            rebound_speed: 0.05,
            limit_stiffness: 1e3,
            rolling_deadband: 1e-2,
            tolerance: 1e-6,
            max_iterations: 200,
            sleeping: true,
            sleep_linear: 2e-3,
            sleep_angular: 4e-2,
            sleep_acceleration: 5e-4,
            sleep_angular_acceleration: 5e-3,
            sleep_after_s: 0.15,
            base: BaseConfig::default(),
        }
    }
}

impl Config {
    /// The defaults with another step length.
    pub fn with_step(step_s: f64) -> Self {
        Config { step_s, ..Config::default() }
    }

    /// SHA-256 of every constant, 64 hexadecimal digits. The fields are destructured by name, so that none
    /// can be forgotten.
    pub fn content_hash(&self) -> String {
        let Config {
            step_s,
            gravity,
            contact_stiffness,
            anchor_stiffness,
            contact_dissipation_s,
            contact_onset_m,
            limit_onset_rad,
            contact_margin_m,
            approach_speed,
            self_approach_m,
            de_saxce_deadband,
            de_saxce_tolerance_m,
            hand_de_saxce_tolerance_m,
            coincident_m,
            manifold_reuse_m,
            manifold_reuse_rad,
            round_reuse_m,
            round_reuse_rad,
            overlap_m,
            separation_speed,
            rebound_speed,
            limit_stiffness,
            rolling_deadband,
            tolerance,
            max_iterations,
            sleeping,
            sleep_linear,
            sleep_angular,
            sleep_acceleration,
            sleep_angular_acceleration,
            sleep_after_s,
            base,
        } = self;
        let BaseConfig {
            bolted,
            stiffness,
            damping,
            angular_stiffness,
            angular_damping,
            force_limit,
            torque_limit,
            speed_limit,
            angular_speed_limit,
            acceleration_limit,
            angular_acceleration_limit,
        } = base;
        let mut hash = ContentHash::of("palmares physics 4");
        hash.vector(*gravity);
        hash.count(*max_iterations);
        hash.flag(*sleeping);
        hash.flag(*bolted);
        hash.floats(&[*step_s, *contact_stiffness, *anchor_stiffness, *contact_dissipation_s]);
        hash.floats(&[*contact_onset_m, *limit_onset_rad, *contact_margin_m, *approach_speed]);
        hash.floats(&[*self_approach_m, *hand_de_saxce_tolerance_m, *coincident_m]);
        hash.floats(&[*de_saxce_deadband, *de_saxce_tolerance_m, *manifold_reuse_m, *manifold_reuse_rad]);
        hash.floats(&[*round_reuse_m, *round_reuse_rad, *overlap_m]);
        hash.floats(&[*separation_speed, *rebound_speed, *limit_stiffness, *rolling_deadband]);
        hash.floats(&[*tolerance, *sleep_linear, *sleep_angular, *sleep_after_s]);
        hash.floats(&[*sleep_acceleration, *sleep_angular_acceleration]);
        hash.floats(&[*stiffness, *damping, *angular_stiffness, *angular_damping]);
        hash.floats(&[*force_limit, *torque_limit, *speed_limit, *angular_speed_limit]);
        hash.floats(&[*acceleration_limit, *angular_acceleration_limit]);
        hash.to_hex()
    }

    /// Largest approach of two surfaces within a step from rest, m, that contact detection assumes.
    pub fn from_rest(&self, within_hand: bool) -> f64 {
        let way = self.approach_speed * self.step_s;
        if within_hand { way.min(self.self_approach_m) } else { way }
    }

    /// Gap up to which two surfaces at rest count as a possible contact, m.
    pub fn margin(&self, within_hand: bool) -> f64 {
        self.contact_margin_m + self.from_rest(within_hand)
    }
}
