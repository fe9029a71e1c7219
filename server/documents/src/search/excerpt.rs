//! The part of a section that a result shows.

use super::words::{terms, words};
use std::collections::{BTreeMap, BTreeSet};

/// Bytes before the first found word of an excerpt, and of the whole excerpt.
const BEFORE: usize = 60;
const LENGTH: usize = 250;

/// A mark where text is left out.
const CUT: &str = "…";

/// The part of `text` with most of the words of a search, in pieces that are found words or not. It begins and ends at
/// words. `asked` has the number of the search's word for each term.
pub(super) fn excerpt<'a>(text: &'a str, asked: &BTreeMap<String, usize>) -> Vec<(bool, &'a str)> {
    let number = |word: &str| terms(word).iter().find_map(|term| asked.get(term)).copied();
    // Begin, end and number of each word.
    let all: Vec<(usize, usize, Option<usize>)> =
        words(text).map(|(at, word)| (at, at + word.len(), number(word))).collect();
    let found: Vec<(usize, usize)> =
        all.iter().filter_map(|(at, _, number)| Some((*at, (*number)?))).collect();
    // The first of the parts with most different words.
    let worth = |first: usize| {
        let near = found.iter().filter(|(at, _)| (first..first + LENGTH - BEFORE).contains(at));
        near.map(|(_, number)| number).collect::<BTreeSet<_>>().len()
    };
    let best = found.iter().map(|(at, _)| (worth(*at), std::cmp::Reverse(*at))).max();
    let first = best.map_or(0, |(_, std::cmp::Reverse(at))| at);
    let begin = match first.saturating_sub(BEFORE) {
        0 => 0,
        // From the begin of a sentence on, or else of a word.
        earliest => {
            let sentence = all.windows(2).filter(|pair| (earliest..=first).contains(&pair[1].0));
            let sentence = sentence.filter(|pair| ends_sentence(&text[pair[0].1..pair[1].0]));
            let word = all.iter().map(|(at, ..)| *at).find(|at| *at >= earliest);
            sentence.map(|pair| pair[1].0).next().or(word).unwrap_or(first)
        }
    };
    let last =
        all.iter().rfind(|(at, end, _)| *end <= begin + LENGTH || *at <= first).map_or(0, |word| word.1);
    // A short rest is shown: a sentence keeps its stop.
    let end = if all.last().is_none_or(|word| word.1 <= last) { text.trim_end().len() } else { last };
    let mut parts = Vec::new();
    if begin > 0 {
        parts.push((false, CUT));
    }
    let mut at = begin;
    for (from, to, number) in all.iter().filter(|word| (begin..end).contains(&word.0)) {
        if number.is_some() {
            parts.extend([(false, &text[at..*from]), (true, &text[*from..*to])]);
            at = *to;
        }
    }
    parts.push((false, &text[at..end.max(at)]));
    if end < text.trim_end().len() {
        parts.push((false, CUT));
    }
    parts.retain(|(_, part)| !part.is_empty());
    parts
}

/// Whether the characters between two words end a sentence, a paragraph or a table's cell.
fn ends_sentence(between: &str) -> bool {
    between.contains("  ") || between.contains(". ") || between.contains('\n')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(words: &[&str]) -> BTreeMap<String, usize> {
        words
            .iter()
            .enumerate()
            .flat_map(|(number, word)| terms(word).into_iter().map(move |t| (t, number)))
            .collect()
    }

    fn shown(parts: &[(bool, &str)]) -> String {
        parts.iter().map(|(_, part)| *part).collect()
    }

    #[test]
    fn found_words_are_marked_between_letters_of_any_length() {
        let text = "Größe σ: the Tendons pull. A tendon.";
        let parts = excerpt(text, &asked(&["tendon"]));
        let found: Vec<&str> = parts.iter().filter(|(found, _)| *found).map(|(_, text)| *text).collect();
        assert_eq!(found, ["Tendons", "tendon"]);
        assert_eq!(shown(&parts), text);
    }

    #[test]
    fn an_excerpt_begins_and_ends_at_words() {
        let filler = "interminable ".repeat(60);
        let text = format!("{filler}needle {filler}");
        let parts = shown(&excerpt(&text, &asked(&["needle"])));
        let inner =
            parts.strip_prefix('…').and_then(|rest| rest.strip_suffix('…')).expect("cut at both ends");
        assert!(inner.split(' ').all(|word| ["interminable", "needle"].contains(&word)), "{parts}");
        assert!(parts.len() < 270, "{}", parts.len());
    }

    #[test]
    fn the_part_with_most_words_is_shown() {
        let text = format!("A ball. {}. The ball drops into the box. {}", "x ".repeat(300), "y ".repeat(300));
        let parts = excerpt(&text, &asked(&["ball", "box"]));
        assert!(shown(&parts).starts_with("…The ball drops into the box"), "{}", shown(&parts));
    }
}
