//! Rules `arrange`: objects reach goals, one after the other.

use super::goal::Goal;
use super::goal_info::GoalInfo;
use super::kind::{Aim, Destination, RuleKind};
use super::limits::{REST_SPEED, settle_s};
use crate::observation::Event;
use crate::referee::space::{Corners, away, contains};
use crate::referee::{Count, Measured, ObjectSnapshot, ObjectStatus, Referee, RunStart, Stateful};
use crate::task::objects::Objects;
use crate::task::placing::plain_name;
use palmares_models::Vec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Goals that are reached one after the other. A goal that has been reached stays so.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arrange {
    /// The goals, in their order.
    pub goals: Vec<Goal>,
    /// Maximum settling time after a run, with the hand frozen, s.
    pub settle_s: f64,
}

/// Maximum number of goals of a task.
const MAX_GOALS: usize = 64;

impl RuleKind for Arrange {
    fn check(&self) -> Result<(), String> {
        settle_s(self.settle_s)?;
        if !(1..=MAX_GOALS).contains(&self.goals.len()) {
            return Err(format!("rules.goals: {} of them; 1 to {MAX_GOALS} are possible", self.goals.len()));
        }
        for (k, goal) in self.goals.iter().enumerate() {
            plain_name("rules.goals.name", &goal.name)?;
            if self.goals[..k].iter().any(|other| other.name == goal.name) {
                return Err(format!(
                    "rules.goals: two are called `{}`; each needs a name of its own",
                    goal.name
                ));
            }
            goal.check().map_err(|problem| format!("rules.goals `{}`: {problem}", goal.name))?;
        }
        Ok(())
    }

    /// Every object that a goal names exists with every seed.
    fn check_objects(&self, objects: &Objects) -> Result<(), String> {
        let Some(names) = objects.certain() else {
            let valid = "objects.count as large as the list objects.from";
            return Err(format!(
                "rules of kind `arrange` need objects that are there with every seed: {valid}"
            ));
        };
        for goal in &self.goals {
            let within = goal.within.as_ref().map(|within| ("within.object", &within.object));
            for (field, name) in [("object", &goal.object)].into_iter().chain(within) {
                if !names.contains(name) {
                    let (goal, names) = (&goal.name, names.join(", "));
                    return Err(format!(
                        "rules.goals `{goal}`: {field} = `{name}` is no object; objects: {names}"
                    ));
                }
            }
        }
        Ok(())
    }

    fn regions(&self) -> Vec<(&'static str, &str)> {
        let inside = self.goals.iter().filter_map(|goal| goal.inside.as_deref());
        inside.map(|name| ("rules.goals.inside", name)).collect()
    }

    fn role(&self, region: &str) -> Option<&'static str> {
        self.goals.iter().any(|goal| goal.inside.as_deref() == Some(region)).then_some("goal")
    }

    fn settle_s(&self) -> f64 {
        self.settle_s
    }

    fn aims(&self, objects: &Objects) -> Vec<Aim<'_>> {
        let names = objects.certain().unwrap_or_default();
        let index = |name: &str| names.iter().position(|known| known == name);
        let aims = self.goals.iter().filter_map(|goal| {
            let within = goal.within.as_ref().and_then(|within| {
                Some(Destination::Box { object: index(&within.object)?, min: within.min, max: within.max })
            });
            let target = within.or_else(|| goal.inside.as_deref().map(Destination::Region));
            Some(Aim { object: index(&goal.object)?, point: goal.point, target })
        });
        aims.collect()
    }

    fn in_order(&self) -> bool {
        true
    }

    fn goals(&self) -> Vec<GoalInfo> {
        self.goals.iter().map(GoalInfo::from).collect()
    }

    fn describe(&self) -> Vec<String> {
        self.goals.iter().enumerate().map(|(k, goal)| format!("{}. {}", k + 1, goal.describe())).collect()
    }
}

/// A goal, with its names resolved.
#[derive(Clone, Debug)]
struct ResolvedGoal {
    goal: Goal,
    /// In scene order.
    object: usize,
    region: Option<Corners>,
    /// Index of the object in whose frame the goal is given, in scene order.
    other: Option<usize>,
    /// Height of the measured point at tick 0, m.
    start_m: f64,
}

/// Watches the objects of a run.
#[derive(Clone, Debug)]
pub(super) struct ArrangeReferee {
    aims: Arc<[ResolvedGoal]>,
    tick_s: f64,
    state: ArrangeState,
}

