//! The index: in which sections each term occurs, and where in them.

use super::synonyms;
use super::words::{is_empty_word, parts, plain, stem, terms, words};
use std::collections::BTreeMap;

/// The texts of a section.
pub(super) struct Texts<'a> {
    pub(super) heading: &'a str,
    /// Headings above it, the document's title, and the name of its file.
    pub(super) above: String,
    pub(super) text: &'a str,
}

/// A term in a section.
#[derive(Debug)]
struct Place {
    section: usize,
    /// Whether it is in the section's heading, and in those above.
    heading: bool,
    above: bool,
    /// How often the text has it.
    count: usize,
}

/// Worth of a term in a heading, in those above it, and at most in the text.
const HEADING: f64 = 8.0;
const ABOVE: f64 = 3.0;
const TEXT: f64 = 2.0;
/// Worth of a word that means the same, and of a longer word that begins with the asked one.
pub(super) const SYNONYM: f64 = 0.5;
const LONGER: f64 = 0.2;
/// Least letters of a begin, and most words that begin with it.
const BEGIN: usize = 3;
const MOST_LONGER: usize = 30;

/// All sections by their terms.
#[derive(Debug)]
pub(super) struct Index {
    terms: BTreeMap<String, Vec<Place>>,
    /// Words in lower case as they are written, with the number of sections that have them.
    spellings: BTreeMap<String, usize>,
    synonyms: BTreeMap<String, Vec<String>>,
    /// Number of terms in the text of each section.
    lengths: Vec<f64>,
    mean_length: f64,
}

impl Index {
    pub(super) fn of<'a>(sections: impl Iterator<Item = Texts<'a>>) -> Self {
        let mut index = Index {
            terms: BTreeMap::new(),
            spellings: BTreeMap::new(),
            synonyms: synonyms::of_stems(),
            lengths: Vec::new(),
            mean_length: 1.0,
        };
        for (section, texts) in sections.enumerate() {
            index.add(section, &texts);
        }
        index.mean_length = index.lengths.iter().sum::<f64>().max(1.0) / index.lengths.len().max(1) as f64;
        index
    }

    fn add(&mut self, section: usize, texts: &Texts<'_>) {
        let mut length = 0.0;
        let fields = [(texts.heading, 0), (&texts.above, 1), (texts.text, 2)];
        for (word, field) in
            fields.iter().flat_map(|(text, field)| words(text).map(move |(_, word)| (word, *field)))
        {
            let named = if field == 0 { parts(word) } else { Vec::new() };
            for term in terms(word).into_iter().chain(named) {
                let places = self.terms.entry(term).or_default();
                if places.last().is_none_or(|place| place.section != section) {
                    places.push(Place { section, heading: false, above: false, count: 0 });
                }
                if let Some(place) = places.last_mut() {
                    place.heading |= field == 0;
                    place.above |= field == 1;
                    place.count += usize::from(field == 2);
                }
            }
            length += f64::from(u8::from(field == 2));
        }
        let all = [texts.heading, texts.text].map(plain).join(" ");
        let mut own: Vec<&str> = all.split(' ').collect();
        own.sort_unstable();
        own.dedup();
        for word in own {
            *self.spellings.entry(word.to_owned()).or_default() += 1;
        }
        self.lengths.push(length);
    }

    /// The terms that a word of a search stands for, with the worth of each. None: no section has the word.
    pub(super) fn meanings(&self, word: &str) -> Vec<(String, f64)> {
        let own = stem(word);
        let mut all: Vec<(String, f64)> = Vec::new();
        for (term, worth) in std::iter::once((&own, 1.0))
            .chain(self.synonyms.get(&own).into_iter().flatten().map(|term| (term, SYNONYM)))
        {
            if self.terms.contains_key(term) {
                all.push((term.clone(), worth));
            }
        }
        let begin = word.to_lowercase();
        if begin.chars().count() >= BEGIN {
            let longer = self.terms.range(begin.clone()..).map(|(term, _)| term);
            let longer = longer.take_while(|term| term.starts_with(&begin)).take(MOST_LONGER);
            let longer: Vec<&String> =
                longer.filter(|term| all.iter().all(|(known, _)| known != *term)).collect();
            all.extend(longer.into_iter().map(|term| (term.clone(), LONGER)));
        }
        all
    }

    /// The worth of a word's terms in each section, 0 without any, and whether its titles have one of them.
    pub(super) fn worth(&self, meanings: &[(String, f64)]) -> Vec<(f64, bool)> {
        let number = self.lengths.len() as f64;
        let mut worth = vec![(0.0_f64, false); self.lengths.len()];
        for (term, factor) in meanings {
            let Some(places) = self.terms.get(term) else { continue };
            let rarity = (1.0 + number / places.len() as f64).ln();
            for place in places {
                let count = place.count as f64;
                // A word in a long text says less (BM25 with k = 1.2, b = 0.75).
                let spread = 1.2 * (0.25 + 0.75 * self.lengths[place.section] / self.mean_length);
                let text = TEXT * count / (count + spread);
                let titles =
                    if place.heading { HEADING } else { 0.0 } + if place.above { ABOVE } else { 0.0 };
                let (most, titled) = &mut worth[place.section];
                *most = most.max(factor * rarity * (titles + text));
                *titled |= *factor >= SYNONYM && (place.heading || place.above);
            }
        }
        worth
    }

    /// The word of the documents that is nearest to a word that none of them has.
    pub(super) fn nearest(&self, word: &str) -> Option<&str> {
        let most = match word.chars().count() {
            0..=3 => return None,
            4..=7 => 1,
            _ => 2,
        };
        let written = self.spellings.iter().map(|(word, number)| (word.as_str(), *number));
        let meant = synonyms::all_words().map(|word| (word, 1));
        let all = written.chain(meant).filter(|(known, _)| {
            known.chars().count().abs_diff(word.chars().count()) <= most
                && !is_empty_word(known)
                && known.chars().all(|c| c.is_alphabetic() || c == '_')
        });
        let near = all.filter_map(|(known, number)| {
            let apart = strsim::osa_distance(word, known);
            (apart <= most).then_some((apart, std::cmp::Reverse(number), known))
        });
        near.min().map(|(.., known)| known)
    }
}
