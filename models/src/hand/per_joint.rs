//! A number of `hand.toml` for all joints of a tendon, or one for each.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::number::{Field, Number, Visit};

/// A number for all joints, or one for each joint by its name; 0 for those without.
#[derive(Clone, Debug)]
pub(crate) enum PerJoint {
    All(f64),
    Each(BTreeMap<String, f64>),
}

impl PerJoint {
    /// The number at a joint.
    pub(crate) fn at(&self, joint: &str) -> f64 {
        match self {
            PerJoint::All(x) => *x,
            PerJoint::Each(each) => each.get(joint).copied().unwrap_or(0.0),
        }
    }

    /// The joints that it names.
    pub(crate) fn joints(&self) -> impl Iterator<Item = &String> {
        match self {
            PerJoint::All(_) => None,
            PerJoint::Each(each) => Some(each.keys()),
        }
        .into_iter()
        .flatten()
    }
}

impl Field for PerJoint {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        match self {
            PerJoint::All(x) => x.visit(number, name, each),
            PerJoint::Each(all) => all.visit(number, name, each),
        }
    }
}

impl<'de> Deserialize<'de> for PerJoint {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = PerJoint;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number for all joints, or a table { joint = number, … }")
            }

            fn visit_f64<E: Error>(self, x: f64) -> Result<PerJoint, E> {
                Ok(PerJoint::All(x))
            }

            fn visit_i64<E: Error>(self, x: i64) -> Result<PerJoint, E> {
                Ok(PerJoint::All(x as f64))
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<PerJoint, A::Error> {
                let mut each = BTreeMap::new();
                while let Some((joint, x)) = map.next_entry()? {
                    each.insert(joint, x);
                }
                Ok(PerJoint::Each(each))
            }
        }
        from.deserialize_any(Either)
    }
}
