//! Rules `collect`, as data.

use super::goal_info::GoalInfo;
use super::kind::{Aim, RuleKind, Target};
use super::limits::{REST_SPEED, points, settle_s};
use serde::Deserialize;

/// Points per object by its final place. An object is in a region if its centre of mass is inside and it rests.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Collect {
    /// The region in which the objects must end.
    pub goal: String,
    /// The region from which they come.
    pub start: String,
    /// Points per object in the goal.
    pub in_goal: f64,
    /// Points per object in neither region.
    pub outside: f64,
    /// Maximum settling time after a run, with the hand frozen, s.
    pub settle_s: f64,
}

impl RuleKind for Collect {
    fn check(&self) -> Result<(), String> {
        settle_s(self.settle_s)?;
        points("in_goal", self.in_goal)?;
        points("outside", self.outside)
    }

    fn regions(&self) -> Vec<(&'static str, &str)> {
        vec![("rules.goal", &self.goal), ("rules.start", &self.start)]
    }

    fn role(&self, region: &str) -> Option<&'static str> {
        [(&self.goal, "goal"), (&self.start, "start")]
            .into_iter()
            .find(|(name, _)| *name == region)
            .map(|(_, role)| role)
    }

    fn settle_s(&self) -> f64 {
        self.settle_s
    }

    fn aims(&self, count: usize, _: &[String]) -> Vec<Aim<'_>> {
        let target = Some(Target::Region(&self.goal));
        (0..count).map(|object| Aim { object, point: None, target: target.clone() }).collect()
    }

    fn goals(&self) -> Vec<GoalInfo> {
        let rest_m_s = Some(REST_SPEED);
        let in_goal = GoalInfo {
            name: "in_goal".to_owned(),
            points: self.in_goal,
            inside: Some(self.goal.clone()),
            rest_m_s,
            ..GoalInfo::default()
        };
        let outside = GoalInfo {
            name: "outside".to_owned(),
            points: self.outside,
            outside: vec![self.goal.clone(), self.start.clone()],
            rest_m_s,
            ..GoalInfo::default()
        };
        [Some(in_goal), (self.outside != 0.0).then_some(outside)].into_iter().flatten().collect()
    }

    fn describe(&self) -> Vec<String> {
        let Collect { goal, start, in_goal, outside, .. } = self;
        vec![format!(
            "collect: from `{start}` to `{goal}`; {in_goal} for each in the goal, {outside} for each in neither"
        )]
    }
}