/// State of the referee.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct ArrangeState {
    /// Goals that have been reached, the first ones.
    reached: usize,
    /// The tick since which the next one holds.
    since: Option<u64>,
}

impl ResolvedGoal {
    /// The measured point, m.
    fn point(&self, object: &ObjectSnapshot) -> Vec3 {
        match self.goal.point {
            Some(point) => object.frame * Vec3::from_array(point),
            None => Vec3::from_array(object.position),
        }
    }

    /// Every condition of the goal, measured. `speed` of the object, m/s.
    fn measure(&self, objects: &[ObjectSnapshot], speed: Option<f64>) -> Vec<Measured> {
        let Some(object) = objects.get(self.object) else { return Vec::new() };
        let (goal, point) = (&self.goal, self.point(object));
        let mut out = Vec::new();
        if let Some(region) = self.region {
            let at = point.to_array();
            out.push(Measured::new("inside", contains(region, at), Some(away(region, at)), 0.0, "m"));
        }
        if let (Some(within), Some(other)) = (&goal.within, self.other.and_then(|k| objects.get(k))) {
            let (at, corners) =
                (other.frame.inverse().transform_point(point).to_array(), (within.min, within.max));
            out.push(Measured::new("within", contains(corners, at), Some(away(corners, at)), 0.0, "m"));
        }
        if let Some(above_m) = goal.above_m {
            let risen = point.z - self.start_m;
            out.push(Measured::new("above", risen >= above_m, Some(risen), above_m, "m"));
        }
        if let Some(most_deg) = goal.upright_deg {
            let up = (object.frame.rotation * Vec3::Z).z.clamp(-1.0, 1.0);
            let tilt_deg = libm::acos(up).to_degrees();
            out.push(Measured::new("upright", tilt_deg <= most_deg, Some(tilt_deg), most_deg, "deg"));
        }
        if goal.at_rest {
            out.push(Measured::new("at_rest", object.at_rest, speed, REST_SPEED, "m/s"));
        }
        if let Some(hand_off_m) = goal.hand_off_m {
            let distance = Vec3::from_array(object.in_hand).length();
            out.push(Measured::new("let_go", distance >= hand_off_m, Some(distance), hand_off_m, "m"));
        }
        out
    }
}

impl ArrangeReferee {
    /// A referee at tick 0, with the objects at these poses.
    pub(super) fn new(rules: &Arrange, start: &RunStart<'_>) -> Self {
        // The task has been checked: every name is there.
        let aim = |goal: &Goal| {
            let mut aim = ResolvedGoal {
                object: start.object(&goal.object)?,
                region: goal.inside.as_deref().and_then(|name| start.region(name)),
                other: goal.within.as_ref().and_then(|within| start.object(&within.object)),
                start_m: 0.0,
                goal: goal.clone(),
            };
            aim.start_m = aim.point(start.objects.get(aim.object)?).z;
            Some(aim)
        };
        ArrangeReferee {
            aims: rules.goals.iter().filter_map(aim).collect(),
            tick_s: start.tick_s,
            state: ArrangeState::default(),
        }
    }
}

impl Stateful for ArrangeReferee {
    type State = ArrangeState;

    fn state(&self) -> &ArrangeState {
        &self.state
    }

    fn state_mut(&mut self) -> &mut ArrangeState {
        &mut self.state
    }

    /// It has reached at most as many goals as there are.
    fn fits(&self, state: &ArrangeState) -> bool {
        state.reached <= self.aims.len()
    }
}

impl Referee for ArrangeReferee {
    fn watch(&mut self, tick: u64, objects: &[ObjectSnapshot]) -> Vec<Event> {
        let mut events = Vec::new();
        // The state that reaches one goal may also reach the next one.
        while let Some(aim) = self.aims.get(self.state.reached) {
            if !aim.measure(objects, None).iter().all(|rule| rule.holds) {
                self.state.since = None;
                break;
            }
            let since = *self.state.since.get_or_insert(tick);
            if tick.saturating_sub(since) < (aim.goal.for_s / self.tick_s).round() as u64 {
                break;
            }
            events.push(Event { tick, kind: aim.goal.name.clone(), object: Some(aim.object) });
            self.state = ArrangeState { reached: self.state.reached + 1, since: None };
        }
        events
    }

    /// Number of reached goals.
    fn count(&self) -> Count {
        Count { in_goal: self.state.reached as u32, outside: 0 }
    }

