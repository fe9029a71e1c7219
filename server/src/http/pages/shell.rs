//! The frame of every page: head, navigation, and an element that the page's script fills.

use super::assets::{PageFiles, files_of};
use crate::competition::Competition;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, HeaderName, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
};
use axum::response::IntoResponse;
use maud::{DOCTYPE, Markup, html};
use std::sync::LazyLock;

/// All resources come from this server; inline scripts and styles, and framing by other pages, are forbidden.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; \
                      font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The policy of a page with a form.
static POLICY_WITH_FORM: LazyLock<String> =
    LazyLock::new(|| POLICY.replace("form-action 'none'", "form-action 'self'"));

const OPENER: HeaderName = HeaderName::from_static("cross-origin-opener-policy");

/// A page.
pub(super) struct Page<'a> {
    /// Its script in `viewer/src/pages`.
    pub(super) name: &'a str,
    /// The session, run or hand in its address.
    pub(super) argument: &'a str,
    /// The window's title.
    pub(super) title: &'a str,
    /// The content before the script runs, or without it.
    pub(super) body: Markup,
    /// Style sheet for a server without its viewer.
    pub(super) plain_style: Option<&'a str>,
    /// Seconds after which a browser without scripts reloads.
    pub(super) refresh_s: Option<u32>,
    /// Whether the page has a form that the browser sends to this server without a script.
    pub(super) form: bool,
}

/// The response with a page.
pub(super) fn respond(page: &Page<'_>, competition: &Competition) -> impl IntoResponse + use<> {
    let headers = [
        (CACHE_CONTROL, "no-store"),
        (CONTENT_SECURITY_POLICY, if page.form { POLICY_WITH_FORM.as_str() } else { POLICY }),
        (REFERRER_POLICY, "no-referrer"),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (OPENER, "same-origin"),
    ];
    (headers, render(page, competition.rules.official()))
}

/// The page as HTML.
pub(super) fn render(page: &Page<'_>, official: bool) -> Markup {
    let files = files_of(page.name);
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (page.title) " – Palmares" }
                // An empty icon: the browser requests none.
                link rel="icon" href="data:,";
                (links(files.as_ref(), page.plain_style))
                @if let Some(seconds) = page.refresh_s {
                    noscript { meta http-equiv="refresh" content=(seconds); }
                }
            }
            body data-page=(page.name) data-arg=(page.argument) {
                (navigation(page.name, official))
                main id="app" { (page.body) }
            }
        }
    }
}

fn links(files: Option<&PageFiles>, plain_style: Option<&str>) -> Markup {
    html! {
        @if let Some(files) = files {
            @for style in &files.styles { link rel="stylesheet" href=(style); }
            @for script in &files.preload { link rel="modulepreload" href=(script); }
            script type="module" src=(files.script) {}
        } @else if let Some(style) = plain_style {
            link rel="stylesheet" href=(style);
        }
    }
}

fn navigation(page: &str, official: bool) -> Markup {
    let link = |name: &str, address: &str, words: &str| {
        html! { a href=(address) aria-current=[(page == name).then_some("page")] { (words) } }
    };
    html! {
        header.nav {
            a.brand href="/" { "Palmares" }
            nav aria-label="Pages" {
                (link("leaderboard", "/", "Leaderboard"))
                (link("live", "/live", "Live"))
                (link("replay", "/replay", "Replay"))
                (link("hands", "/hands", "Hands"))
                @if !official { (link("drive", "/drive", "Drive")) }
                (link("wall", "/wall", "Wall"))
                (link("docs", "/docs", "Docs"))
                @if official {
                    a.apart href="/admin" aria-current=[(page == "admin").then_some("page")] { "Organizers" }
                }
            }
        }
    }
}

/// The message of a page that needs its script.
pub(super) fn without_script(name: &str) -> Markup {
    html! {
        @if files_of(name).is_some() {
            noscript { p.notice { "This page needs JavaScript. The " a href="/" { "leaderboard" } " does not." } }
        } @else {
            p.notice {
                "This server was built without its viewer: " code { "cargo xtask viewer" }
                " builds it, and the next " code { "cargo build" } " takes it in."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_no_inline_script_or_style_and_escapes_text() {
        let body = without_script("live");
        let page = Page {
            name: "live",
            argument: "\"><script>",
            title: "<i>",
            body,
            plain_style: None,
            refresh_s: None,
            form: false,
        };
        let html = render(&page, false).into_string();
        assert!(
            html.contains("data-arg=\"&quot;&gt;&lt;script&gt;\"") && html.contains("&lt;i&gt;"),
            "{html}"
        );
        assert!(!html.contains("<style") && !html.contains("style=") && !html.contains("onload"), "{html}");
        assert!(!POLICY.contains("unsafe"));
    }

    #[test]
    fn organizers_have_a_page_on_official_servers() {
        assert!(!navigation("live", false).into_string().contains("/admin"));
        let official = navigation("admin", true).into_string();
        assert!(official.contains("href=\"/admin\" aria-current=\"page\""), "{official}");
    }
}
