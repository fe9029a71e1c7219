//! Bringing objects from one region to another.

use super::snapshot::ObjectSnapshot;
use crate::observation::Event;
use crate::score::{Count, score};
use crate::task::{Collect, Task};

/// Where an object is, as far as the rules care.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// In the box it came from, or on its way.
    Start,
    /// At rest in the goal box.
    Goal,
    /// At rest in neither box.
    Outside,
}

/// Watches the objects of a run.
#[derive(Clone, Debug)]
pub struct CollectReferee {
    rules: Collect,
    goal: ([f64; 3], [f64; 3]),
    start: ([f64; 3], [f64; 3]),
    places: Vec<Place>,
}

impl CollectReferee {
    /// A referee at tick 0: every object is where it was placed.
    pub fn new(task: &Task, rules: &Collect, objects: usize) -> Self {
        let volume = |name: &str| task.region(name).unwrap_or(([0.0; 3], [0.0; 3]));
        CollectReferee {
            goal: volume(&rules.goal),
            start: volume(&rules.start),
            places: vec![Place::Start; objects],
            rules: rules.clone(),
        }
    }

    /// Looks at every object, in scene order, at a tick; returns what changed.
    pub fn watch(&mut self, tick: u64, objects: &[ObjectSnapshot]) -> Vec<Event> {
        let mut events = Vec::new();
        for (k, (seen, place)) in objects.iter().zip(&mut self.places).enumerate() {
            let inside = contains(self.goal, seen.position);
            let now = if inside {
                // What only passes through the goal has not arrived; what has arrived may be nudged.
                if seen.at_rest || *place == Place::Goal { Place::Goal } else { *place }
            } else if contains(self.start, seen.position) {
                Place::Start
            } else if seen.at_rest {
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

    /// The count by what has been noted so far.
    pub fn count(&self) -> Count {
        let number = |place| self.places.iter().filter(|p| **p == place).count() as u32;
        Count { in_goal: number(Place::Goal), outside: number(Place::Outside) }
    }

    /// Points of a count.
    pub fn score(&self, count: Count) -> f64 {
        score(&self.rules, count)
    }

    /// Whether every object is in the goal.
    pub fn complete(&self) -> bool {
        self.places.iter().all(|place| *place == Place::Goal)
    }

    /// The count at the end of a run, after settling: by position alone.
    pub fn final_count(&self, objects: &[ObjectSnapshot]) -> Count {
        let mut count = Count::default();
        for seen in objects {
            if contains(self.goal, seen.position) {
                count.in_goal += 1;
            } else if !contains(self.start, seen.position) {
                count.outside += 1;
            }
        }
        count
    }
}

fn contains((low, high): ([f64; 3], [f64; 3]), p: [f64; 3]) -> bool {
    (0..3).all(|k| p[k] >= low[k] && p[k] <= high[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Rules;

    const IN_A: [f64; 3] = [0.0, 0.0, 0.05];
    const IN_B: [f64; 3] = [0.7, 0.0, 0.05];
    const ABOVE: [f64; 3] = [0.35, 0.0, 0.5];
    const GROUND: [f64; 3] = [0.35, 0.6, 0.045];

    fn start() -> CollectReferee {
        let task = &Task::builtin()[0];
        let Rules::Collect(rules) = &task.rules else { panic!("balls are collected") };
        CollectReferee::new(task, rules, 10)
    }

    fn all(position: [f64; 3], at_rest: bool) -> Vec<ObjectSnapshot> {
        vec![ObjectSnapshot { position, in_hand: [0.0; 3], at_rest }; 10]
    }

    fn kinds(events: &[Event]) -> Vec<&str> {
        events.iter().map(|e| e.kind.as_str()).collect()
    }

    #[test]
    fn a_carried_ball_counts_once_it_rests_in_the_goal() {
        let mut referee = start();
        let mut seen = all(IN_A, true);
        let moving = ObjectSnapshot { at_rest: false, ..seen[4] };
        assert!(referee.watch(1, &seen).is_empty());
        seen[4] = ObjectSnapshot { position: ABOVE, ..moving };
        assert!(referee.watch(2, &seen).is_empty());
        seen[4] = ObjectSnapshot { position: IN_B, ..moving };
        assert!(referee.watch(3, &seen).is_empty());
        seen[4].at_rest = true;
        let events = referee.watch(4, &seen);
        assert_eq!(events, [Event { tick: 4, kind: "in_goal".into(), object: Some(4) }]);
        assert_eq!(referee.count(), Count { in_goal: 1, outside: 0 });
        seen[4].at_rest = false;
        assert!(referee.watch(5, &seen).is_empty(), "a nudge takes nothing away");
        seen[4] = ObjectSnapshot { position: ABOVE, ..moving };
        assert_eq!(kinds(&referee.watch(6, &seen)), ["left_goal"]);
    }

    #[test]
    fn a_lost_ball_costs_until_it_is_back() {
        let mut referee = start();
        let mut seen = all(IN_A, true);
        seen[0] = ObjectSnapshot { position: GROUND, at_rest: true, ..seen[0] };
        assert_eq!(kinds(&referee.watch(1, &seen)), ["outside"]);
        assert_eq!(referee.count(), Count { in_goal: 0, outside: 1 });
        seen[0].position = IN_A;
        assert_eq!(kinds(&referee.watch(2, &seen)), ["back_inside"]);
        assert_eq!(referee.count(), Count::default());
    }

    #[test]
    fn the_final_count_goes_by_position_alone() {
        let referee = start();
        let mut seen = all(IN_A, true);
        seen[0].position = IN_B;
        seen[1].position = GROUND;
        seen[2].position = ABOVE;
        assert_eq!(referee.final_count(&seen), Count { in_goal: 1, outside: 2 });
    }
}
