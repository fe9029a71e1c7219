//! Rules `collect`: objects move from one region to another.

use super::goal_info::GoalInfo;
use super::kind::{Aim, Destination, RuleKind};
use super::limits::{REST_SPEED, points, settle_s};
use crate::observation::Event;
use crate::referee::space::{Corners, away, contains};
use crate::referee::{Count, Measured, ObjectSnapshot, ObjectStatus, Referee, RunStart, Stateful};
use crate::task::objects::Objects;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

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

    fn aims(&self, objects: &Objects) -> Vec<Aim<'_>> {
        let target = Some(Destination::Region(&self.goal));
        (0..objects.count).map(|object| Aim { object, point: None, target: target.clone() }).collect()
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

/// Place of an object under the rules.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Place {
    /// In the box it came from, or on its way.
    Start,
    /// At rest in the goal box.
    Goal,
    /// At rest in neither box.
    Outside,
}

/// State of the referee.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct CollectState {
    /// Place of each object.
    places: Vec<Place>,
}

/// Watches the objects of a run.
#[derive(Clone, Debug)]
pub(super) struct CollectReferee {
    rules: Arc<Collect>,
    goal: Corners,
    start: Corners,
    state: CollectState,
}

impl CollectReferee {
    /// A referee at tick 0: every object is where it was placed.
    pub(super) fn new(rules: &Collect, start: &RunStart<'_>) -> Self {
        let volume = |name: &str| start.region(name).unwrap_or_default();
        CollectReferee {
            goal: volume(&rules.goal),
            start: volume(&rules.start),
            state: CollectState { places: vec![Place::Start; start.objects.len()] },
            rules: Arc::new(rules.clone()),
        }
    }

    /// Points of a count.
    fn points(&self, count: Count) -> f64 {
        self.rules.in_goal * f64::from(count.in_goal) + self.rules.outside * f64::from(count.outside)
    }
}

impl Stateful for CollectReferee {
    type State = CollectState;

    fn state(&self) -> &CollectState {
        &self.state
    }

    fn state_mut(&mut self) -> &mut CollectState {
        &mut self.state
    }

    /// It has as many objects.
    fn fits(&self, state: &CollectState) -> bool {
        self.state.places.len() == state.places.len()
    }
}

impl Referee for CollectReferee {
    fn watch(&mut self, tick: u64, objects: &[ObjectSnapshot]) -> Vec<Event> {
        let mut events = Vec::new();
        for (k, (snapshot, place)) in objects.iter().zip(&mut self.state.places).enumerate() {
            let inside = contains(self.goal, snapshot.position);
            let now = if inside {
                // An object that only passes through the goal has not arrived; one that has arrived may be nudged.
                if snapshot.at_rest || *place == Place::Goal { Place::Goal } else { *place }
            } else if contains(self.start, snapshot.position) {
                Place::Start
            } else if snapshot.at_rest {
                Place::Outside
            } else if *place == Place::Goal {
                Place::Start
            } else {
                *place
            };
            if now == *place {
                continue;
            }
            let mut note = |kind: &str| events.push(Event { tick, kind: kind.to_owned(), object: Some(k) });
            match (*place, now) {
                (_, Place::Goal) => note("in_goal"),
                (_, Place::Outside) => note("outside"),
                (Place::Goal, _) => note("left_goal"),
                (_, Place::Start) => note("back_inside"),
            }
            *place = now;
        }
        events
    }

    fn count(&self) -> Count {
        let number = |place| self.state.places.iter().filter(|p| **p == place).count() as u32;
        Count { in_goal: number(Place::Goal), outside: number(Place::Outside) }
    }

    fn explain(&self, _: u64, objects: &[ObjectSnapshot], speeds: &[f64]) -> Vec<ObjectStatus> {
        let each = objects.iter().zip(speeds).zip(&self.state.places).enumerate();
        each.map(|(object, ((snapshot, speed), place))| {
            let (to_goal, to_start) =
                (away(self.goal, snapshot.position), away(self.start, snapshot.position));
            let in_start = contains(self.start, snapshot.position);
            let counts = *place == Place::Goal;
            let place = match place {
                Place::Goal => "goal",
                Place::Outside => "outside",
                Place::Start if in_start => "start",
                Place::Start => "on_the_way",
            };
            let reasons = vec![
                Measured::new("in_goal", contains(self.goal, snapshot.position), Some(to_goal), 0.0, "m"),
                // An object that has arrived may be nudged.
                Measured::new("at_rest", snapshot.at_rest || counts, Some(*speed), REST_SPEED, "m/s"),
                Measured::new("in_start", in_start, Some(to_start), 0.0, "m"),
            ];
            ObjectStatus { object, counts, place: place.to_owned(), reasons }
        })
        .collect()
    }

    fn score(&self) -> f64 {
        self.points(self.count())
    }

    /// Every object is in the goal.
    fn complete(&self) -> bool {
        self.state.places.iter().all(|place| *place == Place::Goal)
    }

