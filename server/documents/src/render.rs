//! Markdown as HTML for these pages: links lead to this server's addresses, headings have ids, and the policy of the pages
//! holds: neither scripts nor styles in the text.

use super::links::{Places, Target};
use maud::Escaper;
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd, html::push_html};
use std::collections::BTreeMap;
use std::fmt::Write;

/// A heading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heading {
    /// 1 is the title.
    pub level: u8,
    /// Its id in the page.
    pub id: String,
    /// Its words.
    pub text: String,
}

/// A document as HTML.
#[derive(Debug, Default)]
pub(super) struct Rendered {
    pub(super) html: String,
    pub(super) headings: Vec<Heading>,
    /// Text before the first heading, then of each heading.
    pub(super) sections: Vec<String>,
}

/// Renders the document at `path`.
pub(super) fn render(markdown: &str, path: &str, places: &Places) -> Rendered {
    let mut renderer =
        Renderer { path, places, ids: BTreeMap::new(), open: Vec::new(), rendered: Rendered::default() };
    renderer.rendered.sections.push(String::new());
    let parser = Parser::new_ext(markdown, Options::ENABLE_TABLES | Options::ENABLE_STRIKETHROUGH);
    let mut events: Vec<Event<'_>> = Vec::new();
    // Where the heading begins that is open.
    let mut heading = None;
    for event in parser {
        match &event {
            Event::Start(Tag::Heading { .. }) => heading = Some(events.len()),
            Event::End(TagEnd::Heading(level)) => {
                let begin = heading.take().unwrap_or_default();
                let text = words(&events[begin..]);
                let id = renderer.new_id(&text);
                if let Event::Start(Tag::Heading { id: own, .. }) = &mut events[begin] {
                    *own = Some(CowStr::from(id.clone()));
                }
                renderer.rendered.headings.push(Heading { level: *level as u8, id, text });
                renderer.rendered.sections.push(String::new());
            }
            _ if heading.is_none() => renderer.note(&event),
            _ => {}
        }
        renderer.rewrite(event, &mut events);
    }
    let mut text = String::new();
    push_html(&mut text, events.into_iter());
    // Text is escaped: these marks are the writer's own. A scrolled block can be reached by keys.
    for (mark, ours) in [
        ("<pre>", "<pre tabindex=\"0\">"),
        (" style=\"text-align: right\"", " class=\"n\""),
        (" style=\"text-align: left\"", ""),
        (" style=\"text-align: center\"", ""),
    ] {
        text = text.replace(mark, ours);
    }
    text = with_drawings(&text);
    renderer.rendered.html = text;
    renderer.rendered
}

/// Marks blocks that are drawn of lines: these cannot wrap.
fn with_drawings(html: &str) -> String {
    let mut blocks = html.split("<pre ");
    let mut marked = blocks.next().unwrap_or_default().to_owned();
    for block in blocks {
        let own = block.split("</pre>").next().unwrap_or_default();
        let drawn = own.contains(['─', '│', '▶']);
        marked.push_str(if drawn { "<pre class=\"drawing\" " } else { "<pre " });
        marked.push_str(block);
    }
    marked
}

/// The words of some events.
fn words(events: &[Event<'_>]) -> String {
    let words = events.iter().filter_map(|event| match event {
        Event::Text(text) | Event::Code(text) => Some(text.as_ref()),
        _ => None,
    });
    words.collect()
}

struct Renderer<'a> {
    path: &'a str,
    places: &'a Places,
    /// How often each id was taken.
    ids: BTreeMap<String, usize>,
    /// The open links and pictures, and whether each leads to an address.
    open: Vec<bool>,
    rendered: Rendered,
}

