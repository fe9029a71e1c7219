//! The documents as pages, their search, and the files that they link to.

use super::leaderboard::PLAIN;
use super::shell::{Page, respond};
use crate::competition::Competition;
use crate::http::coding::takes;
use crate::http::extract::{Path, Query};
use axum::extract::State;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_ENCODING, CONTENT_SECURITY_POLICY, CONTENT_TYPE, VARY, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue};
use axum::response::{IntoResponse, Redirect, Response};
use maud::{Markup, PreEscaped, html};
use palmares_documents::{Document, Found, Group, Hit, ROOT, library};
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use serde::Deserialize;
use std::sync::Arc;

/// A search.
#[derive(Debug, Deserialize)]
pub(in crate::http) struct Words {
    #[serde(default)]
    q: String,
}

/// `GET /docs`.
pub(in crate::http) async fn first(State(competition): State<Arc<Competition>>) -> Response {
    let Some(document) = library().document(ROOT) else {
        let none = html! {
            p.notice { "This server was built without its documents: they were not beside its sources." }
        };
        return page("Docs", none, &competition);
    };
    page(&document.title, shown(document), &competition)
}

/// `GET /docs/{path}`.
pub(in crate::http) async fn document(
    State(competition): State<Arc<Competition>>,
    Path(path): Path,
) -> Response {
    if let Some(document) = library().document(&format!("{ROOT}/{path}")) {
        return page(&document.title, shown(document), &competition);
    }
    // The path that the document has in the repository.
    let by_path = |document: &&Document| {
        document.path == path || document.path.strip_prefix("docs/").is_some_and(|rest| rest == path)
    };
    if let Some(document) = library().documents.iter().find(by_path) {
        return Redirect::permanent(&document.address).into_response();
    }
    let message = format!("no document {}; {ROOT} lists them", shortened(&path));
    Problem::new(Code::NotFound, message).into_response()
}

/// `GET /docs/search`.
pub(in crate::http) async fn search(
    State(competition): State<Arc<Competition>>,
    Query(Words { q }): Query<Words>,
) -> Response {
    page("Search", results(&q, &palmares_documents::search(&q)), &competition)
}

/// `GET /docs/files/{path}`.
pub(in crate::http) async fn file(Path(path): Path, headers: HeaderMap) -> Response {
    let Some(file) = library().file(&path) else {
        let message = format!("no file {} in the documents", shortened(&path));
        return Problem::new(Code::NotFound, message).into_response();
    };
    let mut response = if file.packed && takes(&headers, "gzip") {
        ([(CONTENT_ENCODING, "gzip")], file.kept).into_response()
    } else {
        file.bytes().into_owned().into_response()
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (CONTENT_TYPE, file.media_type()),
        (CACHE_CONTROL, "no-cache"),
        (VARY, "accept-encoding"),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        // A drawing that is opened by itself runs no script.
        (CONTENT_SECURITY_POLICY, "default-src 'none'; style-src 'unsafe-inline'; img-src data:; sandbox"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

fn page(title: &str, body: Markup, competition: &Competition) -> Response {
    let page = Page {
        name: "docs",
        argument: "",
        title,
        body,
        plain_style: Some(PLAIN),
        refresh_s: None,
        form: true,
    };
    respond(&page, competition).into_response()
}

/// A document: on narrow pages the list is below the text.
fn shown(document: &Document) -> Markup {
    html! {
        (search_form(""))
        article.document { (PreEscaped(&document.html)) }
        (list(Some(document)))
    }
}

fn search_form(words: &str) -> Markup {
    html! {
        form.find action="/docs/search" method="get" role="search" {
            label.visually-hidden for="find" { "Search the documents" }
            input id="find" type="search" name="q" value=(words) placeholder="Words" maxlength="200" autocomplete="off";
            button { "Search" }
            a.to-list href="#list" { "Contents" }
        }
    }
}

/// All documents; the shown one with its headings.
fn list(current: Option<&Document>) -> Markup {
    html! {
        nav.list id="list" aria-label="Documents" {
            @for group in Group::ALL {
                h2 { (group.title()) }
                ul {
                    @for document in library().documents.iter().filter(|document| document.group() == group) {
                        @let is_current = current.is_some_and(|current| current.path == document.path);
                        li {
                            a href=(document.address) aria-current=[is_current.then_some("page")] { (document.title) }
                            @if is_current { (contents(document)) }
                        }
                    }
                }
            }
        }
    }
}

/// The headings of a document below its title.
fn contents(document: &Document) -> Markup {
    html! {
        ul.contents {
            @for heading in document.headings.iter().filter(|heading| (2..=3).contains(&heading.level)) {
                li.sub[heading.level == 3] { a href={ "#" (heading.id) } { (heading.text) } }
            }
        }
    }
}

/// Documents that a reader is sent to who found nothing.
const BEGINNINGS: usize = 6;

fn results(words: &str, found: &Found<'_>) -> Markup {
    html! {
        (search_form(words))
        article.document {
            h1 { "Search" }
            div id="results" {
                p role="status" { (told(words, found)) }
                @if found.hits.is_empty() {
                    p { "Begin with one of these:" }
                    ul {
                        @for document in library().documents.iter().filter(|one| one.group() == Group::Guides).take(BEGINNINGS) {
                            li { a href=(document.address) { (document.title) } }
                        }
                    }
                }
                ol.hits { @for hit in &found.hits { (shown_hit(hit)) } }
            }
        }
        (list(None))
    }
}

/// What the search did, in words.
fn told(words: &str, found: &Found<'_>) -> Markup {
    let count = found.hits.len();
    html! {
        @if words.trim().is_empty() {
            "Type words: the search finds sections with them, titles first."
        } @else if found.hits.is_empty() {
            "No section has any of these words. Try others, or fewer letters."
        } @else {
            @if let Some(spelt) = &found.corrected {
                "No document has the words as you wrote them. Did you mean "
                a href=(format!("/docs/search?q={}", spelt.replace(' ', "+"))) { (spelt) }
                "? "
            }
            @if !found.complete { "No section has all of these words. These have most of them: " }
            @match count {
                1 => { "1 section." }
                palmares_documents::MOST => { "The best " (palmares_documents::MOST) " sections." }
                count => { (count) " sections." }
            }
        }
    }
}

fn shown_hit(hit: &Hit<'_>) -> Markup {
    let id = hit.heading.map(|heading| heading.id.as_str());
    html! {
        li {
            a href={ (hit.document.address) @if let Some(id) = id { "#" (id) } } {
                (hit.document.title)
                @if let Some(heading) = hit.heading.filter(|heading| heading.level > 1) { " – " (heading.text) }
            }
            p { @for (found, text) in &hit.excerpt { @if *found { mark { (text) } } @else { (text) } } }
        }
    }
}
