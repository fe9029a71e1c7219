//! Samples of a run for viewers. The thread that steps the world only copies its state.

use super::Run;
use super::evidence::Evidence;
use super::telemetry::{Contact, RunSample, Telemetry, TelemetryModel};
use crate::referee::ObjectStatus;
use std::sync::Arc;

impl Run {
    /// The model that reads [`Run::sample`].
    pub fn telemetry_model(&self) -> &Arc<TelemetryModel> {
        &self.telemetry_model
    }

    /// A copy of the present state, for telemetry.
    pub fn sample(&self) -> RunSample {
        let state = self.world.state();
        RunSample {
            motors: state.motors.clone(),
            locked: state.locked.clone(),
            tension: state.tension.clone(),
            motor_work_j: self.motor_work_j.clone(),
            base: state.base,
            q: state.q.clone(),
            contacts: self.world.contact_forces().to_vec(),
            readings: self.sensors.ideal(&self.world),
        }
    }

    /// Position and tension of every motor.
    pub(super) fn motor_states(&self) -> Vec<(f64, f64)> {
        let state = self.world.state();
        let motors = state.motors.iter().enumerate();
        motors.map(|(k, motor)| (motor.position, self.hand.motor_load(k, &state.tension))).collect()
    }

    /// Adds the work of the motors on their tendons in a tick; `before` is their state when it began.
    pub(super) fn add_motor_work(&mut self, before: &[(f64, f64)]) {
        let ticked = before.iter().zip(self.motor_states());
        for ((motor, work), ((from, pulled), (to, pulls))) in
            self.hand.motors.iter().zip(&mut self.motor_work_j).zip(ticked)
        {
            *work += 0.5 * (pulled + pulls) * motor.scaling * (to - from);
        }
    }

    /// The present telemetry.
    pub fn telemetry(&self) -> Telemetry {
        self.telemetry_model.telemetry(&self.sample())
    }

    /// Every touching contact.
    pub fn contacts(&self) -> Vec<Contact> {
        self.telemetry_model.contacts(&self.sample())
    }

    /// The present knowledge of the referee.
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