impl Renderer<'_> {
    /// The id of a heading, by GitHub's rule, so that links work there and here.
    fn new_id(&mut self, text: &str) -> String {
        let lower = text.to_lowercase();
        let kept = lower.chars().filter(|c| c.is_alphanumeric() || ['-', '_', ' '].contains(c));
        let base: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        let taken = self.ids.entry(base.clone()).or_default();
        *taken += 1;
        if *taken == 1 { base } else { format!("{base}-{}", *taken - 1) }
    }

    /// Adds the words of an event to the section for the search.
    fn note(&mut self, event: &Event<'_>) {
        let Some(section) = self.rendered.sections.last_mut() else { return };
        match event {
            Event::Text(text) | Event::Code(text) => section.push_str(text),
            Event::SoftBreak | Event::HardBreak => section.push(' '),
            Event::End(TagEnd::Paragraph | TagEnd::Item | TagEnd::TableCell | TagEnd::CodeBlock) => {
                section.push_str("  ");
            }
            _ => {}
        }
    }

    fn rewrite<'e>(&mut self, event: Event<'e>, events: &mut Vec<Event<'e>>) {
        match event {
            Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
                let target = self.places.target(self.path, &dest_url);
                self.open.push(matches!(target, Target::Address(_)));
                events.push(match target {
                    Target::Address(address) => {
                        Event::Start(Tag::Link { link_type, dest_url: address.into(), title, id })
                    }
                    Target::Elsewhere(path) => Event::InlineHtml(elsewhere(&path).into()),
                });
            }
            Event::Start(Tag::Image { link_type, dest_url, title, id }) => {
                let target = self.places.target(self.path, &dest_url);
                self.open.push(matches!(target, Target::Address(_)));
                events.push(match target {
                    Target::Address(address) => {
                        Event::Start(Tag::Image { link_type, dest_url: address.into(), title, id })
                    }
                    Target::Elsewhere(path) => Event::InlineHtml(elsewhere(&path).into()),
                });
            }
            Event::End(end @ (TagEnd::Link | TagEnd::Image)) => {
                let leads = self.open.pop().unwrap_or(true);
                events.push(if leads { Event::End(end) } else { Event::InlineHtml("</span>".into()) });
            }
            Event::Start(Tag::Table(columns)) => {
                events.push(Event::Html("<div class=\"scroll\" tabindex=\"0\">".into()));
                events.push(Event::Start(Tag::Table(columns)));
            }
            Event::End(TagEnd::Table) => {
                events.push(Event::End(TagEnd::Table));
                events.push(Event::Html("</div>".into()));
            }
            // Only comments for the programs that write parts of a document.
            Event::Html(_) | Event::InlineHtml(_) => {}
            other => events.push(other),
        }
    }
}

/// The begin of words that lead to a file or folder which this server does not have.
fn elsewhere(path: &str) -> String {
    let mut escaped = String::new();
    // A string takes everything.
    let _ = Escaper::new(&mut escaped).write_str(path);
    format!("<span class=\"elsewhere\" title=\"{escaped}, in the sources\">")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(markdown: &str) -> Rendered {
        render(markdown, "docs/a.md", &Places::of(["docs/b.md", "docs/p.png"].into_iter()))
    }

    #[test]
    fn headings_have_the_ids_that_links_expect() {
        let page = shown("# A `b_c`: d\n\nx\n\n## One, two\n\n## One, two\n");
        let ids: Vec<&str> = page.headings.iter().map(|heading| heading.id.as_str()).collect();
        assert_eq!(ids, ["a-b_c-d", "one-two", "one-two-1"]);
        assert!(page.html.contains("<h2 id=\"one-two-1\">One, two</h2>"), "{}", page.html);
        assert_eq!(page.sections.len(), 4);
        assert_eq!(page.sections[1].trim(), "x");
    }

    #[test]
    fn a_link_to_what_is_not_here_is_a_path_without_a_link() {
        let page = shown("[b](b.md#x) [world](../sim/\"w.rs) ![p](p.png)\n");
        assert!(page.html.contains("<a href=\"/docs/b#x\">b</a>"), "{}", page.html);
        assert!(
            page.html
                .contains("<span class=\"elsewhere\" title=\"sim/&quot;w.rs, in the sources\">world</span>"),
            "{}",
            page.html
        );
        assert!(page.html.contains("<img src=\"/docs/files/docs/p.png\" alt=\"p\""), "{}", page.html);
    }

    #[test]
    fn a_drawing_of_lines_is_marked() {
        let page = shown("    a ──▶ b\n\nx\n\n```\nlong code\n```\n");
        assert!(page.html.contains("<pre class=\"drawing\" tabindex=\"0\"><code>a ──▶ b"), "{}", page.html);
        assert!(page.html.contains("<pre tabindex=\"0\"><code>long code"), "{}", page.html);
    }

    #[test]
    fn the_text_brings_neither_scripts_nor_styles() {
        let page =
            shown("<script>alert(1)</script>\n\na <b onclick=x>c</b>\n\n| a |\n|--:|\n| `<style>` |\n");
        assert!(!page.html.contains("<script") && !page.html.contains("onclick"), "{}", page.html);
        assert!(!page.html.contains("<style") && !page.html.contains(" style="), "{}", page.html);
        assert!(page.html.contains("<div class=\"scroll\" tabindex=\"0\"><table>"), "{}", page.html);
        assert!(page.html.contains("<td class=\"n\"><code>&lt;style&gt;</code></td>"), "{}", page.html);
    }
}
