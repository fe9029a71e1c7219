//! The row of numbers that the sensors of a hand give, and which of them are whose.

use crate::channels::CHANNELS;
use crate::declaration::{Channel, Rows};
use palmares_models::hand::Hand;
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// The channels of a hand, each with its place in the row.
#[derive(Debug, Default, PartialEq)]
pub struct SensorTable {
    entries: Vec<Entry>,
    dimension: usize,
}

/// A channel of a hand.
#[derive(Debug)]
pub struct Entry {
    /// Its declaration.
    pub channel: &'static Channel,
    /// Place of its first number in the row.
    pub address: usize,
    /// Number of its values.
    pub dimension: usize,
    /// Names of its rows, if its records have them.
    pub row_names: Vec<String>,
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        let place = |entry: &Entry| (entry.channel.name, entry.address, entry.dimension);
        place(self) == place(other) && self.row_names == other.row_names
    }
}

impl SensorTable {
    /// The channels of a hand, in the order of [`CHANNELS`].
    pub fn new(hand: &Hand) -> Self {
        let mut table = SensorTable::default();
        for channel in CHANNELS {
            let dimension = channel.len(hand);
            // A list of records is written even if it is empty.
            if dimension == 0 && !channel.is_list_of_records() {
                continue;
            }
            let named = channel.record.as_ref().is_some_and(|record| record.row_name.is_some());
            let row_names = match &channel.rows {
                Rows::Each(index) if named => (index.names)(hand),
                _ => Vec::new(),
            };
            table.entries.push(Entry { channel, address: table.dimension, dimension, row_names });
            table.dimension += dimension;
        }
        table
    }

    /// Numbers of a row.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Every channel.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }
}

impl Entry {
    /// Its numbers out of a row.
    pub fn of<'a>(&self, row: &'a [f64]) -> &'a [f64] {
        &row[self.address..self.address + self.dimension]
    }
}

/// Readings of the sensors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorReadings {
    table: Arc<SensorTable>,
    row: Vec<f64>,
}

impl SensorReadings {
    pub(crate) fn new(table: Arc<SensorTable>, row: Vec<f64>) -> Self {
        SensorReadings { table, row }
    }

    /// Every channel with its numbers, row by row.
    pub fn iter(&self) -> impl Iterator<Item = (&Entry, &[f64])> {
        self.table.entries.iter().map(|entry| (entry, entry.of(&self.row)))
    }

    /// The numbers of a channel, row by row; none when the hand does not have it.
    ///
    /// # Panics
    /// No channel is declared under this name.
    pub fn of(&self, name: &str) -> &[f64] {
        assert!(CHANNELS.iter().any(|channel| channel.name == name), "no channel `{name}`");
        let found = self.iter().find(|(entry, _)| entry.channel.name == name);
        found.map_or(&[], |(_, numbers)| numbers)
    }

    /// The numbers of a column of a channel, row after row.
    ///
    /// # Panics
    /// No channel or column is declared under this name.
    pub fn column(&self, name: &str, column: &str) -> Vec<f64> {
        let numbers = self.of(name);
        let Some(channel) = CHANNELS.iter().find(|channel| channel.name == name) else { return Vec::new() };
        let place = channel.places().find(|(known, _)| known.name == column);
        let (_, place) = place.unwrap_or_else(|| panic!("channel `{name}` has no column `{column}`"));
        numbers.chunks_exact(channel.width()).flat_map(|row| row[place.clone()].iter().copied()).collect()
    }
}

/// A channel of a hand, as clients and viewers learn it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ChannelInfo {
    /// Name of its array in environments and batches.
    pub name: &'static str,
    /// Its key in `obs.hand`.
    pub key: &'static str,
    /// Shape of the array.
    pub shape: Vec<usize>,
    /// Columns along the array's last axis. Where a column has a name, `obs.hand` has an object with these names, or a list
    /// of such objects, one for each row.
    pub columns: Vec<ColumnInfo>,
    /// Present and true if the channel is only in observations with sensing `truth`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub truth: bool,
    /// For people.
    pub description: &'static str,
}

/// Numbers of a channel that have a unit and a range in common.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ColumnInfo {
    /// Absent where the channel's numbers have no names.
    #[serde(skip_serializing_if = "str::is_empty")]
    #[schemars(extend("default" = ""))]
    pub name: &'static str,
    /// Number of values.
    pub width: usize,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Least value; null for none.
    pub minimum: Option<f64>,
    /// Largest value; null for none.
    pub maximum: Option<f64>,
}

impl ChannelInfo {
    /// A channel of a hand that has it.
    pub fn of(channel: &Channel, hand: &Hand) -> Self {
        let columns = channel.columns.iter().map(|column| {
            let (minimum, maximum) = column.limits(hand);
            ColumnInfo { name: column.name, width: column.width, unit: column.unit, minimum, maximum }
        });
        ChannelInfo {
            name: channel.name,
            key: channel.key,
            shape: channel.shape(hand),
            columns: columns.collect(),
            truth: channel.truth,
            description: channel.doc,
        }
    }

    /// All channels of a hand.
    pub fn all(hand: &Hand) -> Vec<Self> {
        let there = CHANNELS.iter().filter(|channel| channel.len(hand) > 0);
        there.map(|channel| ChannelInfo::of(channel, hand)).collect()
    }

    /// The channels of a hand in the row `readings` of telemetry, in its order.
    pub fn in_readings(hand: &Hand) -> Vec<Self> {
        let there = CHANNELS.iter().filter(|channel| channel.telemetry.is_none() && channel.len(hand) > 0);
        there.map(|channel| ChannelInfo::of(channel, hand)).collect()
    }
}
