//! The search. Titles come before text; forms of a word and words that mean the same are found; what is misspelt is corrected.

mod excerpt;
mod index;
mod synonyms;
mod words;

use super::library::{Document, Group, Library};
use super::render::Heading;
use excerpt::excerpt;
use index::{Index, SYNONYM, Texts};
use std::collections::{BTreeMap, BTreeSet};
use words::{is_empty_word, parts, plain, terms, words};

/// Most results.
pub const MOST: usize = 30;
/// Most words of a search: the longest heading with its document's title has fewer.
const MOST_WORDS: usize = 24;
/// Path of the list of changes: what it says of a subject, the subject's own document says better.
const CHANGES: &str = "CHANGELOG.md";
/// Worth of all words in titles, of a whole heading that is asked for, and of asked words that stand side by side.
const IN_TITLES: f64 = 20.0;
const WHOLE_HEADING: f64 = 15.0;
const SIDE_BY_SIDE: f64 = 3.0;

/// A section that a search finds.
#[derive(Debug)]
pub struct Hit<'a> {
    /// Its document.
    pub document: &'a Document,
    /// Its heading; none before the first one.
    pub heading: Option<&'a Heading>,
    /// A part of its text, with the found words.
    pub excerpt: Vec<(bool, &'a str)>,
}

/// What a search finds.
#[derive(Debug, Default)]
pub struct Found<'a> {
    /// The best first.
    pub hits: Vec<Hit<'a>>,
    /// The words that were searched in place of misspelt ones.
    pub corrected: Option<String>,
    /// Whether each hit has all words; otherwise it has the most that any section has.
    pub complete: bool,
}

/// A section of a document.
#[derive(Debug)]
struct Section<'a> {
    document: &'a Document,
    heading: Option<&'a Heading>,
    text: &'a str,
    /// The words of its text.
    plain: String,
    /// Its heading, alone and after its document's title or name.
    titles: Vec<String>,
    /// The terms of each word of its heading.
    heading_terms: Vec<Vec<String>>,
}

/// The documents, ready for searches.
#[derive(Debug)]
pub(crate) struct Finder<'a> {
    sections: Vec<Section<'a>>,
    index: Index,
}

impl<'a> Finder<'a> {
    pub(crate) fn of(library: &'a Library) -> Self {
        let mut sections: Vec<Section<'a>> = Vec::new();
        let mut above: Vec<String> = Vec::new();
        for document in &library.documents {
            let mut open: Vec<&Heading> = Vec::new();
            for (number, text) in document.sections.iter().enumerate() {
                let heading = number.checked_sub(1).and_then(|number| document.headings.get(number));
                if let Some(heading) = heading {
                    open.retain(|outer| outer.level < heading.level);
                }
                let outer = open.iter().map(|outer| outer.text.as_str());
                above.push(outer.chain([name(document)]).collect::<Vec<_>>().join(" "));
                open.extend(heading);
                sections.push(Section::of(document, heading, text));
            }
        }
        let texts = sections.iter().zip(above).map(|(section, above)| {
            let heading = section.heading.map_or("", |heading| heading.text.as_str());
            Texts { heading, above, text: section.text }
        });
        let index = Index::of(texts);
        Finder { sections, index }
    }

