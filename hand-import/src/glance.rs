//! What a file shows before a reader parses it; its extension does not count.

use std::borrow::Cow;

/// Name of the text that lists tendons which only `hand.toml` states.
pub(crate) const STATED: &str = "tendons_of_settings";
/// How names of exclusions begin that only MJCF's sharp boxes need.
pub(crate) const WITH_CORNERS: &str = "with_corners:";

/// What a file shows of its format.
pub(crate) struct Glance<'a> {
    /// The text between `<` and `>` of the root element; nothing if the file is no XML.
    pub(crate) tag: &'a str,
    /// Name of the root element.
    pub(crate) root: &'a str,
    /// The text; that of XML without comments.
    pub(crate) text: Cow<'a, str>,
}

impl Glance<'_> {
    /// A glance at a text.
    pub(crate) fn new(text: &str) -> Glance<'_> {
        let tag = root_tag(text).unwrap_or_default();
        let root = tag.split(|c: char| c.is_whitespace() || c == '/').next().unwrap_or_default();
        let text = if tag.is_empty() { Cow::Borrowed(text) } else { Cow::Owned(without_comments(text)) };
        Glance { tag, root, text }
    }
}

/// Remedy for a Git LFS pointer.
pub fn lfs_problem() -> String {
    "is a Git LFS pointer, not the file itself; run `git lfs install` and `git lfs pull` in its repository"
        .to_owned()
}

/// Whether these are the bytes of a Git LFS pointer.
pub fn is_lfs_pointer(bytes: &[u8]) -> bool {
    bytes.starts_with(b"version https://git-lfs.github.com/spec/")
}

/// The text between `<` and `>` of the first element.
fn root_tag(text: &str) -> Option<&str> {
    let mut rest = text.trim_start();
    loop {
        let skipped = if rest.starts_with("<!--") {
            rest.split_once("-->")
        } else if rest.starts_with("<?") {
            rest.split_once("?>")
        } else if rest.starts_with("<!") {
            let inner = rest.find('[').filter(|open| rest.find('>').is_none_or(|end| *open < end));
            if inner.is_some() { rest.split_once("]>") } else { rest.split_once('>') }
        } else {
            break;
        };
        rest = skipped?.1.trim_start();
    }
    let tag = rest.strip_prefix('<')?.split_once('>')?.0;
    tag.starts_with(|c: char| c.is_alphabetic()).then_some(tag)
}

/// The text without XML comments: these can contain anything.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("<!--") {
        out.push_str(before);
        rest = after.split_once("-->").map_or("", |(_, after)| after);
    }
    out + rest
}
