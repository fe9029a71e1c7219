//! Declaration of the numbers of a hand.
//!
//! A number is one row in the file of its part, beside its law. [`numbers!`] makes of the row the field in the hand, in `hand.toml`, in an
//! importer's draft and in the description. Loops over the rows do the rest: the checks, the content hash, `hand show`
//! and a written `hand.toml`.

use std::collections::BTreeMap;

/// A number of a part of a hand, or a switch.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// Its field in `hand.toml`.
    pub name: &'static str,
    /// Its unit, as docs/hands.md has it; empty for a switch. Lengths in m and masses in kg have limits of their own.
    pub unit: &'static str,
    /// Its range.
    pub bounds: Bounds,
    /// Its value in a hand that does not state it.
    pub unstated: Unstated,
    /// Its part in the content hash.
    pub hashed: Hashed,
    /// Its line in `hand show`, with `{}` for the number; empty where its part has a line for it.
    pub shown: &'static str,
}

/// Range of a number. All are finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounds {
    /// Each number.
    Any,
    /// Above 0.
    Positive,
    /// From 0.
    NotNegative,
    /// Each number but 0.
    NotZero,
    /// From 0 to 1.
    Part,
}

/// Value of a number that is not stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unstated {
    /// The hand is refused.
    Refused,
    /// This one.
    Is(f64),
    /// None: the part has no such number.
    Absent,
}

/// Part of a number in the content hash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hashed {
    /// All its bits.
    Always,
    /// This word and its bits, unless it is absent or 0.
    After(&'static str),
    /// As `content.rs` says.
    ByPart,
}

/// A stated number or switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    /// A number.
    Number(f64),
    /// A switch.
    Switch(bool),
}

impl Number {
    /// A number that each hand states.
    pub const REQUIRED: Number = Number {
        name: "",
        unit: "",
        bounds: Bounds::Any,
        unstated: Unstated::Refused,
        hashed: Hashed::Always,
        shown: "",
    };
    /// A number that is 0 if it is not stated.
    pub const ZERO: Number = Number { unstated: Unstated::Is(0.0), ..Number::REQUIRED };
    /// A number that not each hand has. A new number is one of these: hands without it keep their hash.
    pub const fn optional(word: &'static str) -> Number {
        Number { unstated: Unstated::Absent, hashed: Hashed::After(word), ..Number::REQUIRED }
    }

    /// Fields that are no number of the hand itself: they say how it is read.
    pub const OF_TABLE: Number =
        Number { unstated: Unstated::Absent, hashed: Hashed::ByPart, ..Number::REQUIRED };
    /// A switch that is off if it is not stated.
    pub const SWITCH: Number =
        Number { unstated: Unstated::Is(0.0), hashed: Hashed::ByPart, ..Number::REQUIRED };

    /// The problem with a value, if there is one.
    fn problem(&self, value: f64) -> Option<String> {
        let valid = match self.bounds {
            Bounds::Any => "finite".to_owned(),
            bounds => format!("finite, {}", bounds.words().trim_start_matches("of ")),
        };
        let sound = value.is_finite() && self.bounds.allows(value);
        (!sound).then(|| format!("{} {value}; valid: {valid}", self.name.replace('_', " ")))
    }
}

impl Bounds {
    /// Whether a number is in the range.
    pub fn allows(self, value: f64) -> bool {
        match self {
            Bounds::Any => true,
            Bounds::Positive => value > 0.0,
            Bounds::NotNegative => value >= 0.0,
            Bounds::NotZero => value != 0.0,
            Bounds::Part => (0.0..=1.0).contains(&value),
        }
    }

    /// The range after the name of a number: `of more than 0`.
    pub fn words(self) -> &'static str {
        match self {
            Bounds::Any => "",
            Bounds::Positive => "of more than 0",
            Bounds::NotNegative => "of at least 0",
            Bounds::NotZero => "other than 0",
            Bounds::Part => "from 0 to 1",
        }
    }
}