    /// The sections with the words of `query`, the best first.
    pub(crate) fn search(&self, query: &str) -> Found<'a> {
        let asked = self.read(query);
        let (ranked, complete) = self.ranked(&asked);
        let meanings = asked.meanings.iter().enumerate();
        let by_term: BTreeMap<String, usize> = meanings
            .flat_map(|(number, meaning)| meaning.iter().map(move |(term, _)| (term.clone(), number)))
            .collect();
        let hits = ranked.iter().map(|number| {
            let Section { document, heading, text, .. } = &self.sections[*number];
            Hit { document, heading: *heading, excerpt: excerpt(text, &by_term) }
        });
        Found { hits: hits.collect(), complete, corrected: asked.corrected.then_some(asked.spelt) }
    }

    /// The words of a query and their meanings; a word that no section has becomes the nearest one.
    fn read<'q>(&self, query: &'q str) -> Asked<'q> {
        let words: Vec<String> =
            plain(query).split_whitespace().take(MOST_WORDS).map(str::to_owned).collect();
        let full = words.iter().any(|word| !is_empty_word(word));
        let mut asked =
            Asked { written: query.trim(), spelt: String::new(), corrected: false, meanings: Vec::new() };
        let mut spelt: Vec<String> = Vec::new();
        for word in words {
            let mut meaning = self.index.meanings(&word);
            let nearest = if meaning.is_empty() { self.index.nearest(&word) } else { None };
            if let Some(nearest) = nearest {
                meaning = self.index.meanings(nearest);
                asked.corrected = true;
            }
            if !(full && is_empty_word(&word)) {
                asked.meanings.push(meaning);
            }
            spelt.push(nearest.map_or(word, str::to_owned));
        }
        asked.spelt = spelt.join(" ");
        asked
    }

    /// The sections with most of the words, the best first, and whether they have all.
    fn ranked(&self, asked: &Asked<'_>) -> (Vec<usize>, bool) {
        let worths: Vec<Vec<(f64, bool)>> =
            asked.meanings.iter().map(|meaning| self.index.worth(meaning)).collect();
        let has = |section: usize| worths.iter().filter(|worth| worth[section].0 > 0.0).count();
        let most = (0..self.sections.len()).map(has).max().unwrap_or_default();
        if most == 0 {
            return (Vec::new(), false);
        }
        // A longer word does not make a heading the asked one.
        let meant = asked.meanings.iter().flatten().filter(|(_, worth)| *worth >= SYNONYM);
        let meant: BTreeSet<&str> = meant.map(|(term, _)| term.as_str()).collect();
        let mut ranked: Vec<(usize, bool, f64, usize)> = Vec::new();
        for (number, section) in self.sections.iter().enumerate().filter(|(number, _)| has(*number) == most) {
            let own = worths.iter().map(|worth| worth[number]);
            let titles = if own.clone().all(|(_, titled)| titled) { IN_TITLES } else { 0.0 };
            let text = own.map(|(worth, _)| worth).sum::<f64>();
            let score = weight(section.document) * (text + titles + section.closeness(&asked.spelt, &meant));
            ranked.push((section.titled(asked), section.document.path == CHANGES, score, number));
        }
        // Equal ones stay in the order of the documents.
        ranked.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(b.2.total_cmp(&a.2)));
        ranked.truncate(MOST);
        (ranked.iter().map(|(.., number)| *number).collect(), most == asked.meanings.len())
    }
}

/// A query.
struct Asked<'q> {
    written: &'q str,
    /// Its words in lower case, misspelt ones corrected.
    spelt: String,
    corrected: bool,
    /// The terms that each word stands for, with their worth.
    meanings: Vec<Vec<(String, f64)>>,
}

impl<'a> Section<'a> {
    fn of(document: &'a Document, heading: Option<&'a Heading>, text: &'a str) -> Self {
        let own = heading.map_or("", |heading| heading.text.as_str());
        let alone = plain(own);
        let before = [plain(&document.title), plain(name(document))];
        let titles =
            std::iter::once(alone.clone()).chain(before.iter().map(|title| format!("{title} {alone}")));
        let titles = if heading.is_some() { titles.collect() } else { Vec::new() };
        let full = words(own).map(|(_, word)| word).filter(|word| !is_empty_word(&word.to_lowercase()));
        let heading_terms = full.map(|word| terms(word).into_iter().chain(parts(word)).collect()).collect();
        Section { document, heading, text, plain: plain(text), titles, heading_terms }
    }

    /// 0 for the section with this title as it is written, 1 in other letters or after the document's title, 2 for others.
    fn titled(&self, asked: &Asked<'_>) -> usize {
        if self.heading.is_some_and(|heading| heading.text == asked.written) {
            0
        } else {
            2 - usize::from(self.titles.contains(&asked.spelt))
        }
    }

    /// The worth of a heading that consists of asked words, and of asked words that stand side by side.
    fn closeness(&self, spelt: &str, meant: &BTreeSet<&str>) -> f64 {
        let is_meant = |terms: &&Vec<String>| terms.iter().any(|term| meant.contains(term.as_str()));
        let number = self.heading_terms.iter().filter(is_meant).count();
        let whole = number as f64 / self.heading_terms.len().max(1) as f64;
        let beside = spelt.contains(' ') && self.plain.contains(spelt);
        WHOLE_HEADING * whole + if beside { SIDE_BY_SIDE } else { 0.0 }
    }
}

/// The name of a document's file, or of its folder for a README.
fn name(document: &Document) -> &'static str {
    let path = document.path.strip_suffix(".md").unwrap_or(document.path);
    let path = path.strip_suffix("/README").unwrap_or(path);
    path.rsplit('/').next().unwrap_or(path)
}

/// Guides are for all readers; how the project is built is for few.
fn weight(document: &Document) -> f64 {
    match document.group() {
        Group::Guides => 1.0,
        Group::Models => 0.8,
        Group::Project => 0.1,
    }
}

#[cfg(test)]
mod tests;
