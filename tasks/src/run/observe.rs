//! Observations of a run.

use super::{Reason, Run};
use crate::hand_observation::HandObservation;
use crate::observation::{BodyState, Contacts, Joints, Objects, Observation, Truth};
use crate::sensing::Sensing;
use crate::table::{Numbers, Table};
use palmares_senses::{SensorReadings, SensorTable};

impl Run {
    /// The observation after the last [`Run::step`], with its `events`. [`Run::expose`] takes images.
    pub fn observe(&self, sensing: Sensing) -> Observation {
        let over = self.over();
        Observation {
            tick: self.tick,
            sim_time_s: self.sim_time_s(),
            applied_action: self.applied.clone(),
            hand: HandObservation::new(self.read_sensors(), sensing),
            arm: self.arm_reading(),
            cameras: Vec::new(),
            truth: (sensing == Sensing::Truth).then(|| self.observe_truth()),
            events: self.news.iter().map(|event| event.redacted_for(sensing)).collect(),
            score: self.score(),
            terminated: over == Some(Reason::Complete),
            truncated: over == Some(Reason::TimeLimit),
            reason: over.map(|reason| reason.as_str().to_owned()),
        }
    }

    /// The present readings of the sensors of the hand and its arm.
    pub fn read_sensors(&self) -> SensorReadings {
        self.sensors.read(&self.world)
    }

    /// Writes them to a row of [`SensorTable::dimension`] numbers.
    pub fn read_sensors_into(&self, row: &mut [f64]) {
        self.sensors.read_into(&self.world, row);
    }

    /// The channels of a row of numbers.
    pub fn sensor_table(&self) -> &SensorTable {
        self.sensors.table()
    }

    fn observe_truth(&self) -> Truth {
        let state = self.world.state();
        let n = self.hand.coordinates.len();
        Truth {
            objects: self.objects(),
            joints: Joints {
                position: Numbers(state.q.clone()),
                velocity: Numbers(state.v[6..6 + n].to_vec()),
            },
            contacts: self.observe_contacts(),
            predicted_equilibrium: Numbers(self.telemetry_model.predict(&state.motors, &state.locked)),
        }
    }

    /// Pose and velocity of every free object.
    pub fn object_states(&self) -> impl Iterator<Item = BodyState> {
        let (model, state) = (self.world.model(), self.world.state());
        (0..state.objects.len()).map(move |k| {
            let pose = state.object_pose(model, k);
            let (linear, angular) = state.object_velocity(model, k);
            let from_com = pose.translation - state.objects[k].translation;
            BodyState {
                position: pose.translation.to_array(),
                quat_xyzw: pose.rotation.to_array(),
                linear: (linear + angular.cross(from_com)).to_array(),
                angular: angular.to_array(),
            }
        })
    }

    /// [`Run::object_states`] as tables of numbers.
    pub fn objects(&self) -> Objects {
        let count = self.world.state().objects.len();
        let mut objects = Objects {
            position: Table(Vec::with_capacity(count)),
            quat_xyzw: Table(Vec::with_capacity(count)),
            linear: Table(Vec::with_capacity(count)),
            angular: Table(Vec::with_capacity(count)),
        };
        for BodyState { position, quat_xyzw, linear, angular } in self.object_states() {
            objects.position.0.push(position);
            objects.quat_xyzw.0.push(quat_xyzw);
            objects.linear.0.push(linear);
            objects.angular.0.push(angular);
        }
        objects
    }

    fn observe_contacts(&self) -> Contacts {
        let forces = self.world.contact_forces();
        let name = |collider: u32| self.body_names[collider as usize].clone();
        Contacts {
            a: forces.iter().map(|contact| name(contact.colliders.0)).collect(),
            b: forces.iter().map(|contact| name(contact.colliders.1)).collect(),
            position: Table(forces.iter().map(|contact| contact.position.to_array()).collect()),
            force: Table(forces.iter().map(|contact| contact.force.to_array()).collect()),
        }
    }
}
