//! Names, shapes, units and ranges of the fields of actions and observations.

use palmares_senses::{CHANNELS, Rows};
use palmares_tasks::ActionLimits;
use schemars::JsonSchema;
use serde::Serialize;
use std::borrow::Cow;

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
    pub name: Cow<'static, str>,
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
    /// `arm` (see `welcome.tasks`), `motors`, `joints`, `encoders`, `taxels` (see `welcome.hands`) or `objects` (free bodies of the scene).
    Of(&'static str),
}

fn field(
    name: &'static str,
    shape: &[Length],
    unit: &'static str,
    range: (Option<f64>, Option<f64>),
) -> Field {
    Field { name: name.into(), shape: shape.to_vec(), unit, minimum: range.0, maximum: range.1 }
}

/// The fields of `obs.hand`, as its channels are declared.
fn of_hand() -> impl Iterator<Item = Field> {
    CHANNELS.iter().flat_map(|channel| {
        channel.columns.iter().map(|column| {
            let (entries, rows) = match (&channel.rows, &channel.record) {
                (Rows::Each(index), Some(_)) => ("[]", Some(index)),
                (Rows::Each(index), None) => ("", Some(index)),
                (Rows::One | Rows::If(_), _) => ("", None),
            };
            let dot = if column.name.is_empty() { "" } else { "." };
            let list = column.width > 1 || (rows.is_none() && channel.record.is_none());
            let rows = rows.map(|index| Length::Of(index.name));
            let (minimum, maximum) = column.fixed_limits();
            Field {
                name: format!("hand.{}{entries}{dot}{}", channel.key, column.name).into(),
                shape: rows.into_iter().chain(list.then_some(Length::Fixed(column.width))).collect(),
                unit: column.unit,
                minimum,
                maximum,
            }
        })
    })
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
        let arm = [Length::Of("arm")];
        let of_objects = |n: usize| [Length::Of("objects"), Length::Fixed(n)];
        let of_world = [field("tick", &[], "", FROM_ZERO), field("sim_time_s", &[], "s", FROM_ZERO)];
        let of_arm = [field("arm.position", &arm, "", FREE), field("arm.velocity", &arm, "1/s", FREE)];
        let of_truth = [
            field("truth.objects.position", &of_objects(3), "m", FREE),
            field("truth.objects.quat_xyzw", &of_objects(4), "", UNIT),
            field("truth.objects.linear", &of_objects(3), "m/s", FREE),
            field("truth.objects.angular", &of_objects(3), "rad/s", FREE),
            field("truth.joints.position", &joints, "rad", FREE),
            field("truth.joints.velocity", &joints, "rad/s", FREE),
            field("truth.predicted_equilibrium", &joints, "rad", FREE),
            field("score", &[], "points", FREE),
        ];
        Specs {
            action: vec![
                field("base.position", &three, "m", symmetric(limits.reach_m)),
                field("base.quat_xyzw", &four, "", UNIT),
                field("base.linear", &three, "m/s", symmetric(limits.speed)),
                field("base.angular", &three, "rad/s", symmetric(limits.angular_speed)),
                field("base.joints", &arm, "", FREE),
                field("hand", &motors, "", SIGMA),
                field("effort", &motors, "", SIGMA),
            ],
            observation: of_world.into_iter().chain(of_hand()).chain(of_arm).chain(of_truth).collect(),
        }
    }
}
