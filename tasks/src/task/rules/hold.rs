//! Rules `hold`, as data.

use super::goal_info::GoalInfo;
use super::kind::{Aim, RuleKind};
use super::limits::{points, positive};
use crate::task::objects::Objects;
use serde::Deserialize;

/// Part of the lift that the object keeps during the shake, or it is lost.
pub(crate) const LOST_FROM: f64 = 0.5;

/// Points for one object that is lifted, held, and kept in the hand while the server shakes it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hold {
    /// Required rise of the object's centre of mass above its height at tick 0, m.
    pub lift_m: f64,
    /// Time for which it must stay up without slipping before the shake, s.
    pub hold_s: f64,
    /// Maximum motion in the frame of the hand's base, m.
    pub slip_m: f64,
    /// Time until the shake at which the points for speed are zero, s.
    pub slow_s: f64,
    /// The shake.
    pub shake: Shake,
    /// Points.
    pub points: HoldPoints,
}

/// A shake along x, then y, then z of the world: `a sin(2π f t) (1 − cos(2π t / T)) / 2` each.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shake {
    /// Amplitude a, m.
    pub amplitude_m: f64,
    /// Frequency f, 1/s.
    pub frequency_hz: f64,
    /// Length T of the shake along one axis, s.
    pub axis_s: f64,
}

/// Points of the stages.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HoldPoints {
    /// For lifting.
    pub lifted: f64,
    /// For holding.
    pub held: f64,
    /// For an object that is still in the hand after the shake.
    pub shaken: f64,
    /// In addition, times 1 − slip / `slip_m`.
    pub firm: f64,
    /// In addition, times 1 − time until the shake / `slow_s`.
    pub quick: f64,
}

impl RuleKind for Hold {
    fn check(&self) -> Result<(), String> {
        positive("lift_m", self.lift_m)?;
        positive("hold_s", self.hold_s)?;
        positive("slip_m", self.slip_m)?;
        positive("slow_s", self.slow_s)?;
        positive("shake.amplitude_m", self.shake.amplitude_m)?;
        positive("shake.frequency_hz", self.shake.frequency_hz)?;
        positive("shake.axis_s", self.shake.axis_s)?;
        let HoldPoints { lifted, held, shaken, firm, quick } = self.points;
        points("points.lifted", lifted)?;
        points("points.held", held)?;
        points("points.shaken", shaken)?;
        points("points.firm", firm)?;
        points("points.quick", quick)
    }

    fn check_objects(&self, objects: &Objects) -> Result<(), String> {
        let count = objects.count;
        if count == 1 {
            Ok(())
        } else {
            Err(format!("rules of kind `hold` need objects.count = 1, not {count}"))
        }
    }

    fn aims(&self, count: usize, _: &[String]) -> Vec<Aim<'_>> {
        (0..count).map(|object| Aim { object, point: None, target: None }).collect()
    }

    fn goals(&self) -> Vec<GoalInfo> {
        let HoldPoints { lifted, held, shaken, firm, quick } = self.points;
        let (above_m, slip_m) = (Some(self.lift_m), Some(self.slip_m));
        let goal = |name: &str, points| GoalInfo { name: name.to_owned(), points, ..GoalInfo::default() };
        let less = |by: &str| Some(by.to_owned());
        vec![
            GoalInfo { above_m, ..goal("lifted", lifted) },
            GoalInfo { above_m, slip_m, for_s: self.hold_s, ..goal("held", held) },
            GoalInfo {
                above_m: Some(LOST_FROM * self.lift_m),
                slip_m,
                for_s: 3.0 * self.shake.axis_s,
                ..goal("shaken", shaken)
            },
            GoalInfo { less_by: less("slip"), slip_m, ..goal("firm", firm) },
            GoalInfo { less_by: less("time"), slow_s: Some(self.slow_s), ..goal("quick", quick) },
        ]
    }

    fn describe(&self) -> Vec<String> {
        let (lift, slip) = (self.lift_m * 1e3, self.slip_m * 1e3);
        vec![format!(
            "hold: lift by {lift} mm, hold for {} s, slip by less than {slip} mm, through a shake",
            self.hold_s
        )]
    }
}
