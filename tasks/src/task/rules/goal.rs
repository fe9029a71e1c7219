//! A goal of rules `arrange`, as data.

use super::goal_info::{GoalInfo, Within};
use super::kind::mm;
use super::limits::{MAX_POINTS, REST_SPEED};
use serde::Deserialize;

/// A goal of an object. All given conditions must hold at the same time, for `for_s`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Goal {
    /// Name of the goal, and kind of its event.
    pub name: String,
    /// Name of the object.
    pub object: String,
    /// The measured point of the object, in its own frame, m; omitted, its centre of mass.
    #[serde(default)]
    pub point: Option<[f64; 3]>,
    /// Name of the region that must contain the point.
    #[serde(default)]
    pub inside: Option<String>,
    /// A box in another object's frame that must contain the point.
    #[serde(default)]
    pub within: Option<Within>,
    /// Required rise of the point above its height at tick 0, m.
    #[serde(default)]
    pub above_m: Option<f64>,
    /// Maximum angle of the object's z from the vertical, degrees.
    #[serde(default)]
    pub upright_deg: Option<f64>,
    /// Whether the object must be at rest.
    #[serde(default)]
    pub at_rest: bool,
    /// Minimum distance of the object's centre of mass from the hand's base, m: the hand has released it.
    #[serde(default)]
    pub hand_off_m: Option<f64>,
    /// Time for which all conditions must hold without a break, s.
    #[serde(default)]
    pub for_s: f64,
    /// Points for reaching it.
    pub points: f64,
}

impl From<&Goal> for GoalInfo {
    fn from(goal: &Goal) -> Self {
        let Goal {
            name,
            object,
            point,
            inside,
            within,
            above_m,
            upright_deg,
            at_rest,
            hand_off_m,
            for_s,
            points,
        } = goal;
        GoalInfo {
            name: name.clone(),
            object: Some(object.clone()),
            points: *points,
            point: *point,
            inside: inside.clone(),
            within: within.clone(),
            above_m: *above_m,
            upright_deg: *upright_deg,
            rest_m_s: at_rest.then_some(REST_SPEED),
            hand_off_m: *hand_off_m,
            for_s: *for_s,
            ..GoalInfo::default()
        }
    }
}

impl Goal {
    /// The goal in words.
    pub(super) fn describe(&self) -> String {
        let mut conditions = Vec::new();
        if let Some(region) = &self.inside {
            conditions.push(format!("in `{region}`"));
        }
        if let Some(within) = &self.within {
            let (min, max) = (mm(within.min), mm(within.max));
            conditions.push(format!("within ({min}) to ({max}) mm of `{}`", within.object));
        }
        if let Some(above_m) = self.above_m {
            conditions.push(format!("raised by {} mm", above_m * 1e3));
        }
        if let Some(upright_deg) = self.upright_deg {
            conditions.push(format!("upright within {upright_deg}°"));
        }
        if self.at_rest {
            conditions.push("at rest".to_owned());
        }
        if let Some(hand_off_m) = self.hand_off_m {
            conditions.push(format!("{} mm or more from the hand's base", hand_off_m * 1e3));
        }
        if self.for_s > 0.0 {
            conditions.push(format!("for {} s", self.for_s));
        }
        let point = self.point.map_or(String::new(), |point| format!(", its point ({}) mm", mm(point)));
        let (name, object, conditions) = (&self.name, &self.object, conditions.join(", "));
        format!("{name}: `{object}`{point} {conditions}: {} points", self.points)
    }

    /// Checks the numbers.
    pub(super) fn check(&self) -> Result<(), String> {
        let Goal {
            object,
            point,
            inside,
            within,
            above_m,
            upright_deg,
            at_rest,
            hand_off_m,
            for_s,
            points,
            ..
        } = self;
        let poses = [inside.is_some(), within.is_some(), above_m.is_some(), upright_deg.is_some()];
        let asks = poses.contains(&true) || *at_rest || hand_off_m.is_some();
        if !asks {
            return Err("asks for nothing; give inside, within, above_m, upright_deg, at_rest or hand_off_m"
                .to_owned());
        }
        if !(0.0..=MAX_POINTS).contains(points) {
            return Err(format!("points = {points}; they must be in [0, {MAX_POINTS}]"));
        }
        if let Some(point) = point
            && !point.iter().all(|x| x.abs() <= 10.0)
        {
            return Err(format!("point = {point:?}; three numbers within 10 m"));
        }
        if let Some(within) = within {
            let (min, max) = (within.min, within.max);
            if !(0..3).all(|k| min[k].is_finite() && max[k].is_finite() && min[k] < max[k]) {
                return Err(format!("within from {min:?} to {max:?} has no size"));
            }
            if within.object == *object {
                return Err(format!("within.object = `{object}` is the object itself; name another one"));
            }
        }
        if let Some(above_m) = above_m
            && !(-10.0..=10.0).contains(above_m)
        {
            return Err(format!("above_m = {above_m}; it must be in [-10, 10]"));
        }
        if let Some(upright_deg) = upright_deg
            && !(0.0..=180.0).contains(upright_deg)
        {
            return Err(format!("upright_deg = {upright_deg}; it must be in [0, 180]"));
        }
        if let Some(hand_off_m) = hand_off_m
            && !(*hand_off_m > 0.0 && *hand_off_m <= 10.0)
        {
            return Err(format!("hand_off_m = {hand_off_m}; it must be in (0, 10]"));
        }
        if !(0.0..=600.0).contains(for_s) {
            return Err(format!("for_s = {for_s}; it must be in [0, 600]"));
        }
        Ok(())
    }
}