    /// Points of the goals that have been reached.
    fn score(&self) -> f64 {
        // An empty sum is -0.
        self.aims.iter().take(self.state.reached).fold(0.0, |sum, aim| sum + aim.goal.points)
    }

    /// All goals have been reached.
    fn complete(&self) -> bool {
        self.state.reached == self.aims.len()
    }

    /// The status of each object by its first goal that is not reached.
    fn explain(&self, tick: u64, objects: &[ObjectSnapshot], speeds: &[f64]) -> Vec<ObjectStatus> {
        let verdict = |object: usize| {
            let mut own = self.aims.iter().enumerate().filter(|(_, aim)| aim.object == object).peekable();
            let concerned = own.peek().is_some();
            let Some((k, aim)) = own.find(|(k, _)| *k >= self.state.reached) else {
                let place = if concerned { "done" } else { "none" };
                return ObjectStatus {
                    object,
                    counts: concerned,
                    place: place.to_owned(),
                    reasons: Vec::new(),
                };
            };
            let now = k == self.state.reached;
            let mut reasons = aim.measure(objects, speeds.get(object).copied());
            if aim.goal.for_s > 0.0 {
                let since = self.state.since.filter(|_| now);
                let held_s = since.map_or(0.0, |since| tick.saturating_sub(since) as f64 * self.tick_s);
                let (holds, limit) = (held_s >= aim.goal.for_s, aim.goal.for_s);
                reasons.push(Measured::new("held", holds, Some(held_s), limit, "s"));
            }
            let place = if now { aim.goal.name.clone() } else { "later".to_owned() };
            ObjectStatus { object, counts: false, place, reasons }
        };
        (0..objects.len()).map(verdict).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{Rules, Task};
    use palmares_models::{Pose, Rotation};

    /// A cube that is to be lifted for 0.1 s, then put upright and at rest into a tray, then next to a post, and the post.
    fn start() -> ArrangeReferee {
        let text = include_str!("../../../tests/cube.toml");
        let task = Task::parse("cube.toml", text).expect("valid");
        let Rules::Arrange(rules) = &task.rules else { panic!("cubes are arranged") };
        ArrangeReferee::new(rules, &task.at_start(&scene(at([0.0, 0.0, 0.02]))))
    }

    fn at(position: [f64; 3]) -> ObjectSnapshot {
        let frame = Pose::from_translation(Vec3::from_array(position));
        ObjectSnapshot { position, in_hand: [0.0, 0.0, 0.5], at_rest: true, frame }
    }

    fn turned(object: ObjectSnapshot, rotation: Rotation) -> ObjectSnapshot {
        ObjectSnapshot { frame: Pose::from_parts(object.frame.translation, rotation), ..object }
    }

    /// The cube, and the post at its place.
    fn scene(cube: ObjectSnapshot) -> Vec<ObjectSnapshot> {
        vec![cube, at([0.3, 0.0, 0.05])]
    }

    fn play(
        referee: &mut ArrangeReferee,
        ticks: std::ops::Range<u64>,
        cube: ObjectSnapshot,
    ) -> Vec<(u64, String)> {
        let events = ticks.flat_map(|tick| referee.watch(tick, &scene(cube)));
        events.map(|event| (event.tick, event.kind)).collect()
    }

    const UP: [f64; 3] = [0.0, 0.0, 0.13];
    const TRAY: [f64; 3] = [0.0, 0.3, 0.02];
    const POST: [f64; 3] = [0.25, 0.0, 0.02];

    #[test]
    fn goals_are_reached_one_after_the_other() {
        let mut referee = start();
        // Out of order: nothing.
        assert_eq!(play(&mut referee, 1..50, at(TRAY)), []);
        assert_eq!((referee.score().to_bits(), referee.count()), (0, Count::default()), "not -0");
        assert_eq!(play(&mut referee, 50..80, at(UP)), [(60, "up".to_owned())]);
        assert_eq!((referee.score(), referee.count().in_goal), (1.0, 1));
        assert_eq!(play(&mut referee, 80..90, at(TRAY)), [(80, "in_tray".to_owned())]);
        // A goal that was reached stays so.
        assert_eq!(play(&mut referee, 90..100, at(UP)), []);
        assert_eq!((referee.score(), referee.complete()), (3.0, false));
        assert_eq!(play(&mut referee, 100..110, at(POST)), [(100, "at_post".to_owned())]);
        assert_eq!((referee.score(), referee.complete(), referee.count().in_goal), (6.0, true, 3));
        assert_eq!(play(&mut referee, 110..120, at(UP)), [], "it is over");
    }

    #[test]
    fn what_does_not_last_starts_again() {
        let mut referee = start();
        assert_eq!(play(&mut referee, 1..11, at(UP)), []);
        assert_eq!(play(&mut referee, 11..12, at([0.0, 0.0, 0.1])), []);
        assert_eq!(play(&mut referee, 12..23, at(UP)), [(22, "up".to_owned())]);
    }

    #[test]
    fn what_leans_moves_or_lies_aside_does_not_count() {
        let mut referee = start();
        let _ = play(&mut referee, 1..20, at(UP));
        let leaning = turned(at(TRAY), Rotation::from_rotation_x(0.3));
        assert_eq!(play(&mut referee, 20..30, leaning), []);
        assert_eq!(play(&mut referee, 30..40, ObjectSnapshot { at_rest: false, ..at(TRAY) }), []);
        assert_eq!(play(&mut referee, 40..50, at([0.0, 0.36, 0.02])), []);
        assert_eq!(play(&mut referee, 50..51, at(TRAY)).len(), 1);
        // The point that is looked at is a corner of the cube: 2 cm towards the post, wherever that is.
        assert_eq!(play(&mut referee, 51..52, at([0.21, 0.0, 0.02])), []);
        let back = turned(at(POST), Rotation::from_rotation_z(std::f64::consts::PI));
        assert_eq!(play(&mut referee, 52..53, back), []);
        assert_eq!(play(&mut referee, 53..54, at(POST)).len(), 1);
    }

    #[test]
    fn it_says_how_far_each_object_is() {
        let mut referee = start();
        let explain = |referee: &ArrangeReferee, tick, cube| referee.explain(tick, &scene(cube), &[0.1, 0.0]);
        let verdicts = explain(&referee, 0, at([0.0, 0.0, 0.07]));
        let [cube, post] = verdicts.as_slice() else { panic!("{verdicts:?}") };
        // An object of no goal.
        assert_eq!((post.counts, post.place.as_str(), post.reasons.len()), (false, "none", 0));
        assert_eq!((cube.counts, cube.place.as_str(), cube.reasons.len()), (false, "up", 2));
        let risen = &cube.reasons[0];
        assert_eq!((risen.rule.as_str(), risen.holds, risen.limit), ("above", false, 0.1));
        assert!(risen.value.is_some_and(|m| (m - 0.05).abs() < 1e-12), "{risen:?}");
        let _ = play(&mut referee, 1..6, at(UP));
        let held = &explain(&referee, 5, at(UP))[0].reasons[1];
        assert_eq!((held.rule.as_str(), held.value, held.unit.as_str()), ("held", Some(0.04), "s"));
        let _ = play(&mut referee, 6..20, at(UP));
        let cube = explain(&referee, 20, turned(at(TRAY), Rotation::from_rotation_x(0.3))).remove(0);
        let rules: Vec<(&str, bool)> = cube.reasons.iter().map(|r| (r.rule.as_str(), r.holds)).collect();
        assert_eq!(rules, [("inside", true), ("upright", false), ("at_rest", true), ("let_go", true)]);
        assert_eq!(cube.reasons[2].value, Some(0.1));
        let _ = play(&mut referee, 20..22, at(TRAY));
        let _ = play(&mut referee, 22..24, at(POST));
        let cube = explain(&referee, 24, at(POST)).remove(0);
        assert_eq!((cube.counts, cube.place.as_str()), (true, "done"));
    }

    #[test]
    fn what_is_still_in_the_hand_has_not_been_let_go() {
        let mut referee = start();
        let _ = play(&mut referee, 1..20, at(UP));
        let held = ObjectSnapshot { in_hand: [0.0, 0.0, 0.2], ..at(TRAY) };
        assert_eq!(play(&mut referee, 20..40, held), []);
        let reason =
            referee.explain(40, &scene(held), &[0.0, 0.0]).remove(0).reasons.pop().expect("the last rule");
        assert_eq!((reason.rule.as_str(), reason.value, reason.limit), ("let_go", Some(0.2), 0.3));
        assert_eq!(play(&mut referee, 40..41, at(TRAY)).len(), 1);
    }

    #[test]
    fn a_place_that_is_no_number_reaches_nothing() {
        let mut referee = start();
        assert_eq!(play(&mut referee, 1..50, at([f64::NAN; 3])), []);
    }
}
