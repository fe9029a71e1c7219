//! The search: sections of the documents that have all words.

use super::library::{Document, Library};
use super::render::Heading;

/// Most results.
pub(crate) const MOST: usize = 30;
/// Most words of a search.
const MOST_WORDS: usize = 8;
/// Characters before and after the first found word.
const AROUND: (usize, usize) = (60, 180);

/// A section that has all words.
#[derive(Debug)]
pub(crate) struct Hit<'a> {
    /// Its document.
    pub(crate) document: &'a Document,
    /// Its heading; none before the first one.
    pub(crate) heading: Option<&'a Heading>,
    /// A part of its text, with the found words.
    pub(crate) excerpt: Vec<(bool, &'a str)>,
    score: usize,
}

/// Sections with all words of `query`, the best first. Letters A to Z match in both cases.
pub(crate) fn search<'a>(library: &'a Library, query: &str) -> Vec<Hit<'a>> {
    let lower = query.to_ascii_lowercase();
    let words: Vec<&str> = lower.split_whitespace().take(MOST_WORDS).collect();
    if words.is_empty() {
        return Vec::new();
    }
    let mut hits: Vec<Hit<'a>> = Vec::new();
    for document in &library.documents {
        for (number, text) in document.sections.iter().enumerate() {
            let heading = number.checked_sub(1).and_then(|number| document.headings.get(number));
            let own = heading.map_or("", |heading| heading.text.as_str()).to_ascii_lowercase();
            let (title, lower) = (document.title.to_ascii_lowercase(), text.to_ascii_lowercase());
            let scores = words.iter().map(|word| {
                let in_text = lower.matches(word).count().min(5);
                let score = in_text + 20 * usize::from(own.contains(word));
                (score > 0).then_some(score + 5 * usize::from(title.contains(word)))
            });
            let Some(score) = scores.sum::<Option<usize>>() else { continue };
            let phrase = 10 * usize::from(words.len() > 1 && lower.contains(&words.join(" ")));
            hits.push(Hit {
                document,
                heading,
                excerpt: excerpt(text, &lower, &words),
                score: score + phrase,
            });
        }
    }
    // Equal ones stay in the order of the documents.
    hits.sort_by_key(|hit| std::cmp::Reverse(hit.score));
    hits.truncate(MOST);
    hits
}

/// The text around the first found word. `lower` has the same bytes but for the case of letters.
fn excerpt<'a>(text: &'a str, lower: &str, words: &[&str]) -> Vec<(bool, &'a str)> {
    let first = words.iter().filter_map(|word| lower.find(word)).min().unwrap_or_default();
    let whole = |mut at: usize| {
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    let begin = whole(first.saturating_sub(AROUND.0));
    // From the begin of a word on.
    let begin = match begin {
        0 => 0,
        begin => text[begin..first].find(' ').map_or(begin, |space| begin + space + 1),
    };
    let end = whole((first + AROUND.1).min(text.len()));
    let (mut at, mut parts) = (begin, Vec::new());
    while at < end {
        let next = words.iter().filter_map(|word| Some((lower[at..end].find(word)? + at, word.len()))).min();
        let Some((found, length)) = next else { break };
        parts.push((false, &text[at..found]));
        parts.push((true, &text[found..found + length]));
        at = found + length;
    }
    if at < end {
        parts.push((false, &text[at..end]));
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::super::library;
    use super::*;

    #[test]
    fn the_best_section_is_first() {
        let hits = search(library(), "chain SIGNATURE");
        let best = hits.first().expect("a hit");
        assert_eq!(best.document.path, "docs/replays.md");
        assert_eq!(best.heading.map(|heading| heading.text.as_str()), Some("Chain and signature"));
        assert!(hits.len() <= MOST);
    }

    #[test]
    fn every_hit_has_every_word() {
        let hits = search(library(), "capstan friction");
        assert!(!hits.is_empty());
        for hit in hits {
            let at = hit
                .heading
                .map_or(0, |h| hit.document.headings.iter().position(|x| x == h).expect("its") + 1);
            let all = format!("{} {}", hit.heading.map_or("", |h| &h.text), hit.document.sections[at])
                .to_lowercase();
            assert!(all.contains("capstan") && all.contains("friction"), "{}: {all}", hit.document.path);
        }
        assert!(search(library(), "friction zyzzyva").is_empty());
        assert!(search(library(), "  ").is_empty());
    }

    #[test]
    fn found_words_are_marked_between_letters_of_any_length() {
        let text = "Größe σ: the Tendon pulls. A tendon.";
        let parts = excerpt(text, &text.to_ascii_lowercase(), &["tendon"]);
        let found: Vec<&str> = parts.iter().filter(|(found, _)| *found).map(|(_, text)| *text).collect();
        assert_eq!(found, ["Tendon", "tendon"]);
        assert_eq!(parts.iter().map(|(_, text)| *text).collect::<String>(), text);
    }
}
