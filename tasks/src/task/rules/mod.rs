//! Rules of a task: conditions and points.

mod arrange;
mod collect;
mod goal_info;
mod hold;
mod kind;
mod limits;

pub use arrange::{Arrange, Goal};
pub use collect::Collect;
pub use goal_info::{GoalInfo, Within};
pub(crate) use hold::LOST_FROM;
pub use hold::{Hold, HoldPoints, Shake};
pub(crate) use kind::{Aim, Target};
pub(crate) use limits::REST_SPEED;

use super::objects::Objects;
use kind::RuleKind;
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// The rules of a task, by `kind`.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Rules {
    /// Objects must move from one region to another.
    Collect(Collect),
    /// One object must be lifted, held and kept during a shake.
    Hold(Hold),
    /// Objects must reach goals in a given order.
    Arrange(Arrange),
}

impl Rules {
    fn kind(&self) -> &dyn RuleKind {
        match self {
            Rules::Collect(rules) => rules,
            Rules::Hold(rules) => rules,
            Rules::Arrange(rules) => rules,
        }
    }

    /// The error of a file whose rules are read as `kind`.
    fn error_of(kind: &str, text: &str) -> Option<toml::de::Error> {
        match kind {
            "collect" => error::<Collect>(text),
            "hold" => error::<Hold>(text),
            "arrange" => error::<Arrange>(text),
            _ => None,
        }
    }

    /// Maximum settling time after a run, s.
    pub fn settle_s(&self) -> f64 {
        self.kind().settle_s()
    }

    /// Role of a region: `start` or `goal`.
    pub fn role(&self, region: &str) -> Option<&'static str> {
        self.kind().role(region)
    }

    /// The goals with their points and tolerances, in the order in which they are reached.
    pub fn goals(&self) -> Vec<GoalInfo> {
        self.kind().goals()
    }

    /// The rules in words, one line or more.
    pub fn describe(&self) -> Vec<String> {
        self.kind().describe()
    }

    /// Whether an object has a destination; `objects` of the task.
    pub(crate) fn has_destination(&self, objects: &Objects) -> bool {
        self.aims(objects).iter().any(|aim| aim.target.is_some())
    }

    /// Aims of the objects, from which shaped rewards are computed.
    pub(crate) fn aims(&self, objects: &Objects) -> Vec<Aim<'_>> {
        self.kind().aims(objects.count, &objects.certain().unwrap_or_default())
    }

    /// Whether the aims are reached in their order, and each concerns an object by its name.
    pub(crate) fn in_order(&self) -> bool {
        self.kind().in_order()
    }

    /// Regions that the rules name, each with its field.
    pub(crate) fn regions(&self) -> Vec<(&'static str, &str)> {
        self.kind().regions()
    }

    /// Checks the numbers.
    pub(crate) fn check(&self) -> Result<(), String> {
        self.kind().check()
    }

    /// Checks the rules against the objects of the task.
    pub(crate) fn check_objects(&self, objects: &Objects) -> Result<(), String> {
        self.kind().check_objects(objects)
    }
}

#[derive(Deserialize)]
struct File<R> {
    rules: R,
}

fn error<R: DeserializeOwned>(text: &str) -> Option<toml::de::Error> {
    toml::from_str::<File<R>>(text).err()
}

/// Locates an error in the rules of a file. Serde reads a tagged enum through a buffer, which loses the line. So the rules are
/// parsed again as rules of their `kind`, with the line of the kind left blank.
pub(super) fn place_of_error(text: &str) -> Option<toml::de::Error> {
    #[derive(Deserialize)]
    struct Kind {
        kind: toml::Spanned<String>,
    }
    let kind = toml::from_str::<File<Kind>>(text).ok()?.rules.kind;
    let line = text[..kind.span().start].rfind('\n').map_or(0, |end| end + 1)..kind.span().end;
    if !text[line.clone()].trim_start().starts_with("kind") {
        return None;
    }
    let blank = " ".repeat(line.len());
    Rules::error_of(kind.get_ref(), &[&text[..line.start], &blank, &text[line.end..]].concat())
}
