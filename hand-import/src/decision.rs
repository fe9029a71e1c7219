//! The decisions of an import: what was taken, guessed and dropped, and what is wrong.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;

/// Kind of a decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DecisionKind {
    /// The source states it, in other words or units.
    Taken,
    /// The source does not state it; the hand needs it.
    Guessed,
    /// The source states it; a hand has no place for it.
    Dropped,
    /// The hand is not right without a repair by its author.
    Problem,
}

impl DecisionKind {
    /// Its word in comments.
    pub fn word(self) -> &'static str {
        match self {
            DecisionKind::Taken => "taken",
            DecisionKind::Guessed => "guessed",
            DecisionKind::Dropped => "dropped",
            DecisionKind::Problem => "problem",
        }
    }
}

/// Element of the written files at which a decision is a comment.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum At {
    /// The hand: the first lines of `hand.toml`.
    Hand,
    /// A link, in `hand.urdf`.
    Link(String),
    /// A joint, in `hand.urdf`.
    Joint(String),
    /// A tendon: its transmission in `hand.urdf`.
    Tendon(String),
    /// A motor, in `hand.toml`.
    Motor(String),
}

/// A decision about one element of the source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Decision {
    /// The file.
    pub file: PathBuf,
    /// The element: `joint 'thumb_abd'`.
    pub element: String,
    /// Taken, guessed, dropped or a problem.
    pub kind: DecisionKind,
    /// One sentence.
    pub text: String,
    /// Place of its comment.
    #[serde(skip)]
    pub at: At,
}

impl fmt::Display for Decision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}: {}: {}", self.file.display(), self.element, self.kind.word(), self.text)
    }
}

/// Collects decisions.
#[derive(Clone, Debug, Default)]
pub struct Log {
    /// The file that is being read, as in messages.
    pub file: PathBuf,
    /// In the order in which they were made.
    pub decisions: Vec<Decision>,
}

impl Log {
    /// A log of one file.
    pub fn new(file: &Path) -> Log {
        Log { file: file.to_owned(), decisions: Vec::new() }
    }

    /// The source states it.
    pub fn taken(&mut self, at: At, element: impl Into<String>, text: impl Into<String>) {
        self.add(DecisionKind::Taken, at, element.into(), text.into());
    }

    /// The source does not state it.
    pub fn guessed(&mut self, at: At, element: impl Into<String>, text: impl Into<String>) {
        self.add(DecisionKind::Guessed, at, element.into(), text.into());
    }

    /// A hand has no place for it.
    pub fn dropped(&mut self, at: At, element: impl Into<String>, text: impl Into<String>) {
        self.add(DecisionKind::Dropped, at, element.into(), text.into());
    }

    /// It needs a repair.
    pub fn problem(&mut self, at: At, element: impl Into<String>, text: impl Into<String>) {
        self.add(DecisionKind::Problem, at, element.into(), text.into());
    }

    /// A decision before all others: it matters most.
    pub fn first(&mut self, kind: DecisionKind, at: At, element: impl Into<String>, text: impl Into<String>) {
        let decision =
            Decision { file: self.file.clone(), element: element.into(), kind, text: text.into(), at };
        self.decisions.insert(0, decision);
    }

    fn add(&mut self, kind: DecisionKind, at: At, element: String, text: String) {
        // The texts differ most, so they are compared first: a hostile file has many decisions.
        let again = |other: &Decision| {
            other.text == text && other.element == element && other.kind == kind && other.at == at
        };
        if !self.decisions.iter().any(|other| again(other) && other.file == self.file) {
            self.decisions.push(Decision { file: self.file.clone(), element, kind, text, at });
        }
    }

    /// The decisions of this kind.
    pub fn of(&self, kind: DecisionKind) -> impl Iterator<Item = &Decision> {
        self.decisions.iter().filter(move |decision| decision.kind == kind)
    }
}
