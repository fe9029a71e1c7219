//! Names of teams and hands, and labels: which characters they may have, and which names look alike.
//!
//! The rules are those of RFC 8264 (FreeformClass: letters, marks, numbers, punctuation, symbols, spaces; no invisible characters and
//! none that change the direction of writing), with the spaces of RFC 8266 and current Unicode. Names look alike if their skeletons
//! (UTS 39) are equal. docs/protocol.md, section Names, has the same rules.

use palmares_protocol::text::hidden;
pub use palmares_protocol::text::printable;
use palmares_protocol::{Code, Refusal};
use std::collections::BTreeMap;
use unicode_normalization::UnicodeNormalization;
use unicode_normalization::char::is_combining_mark;
use unicode_properties::{GeneralCategory, UnicodeGeneralCategory};

/// Longest name, characters.
const MAX_CHARS: usize = 64;
/// Most combining marks on one character (UTS 39, section 5.4): more would cover the lines above and below.
const MAX_MARKS: usize = 4;

/// Reason why a name is not valid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// The name is too short or too long.
    #[error("it has {0} characters, expected 1 to {MAX_CHARS}")]
    Length(usize),
    /// A character is not allowed.
    #[error(
        "character {position} is U+{:04X}, {what}; a name consists of letters, marks, numbers, punctuation, symbols \
         and spaces (RFC 8264)", u32::from(*character)
    )]
    Character {
        /// The character.
        character: char,
        /// Its position, from 1.
        position: usize,
        /// The problem.
        what: &'static str,
    },
    /// A combining mark without a character, or too many on one.
    #[error(
        "character {position} is U+{:04X}, a combining mark {why} (UTS 39, section 5.4)", u32::from(*character)
    )]
    Mark {
        /// The character.
        character: char,
        /// Its position in the decomposed form, from 1.
        position: usize,
        /// The problem.
        why: &'static str,
    },
    /// The name has neither letters nor numbers.
    #[error("there is no letter or number in it")]
    NoLetter,
    /// A character that the name of a hand, which is used in addresses and files, may not have.
    #[error("character {position} is U+{:04X}; the name of a hand consists of letters a to z and A to Z, digits, `_`, \
             `-` and `.`, the first no `.`", u32::from(*character))]
    Hand {
        /// The character.
        character: char,
        /// Its position, from 1.
        position: usize,
    },
}

impl NameError {
    /// The refusal, with the name of the field.
    pub fn of(self, field: &str) -> Refusal {
        Refusal::new(Code::BadRequest, format!("{field}: {self}"))
    }
}

/// The name of a team in the form that is stored: composed (NFC), with single spaces between words.
pub fn team(text: &str) -> Result<String, NameError> {
    let name = label(text)?;
    if name.is_empty() {
        return Err(NameError::Length(0));
    }
    if !name.chars().any(char::is_alphanumeric) {
        return Err(NameError::NoLetter);
    }
    Ok(name)
}

/// A label, such as the holder of a token: a name that may be empty.
pub fn label(text: &str) -> Result<String, NameError> {
    let text = text.trim();
    for (i, character) in text.chars().enumerate() {
        if let Some(what) = hidden(character) {
            return Err(NameError::Character { character, position: i + 1, what });
        }
    }
    let words = text.split(|c: char| c.general_category() == GeneralCategory::SpaceSeparator);
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let name: String = words.join(" ").nfc().collect();
    let length = name.chars().count();
    if length > MAX_CHARS {
        return Err(NameError::Length(length));
    }
    marks(&name)?;
    Ok(name)
}

/// Checks the name of an uploaded hand, which is used in messages, files and addresses.
pub fn hand(name: &str) -> Result<(), NameError> {
    let length = name.chars().count();
    if !(1..=MAX_CHARS).contains(&length) {
        return Err(NameError::Length(length));
    }
    let fits = |i: usize, c: char| c.is_ascii_alphanumeric() || "_-".contains(c) || (c == '.' && i > 0);
    match name.chars().enumerate().find(|&(i, c)| !fits(i, c)) {
        Some((i, character)) => Err(NameError::Hand { character, position: i + 1 }),
        None => Ok(()),
    }
}

fn marks(name: &str) -> Result<(), NameError> {
    let mut on_one = 0;
    for (i, character) in name.nfd().enumerate() {
        on_one = if is_combining_mark(character) { on_one + 1 } else { 0 };
        let why = match on_one {
            1.. if on_one == i + 1 => "without a character that carries it",
            n if n > MAX_MARKS => "after 4 others",
            _ => continue,
        };
        return Err(NameError::Mark { character, position: i + 1, why });
    }
    Ok(())
}

/// The skeletons of a name: characters that look alike are replaced by one (UTS 39, section 4), and capitals by small letters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Skeleton([String; 2]);

impl Skeleton {
    /// The skeletons of a name, valid or not.
    pub fn of(name: &str) -> Self {
        let skeleton = |text: &str| unicode_security::skeleton(text).collect::<String>();
        let plain: String = name.nfkc().collect();
        // Two orders: I looks like l, but i does not; the Cyrillic В looks like B, but в not like b.
        Skeleton([skeleton(&plain.to_lowercase()), skeleton(&skeleton(&plain).to_lowercase())])
    }

    /// Whether two names look alike.
    pub fn is_like(&self, other: &Skeleton) -> bool {
        self.0.iter().zip(&other.0).any(|(a, b)| a == b)
    }
}

/// The first of `others` that looks like `name`.
pub fn like<'a>(name: &str, others: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let skeleton = Skeleton::of(name);
    others.into_iter().find(|other| Skeleton::of(other).is_like(&skeleton))
}

/// Names that do not look alike.
#[derive(Debug, Default)]
pub struct DistinctNames(BTreeMap<(usize, String), String>);

impl DistinctNames {
    /// Adds a name, or returns the one that it looks like.
    pub fn add(&mut self, name: &str) -> Option<&str> {
        let Skeleton(skeletons) = Skeleton::of(name);
        let keys = || skeletons.iter().cloned().enumerate();
        if let Some(key) = keys().find(|key| self.0.contains_key(key)) {
            return self.0.get(&key).map(String::as_str);
        }
        self.0.extend(keys().map(|key| (key, name.to_owned())));
        None
    }
}

#[cfg(test)]
mod tests;
