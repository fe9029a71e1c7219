//! Rules of a task: conditions and points.

use super::arrange::{Arrange, MAX_POINTS};
use serde::Deserialize;

/// The rules of a task, by `kind`.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Rules {
    /// Objects must move from one region to another.
    Collect(Collect),
    /// One object must be lifted, held and kept during a shake.
    Hold(Hold),
    /// Objects must reach goals in a given order.
    Arrange(Arrange),
}

/// Points per object by its final place. An object is in a region if its centre of mass is inside and it rests.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Collect {
    /// The region the objects should end in.
    pub goal: String,
    /// The region they come from.
    pub start: String,
    /// Points per object in the goal.
    pub in_goal: f64,
    /// Points per object in neither region.
    pub outside: f64,
    /// Maximum settling time after a run, with the hand frozen, s.
    pub settle_s: f64,
}

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

/// Locates an error in the rules of a file. Serde reads a tagged enum through a buffer, which loses the line. So the rules are
/// parsed again as rules of their `kind`, with the line of the kind left blank.
pub(super) fn place_of_error(text: &str) -> Option<toml::de::Error> {
    #[derive(Deserialize)]
    struct File<R> {
        rules: R,
    }
    #[derive(Deserialize)]
    struct Kind {
        kind: toml::Spanned<String>,
    }
    fn error<R: serde::de::DeserializeOwned>(text: &str) -> Option<toml::de::Error> {
        toml::from_str::<File<R>>(text).err()
    }
    let kind = toml::from_str::<File<Kind>>(text).ok()?.rules.kind;
    let line = text[..kind.span().start].rfind('\n').map_or(0, |end| end + 1)..kind.span().end;
    if !text[line.clone()].trim_start().starts_with("kind") {
        return None;
    }
    let blank = " ".repeat(line.len());
    let text = [&text[..line.start], &blank, &text[line.end..]].concat();
    match kind.get_ref().as_str() {
        "collect" => error::<Collect>(&text),
        "hold" => error::<Hold>(&text),
        "arrange" => error::<Arrange>(&text),
        _ => None,
    }
}

impl Rules {
    /// Maximum settling time after a run, s.
    pub fn settle_s(&self) -> f64 {
        match self {
            Rules::Collect(rules) => rules.settle_s,
            Rules::Hold(_) => 0.0,
            Rules::Arrange(rules) => rules.settle_s,
        }
    }

    /// Whether the rules have a place where objects must end.
    pub fn has_destination(&self) -> bool {
        match self {
            Rules::Collect(_) => true,
            Rules::Hold(_) => false,
            Rules::Arrange(rules) => {
                rules.goals.iter().any(|goal| goal.inside.is_some() || goal.within.is_some())
            }
        }
    }

    /// Role of a region: `start` or `goal`.
    pub fn role(&self, region: &str) -> Option<&'static str> {
        match self {
            Rules::Collect(rules) if rules.goal == region => Some("goal"),
            Rules::Collect(rules) if rules.start == region => Some("start"),
            Rules::Arrange(rules)
                if rules.goals.iter().any(|goal| goal.inside.as_deref() == Some(region)) =>
            {
                Some("goal")
            }
            _ => None,
        }
    }

    /// Checks the numbers.
    pub(crate) fn check(&self) -> Result<(), String> {
        let positive = |field: &str, x: f64| {
            let fine = x.is_finite() && x > 0.0;
            if fine { Ok(()) } else { Err(format!("rules.{field} = {x}; it must be positive and finite")) }
        };
        let points = |field: &str, x: f64| {
            let valid = format!("in [-{MAX_POINTS}, {MAX_POINTS}]");
            if x.abs() <= MAX_POINTS {
                Ok(())
            } else {
                Err(format!("rules.{field} = {x}; it must be {valid}"))
            }
        };
        match self {
            Rules::Collect(rules) => {
                if !(0.0..=60.0).contains(&rules.settle_s) {
                    return Err(format!("rules.settle_s = {}; it must be in [0, 60]", rules.settle_s));
                }
                points("in_goal", rules.in_goal)?;
                points("outside", rules.outside)
            }
            Rules::Hold(rules) => {
                positive("lift_m", rules.lift_m)?;
                positive("hold_s", rules.hold_s)?;
                positive("slip_m", rules.slip_m)?;
                positive("slow_s", rules.slow_s)?;
                positive("shake.amplitude_m", rules.shake.amplitude_m)?;
                positive("shake.frequency_hz", rules.shake.frequency_hz)?;
                positive("shake.axis_s", rules.shake.axis_s)?;
                let HoldPoints { lifted, held, shaken, firm, quick } = rules.points;
                points("points.lifted", lifted)?;
                points("points.held", held)?;
                points("points.shaken", shaken)?;
                points("points.firm", firm)?;
                points("points.quick", quick)
            }
            Rules::Arrange(rules) => rules.check(),
        }
    }
}
