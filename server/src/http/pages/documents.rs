//! The documents as pages, their search, and the files that they link to.

use super::leaderboard::PLAIN;
use super::shell::{Page, respond};
use crate::competition::Competition;
use crate::documents::{self, Document, Group, Hit, ROOT, library};
use crate::http::extract::{Path, Query};
use crate::problem::Problem;
use axum::extract::State;
use axum::http::header::{
    ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_SECURITY_POLICY, CONTENT_TYPE, VARY,
    X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue};
use axum::response::{IntoResponse, Redirect, Response};
use maud::{Markup, PreEscaped, html};
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
    page("Search", results(&q, &documents::search(library(), &q)), &competition)
}

/// `GET /docs/files/{path}`.
pub(in crate::http) async fn file(Path(path): Path, headers: HeaderMap) -> Response {
    let Some(file) = library().file(&path) else {
        let message = format!("no file {} in the documents", shortened(&path));
        return Problem::new(Code::NotFound, message).into_response();
    };
    let takes_gzip = headers.get_all(ACCEPT_ENCODING).iter().any(|value| {
        let codings = value.to_str().unwrap_or_default().split(',');
        codings.map(str::trim).any(|coding| coding.eq_ignore_ascii_case("gzip"))
    });
    let mut response = if file.packed && takes_gzip {
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

fn results(words: &str, hits: &[Hit<'_>]) -> Markup {
    html! {
        (search_form(words))
        article.document {
            h1 { "Search" }
            div id="results" {
                @if words.trim().is_empty() {
                    p role="status" { "Type words: the search finds sections with all of them." }
                } @else {
                    p role="status" {
                        @match hits.len() {
                            0 => { "No section has all of these words." }
                            1 => { "1 section." }
                            documents::MOST => { "The best " (documents::MOST) " sections." }
                            count => { (count) " sections." }
                        }
                    }
                }
                ol.hits { @for hit in hits { (found(hit)) } }
            }
        }
        (list(None))
    }
}

fn found(hit: &Hit<'_>) -> Markup {
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
