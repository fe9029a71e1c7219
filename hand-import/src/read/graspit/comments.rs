//! Comments of GraspIt!'s files, which are not always well-formed.

/// The text with blanks instead of comments: published ones have hyphens that XML does not allow there.
pub(super) fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, comment)) = rest.split_once("<!--") {
        let (comment, after) = comment.split_once("-->").unwrap_or((comment, ""));
        out.push_str(before);
        // Lines keep their numbers.
        out.extend(comment.chars().filter(|c| *c == '\n'));
        rest = after;
    }
    out + rest
}
