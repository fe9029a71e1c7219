use super::super::library;
use super::*;
use std::sync::LazyLock;

fn finder() -> &'static Finder<'static> {
    static FINDER: LazyLock<Finder<'static>> = LazyLock::new(|| Finder::of(library()));
    &FINDER
}

/// Document and heading of a hit.
fn place(hit: &Hit<'static>) -> (&'static str, &'static str) {
    (hit.document.path, hit.heading.map_or("", |heading| heading.text.as_str()))
}

#[test]
fn a_reader_of_other_programs_finds_the_section() {
    let finder = finder();
    let table = [
        ("asyncio", "docs/teams.md", "Threads and asyncio"),
        ("await", "docs/teams.md", "Threads and asyncio"),
        ("thread", "docs/teams.md", "Threads and asyncio"),
        ("Jupyter", "docs/python.md", "Notebooks"),
        ("notebook", "docs/python.md", "Notebooks"),
        ("colab", "docs/python.md", "Notebooks"),
        ("record video", "docs/replays.md", "Films and pictures"),
        ("mp4", "docs/replays.md", "Films and pictures"),
        ("render", "docs/replays.md", "Films and pictures"),
        ("make a movie of my run", "docs/replays.md", "Films and pictures"),
        ("download replay", "docs/replays.md", "Getting the files"),
        ("fetch the recording", "docs/replays.md", "Getting the files"),
        ("cookbook leap", "docs/cookbook.md", "leap"),
        ("leap ball", "docs/cookbook.md", "leap"),
        ("reconnect", "docs/protocol.md", "Reconnecting"),
        ("timeout", "docs/python.md", "Evaluate"),
        ("proxy", "docs/operations.md", "Proxies"),
        ("nginx", "docs/operations.md", "Proxies"),
        ("foxglove", "docs/bridges.md", "Foxglove"),
        ("ROS 2", "docs/bridges.md", "ROS 2"),
        ("quaternion order", "docs/teams.md", "Rotations"),
        ("friction", "docs/hands.md", "Friction of tendons and joints"),
        ("time limit", "docs/teams.md", "Time"),
        ("stale_tick", "docs/protocol.md", "Errors"),
        ("gymnasium", "docs/python.md", "gymnasium"),
        ("openai gym", "docs/python.md", "gymnasium"),
        ("Windows", "docs/python.md", "The wheel"),
        ("how to install", "README.md", "Install"),
        ("wrong token", "docs/operations.md", "WrongTokens"),
        ("ticks slow", "docs/operations.md", "TicksSlow"),
    ];
    // Several sections answer these.
    let among_three = [
        ("how do I grasp a ball", "docs/teams.md", "Grasp and lift"),
        ("score shelf", "docs/controllers.md", "Scores of the example controllers"),
        ("realtime missed_ticks", "docs/teams.md", "Time"),
    ];
    let mut wrong = Vec::new();
    let rows = table.into_iter().map(|row| (row, 1)).chain(among_three.map(|row| (row, 3)));
    for ((query, path, heading), places) in rows {
        let found = finder.search(query);
        let first: Vec<_> = found.hits.iter().take(places).map(place).collect();
        if !first.contains(&(path, heading)) || found.corrected.is_some() || !found.complete {
            wrong.push(format!("{query:?}: {first:?}, wanted {path}, {heading}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_title_finds_itself_first() {
    let finder = finder();
    let (mut checked, mut wrong) = (0, Vec::new());
    let first = |query: &str| {
        let (ranked, _) = finder.ranked(&finder.read(query));
        ranked.first().map(|number| &finder.sections[*number])
    };
    for document in &library().documents {
        for heading in &document.headings {
            // Several documents can have a section "Limits".
            let alone = first(&heading.text).and_then(|section| section.heading);
            if alone.map(|found| &found.text) != Some(&heading.text) {
                wrong.push(format!("{:?} finds {alone:?}", heading.text));
            }
            let both = format!("{} {}", document.title, heading.text);
            let found =
                first(&both).map(|section| (section.document.path, &section.heading.expect("one").text));
            if heading.level > 1 && found != Some((document.path, &heading.text)) {
                wrong.push(format!("{both:?} finds {found:?}"));
            }
            checked += 1;
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(checked > 300, "{checked}");
}

#[test]
fn a_misspelt_word_is_corrected_and_said() {
    let finder = finder();
    let table = [
        ("recconect", "reconnect"),
        ("jupiter", "jupyter"),
        ("gymnasum", "gymnasium"),
        ("softhnd friction", "softhand friction"),
        ("leaderbord", "leaderboard"),
    ];
    for (query, meant) in table {
        let (found, right) = (finder.search(query), finder.search(meant));
        assert_eq!(found.corrected.as_deref(), Some(meant));
        assert_eq!(
            found.hits.iter().map(place).collect::<Vec<_>>(),
            right.hits.iter().map(place).collect::<Vec<_>>()
        );
        assert!(right.corrected.is_none() && !right.hits.is_empty());
    }
}

#[test]
fn without_a_section_of_all_words_those_with_most_are_shown() {
    let finder = finder();
    let found = finder.search("friction zyzzyva");
    assert!(!found.complete);
    assert_eq!(place(&found.hits[0]), ("docs/hands.md", "Friction of tendons and joints"));
    assert!(finder.search("zyzzyva").hits.is_empty());
    assert!(finder.search("  ?! ").hits.is_empty());
    assert!(finder.search("tick").hits.len() <= MOST);
}

#[test]
fn the_list_of_changes_comes_last() {
    let finder = finder();
    for query in ["capstan friction", "replay verify", "organizers page", "leap"] {
        let hits = finder.search(query).hits;
        let last = hits.iter().skip_while(|hit| hit.document.path != CHANGES);
        assert!(
            last.clone().all(|hit| hit.document.path == CHANGES),
            "{query}: {:?}",
            hits.iter().map(place)
        );
        assert_ne!(hits[0].document.path, CHANGES, "{query}");
    }
}

#[test]
fn excerpts_of_all_sections_begin_and_end_at_words() {
    let finder = finder();
    let mut checked = 0;
    for query in ["tendon", "replay score", "server token", "σ", "ball box hand"] {
        for hit in finder.search(query).hits {
            let shown: String = hit.excerpt.iter().map(|(_, part)| *part).collect();
            let whole = library().documents.iter().flat_map(|document| &document.sections);
            let inner = shown.trim_matches('…').trim();
            let text = whole.into_iter().find(|text| text.contains(inner)).expect("a part of a section");
            let at = text.find(inner).expect("in it");
            let letter = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
            assert!(!(letter(text[..at].chars().next_back()) && letter(inner.chars().next())), "{shown}");
            let after = text[at + inner.len()..].chars().next();
            assert!(!(letter(inner.chars().next_back()) && letter(after)), "{shown}");
            assert!(hit.excerpt.iter().any(|(found, _)| *found) || hit.heading.is_some(), "{shown}");
            checked += 1;
        }
    }
    assert!(checked > 50, "{checked}");
}

#[test]
fn every_synonym_leads_somewhere() {
    let finder = finder();
    for word in synonyms::all_words() {
        assert!(!finder.index.meanings(word).is_empty(), "{word}");
    }
}