/// Type of a number in a hand.
pub trait Value: Copy + Into<Self::Stated> {
    /// Its type in `hand.toml`.
    type Stated;

    /// Its value as stated, or as it is if it is not stated. A number that had to be stated is then not finite.
    fn of(stated: Self::Stated, number: &Number) -> Self;

    /// The stated value.
    fn entry(stated: Self::Stated) -> Option<Entry>;
}

impl Value for f64 {
    type Stated = Option<f64>;

    fn of(stated: Option<f64>, number: &Number) -> f64 {
        let Unstated::Is(unstated) = number.unstated else { return stated.unwrap_or(f64::NAN) };
        stated.unwrap_or(unstated)
    }

    fn entry(stated: Option<f64>) -> Option<Entry> {
        stated.map(Entry::Number)
    }
}

impl Value for Option<f64> {
    type Stated = Option<f64>;

    fn of(stated: Option<f64>, _: &Number) -> Option<f64> {
        stated
    }

    fn entry(stated: Option<f64>) -> Option<Entry> {
        stated.map(Entry::Number)
    }
}

impl Value for bool {
    type Stated = Option<bool>;

    fn of(stated: Option<bool>, _: &Number) -> bool {
        stated.unwrap_or(false)
    }

    fn entry(stated: Option<bool>) -> Option<Entry> {
        stated.map(Entry::Switch)
    }
}

/// The numbers of a part.
pub trait Numbers {
    /// The numbers that the part has, in their order.
    fn entries(&self) -> Vec<(Number, Entry)>;

    /// The numbers that `hand.toml` must state.
    fn needed(&self) -> Vec<(Number, Entry)> {
        let mut entries = self.entries();
        entries.retain(|(number, entry)| match entry {
            Entry::Number(value) => number.unstated != Unstated::Is(*value),
            Entry::Switch(on) => *on,
        });
        entries
    }

    /// The first problem with a number.
    ///
    /// # Errors
    /// A number that is not finite or out of its range.
    fn check(&self) -> Result<(), String> {
        let problem = |(number, entry): (Number, Entry)| match entry {
            Entry::Number(value) => number.problem(value),
            Entry::Switch(_) => None,
        };
        self.entries().into_iter().find_map(problem).map_or(Ok(()), Err)
    }
}

/// Gets a number, its name in the table and its value, if the table states it.
pub type Visit<'a> = dyn FnMut(&Number, &str, Option<f64>) + 'a;

/// A table of `hand.toml`.
pub trait Table {
    /// Visits each number.
    fn visit(&self, each: &mut Visit<'_>);
}

/// A field of a table.
pub trait Field {
    /// Visits each number in it.
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>);
}

impl Field for f64 {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        each(number, name, Some(*self));
    }
}

macro_rules! without_numbers {
    ($($Type:ty),*) => {
        $(impl Field for $Type {
            fn visit(&self, _: &Number, _: &str, _: &mut Visit<'_>) {}
        })*
    };
}

without_numbers!(bool, usize, String);

impl<T: Field> Field for Option<T> {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        match self {
            Some(value) => value.visit(number, name, each),
            None => each(number, name, None),
        }
    }
}

impl<T: Field> Field for Vec<T> {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        self.iter().for_each(|value| value.visit(number, name, each));
    }
}

impl<T: Field, const N: usize> Field for [T; N] {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        self.iter().for_each(|value| value.visit(number, name, each));
    }
}

impl<T: Field> Field for BTreeMap<String, T> {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        self.iter().for_each(|(key, value)| value.visit(number, &format!("{name}.{key}"), each));
    }
}

