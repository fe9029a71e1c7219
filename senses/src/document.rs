//! The tables of channels in docs/senses.md.

use crate::channels::CHANNELS;
use crate::channels::cameras::IMAGES;
use crate::declaration::{Channel, Column, Rows};
use std::fmt::Write;

/// Every channel: its path in an observation, its array, units, and which hands have it.
pub fn document() -> String {
    let mut text =
        "| field of `obs.hand` | array | shape | units | reading | hands |\n|---|---|---|---|---|---|\n"
            .to_owned();
    for channel in CHANNELS {
        let Channel { name, key, doc, hands, .. } = channel;
        let entries = if channel.is_list_of_records() { "[]" } else { "" };
        let columns: Vec<String> = channel.columns.iter().map(column).collect();
        let units = columns.join(", ");
        // A string takes every write.
        let _ = writeln!(
            text,
            "| `{key}{entries}` | `{name}` | {} | {units} | {doc} | {hands} |",
            shape(channel)
        );
    }
    text
}

/// Every kind of image of a camera.
pub fn image_document() -> String {
    let mut text = "| image | on the wire | content | with `sensors` |\n|---|---|---|---|\n".to_owned();
    for image in IMAGES {
        let numbers = if image.width > 1 { format!("{} × ", image.width) } else { String::new() };
        let sensors = if image.truth { "no" } else { "yes" };
        let _ = writeln!(
            text,
            "| `{}` | {numbers}{} bits a pixel | {} | {sensors} |",
            image.name,
            8 * image.bytes,
            image.doc
        );
    }
    text
}

fn shape(channel: &Channel) -> String {
    match (&channel.rows, channel.width()) {
        (Rows::One | Rows::If(_), width) => format!("({width},)"),
        (Rows::Each(index), 1) => format!("({},)", index.name),
        (Rows::Each(index), width) => format!("({}, {width})", index.name),
    }
}

fn column(column: &Column) -> String {
    let unit = match column.unit {
        "" => "–",
        "tendon" => "the tendon's unit",
        unit => unit,
    };
    if column.name.is_empty() { unit.to_owned() } else { format!("`{}` {unit}", column.name) }
}
