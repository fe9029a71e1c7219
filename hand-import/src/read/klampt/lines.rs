//! The lines of a `.rob`: comments, continued lines, quotes.

/// A keyword and its values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Line {
    /// In lower case: Klamp't does not distinguish.
    pub(crate) keyword: String,
    pub(crate) words: Vec<String>,
}

/// The lines with content.
pub(crate) fn lines(text: &str) -> Vec<Line> {
    let mut lines = Vec::new();
    let mut words: Vec<String> = Vec::new();
    for line in text.lines() {
        let line = without_comment(line).trim_end();
        let (line, continued) = line.strip_suffix('\\').map_or((line, false), |line| (line, true));
        words.extend(split(line));
        if !continued && !words.is_empty() {
            let values = words.split_off(1);
            let keyword = words.remove(0).to_lowercase();
            lines.push(Line { keyword, words: values });
        }
    }
    lines
}

/// A number; `inf` is one.
pub(crate) fn number(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| !x.is_nan())
}

fn without_comment(line: &str) -> &str {
    let mut quoted = false;
    for (i, c) in line.char_indices() {
        match c {
            '"' => quoted = !quoted,
            '#' if !quoted => return &line[..i],
            _ => {}
        }
    }
    line
}

/// Words between spaces; quotes keep spaces, and nothing between them is a word too.
fn split(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut word: Option<String> = None;
    let mut quoted = false;
    for c in line.chars() {
        match c {
            '"' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            c if c.is_whitespace() && !quoted => words.extend(word.take()),
            c => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_continued_lines_and_quotes() {
        let found = lines("# a hand\nLinks a \"b c\" # two\n\ngeometry \"\" \\\n  x.stl\nautomass\n");
        let line = |keyword: &str, words: &[&str]| Line {
            keyword: keyword.to_owned(),
            words: words.iter().map(|word| (*word).to_owned()).collect(),
        };
        assert_eq!(
            found,
            [line("links", &["a", "b c"]), line("geometry", &["", "x.stl"]), line("automass", &[])]
        );
    }
}
