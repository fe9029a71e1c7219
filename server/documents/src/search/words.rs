//! Words of a text, and the terms under which the index has them.

use rust_stemmers::{Algorithm, Stemmer};
use std::sync::LazyLock;

/// Words that a question has, and that say nothing of its subject.
const EMPTY: [&str; 45] = [
    "a", "an", "and", "are", "as", "at", "be", "by", "can", "do", "does", "for", "from", "has", "have",
    "how", "i", "if", "in", "is", "it", "its", "make", "me", "my", "of", "on", "or", "should", "that", "the",
    "there", "this", "to", "want", "was", "what", "when", "where", "which", "why", "will", "with", "you",
    "your",
];

static STEMMER: LazyLock<Stemmer> = LazyLock::new(|| Stemmer::create(Algorithm::English));

/// The words of a text with their places: letters, digits and `_`.
pub(super) fn words(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let inside = |c: char| c.is_alphanumeric() || c == '_';
    let mut at = 0;
    std::iter::from_fn(move || {
        let begin = at + text[at..].find(inside)?;
        let end = text[begin..].find(|c| !inside(c)).map_or(text.len(), |length| begin + length);
        at = end;
        Some((begin, &text[begin..end]))
    })
}

/// The words in lower case, one after the other.
pub(super) fn plain(text: &str) -> String {
    words(text).map(|(_, word)| word.to_lowercase()).collect::<Vec<_>>().join(" ")
}

/// Whether a word in lower case says nothing of a subject.
pub(super) fn is_empty_word(word: &str) -> bool {
    EMPTY.binary_search(&word).is_ok()
}

/// The stem of a word, in lower case: `Proxies` and `proxy` have one.
pub(super) fn stem(word: &str) -> String {
    STEMMER.stem(&word.to_lowercase()).into_owned()
}

/// The terms of a word: its stem, and those of its parts around `_`.
pub(super) fn terms(word: &str) -> Vec<String> {
    let mut all = vec![stem(word)];
    if word.contains('_') {
        all.extend(word.split('_').filter(|part| !part.is_empty()).map(stem));
    }
    all
}

/// The stems of the parts of a word such as `WrongTokens`; none of a word without capital letters inside.
pub(super) fn parts(word: &str) -> Vec<String> {
    let inside = word.char_indices().zip(word.chars().skip(1));
    let cuts = inside.filter(|((_, before), after)| before.is_lowercase() && after.is_uppercase());
    let mut ends: Vec<usize> = cuts.map(|((at, before), _)| at + before.len_utf8()).collect();
    if ends.is_empty() {
        return Vec::new();
    }
    ends.push(word.len());
    let begins = std::iter::once(0).chain(ends.clone());
    begins.zip(ends.clone()).map(|(begin, end)| stem(&word[begin..end])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_its_words() {
        let found: Vec<&str> = words("`stale_tick` (σ = 0.5): Größe, mp4.").map(|(_, word)| word).collect();
        assert_eq!(found, ["stale_tick", "σ", "0", "5", "Größe", "mp4"]);
        assert_eq!(plain("The  *Time*-limit"), "the time limit");
    }

    #[test]
    fn forms_of_a_word_have_one_stem() {
        for (a, b) in [("Proxies", "proxy"), ("recording", "records"), ("grasps", "Grasping")] {
            assert_eq!(stem(a), stem(b));
        }
        assert_eq!(terms("missed_ticks"), [stem("missed_ticks"), "miss".into(), "tick".into()]);
    }

    #[test]
    fn a_name_has_parts() {
        assert_eq!(parts("TicksSlow"), ["tick", "slow"]);
        assert!(parts("Ticks").is_empty() && parts("ROS").is_empty() && parts("σ").is_empty());
    }

    #[test]
    fn empty_words_are_sorted() {
        assert!(EMPTY.is_sorted());
        assert!(is_empty_word("how") && !is_empty_word("hand"));
    }
}
