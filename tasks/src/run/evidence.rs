//! What the referee knows at a moment, for those who ask why an object counts.

use super::Run;
use crate::referee::{ObjectSnapshot, Referee, Verdict};

/// A copy of what the referee knows, to be explained where no world waits.
#[derive(Clone, Debug)]
pub struct Evidence {
    tick: u64,
    referee: Referee,
    objects: Vec<ObjectSnapshot>,
    /// m/s
    speeds: Vec<f64>,
}

impl Evidence {
    /// The referee's verdict on each object.
    pub fn explain(&self) -> Vec<Verdict> {
        self.referee.explain(self.tick, &self.objects, &self.speeds)
    }
}

impl Run {
    /// What the referee knows now.
    pub fn evidence(&self) -> Evidence {
        let (model, state) = (self.world.model(), self.world.state());
        let speeds = (0..state.objects.len()).map(|k| state.object_velocity(model, k).0.length());
        Evidence {
            tick: self.tick,
            referee: self.referee.clone(),
            objects: self.sightings(),
            speeds: speeds.collect(),
        }
    }

    /// Why each object counts or does not, if the run ended now, without the settling.
    pub fn explain(&self) -> Vec<Verdict> {
        self.evidence().explain()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Action, Seed, Task};
    use palmares_models::hand::Hand;

    #[test]
    fn every_object_has_a_verdict_from_the_first_tick_on() {
        for task in Task::builtin() {
            let hand = Hand::builtin("softhand").expect("built in");
            let mut run = Run::new(task, hand, Seed::from_u64(1)).expect("a scene");
            for _ in 0..2 {
                let told = run.explain();
                assert_eq!(told.len(), run.scene().bodies.iter().filter(|body| body.free).count());
                assert!(told.iter().all(|verdict| !verdict.counts && verdict.reasons.len() > 2), "{told:?}");
                run.step(&Action::default()).expect("valid");
            }
        }
    }

    #[test]
    fn a_ball_that_is_put_into_the_box_counts_when_it_rests() {
        let task = Task::builtin().into_iter().find(|task| task.name == "balls").expect("balls");
        let hand = Hand::builtin("softhand").expect("built in");
        let mut run = Run::new(task.clone(), hand, Seed::from_u64(1)).expect("a scene");
        let goal = run.scene().regions.iter().find(|region| region.role.as_deref() == Some("goal"));
        let (low, high) = goal.map(|region| (region.min, region.max)).expect("a goal");
        let mut state = run.world.state().clone();
        let middle = |k: usize| 0.5 * (low[k] + high[k]);
        state.objects[0].translation = palmares_models::Vec3::new(middle(0), middle(1), low[2] + 0.12);
        state.sleep[0] = Default::default();
        run.world.restore(state);
        run.step(&Action::default()).expect("valid");
        let falling = run.explain().remove(0);
        assert!(!falling.counts && falling.place == "on_the_way", "{falling:?}");
        let holds = |told: &Verdict| told.reasons.iter().map(|rule| rule.holds).collect::<Vec<_>>();
        assert_eq!(holds(&falling), [true, false, false]);
        for _ in 0..500 {
            run.step(&Action::default()).expect("valid");
        }
        let rests = run.explain().remove(0);
        assert!(rests.counts && rests.place == "goal", "{rests:?}");
        assert_eq!(holds(&rests), [true, true, false]);
        assert_eq!(run.score(), 1.0);
    }
}
