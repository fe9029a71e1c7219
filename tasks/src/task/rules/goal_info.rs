//! The goals of any kind of rules in one form, with their tolerances, as clients get them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A goal of a task with its points and tolerances. All given conditions hold at the same time, for `for_s`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GoalInfo {
    /// Its name, mostly the kind of its event.
    pub name: String,
    /// The object; absent where the goal holds for each object.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// Points; less than 0 is a penalty.
    pub points: f64,
    /// Where the points shrink in proportion to a measured quantity: `slip` from 0 to `slip_m`, `time` from 0 to `slow_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub less_by: Option<String>,
    /// The measured point in the object's frame, m; absent: its centre of mass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// The region that contains the point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inside: Option<String>,
    /// The regions of which none contains the point.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outside: Vec<String>,
    /// The box in another object's frame that contains the point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within: Option<Within>,
    /// Least rise of the point above its height at tick 0, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub above_m: Option<f64>,
    /// Largest angle of the object's z from the vertical, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upright_deg: Option<f64>,
    /// The object's speed is below this, m/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest_m_s: Option<f64>,
    /// Least distance of the object's centre of mass from the hand's base, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_off_m: Option<f64>,
    /// The object moves by less than this in the frame of the hand's base, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slip_m: Option<f64>,
    /// Simulated time from which on the points are 0, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slow_s: Option<f64>,
    /// Time for which the conditions hold without a break, s.
    #[serde(default)]
    pub for_s: f64,
}

/// A box in the frame of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Within {
    /// Name of the object.
    pub object: String,
    /// Lowest corner in its frame, m.
    pub min: [f64; 3],
    /// Highest corner, m.
    pub max: [f64; 3],
}

#[cfg(test)]
mod tests {
    use super::super::limits::REST_SPEED;
    use super::*;
    use crate::task::Task;

    fn goals(name: &str) -> Vec<GoalInfo> {
        let text = Task::builtin_toml(name).expect("built in");
        Task::parse("task.toml", text).expect("valid").rules.goals()
    }

    #[test]
    fn objects_that_move_between_regions_have_a_goal_and_a_penalty() {
        let [in_goal, outside] = <[GoalInfo; 2]>::try_from(goals("balls")).expect("two");
        assert_eq!(in_goal.inside.as_deref(), Some("box_b"));
        assert_eq!((in_goal.points, in_goal.rest_m_s, in_goal.object), (1.0, Some(REST_SPEED), None));
        assert_eq!((outside.points, outside.outside), (-0.5, vec!["box_b".to_owned(), "box_a".to_owned()]));
        assert_eq!(goals("shelf").len(), 1, "no penalty of 0 points");
    }

    #[test]
    fn the_stages_of_a_hold_add_up_to_ten_points() {
        let goals = goals("grasp");
        let named = |name: &str| goals.iter().find(|goal| goal.name == name).expect("is there");
        assert_eq!(goals.iter().map(|goal| goal.points).sum::<f64>(), 10.0);
        assert_eq!((named("lifted").above_m, named("lifted").for_s), (Some(0.1), 0.0));
        assert_eq!((named("held").slip_m, named("held").for_s), (Some(0.03), 2.0));
        assert_eq!((named("shaken").above_m, named("shaken").for_s), (Some(0.05), 3.0));
        assert_eq!((named("firm").less_by.as_deref(), named("firm").slip_m), (Some("slip"), Some(0.03)));
        assert_eq!((named("quick").less_by.as_deref(), named("quick").slow_s), (Some("time"), Some(30.0)));
    }

    #[test]
    fn a_goal_of_the_peg_has_its_box_in_the_block() {
        let goals = goals("peg");
        let seated = goals.iter().find(|goal| goal.name == "seated").expect("is there");
        let within = seated.within.as_ref().expect("a box");
        assert_eq!((within.object.as_str(), within.max), ("block", [0.004, 0.004, 0.023]));
        assert_eq!((seated.point, seated.for_s), (Some([0.0, 0.0, -0.1]), 0.2));
        let text = serde_json::to_value(seated).expect("JSON");
        assert_eq!(text.get("upright_deg"), None, "absent conditions are not written");
        assert_eq!(serde_json::from_value::<GoalInfo>(text).expect("reads"), *seated);
    }
}
