//! Names that others read: of teams, of hands, labels. What they may consist of, and which of them look alike.
//!
//! The rules are those of RFC 8264 (FreeformClass: letters, marks, numbers, punctuation, symbols, spaces; nothing
//! that is invisible or steers what stands beside it) with the spaces of RFC 8266, over the Unicode of today. Whether
//! two names look alike is decided by the skeletons of UTS 39. docs/protocol.md, section Names, says the same.

use palmares_protocol::text::hidden;
pub(crate) use palmares_protocol::text::printable;
use palmares_protocol::{Code, Refusal};
use unicode_normalization::UnicodeNormalization;
use unicode_normalization::char::is_combining_mark;
use unicode_properties::{GeneralCategory, UnicodeGeneralCategory};

/// Characters of the longest name.
const LONGEST: usize = 64;
/// Combining marks on one character, UTS 39 section 5.4. More of them cover the lines above and below.
const MOST_MARKS: usize = 4;

/// Why something is no name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NameError {
    /// Too short or too long.
    #[error("it has {0} characters, expected 1 to {LONGEST}")]
    Length(usize),
    /// A character that no name has.
    #[error(
        "character {position} is U+{:04X}, {what}; a name consists of letters, marks, numbers, punctuation, symbols \
         and spaces (RFC 8264)", u32::from(*character)
    )]
    Character {
        /// Which.
        character: char,
        /// From 1.
        position: usize,
        /// What is wrong with it.
        what: &'static str,
    },
    /// Marks without a letter, or too many on one.
    #[error(
        "character {position} is U+{:04X}, a combining mark {why} (UTS 39, section 5.4)", u32::from(*character)
    )]
    Mark {
        /// Which.
        character: char,
        /// From 1, in the decomposed form.
        position: usize,
        /// What is wrong with it.
        why: &'static str,
    },
    /// Nothing to call it by.
    #[error("there is no letter or number in it")]
    Speechless,
    /// Not for an address or a file.
    #[error("character {position} is U+{:04X}; the name of a hand consists of letters a to z and A to Z, digits, `_`, \
             `-` and `.`, the first no `.`", u32::from(*character))]
    Hand {
        /// Which.
        character: char,
        /// From 1.
        position: usize,
    },
}

impl NameError {
    /// As an answer, with the field it stands in.
    pub(crate) fn of(self, field: &str) -> Refusal {
        Refusal::new(Code::BadRequest, format!("{field}: {self}"))
    }
}

/// The name of a team as it is stored and shown: composed (NFC), spaces single and only inside.
pub(crate) fn team(text: &str) -> Result<String, NameError> {
    let name = label(text)?;
    if name.is_empty() {
        return Err(NameError::Length(0));
    }
    if !name.chars().any(char::is_alphanumeric) {
        return Err(NameError::Speechless);
    }
    Ok(name)
}

/// What somebody is called besides, as the owner of a token: as a team's name, but it may be empty.
pub(crate) fn label(text: &str) -> Result<String, NameError> {
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
    if length > LONGEST {
        return Err(NameError::Length(length));
    }
    marks(&name)?;
    Ok(name)
}

/// Whether a hand that somebody sends in may be called so: alike in a message, a file and an address.
pub(crate) fn hand(name: &str) -> Result<(), NameError> {
    let length = name.chars().count();
    if !(1..=LONGEST).contains(&length) {
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
            n if n > MOST_MARKS => "after 4 others",
            _ => continue,
        };
        return Err(NameError::Mark { character, position: i + 1, why });
    }
    Ok(())
}

/// How a name looks: what is left when all characters that look alike are the same one (UTS 39, section 4), and
/// capitals are small.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Look([String; 2]);

impl Look {
    /// Of a name, also of one that would not be taken today.
    pub(crate) fn of(name: &str) -> Self {
        let skeleton = |text: &str| unicode_security::skeleton(text).collect::<String>();
        let plain: String = name.nfkc().collect();
        // Small before: I is like l, and i is not. And after: the Cyrillic В is like B, and в is not like b.
        Look([skeleton(&plain.to_lowercase()), skeleton(&skeleton(&plain).to_lowercase())])
    }

    /// Whether people take one for the other.
    pub(crate) fn is_like(&self, other: &Look) -> bool {
        self.0.iter().zip(&other.0).any(|(a, b)| a == b)
    }
}

/// The first of these names that looks like this one.
pub(crate) fn like<'a>(name: &str, others: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let look = Look::of(name);
    others.into_iter().find(|other| Look::of(other).is_like(&look))
}

#[cfg(test)]
mod tests;
