//! The code of a sensor: its law and its errors.

use crate::declaration::Channel;
use crate::moment::Moment;
use crate::noise::Noise;
use palmares_models::hand::Hand;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::Range;

/// A sensor: the declaration of its channel, how it reads without errors, and how with them.
pub(crate) trait Sensor: Clone + Sized {
    /// The declaration.
    const CHANNEL: Channel;
    /// State that changes from tick to tick. The last reading is stored next to it.
    type State: Clone + Serialize + DeserializeOwned;

    /// The law: writes the reading without errors. `state` is there if [`Sensor::new`] gave one.
    fn law(now: &Moment<'_>, state: Option<&Self::State>, row: &mut [f64]);

    /// The error model of a run at tick 0, if `noise` is given. A sensor that needs more than one tick for a reading has
    /// one without noise as well.
    fn new(hand: &Hand, noise: Option<&Noise>, tick_s: f64) -> Option<(Self, Self::State)>;

    /// Ticks that have passed since the run began: `tick`. Writes the reading over the last one.
    fn tick(&self, now: &Moment<'_>, tick: u64, state: &mut Self::State, row: &mut [f64]);

    /// Whether a state that was read from bytes can be this sensor's.
    fn fits(_own: &Self::State, _read: &Self::State) -> bool {
        true
    }
}

/// A sensor of a run.
#[derive(Clone)]
pub(crate) struct Slot<S: Sensor> {
    /// Its numbers in the row.
    place: Range<usize>,
    /// The error model; without it the law is the reading.
    errors: Option<(S, S::State)>,
}

impl<S: Sensor> Slot<S> {
    /// The sensor whose numbers begin at `begin`.
    pub(crate) fn new(hand: &Hand, noise: Option<&Noise>, tick_s: f64, begin: &mut usize) -> Self {
        let place = *begin..*begin + S::CHANNEL.len(hand);
        *begin = place.end;
        let errors = if place.is_empty() { None } else { S::new(hand, noise, tick_s) };
        Slot { place, errors }
    }

    /// Whether it must be ticked.
    pub(crate) fn is_ticked(&self) -> bool {
        self.errors.is_some()
    }

    /// A tick has passed.
    pub(crate) fn tick(&mut self, now: &Moment<'_>, tick: u64, row: &mut [f64]) {
        if let Some((sensor, state)) = &mut self.errors {
            sensor.tick(now, tick, state, &mut row[self.place.clone()]);
        }
    }

    /// Writes the present reading; `kept` are the readings of the last tick.
    pub(crate) fn read(&self, now: &Moment<'_>, kept: &[f64], row: &mut [f64]) {
        let place = self.place.clone();
        if self.errors.is_some() {
            row[place.clone()].copy_from_slice(&kept[place]);
        } else if !place.is_empty() {
            S::law(now, None, &mut row[place]);
        }
    }

    /// Adds the present reading without errors, unless telemetry has the channel in fields of its own.
    pub(crate) fn add_ideal(&self, now: &Moment<'_>, readings: &mut Vec<f64>) {
        if S::CHANNEL.telemetry.is_none() && !self.place.is_empty() {
            let begin = readings.len();
            readings.resize(begin + self.place.len(), 0.0);
            S::law(now, self.errors.as_ref().map(|(_, state)| state), &mut readings[begin..]);
        }
    }

    /// Its changing state.
    pub(crate) fn state(&self) -> Option<S::State> {
        self.errors.as_ref().map(|(_, state)| state.clone())
    }

    /// Whether a state can be this sensor's.
    pub(crate) fn fits(&self, state: Option<&S::State>) -> bool {
        match (&self.errors, state) {
            (None, None) => true,
            (Some((_, own)), Some(read)) => S::fits(own, read),
            _ => false,
        }
    }

    /// Continues from a state.
    pub(crate) fn restore(&mut self, state: Option<&S::State>) {
        if let (Some((_, own)), Some(state)) = (&mut self.errors, state) {
            own.clone_from(state);
        }
    }
}