    /// By position alone.
    fn final_result(&self, objects: &[ObjectSnapshot]) -> (Count, f64) {
        let mut count = Count::default();
        for snapshot in objects {
            if contains(self.goal, snapshot.position) {
                count.in_goal += 1;
            } else if !contains(self.start, snapshot.position) {
                count.outside += 1;
            }
        }
        (count, self.points(count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{Rules, Task};
    use palmares_models::Pose;

    const IN_A: [f64; 3] = [0.0, 0.0, 0.05];
    const IN_B: [f64; 3] = [0.7, 0.0, 0.05];
    const ABOVE: [f64; 3] = [0.35, 0.0, 0.5];
    const GROUND: [f64; 3] = [0.35, 0.6, 0.045];

    fn start() -> CollectReferee {
        let task = &Task::builtin()[0];
        let Rules::Collect(rules) = &task.rules else { panic!("balls are collected") };
        CollectReferee::new(rules, &task.at_start(&all(IN_A, true)))
    }

    fn all(position: [f64; 3], at_rest: bool) -> Vec<ObjectSnapshot> {
        vec![ObjectSnapshot { position, in_hand: [0.0; 3], at_rest, frame: Pose::IDENTITY }; 10]
    }

    fn kinds(events: &[Event]) -> Vec<&str> {
        events.iter().map(|e| e.kind.as_str()).collect()
    }

    #[test]
    fn balls_count_one_and_minus_a_half() {
        assert_eq!(start().points(Count { in_goal: 7, outside: 2 }), 6.0);
        assert_eq!(start().points(Count::default()), 0.0);
    }

    #[test]
    fn a_carried_ball_counts_once_it_rests_in_the_goal() {
        let mut referee = start();
        let mut objects = all(IN_A, true);
        let moving = ObjectSnapshot { at_rest: false, ..objects[4] };
        assert!(referee.watch(1, &objects).is_empty());
        objects[4] = ObjectSnapshot { position: ABOVE, ..moving };
        assert!(referee.watch(2, &objects).is_empty());
        objects[4] = ObjectSnapshot { position: IN_B, ..moving };
        assert!(referee.watch(3, &objects).is_empty());
        objects[4].at_rest = true;
        let events = referee.watch(4, &objects);
        assert_eq!(events, [Event { tick: 4, kind: "in_goal".into(), object: Some(4) }]);
        assert_eq!(referee.count(), Count { in_goal: 1, outside: 0 });
        objects[4].at_rest = false;
        assert!(referee.watch(5, &objects).is_empty(), "a nudge takes nothing away");
        objects[4] = ObjectSnapshot { position: ABOVE, ..moving };
        assert_eq!(kinds(&referee.watch(6, &objects)), ["left_goal"]);
    }

    #[test]
    fn it_says_why_a_ball_counts_or_does_not() {
        let mut referee = start();
        let mut objects = all(IN_A, true);
        objects[1].position = IN_B;
        objects[2] = ObjectSnapshot { position: IN_B, at_rest: false, ..objects[2] };
        objects[3].position = GROUND;
        objects[4] = ObjectSnapshot { position: ABOVE, at_rest: false, ..objects[4] };
        let _ = referee.watch(1, &objects);
        let mut speeds = [0.0; 10];
        (speeds[2], speeds[4]) = (0.2, 0.3);
        let statuses = referee.explain(1, &objects, &speeds);
        let short = |status: &ObjectStatus| (status.counts, status.place.clone());
        let expected = [
            (false, "start"),
            (true, "goal"),
            (false, "on_the_way"),
            (false, "outside"),
            (false, "on_the_way"),
        ];
        for (status, (counts, place)) in statuses.iter().zip(expected) {
            assert_eq!(short(status), (counts, place.to_owned()), "{status:?}");
        }
        let fast = &statuses[2].reasons[1];
        assert_eq!(
            (fast.rule.as_str(), fast.holds, fast.value, fast.limit, fast.unit.as_str()),
            ("at_rest", false, Some(0.2), REST_SPEED, "m/s")
        );
        assert!(statuses[2].reasons[0].holds && statuses[2].reasons[0].value == Some(0.0));
        let far = &statuses[3].reasons[0];
        assert!(!far.holds && far.value.is_some_and(|away| away > 0.1 && away < 1.0), "{far:?}");
        // Nudged, it still counts.
        let nudged = ObjectSnapshot { position: IN_B, at_rest: false, ..objects[1] };
        objects[1] = nudged;
        let _ = referee.watch(2, &objects);
        speeds[1] = 0.1;
        let status = &referee.explain(1, &objects, &speeds)[1];
        assert!(
            status.counts && status.reasons[1].holds && status.reasons[1].value == Some(0.1),
            "{status:?}"
        );
        assert_eq!(status.counts, referee.count().in_goal == 1);
    }

    #[test]
    fn a_lost_ball_costs_until_it_is_back() {
        let mut referee = start();
        let mut objects = all(IN_A, true);
        objects[0] = ObjectSnapshot { position: GROUND, at_rest: true, ..objects[0] };
        assert_eq!(kinds(&referee.watch(1, &objects)), ["outside"]);
        assert_eq!(referee.count(), Count { in_goal: 0, outside: 1 });
        objects[0].position = IN_A;
        assert_eq!(kinds(&referee.watch(2, &objects)), ["back_inside"]);
        assert_eq!(referee.count(), Count::default());
    }

    #[test]
    fn the_final_count_goes_by_position_alone() {
        let referee = start();
        let mut objects = all(IN_A, true);
        objects[0].position = IN_B;
        objects[1].position = GROUND;
        objects[2].position = ABOVE;
        assert_eq!(referee.final_result(&objects), (Count { in_goal: 1, outside: 2 }, 0.0));
    }
}
