//! Rules `hold`: one object is lifted, held and shaken.

use super::goal_info::GoalInfo;
use super::kind::{Aim, RuleKind};
use super::limits::{points, positive};
use crate::observation::Event;
use crate::referee::{Count, Measured, ObjectSnapshot, ObjectStatus, Referee, RunStart, Shake, Stateful};
use crate::task::objects::Objects;
use serde::{Deserialize, Serialize};

/// Part of the lift that the object keeps during the shake, or it is lost.
const LOST_FROM: f64 = 0.5;

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

    fn aims(&self, objects: &Objects) -> Vec<Aim<'_>> {
        (0..objects.count).map(|object| Aim { object, point: None, target: None }).collect()
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

/// Motion of an object in the hand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Slip {
    /// Position in the frame of the hand's base at the start of the hold, m.
    from: [f64; 3],
    /// Maximum distance from it, m.
    most: f64,
}

impl Slip {
    fn new(from: [f64; 3]) -> Self {
        Slip { from, most: 0.0 }
    }

    fn see(&mut self, at: [f64; 3]) -> f64 {
        let [x, y, z] = [at[0] - self.from[0], at[1] - self.from[1], at[2] - self.from[2]];
        let distance = (x * x + y * y + z * z).sqrt();
        // NaN is not a hold.
        self.most = if distance.is_nan() { f64::INFINITY } else { self.most.max(distance) };
        self.most
    }
}

/// Stage of the object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Stage {
    /// Not up.
    Down,
    /// Up, and not slipping, since a tick.
    Up { since: u64, slip: Slip },
    /// The server shakes the hand since a tick.
    Shaking { since: u64, slip: Slip },
    /// Lost in the shake.
    Lost,
    /// Still in the hand after the shake.
    Kept { slip: Slip },
}

/// Watches one object.
#[derive(Clone, Debug)]
pub(super) struct HoldReferee {
    rules: Hold,
    tick_s: f64,
    /// Height of the object at tick 0, m.
    start_m: f64,
    state: HoldState,
}

/// State of the referee.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct HoldState {
    stage: Stage,
    lifted: bool,
    /// The tick at which it had been held long enough.
    held: Option<u64>,
}

impl HoldReferee {
    /// A referee at tick 0.
    pub(super) fn new(rules: &Hold, start: &RunStart<'_>) -> Self {
        HoldReferee {
            rules: rules.clone(),
            tick_s: start.tick_s,
            start_m: start.objects.first().map_or(0.0, |object| object.position[2]),
            state: HoldState { stage: Stage::Down, lifted: false, held: None },
        }
    }
}

impl Stateful for HoldReferee {
    type State = HoldState;

    fn state(&self) -> &HoldState {
        &self.state
    }

    fn state_mut(&mut self) -> &mut HoldState {
        &mut self.state
    }
}

impl Referee for HoldReferee {
    fn watch(&mut self, tick: u64, objects: &[ObjectSnapshot]) -> Vec<Event> {
        let mut events = Vec::new();
        let Some(object) = objects.first() else { return events };
        let mut note = |kind: &str| events.push(Event { tick, kind: kind.to_owned(), object: Some(0) });
        let risen = object.position[2] - self.start_m;
        let up = risen >= self.rules.lift_m;
        let ticks = |seconds: f64| (seconds / self.tick_s).round() as u64;
        self.state.stage = match self.state.stage {
            Stage::Down if up => {
                if !self.state.lifted {
                    note("lifted");
                    self.state.lifted = true;
                }
                Stage::Up { since: tick, slip: Slip::new(object.in_hand) }
            }
            Stage::Up { .. } if !up => {
                note("dropped");
                Stage::Down
            }
            Stage::Up { since, mut slip } => {
                if slip.see(object.in_hand) >= self.rules.slip_m {
                    note("slipped");
                    Stage::Up { since: tick, slip: Slip::new(object.in_hand) }
                } else if tick.saturating_sub(since) >= ticks(self.rules.hold_s) {
                    note("held");
                    self.state.held = Some(tick);
                    Stage::Shaking { since: tick, slip }
                } else {
                    Stage::Up { since, slip }
                }
            }
            Stage::Shaking { since, mut slip } => {
                let slipped = slip.see(object.in_hand) >= self.rules.slip_m;
                let down = risen.is_nan() || risen < LOST_FROM * self.rules.lift_m;
                if slipped || down {
                    note(if slipped { "slipped" } else { "dropped" });
                    Stage::Lost
                } else if tick.saturating_sub(since) >= ticks(3.0 * self.rules.shake.axis_s) {
                    note("shaken");
                    Stage::Kept { slip }
                } else {
                    Stage::Shaking { since, slip }
                }
            }
            stage => stage,
        };
        events
    }

