//! The readings of a hand's sensors as part of an observation. How they are written and described follows from the
//! declarations of their channels.

use crate::sensing::Sensing;
use crate::table::{BINARY, Written};
use palmares_senses::{CHANNELS, Channel, Column, Entry, Record, Rows, SensorReadings};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::ser::{Serialize, SerializeStruct, Serializer};
use serde_json::{Map, Value, json};
use std::borrow::Cow;

/// Readings of the hand's own sensors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HandObservation {
    readings: SensorReadings,
    sensing: Sensing,
}

impl HandObservation {
    /// The readings that a controller gets with this sensing.
    pub fn new(readings: SensorReadings, sensing: Sensing) -> Self {
        HandObservation { readings, sensing }
    }

    /// The numbers of a channel, row by row; none when the hand does not have it.
    ///
    /// # Panics
    /// No channel is declared under this name.
    pub fn of(&self, channel: &str) -> &[f64] {
        self.readings.of(channel)
    }

    /// The numbers of a column of a channel, row after row.
    ///
    /// # Panics
    /// No channel or column is declared under this name.
    pub fn column(&self, channel: &str, column: &str) -> Vec<f64> {
        self.readings.column(channel, column)
    }
}

impl Serialize for HandObservation {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let shown = |entry: &Entry| !entry.channel.truth || self.sensing == Sensing::Truth;
        let count = self.readings.iter().filter(|(entry, _)| shown(entry)).count();
        let mut fields = serializer.serialize_struct("HandObservation", count)?;
        for (entry, numbers) in self.readings.iter().filter(|(entry, _)| shown(entry)) {
            let Entry { channel, row_names, .. } = entry;
            let width = channel.width();
            match (&channel.record, &channel.rows) {
                (None, Rows::Each(_)) => fields.serialize_field(channel.key, &Written { width, numbers })?,
                (None, _) => fields.serialize_field(channel.key, numbers)?,
                (Some(record), Rows::Each(_)) => {
                    let rows = Records { channel, record, row_names, numbers };
                    fields.serialize_field(channel.key, &rows)?;
                }
                (Some(record), _) => {
                    let row = WrittenRecord { channel, record, name: None, numbers };
                    fields.serialize_field(channel.key, &row)?;
                }
            }
        }
        fields.end()
    }
}

/// The rows of a channel as objects.
struct Records<'a> {
    channel: &'a Channel,
    record: &'a Record,
    row_names: &'a [String],
    numbers: &'a [f64],
}

impl Serialize for Records<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Records { channel, record, row_names, numbers } = *self;
        let rows = numbers.chunks_exact(channel.width()).enumerate();
        serializer.collect_seq(rows.map(|(k, numbers)| {
            let name = row_names.get(k).map(String::as_str);
            WrittenRecord { channel, record, name, numbers }
        }))
    }
}

/// A row as an object.
struct WrittenRecord<'a> {
    channel: &'a Channel,
    record: &'a Record,
    name: Option<&'a str>,
    numbers: &'a [f64],
}

impl Serialize for WrittenRecord<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let WrittenRecord { channel, record, name, numbers } = *self;
        let count = channel.columns.len() + usize::from(name.is_some());
        let mut fields = serializer.serialize_struct(record.name, count)?;
        if let Some(name) = name {
            fields.serialize_field("name", name)?;
        }
        for (column, place) in channel.places() {
            match &numbers[place] {
                [number] => fields.serialize_field(column.name, number)?,
                several => fields.serialize_field(column.name, several)?,
            }
        }
        fields.end()
    }
}

impl JsonSchema for HandObservation {
    fn schema_name() -> Cow<'static, str> {
        "HandObservation".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut properties = Map::new();
        let mut required = Vec::new();
        for channel in CHANNELS {
            let always = match &channel.rows {
                Rows::One => true,
                Rows::If(_) => false,
                Rows::Each(_) => channel.record.is_some(),
            } && !channel.truth;
            required.extend(always.then_some(channel.key));
            let note = match (always, channel.truth) {
                (true, _) => "",
                (_, true) => "; with sensing `truth` only",
                (_, false) => "; absent when the hand has none",
            };
            let mut schema = schema(channel, generator);
            schema.insert("description".into(), format!("{}{}{note}.", channel.doc, units(channel)).into());
            properties.insert(channel.key.into(), schema.into());
        }
        json_schema!({
            "description": "What the hand's own sensors read.",
            "type": "object",
            "properties": properties,
            "required": required,
        })
    }
}

/// The units of a channel without a record; a record has them in its columns.
fn units(channel: &Channel) -> String {
    let unit = channel.columns.iter().map(|column| column.unit).find(|unit| !unit.is_empty());
    match (unit, &channel.record) {
        (Some(unit), None) => format!(", {unit}"),
        _ => String::new(),
    }
}

fn schema(channel: &Channel, generator: &mut SchemaGenerator) -> Map<String, Value> {
    let row = match &channel.record {
        None if channel.width() == 1 && matches!(channel.rows, Rows::Each(_)) => number(),
        None => numbers(channel.width()),
        Some(record) => {
            generator.definitions_mut().insert(record.name.into(), definition(channel, record));
            json!({"$ref": format!("#{}/{}", generator.settings().definitions_path, record.name)})
        }
    };
    let whole = match &channel.rows {
        Rows::Each(_) if channel.record.is_none() => {
            json!({"type": "array", "items": row, "x-msgpack": BINARY})
        }
        Rows::Each(_) => json!({"type": "array", "items": row}),
        Rows::One => row,
        // Clients read null where the channel is absent.
        Rows::If(_) => {
            let mut row = row;
            row["type"] = json!(["array", "null"]);
            row
        }
    };
    // Each of them is an object.
    whole.as_object().cloned().unwrap_or_default()
}

fn definition(channel: &Channel, record: &Record) -> Value {
    let property = |column: &Column| {
        let mut schema = if column.width == 1 { number() } else { numbers(column.width) };
        schema["description"] = column.doc.into();
        (column.name.to_owned(), schema)
    };
    let name = record.row_name.map(|doc| ("name".to_owned(), json!({"type": "string", "description": doc})));
    let properties: Vec<(String, Value)> =
        name.into_iter().chain(channel.columns.iter().map(property)).collect();
    let required: Vec<String> = properties.iter().map(|(name, _)| name.clone()).collect();
    json!({
        "description": record.doc,
        "type": "object",
        "properties": Map::from_iter(properties),
        "required": required,
    })
}

fn number() -> Value {
    json!({"type": "number", "format": "double"})
}

fn numbers(count: usize) -> Value {
    json!({"type": "array", "items": number(), "minItems": count, "maxItems": count})
}