    /// The status of each object if the run ended now, without the settling.
    pub fn explain(&self) -> Vec<ObjectStatus> {
        self.evidence().explain()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::telemetry::friction_use;
    use crate::sensing::Sensing;
    use crate::{Action, BaseTarget, Seed, Task};
    use palmares_models::hand::Hand;
    use palmares_models::{Pose, Vec3};
    use palmares_sim::model::pair_friction;
    use palmares_sim::{ContactForce, Owner};

    fn run() -> Run {
        let task = Task::builtin().into_iter().find(|task| task.name == "balls").expect("balls");
        let mut run =
            Run::new(task, Hand::builtin("softhand").expect("built in"), Seed::from_u64(8)).expect("a scene");
        for tick in 0..150 {
            let z = (0.6 - 0.004 * f64::from(tick)).max(0.2);
            let base = BaseTarget::Pose { position: [0.0, 0.0, z], quat_xyzw: [0.0, 1.0, 0.0, 0.0] };
            run.step(&Action { base: Some(base), hand: Some(vec![0.5]), effort: None }).expect("valid");
        }
        run
    }

    #[test]
    fn it_has_the_observation_of_the_controller_with_the_bodies_ids() {
        let run = run();
        let observation = run.observe(Sensing::Truth);
        let truth = observation.truth.expect("the truth");
        let telemetry = run.telemetry();
        assert_eq!(
            (&telemetry.q, &telemetry.predicted),
            (&truth.joints.position.0, &truth.predicted_equilibrium.0)
        );
        for (motor, [command, position, _, tension]) in
            telemetry.motors.iter().zip(observation.hand.of("motors").as_chunks().0)
        {
            assert_eq!((motor.command, motor.position, motor.tension), (*command, *position, *tension));
        }
        let names: Vec<String> = run
            .scene()
            .bodies
            .iter()
            .map(|body| body.name.clone())
            .chain(run.hand_bodies().into_iter().map(|link| link.name))
            .collect();
        let contacts = run.contacts();
        assert_eq!(contacts.len(), truth.contacts.a.len());
        assert!(contacts.len() > 10, "the balls lie in a box, and the hand on one");
        for (k, contact) in contacts.iter().enumerate() {
            assert_eq!((&names[contact.a], &names[contact.b]), (&truth.contacts.a[k], &truth.contacts.b[k]));
            assert_eq!(contact.force, truth.contacts.force.0[k]);
            assert!(contact.friction_use >= 0.0 && contact.friction_use < 1.001, "{contact:?}");
        }
    }

    #[test]
    fn the_poses_are_those_of_the_run() {
        let run = run();
        let (model, state) = (run.world().model(), run.world().state());
        let objects: Vec<Pose> = (0..state.objects.len()).map(|k| state.object_pose(model, k)).collect();
        let poses = run.telemetry_model().poses(state.base, &state.q, &objects);
        assert_eq!(poses, run.poses().collect::<Vec<_>>());
    }

    #[test]
    fn half_of_the_friction_is_a_half() {
        let run = run();
        let (colliders, touching) = (run.world().model().colliders(), run.world().contact_forces());
        let contact = touching[0];
        let friction =
            pair_friction(&colliders[contact.colliders.0 as usize], &colliders[contact.colliders.1 as usize]);
        let across = contact.normal.any_orthonormal_vector() * 0.5 * friction * 8.0;
        let pressed = ContactForce { force: contact.normal * 8.0 + across, ..contact };
        let sample = RunSample { contacts: vec![pressed], ..run.sample() };
        let used = run.telemetry_model().contacts(&sample)[0].friction_use;
        assert!((used - 0.5).abs() < 1e-12, "{used}");
        let free = ContactForce { force: contact.normal * 0.0, ..contact };
        assert_eq!(friction_use(&free, friction), 0.0);
    }

    #[test]
    fn a_finger_bears_what_presses_on_its_links() {
        let run = run();
        let thumb = run.hand().fingers().into_iter().find(|finger| finger.name.starts_with("thumb"));
        let thumb = thumb.expect("a thumb");
        let force = Vec3::new(1.0, 2.0, 3.0);
        let touching = run.world().contact_forces()[0];
        let (on, by) = (Owner::Link(thumb.links[1]), Owner::Object(0));
        let at = run.world().state().base.translation + Vec3::new(0.0, 0.0, 0.1);
        let press = |a, b, force| ContactForce {
            a,
            b,
            force,
            position: at,
            friction_at: at,
            torque: Vec3::ZERO,
            ..touching
        };
        // The force is that on the second of two.
        let sample =
            RunSample { contacts: vec![press(by, on, force), press(on, by, -force)], ..run.sample() };
        let fingers = run.telemetry_model().telemetry(&sample).fingers;
        assert_eq!(fingers.len(), 5);
        for finger in fingers {
            let expected = if finger.name == thumb.name { [2.0, 4.0, 6.0] } else { [0.0; 3] };
            assert_eq!(finger.force, expected, "{}", finger.name);
            let turned = if finger.name == thumb.name { [-0.4, 0.2, 0.0] } else { [0.0; 3] };
            assert!(Vec3::from_array(finger.torque).abs_diff_eq(Vec3::from_array(turned), 1e-12));
        }
    }

    #[test]
    fn every_object_has_a_verdict_from_the_first_tick_on() {
        for task in Task::builtin() {
            let hand = Hand::builtin("softhand").expect("built in");
            let mut run = Run::new(task, hand, Seed::from_u64(1)).expect("a scene");
            for _ in 0..2 {
                let verdicts = run.explain();
                assert_eq!(verdicts.len(), run.scene().bodies.iter().filter(|body| body.free).count());
                // A block with a hole is an object of no goal.
                let explained =
                    |verdict: &ObjectStatus| !verdict.reasons.is_empty() || verdict.place == "none";
                assert!(verdicts.iter().all(|verdict| !verdict.counts && explained(verdict)), "{verdicts:?}");
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
        let holds = |status: &ObjectStatus| status.reasons.iter().map(|rule| rule.holds).collect::<Vec<_>>();
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
