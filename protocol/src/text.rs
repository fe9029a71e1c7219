//! Makes untrusted text safe to show on a terminal, on a page or in a message.

use std::borrow::Cow;
use std::fmt::Write;
use unicode_properties::{GeneralCategory, UnicodeGeneralCategory};
use unicode_security::GeneralSecurityProfile;
use unicode_security::general_security_profile::IdentifierType;

/// BRAILLE PATTERN BLANK is a symbol by its category, but shows nothing.
const BRAILLE_BLANK: char = '\u{2800}';

/// Reason why a character must not be shown: it is invisible, or it changes the direction of the text around it.
pub fn hidden(c: char) -> Option<&'static str> {
    use GeneralCategory as Is;
    match c.general_category() {
        Is::Control => Some("a control character"),
        Is::Format if steers(c) => Some("which steers the direction of writing"),
        Is::LineSeparator | Is::ParagraphSeparator => Some("a line break"),
        Is::PrivateUse => Some("which looks different everywhere"),
        Is::Unassigned | Is::Surrogate => Some("no character"),
        Is::Format => Some("which is invisible"),
        _ if c.identifier_type() == Some(IdentifierType::Default_Ignorable) || c == BRAILLE_BLANK => {
            Some("which is invisible")
        }
        _ => None,
    }
}

/// Bidi_Control of the Unicode Character Database.
fn steers(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The text with every hidden character written as `\u{202E}`; see [`hidden`].
pub fn printable(text: &str) -> Cow<'_, str> {
    if text.chars().all(|c| hidden(c).is_none()) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match hidden(c) {
            // Writing into a string cannot fail.
            Some(_) => drop(write!(out, "\\u{{{:04X}}}", u32::from(c))),
            None => out.push(c),
        }
    }
    out.into()
}

/// The beginning of a text, for quotation, with every hidden character written as `\u{202E}`.
pub fn shortened(text: &str) -> String {
    const MAX_CHARACTERS: usize = 64;
    match text.char_indices().nth(MAX_CHARACTERS) {
        Some((end, _)) => format!("{}…", printable(&text[..end])),
        None => printable(text).into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::{prop_assert, proptest};

    #[test]
    fn hidden_characters_are_written_as_escapes() {
        assert_eq!(printable("R&D 🦀"), "R&D 🦀");
        assert_eq!(printable("a\u{202e}b\u{1b}[2J\u{9b}"), "a\\u{202E}b\\u{001B}[2J\\u{009B}");
    }

    proptest! {
        #[test]
        fn printable_text_has_no_control_characters(text in "(?s).{0,20}") {
            let shown = printable(&text).into_owned();
            prop_assert!(!shown.chars().any(|c| c.is_control() || steers(c)), "{:?}", shown);
        }
    }
}
