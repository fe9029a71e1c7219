//! All sensors of a run.

use crate::channels::{Slots, States};
use crate::moment::Moment;
use crate::noise::Noise;
use crate::table::{SensorReadings, SensorTable};
use palmares_models::hand::Hand;
use palmares_sim::World;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The sensors of a run, ideal or with the errors of real ones.
#[derive(Clone)]
pub struct Sensors {
    hand: Arc<Hand>,
    table: Arc<SensorTable>,
    slots: Slots,
    /// Readings of the last tick. The numbers of sensors that are their law alone are not set.
    row: Vec<f64>,
}

/// State of the sensors that changes from tick to tick. Sensors of the same run that restore it continue with the same readings.
#[derive(Clone, Serialize, Deserialize)]
pub struct SensorState {
    row: Vec<f64>,
    states: States,
}

impl Sensors {
    /// The sensors of a run whose world is at tick 0; with errors if `noise` is given.
    pub fn new(hand: Arc<Hand>, world: &World, tick_s: f64, noise: Option<&Noise>) -> Self {
        let table = Arc::new(SensorTable::new(&hand));
        let slots = Slots::new(&hand, noise, tick_s);
        let row = vec![0.0; table.dimension()];
        let mut sensors = Sensors { hand, table, slots, row };
        sensors.tick(world, 0);
        sensors
    }

    /// A tick has passed. `tick` of them have passed since the run began.
    pub fn tick(&mut self, world: &World, tick: u64) {
        if self.slots.are_ticked() {
            self.slots.tick(&Moment::of(&self.hand, world), tick, &mut self.row);
        }
    }

    /// Address of each channel in a row.
    pub fn table(&self) -> &Arc<SensorTable> {
        &self.table
    }

    /// The present readings.
    pub fn read(&self, world: &World) -> SensorReadings {
        let mut row = vec![0.0; self.row.len()];
        self.read_into(world, &mut row);
        SensorReadings::new(Arc::clone(&self.table), row)
    }

    /// Writes the present readings to a row of [`SensorTable::dimension`] numbers.
    pub fn read_into(&self, world: &World, row: &mut [f64]) {
        self.slots.read(&Moment::of(&self.hand, world), &self.row, row);
    }

    /// The present readings without errors of the channels that telemetry has in `readings`: see [`crate::ChannelInfo::in_readings`].
    pub fn ideal(&self, world: &World) -> Vec<f64> {
        self.slots.ideal(&Moment::of(&self.hand, world))
    }

    /// Their changing state.
    pub fn state(&self) -> SensorState {
        SensorState { row: self.row.clone(), states: self.slots.states() }
    }

    /// Whether a state can be that of these sensors: with the same channels, and errors where these have errors.
    pub fn fits(&self, state: &SensorState) -> bool {
        state.row.len() == self.row.len() && self.slots.fit(&state.states)
    }

    /// Continues from a state.
    pub fn restore(&mut self, state: &SensorState) {
        self.row.clone_from(&state.row);
        self.slots.restore(&state.states);
    }
}
