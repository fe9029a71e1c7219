//! Form of the declaration of a channel.

use palmares_models::hand::{Hand, TactilePatch};
use std::ops;

/// A channel: numbers that a hand or its arm measures at every tick.
#[derive(Debug)]
pub struct Channel {
    /// Name of its array.
    pub name: &'static str,
    /// Its key in `obs.hand`. A new channel has its name here.
    pub key: &'static str,
    /// Number of its rows.
    pub rows: Rows,
    /// The columns of a row.
    pub columns: &'static [Column],
    /// `obs.hand` has an object for each row, with the columns by name. Without, it has the numbers in the array's shape.
    pub record: Option<Record>,
    /// `palmares.Telemetry` has it in these fields, without the errors of sensors. Without, it is part of `readings`.
    pub telemetry: Option<&'static str>,
    /// It belongs to the truth: a controller with `sensing: "sensors"` does not get it.
    pub truth: bool,
    /// One sentence without a full stop.
    pub doc: &'static str,
    /// The hands that have it.
    pub hands: &'static str,
}

/// Number of rows of a channel.
#[derive(Debug)]
pub enum Rows {
    /// One, with every hand.
    One,
    /// One, with a hand of which this is true.
    If(fn(&Hand) -> bool),
    /// One for each entry of an index.
    Each(&'static Index),
}

/// Parts of a hand that are numbered.
#[derive(Debug)]
pub struct Index {
    /// Its name in `welcome.specs` and in `welcome.hands`.
    pub name: &'static str,
    /// Number of these.
    pub count: fn(&Hand) -> usize,
    /// Their names.
    pub names: fn(&Hand) -> Vec<String>,
}

/// The motors.
pub static MOTORS: Index = Index {
    name: "motors",
    count: |hand| hand.motors.len(),
    names: |hand| hand.motors.iter().map(|motor| motor.name.clone()).collect(),
};

/// The joint coordinates.
pub static JOINTS: Index = Index {
    name: "joints",
    count: |hand| hand.coordinates.len(),
    names: |hand| hand.coordinates.iter().map(|coordinate| coordinate.name.clone()).collect(),
};

/// The joint coordinates that have an encoder.
pub static ENCODERS: Index = Index {
    name: "encoders",
    count: |hand| hand.sensors.joints.as_ref().map_or(0, |joints| joints.on.len()),
    names: |hand| hand.sensors.joints.iter().flat_map(|joints| joints.on.clone()).collect(),
};

/// The taxels.
pub static TAXELS: Index = Index {
    name: "taxels",
    count: |hand| hand.tactile.iter().map(TactilePatch::len).sum(),
    names: |hand| hand.tactile.iter().flat_map(TactilePatch::taxel_names).collect(),
};

/// The type of the objects in `obs.hand`.
#[derive(Debug)]
pub struct Record {
    /// Its name in the JSON Schema.
    pub name: &'static str,
    /// One sentence without a full stop.
    pub doc: &'static str,
    /// Description of the field `name`, which has the row's name in its index.
    pub row_name: Option<&'static str>,
}

/// Columns of a row that have a name, a unit and a range in common.
#[derive(Debug)]
pub struct Column {
    /// Empty where the channel has no record.
    pub name: &'static str,
    /// Number of values.
    pub width: usize,
    /// Empty for a pure number; `tendon` for the unit of the tendon's force in hand.toml.
    pub unit: &'static str,
    /// Range of each number.
    pub range: Range,
    /// Its description in the JSON Schema.
    pub doc: &'static str,
}

/// Range of a number.
#[derive(Debug)]
pub enum Range {
    /// Any number.
    Free,
    /// From here to there.
    Within(f64, f64),
    /// At most this far from zero, as the hand declares it.
    Symmetric(fn(&Hand) -> f64),
}

impl Channel {
    /// A channel without a record. A declaration fills in the rest.
    pub const NUMBERS: Channel = Channel {
        name: "",
        key: "",
        rows: Rows::One,
        columns: &[],
        record: None,
        telemetry: None,
        truth: false,
        doc: "",
        hands: "every hand",
    };

    /// Numbers in a row.
    pub fn width(&self) -> usize {
        self.columns.iter().map(|column| column.width).sum()
    }

    /// Rows for a hand.
    pub fn count(&self, hand: &Hand) -> usize {
        match &self.rows {
            Rows::One => 1,
            Rows::If(there) => usize::from(there(hand)),
            Rows::Each(index) => (index.count)(hand),
        }
    }

    /// Numbers for a hand; none when the hand does not have the channel.
    pub fn len(&self, hand: &Hand) -> usize {
        self.count(hand) * self.width()
    }

    /// Shape of the array for a hand.
    pub fn shape(&self, hand: &Hand) -> Vec<usize> {
        match (&self.rows, self.width()) {
            (Rows::One | Rows::If(_), width) => vec![self.count(hand) * width],
            (Rows::Each(index), 1) => vec![(index.count)(hand)],
            (Rows::Each(index), width) => vec![(index.count)(hand), width],
        }
    }

    /// Whether `obs.hand` has a list of objects.
    pub fn is_list_of_records(&self) -> bool {
        self.record.is_some() && matches!(self.rows, Rows::Each(_))
    }

    /// Every column with its place in a row.
    pub fn places(&self) -> impl Iterator<Item = (&'static Column, ops::Range<usize>)> {
        self.columns.iter().scan(0, |end, column| {
            let begin = *end;
            *end += column.width;
            Some((column, begin..*end))
        })
    }
}

impl Column {
    /// Numbers without a name.
    pub const fn numbers(width: usize, unit: &'static str) -> Column {
        Column::named("", width, unit, "")
    }

    /// Numbers of a record.
    pub const fn named(name: &'static str, width: usize, unit: &'static str, doc: &'static str) -> Column {
        Column { name, width, unit, range: Range::Free, doc }
    }

    /// The same with a range.
    #[must_use]
    pub const fn range(self, range: Range) -> Column {
        Column { name: self.name, width: self.width, unit: self.unit, doc: self.doc, range }
    }

    /// Least and largest value for a hand; none where there is no limit.
    pub fn limits(&self, hand: &Hand) -> (Option<f64>, Option<f64>) {
        match &self.range {
            Range::Symmetric(limit) => (Some(-limit(hand)), Some(limit(hand))),
            _ => self.fixed_limits(),
        }
    }

    /// The limits that hold for all hands.
    pub fn fixed_limits(&self) -> (Option<f64>, Option<f64>) {
        match &self.range {
            Range::Within(low, high) => (Some(*low), Some(*high)),
            Range::Free | Range::Symmetric(_) => (None, None),
        }
    }
}