    /// One object in the goal when it was kept.
    fn count(&self) -> Count {
        Count { in_goal: u32::from(matches!(self.state.stage, Stage::Kept { .. })), outside: 0 }
    }

    fn score(&self) -> f64 {
        let points = &self.rules.points;
        let mut sum = 0.0;
        if self.state.lifted {
            sum += points.lifted;
        }
        let Some(held) = self.state.held else { return sum };
        sum += points.held;
        if let Stage::Kept { slip } = self.state.stage {
            let part = |x: f64| (1.0 - x).clamp(0.0, 1.0);
            sum += points.shaken;
            sum += points.firm * part(slip.most / self.rules.slip_m);
            sum += points.quick * part(held as f64 * self.tick_s / self.rules.slow_s);
        }
        sum
    }

    fn explain(&self, tick: u64, objects: &[ObjectSnapshot], _: &[f64]) -> Vec<ObjectStatus> {
        let Some(object) = objects.first() else { return Vec::new() };
        let rules = &self.rules;
        let risen = object.position[2] - self.start_m;
        let since_s = |since: u64| (tick.saturating_sub(since)) as f64 * self.tick_s;
        let shake_s = 3.0 * rules.shake.axis_s;
        let (place, held_s, slip, shaken_s) = match self.state.stage {
            Stage::Down => ("down", None, None, None),
            Stage::Up { since, slip } => ("up", Some(since_s(since)), Some(slip), None),
            Stage::Shaking { since, slip } => {
                ("shaking", Some(rules.hold_s), Some(slip), Some(since_s(since)))
            }
            Stage::Lost => ("lost", Some(rules.hold_s), None, None),
            Stage::Kept { slip } => ("kept", Some(rules.hold_s), Some(slip), Some(shake_s)),
        };
        let slip_m = slip.map(|slip| slip.most);
        let kept = matches!(self.state.stage, Stage::Kept { .. });
        let reasons = vec![
            Measured::new("lifted", risen >= rules.lift_m || kept, Some(risen), rules.lift_m, "m"),
            Measured::new("held", self.state.held.is_some(), held_s, rules.hold_s, "s"),
            Measured::new(
                "no_slip",
                slip_m.is_some_and(|slip| slip < rules.slip_m),
                slip_m,
                rules.slip_m,
                "m",
            ),
            Measured::new("shaken", kept, shaken_s, shake_s, "s"),
        ];
        vec![ObjectStatus { object: 0, counts: kept, place: place.to_owned(), reasons }]
    }

    /// The shake is over.
    fn complete(&self) -> bool {
        matches!(self.state.stage, Stage::Lost | Stage::Kept { .. })
    }

