//! Valid and invalid names, and names that look alike.

use super::*;
use proptest::prelude::*;

#[test]
fn usual_names_are_valid() {
    for (text, name) in [
        ("crabs", "crabs"),
        ("  R&D <2> ", "R&D <2>"),
        ("two\u{a0}\u{2003}spaces", "two spaces"),
        ("蟹座", "蟹座"),
        ("סרטנים", "סרטנים"),
        ("سرطان 7", "سرطان 7"),
        ("krabbe\u{301}", "krabbé"),
        ("crabs 🦀", "crabs 🦀"),
        ("हाथ", "हाथ"),
        ("Việt", "Việt"),
    ] {
        assert_eq!(team(text).as_deref(), Ok(name), "{text}");
    }
    assert_eq!(label("").as_deref(), Ok(""));
}

#[test]
fn invisible_and_directional_characters_are_named_and_refused() {
    for (text, at) in [
        ("\u{200b}\u{200b}", "character 1 is U+200B"),
        ("\u{3164}", "character 1 is U+3164"),
        ("a\u{2800}b", "character 2 is U+2800"),
        ("cr\u{202e}sba", "character 3 is U+202E, which steers"),
        ("\u{2067}crabs", "character 1 is U+2067, which steers"),
        ("crabs\u{feff}", "character 6 is U+FEFF"),
        ("cra\u{ad}bs", "character 4 is U+00AD"),
        ("crabs\u{fe0f}", "character 6 is U+FE0F"),
        ("crabs\u{e0041}", "character 6 is U+E0041"),
        ("a\u{1b}[31m", "character 2 is U+001B, a control"),
        ("a\u{9b}31m", "character 2 is U+009B, a control"),
        ("a\nb", "character 2 is U+000A, a control"),
        ("a\u{2028}b", "character 2 is U+2028, a line break"),
        ("\u{e000}", "character 1 is U+E000"),
        ("a\u{378}", "character 2 is U+0378, no character"),
        ("\u{301}a", "character 1 is U+0301, a combining mark without"),
        ("a\u{301}\u{302}\u{303}\u{304}\u{305}", "character 6 is U+0305, a combining mark after 4"),
        ("", "it has 0 characters"),
        ("\u{a0} \u{3000}", "it has 0 characters"),
        ("...", "no letter or number"),
        (&"x".repeat(65), "it has 65 characters"),
    ] {
        let said = team(text).expect_err(text).to_string();
        assert!(said.contains(at), "{text:?}: {said}");
    }
}

#[test]
fn names_that_look_alike_are_found() {
    for (a, b) in [
        ("crabs", "crаbs"),
        ("crabs", "Crabs"),
        ("crabs", "ＣＲＡＢＳ"),
        ("crabs", "СRАВS"),
        ("crabs 1", "crabs l"),
        ("crabs 1", "crabs I"),
        ("modern", "modem"),
        ("Team 0", "team O"),
        ("caf\u{e9}", "cafe\u{301}"),
        ("crabs", "cra\u{200b}bs"),
    ] {
        assert!(Skeleton::of(a).is_like(&Skeleton::of(b)), "{a} {b}");
        assert_eq!(like(a, ["eels", b]), Some(b));
    }
    for (a, b) in [("crabs", "crab"), ("crabs 1", "crabs 2"), ("crabs", "eels"), ("蟹", "解")] {
        assert!(!Skeleton::of(a).is_like(&Skeleton::of(b)), "{a} {b}");
    }
}

#[test]
fn names_of_hands_are_safe_in_paths() {
    for name in ["claw", "Claw-2.1", "a_b"] {
        assert_eq!(hand(name), Ok(()), "{name}");
    }
    for (name, said) in [
        ("", "0 characters"),
        (".", "character 1 is U+002E"),
        ("..", "character 1"),
        (".hidden", "character 1"),
        ("a/b", "character 2 is U+002F"),
        ("a\\b", "character 2 is U+005C"),
        ("a b", "character 2 is U+0020"),
        ("é", "character 1 is U+00E9"),
        (&"x".repeat(65), "65 characters"),
    ] {
        let error = hand(name).expect_err(name).to_string();
        assert!(error.contains(said), "{name}: {error}");
    }
}

#[test]
fn names_are_distinct_if_no_two_look_alike() {
    let mut names = DistinctNames::default();
    for name in ["crabs", "eels", "Иван"] {
        assert_eq!(names.add(name), None, "{name}");
    }
    for (name, other) in [("CRABS", "crabs"), ("сrabs", "crabs"), ("ee1s", "eels"), ("Иван", "Иван")]
    {
        assert_eq!(names.add(name), Some(other), "{name}");
        assert!(like(name, ["newts", other]).is_some(), "{name}");
    }
}

proptest! {
    #[test]
    fn a_valid_name_is_in_its_stored_form_already(text in "\\PC{0,40}|(?s).{0,8}") {
        if let Ok(name) = team(&text) {
            prop_assert_eq!(team(&name), Ok(name.clone()));
            prop_assert!((1..=MAX_CHARS).contains(&name.chars().count()));
            prop_assert_eq!(printable(&name), name.as_str());
            prop_assert!(!name.chars().any(char::is_control));
        }
    }

    #[test]
    fn every_name_looks_like_itself_however_it_is_written(text in "[a-zA-Zà-ü 0-9]{1,20}") {
        let skeleton = Skeleton::of(&text);
        for other in [text.to_uppercase(), text.to_lowercase(), text.nfd().collect(), text.nfkc().collect()] {
            prop_assert!(skeleton.is_like(&Skeleton::of(&other)), "{} {}", text, other);
        }
    }
}