/// Whether a description leaves it out.
pub(crate) fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// A table of `hand.toml`, with the row of each field.
macro_rules! table {
    (
        $(#[$about:meta])*
        $vis:vis table $Table:ident;
        $($(#[$of:meta])* $name:ident: $Type:ty = $number:expr,)*
    ) => {
        $(#[$about])*
        #[derive(Clone, Debug, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        $vis struct $Table { $($(#[$of])* $vis $name: $Type,)* }

        impl $crate::hand::number::Table for $Table {
            fn visit(&self, each: &mut $crate::hand::number::Visit<'_>) {
                $(
                    let number = $crate::hand::number::Number { name: stringify!($name), ..$number };
                    $crate::hand::number::Field::visit(&self.$name, &number, stringify!($name), each);
                )*
            }
        }
    };
}

/// The numbers of a part, which reads as if they were its own fields, and their table in `hand.toml`; `settings` is a table with further
/// fields, which say how it is read.
macro_rules! numbers {
    (
        $(#[$about:meta])*
        numbers $Numbers:ident of $Part:ident;
        $(#[$about_table:meta])*
        table $Table:ident;
        $(#[$about_settings:meta])*
        settings $Settings:ident { $($extra:tt)* }
        $($(#[$of:meta])* $name:ident: $Type:ty = $number:expr,)+
    ) => {
        $crate::hand::number::numbers! {
            $(#[$about])*
            numbers $Numbers of $Part;
            $(#[$about_table])*
            table $Table;
            $($(#[$of])* $name: $Type = $number,)+
        }

        $crate::hand::number::table! {
            $(#[$about_settings])*
            pub(crate) table $Settings;
            $($extra)*
            $($(#[$of])* $name: <$Type as $crate::hand::number::Value>::Stated = $number,)+
        }

        impl $Settings {
            /// The numbers; those that are not stated have their defaults.
            pub(crate) fn numbers(&self) -> $Numbers {
                $Table { $($name: self.$name,)+ }.numbers()
            }
        }
    };
    (
        $(#[$about:meta])*
        numbers $Numbers:ident of $Part:ident;
        $(#[$about_table:meta])*
        table $Table:ident;
        $($(#[$of:meta])* $name:ident: $Type:ty = $number:expr,)+
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, schemars::JsonSchema)]
        pub struct $Numbers { $($(#[$of])* pub $name: $Type,)+ }

        $crate::hand::number::table! {
            $(#[$about_table])*
            #[derive(Copy, Default, PartialEq)]
            pub table $Table;
            $($(#[$of])* $name: <$Type as $crate::hand::number::Value>::Stated = $number,)+
        }

        impl $Numbers {
            /// Its rows.
            pub const ROWS: &'static [$crate::hand::number::Number] =
                &[$($crate::hand::number::Number { name: stringify!($name), ..$number }),+];
        }

        impl $Table {
            /// The numbers; those that are not stated have their defaults.
            pub fn numbers(&self) -> $Numbers {
                $Numbers { $($name: $crate::hand::number::Value::of(self.$name, &$number),)+ }
            }

            /// Each number, of the other table where this one does not state it.
            #[must_use]
            pub fn or(&self, other: &Self) -> Self {
                Self { $($name: self.$name.or(other.$name),)+ }
            }
        }

        impl std::ops::Deref for $Part {
            type Target = $Numbers;

            fn deref(&self) -> &$Numbers {
                &self.numbers
            }
        }

        impl std::ops::DerefMut for $Part {
            fn deref_mut(&mut self) -> &mut $Numbers {
                &mut self.numbers
            }
        }

        impl From<$Numbers> for $Table {
            fn from(numbers: $Numbers) -> Self {
                Self { $($name: numbers.$name.into(),)+ }
            }
        }

        impl $crate::hand::number::Numbers for $Table {
            fn entries(&self) -> Vec<($crate::hand::number::Number, $crate::hand::number::Entry)> {
                let values = [$(<$Type as $crate::hand::number::Value>::entry(self.$name)),+];
                $Numbers::ROWS.iter().zip(values).filter_map(|(row, entry)| Some((*row, entry?))).collect()
            }
        }

        impl $crate::hand::number::Numbers for $Numbers {
            fn entries(&self) -> Vec<($crate::hand::number::Number, $crate::hand::number::Entry)> {
                $Table::from(*self).entries()
            }
        }
    };
}

pub(crate) use numbers;
pub(crate) use table;
