//! Rules of a task: conditions and points. Each kind has one file with its fields and its referee.

mod arrange;
mod collect;
mod goal;
mod goal_info;
mod hold;
mod kind;
mod limits;

pub use arrange::Arrange;
pub use collect::Collect;
pub use goal::Goal;
pub use goal_info::{GoalInfo, Within};
pub use hold::{Hold, HoldPoints};
pub use kind::{Aim, Destination, RuleKind};
pub(crate) use limits::REST_SPEED;

use crate::referee::{Referee, RunStart, Stateful};
use arrange::ArrangeReferee;
use collect::CollectReferee;
use hold::HoldReferee;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::ops::{Deref, DerefMut};

/// Makes the enums of rules, of referees and of their states from the table of kinds.
macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:literal => $Rules:ident, $Referee:ident;)*) => {
        /// The rules of a task, by `kind`.
        #[derive(Clone, Debug, Deserialize)]
        #[serde(tag = "kind")]
        pub enum Rules {
            $($(#[$doc])* #[serde(rename = $kind)] $Rules($Rules),)*
        }

        #[derive(Clone, Debug)]
        enum EachReferee {
            $($Rules($Referee),)*
        }

        #[derive(Clone, Serialize, Deserialize)]
        enum EachState {
            $($Rules(<$Referee as Stateful>::State),)*
        }

        impl Deref for Rules {
            type Target = dyn RuleKind;

            fn deref(&self) -> &Self::Target {
                match self { $(Rules::$Rules(rules) => rules,)* }
            }
        }

        impl Deref for AnyReferee {
            type Target = dyn Referee;

            fn deref(&self) -> &Self::Target {
                match &self.0 { $(EachReferee::$Rules(referee) => referee,)* }
            }
        }

        impl DerefMut for AnyReferee {
            fn deref_mut(&mut self) -> &mut Self::Target {
                match &mut self.0 { $(EachReferee::$Rules(referee) => referee,)* }
            }
        }

        impl AnyReferee {
            /// The referee of these rules.
            pub(super) fn new(rules: &Rules, start: &RunStart<'_>) -> Self {
                AnyReferee(match rules {
                    $(Rules::$Rules(rules) => EachReferee::$Rules($Referee::new(rules, start)),)*
                })
            }

            /// The present state.
            pub fn state(&self) -> RefereeState {
                RefereeState(match &self.0 {
                    $(EachReferee::$Rules(referee) => EachState::$Rules(referee.state().clone()),)*
                })
            }

            /// Whether a state fits this referee: the same kind of rules, with the same numbers of objects and goals.
            pub fn fits(&self, state: &RefereeState) -> bool {
                match (&self.0, &state.0) {
                    $((EachReferee::$Rules(referee), EachState::$Rules(state)) => referee.fits(state),)*
                    _ => false,
                }
            }

            /// Continues from a state; one of another kind of rules changes nothing.
            pub fn restore(&mut self, state: &RefereeState) {
                match (&mut self.0, &state.0) {
                    $((EachReferee::$Rules(referee), EachState::$Rules(state)) => {
                        referee.state_mut().clone_from(state);
                    })*
                    _ => {}
                }
            }
        }

        /// The error of a file whose rules are read as `kind`.
        fn error_of(kind: &str, text: &str) -> Option<toml::de::Error> {
            match kind {
                $($kind => error::<$Rules>(text),)*
                _ => None,
            }
        }
    };
}

// A new kind is one line here, and one file with the two types that the line names.
kinds! {
    /// Objects must move from one region to another.
    "collect" => Collect, CollectReferee;
    /// One object must be lifted, held and kept during a shake.
    "hold" => Hold, HoldReferee;
    /// Objects must reach goals in a given order.
    "arrange" => Arrange, ArrangeReferee;
}

/// The referee of a run.
#[derive(Clone, Debug)]
pub struct AnyReferee(EachReferee);

/// The state of a referee.
#[derive(Clone, Serialize, Deserialize)]
pub struct RefereeState(EachState);

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
    struct KindAndSpan {
        kind: toml::Spanned<String>,
    }
    let kind = toml::from_str::<File<KindAndSpan>>(text).ok()?.rules.kind;
    let line = text[..kind.span().start].rfind('\n').map_or(0, |end| end + 1)..kind.span().end;
    if !text[line.clone()].trim_start().starts_with("kind") {
        return None;
    }
    let blank = " ".repeat(line.len());
    error_of(kind.get_ref(), &[&text[..line.start], &blank, &text[line.end..]].concat())
}