    fn shaking(&self, tick: u64) -> Option<(f64, Shake)> {
        match self.state.stage {
            Stage::Shaking { since, .. } => {
                Some((tick.saturating_sub(since) as f64 * self.tick_s, self.rules.shake))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{Rules, Task};
    use palmares_models::Pose;

    fn start() -> HoldReferee {
        let task = Task::builtin().into_iter().find(|task| task.name == "grasp").expect("built in");
        let Rules::Hold(rules) = &task.rules else { panic!("grasp is about holding") };
        HoldReferee::new(rules, &task.at_start(&[at(0.05, 0.0)]))
    }

    /// The object at a height, moved in the hand.
    fn at(z: f64, moved: f64) -> ObjectSnapshot {
        ObjectSnapshot {
            position: [0.0, 0.0, z],
            in_hand: [moved, 0.0, 0.15],
            at_rest: false,
            frame: Pose::IDENTITY,
        }
    }

    fn play(
        referee: &mut HoldReferee,
        ticks: std::ops::Range<u64>,
        object: ObjectSnapshot,
    ) -> Vec<(u64, String)> {
        let events = ticks.flat_map(|tick| referee.watch(tick, &[object]));
        events.map(|event| (event.tick, event.kind)).collect()
    }

    fn is(events: &[(u64, String)], expected: &[(u64, &str)]) {
        let events: Vec<(u64, &str)> = events.iter().map(|(tick, kind)| (*tick, kind.as_str())).collect();
        assert_eq!(events, expected);
    }

    #[test]
    fn a_firm_grasp_gets_everything_but_the_time() {
        let mut referee = start();
        is(&play(&mut referee, 1..300, at(0.05, 0.0)), &[]);
        assert_eq!(referee.score(), 0.0);
        is(&play(&mut referee, 300..502, at(0.16, 0.0)), &[(300, "lifted"), (500, "held")]);
        assert_eq!(referee.shaking(501).map(|(since_s, _)| since_s), Some(0.01));
        assert_eq!(referee.score(), 4.0);
        is(&play(&mut referee, 502..900, at(0.16, 0.015)), &[(800, "shaken")]);
        assert!(referee.complete());
        assert_eq!(referee.count(), Count { in_goal: 1, outside: 0 });
        // Half of the points for firmness, and 25 of 30 s left.
        assert!((referee.score() - (7.0 + 1.0 + 25.0 / 30.0)).abs() < 1e-12, "{}", referee.score());
    }

    #[test]
    fn it_says_how_far_the_object_has_got() {
        let mut referee = start();
        let explain = |referee: &HoldReferee, tick, object| referee.explain(tick, &[object], &[]).remove(0);
        let holds =
            |verdict: &ObjectStatus| verdict.reasons.iter().map(|rule| rule.holds).collect::<Vec<_>>();
        let down = explain(&referee, 0, at(0.05, 0.0));
        assert_eq!((down.place.as_str(), holds(&down)), ("down", vec![false; 4]));
        let _ = play(&mut referee, 1..101, at(0.16, 0.01));
        let up = explain(&referee, 100, at(0.16, 0.01));
        assert_eq!((up.place.as_str(), holds(&up)), ("up", vec![true, false, true, false]));
        let held = &up.reasons[1];
        assert_eq!((held.value, held.limit, held.unit.as_str()), (Some(0.99), 2.0, "s"));
        let _ = play(&mut referee, 101..900, at(0.16, 0.015));
        let kept = explain(&referee, 900, at(0.16, 0.015));
        assert_eq!((kept.place.as_str(), kept.counts, holds(&kept)), ("kept", true, vec![true; 4]));
        assert!(kept.reasons[2].value.is_some_and(|slip| (slip - 0.005).abs() < 1e-12), "{kept:?}");
    }

    #[test]
    fn what_comes_down_or_slips_starts_the_hold_again() {
        let mut referee = start();
        let _ = play(&mut referee, 1..100, at(0.16, 0.0));
        is(&play(&mut referee, 100..110, at(0.12, 0.0)), &[(100, "dropped")]);
        is(&play(&mut referee, 110..200, at(0.16, 0.0)), &[]);
        is(&play(&mut referee, 200..401, at(0.16, 0.04)), &[(200, "slipped"), (400, "held")]);
    }

    #[test]
    fn what_is_lost_in_the_shake_is_lost() {
        for (lost, kind) in [(at(0.05, 0.0), "dropped"), (at(0.16, 0.03), "slipped")] {
            let mut referee = start();
            let _ = play(&mut referee, 1..202, at(0.16, 0.0));
            is(&play(&mut referee, 202..900, lost), &[(202, kind)]);
            assert!(referee.complete());
            assert_eq!((referee.score(), referee.count()), (4.0, Count::default()));
            assert_eq!(referee.shaking(300), None);
            is(&play(&mut referee, 900..2000, at(0.16, 0.0)), &[]);
        }
    }
}
