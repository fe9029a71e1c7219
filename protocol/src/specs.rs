//! Names, shapes, units and ranges of the fields of actions and observations.

use palmares_tasks::ActionLimits;
use schemars::JsonSchema;
use serde::Serialize;

/// Every numeric field a controller writes or reads.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Specs {
    /// Fields of `step.action`.
    pub action: Vec<Field>,
    /// Fields of `obs`.
    pub observation: Vec<Field>,
}

/// One field.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Field {
    /// Path; `[]` stands for every entry of a list.
    pub name: &'static str,
    /// Lengths; empty for a single number.
    pub shape: Vec<Length>,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Least value of an entry; null for none. Commands beyond are clipped.
    pub minimum: Option<f64>,
    /// Largest value of an entry; null for none.
    pub maximum: Option<f64>,
}

/// A length that is fixed, or that of the hand or scene.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Length {
    /// Fixed.
    Fixed(usize),
    /// `motors`, `joints`, `encoders`, `taxels` (see `welcome.hands`) or `objects` (free bodies of the scene).
    Of(&'static str),
}

fn field(
    name: &'static str,
    shape: &[Length],
    unit: &'static str,
    range: (Option<f64>, Option<f64>),
) -> Field {
    Field { name, shape: shape.to_vec(), unit, minimum: range.0, maximum: range.1 }
}

impl Default for Specs {
    /// The fields of this version.
    fn default() -> Self {
        const FREE: (Option<f64>, Option<f64>) = (None, None);
        const UNIT: (Option<f64>, Option<f64>) = (Some(-1.0), Some(1.0));
        const SIGMA: (Option<f64>, Option<f64>) = (Some(0.0), Some(1.0));
        const FROM_ZERO: (Option<f64>, Option<f64>) = (Some(0.0), None);
        let limits = ActionLimits::default();
        let symmetric = |limit: f64| (Some(-limit), Some(limit));
        let (three, four) = ([Length::Fixed(3)], [Length::Fixed(4)]);
        let (motors, joints) = ([Length::Of("motors")], [Length::Of("joints")]);
        let of_objects = |n: usize| [Length::Of("objects"), Length::Fixed(n)];
        Specs {
            action: vec![
                field("base.position", &three, "m", symmetric(limits.reach_m)),
                field("base.quat_xyzw", &four, "", UNIT),
                field("base.linear", &three, "m/s", symmetric(limits.speed)),
                field("base.angular", &three, "rad/s", symmetric(limits.angular_speed)),
                field("hand", &motors, "", SIGMA),
            ],
            observation: vec![
                field("tick", &[], "", FROM_ZERO),
                field("sim_time_s", &[], "s", FROM_ZERO),
                field("hand.base.position", &three, "m", FREE),
                field("hand.base.quat_xyzw", &four, "", UNIT),
                field("hand.base.linear", &three, "m/s", FREE),
                field("hand.base.angular", &three, "rad/s", FREE),
                field("hand.actuators[].command", &motors, "", SIGMA),
                field("hand.actuators[].position", &motors, "", FREE),
                field("hand.actuators[].velocity", &motors, "1/s", FREE),
                field("hand.actuators[].tension", &motors, "tendon", FREE),
                field("hand.wrist.force", &three, "N", FREE),
                field("hand.wrist.torque", &three, "N·m", FREE),
                field("hand.joints", &[Length::Of("encoders")], "rad", FREE),
                field("hand.touch", &[Length::Of("taxels"), Length::Fixed(3)], "N", FREE),
                field("hand.acceleration", &three, "m/s²", FREE),
                field("truth.objects.position", &of_objects(3), "m", FREE),
                field("truth.objects.quat_xyzw", &of_objects(4), "", UNIT),
                field("truth.objects.linear", &of_objects(3), "m/s", FREE),
                field("truth.objects.angular", &of_objects(3), "rad/s", FREE),
                field("truth.joints.position", &joints, "rad", FREE),
                field("truth.joints.velocity", &joints, "rad/s", FREE),
                field("truth.predicted_equilibrium", &joints, "rad", FREE),
                field("score", &[], "points", FREE),
            ],
        }
    }
}
