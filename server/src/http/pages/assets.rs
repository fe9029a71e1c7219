//! The viewer's scripts and style sheets, embedded from `viewer/dist`, which `cargo xtask viewer` builds.

use crate::http::coding::takes;
use axum::extract::Path;
use axum::http::header::{CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE, VARY, X_CONTENT_TYPE_OPTIONS};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use rust_embed::{EmbeddedFile, RustEmbed};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// The names contain a hash of the content: a file never changes.
const IMMUTABLE: &str = "public, max-age=31536000, immutable";

/// Content codings, the smallest first, and the suffix of the compressed file.
const CODINGS: [(&str, &str); 2] = [("br", "br"), ("gzip", "gz")];

#[derive(RustEmbed)]
#[folder = "../viewer/dist"]
#[include = "bundle/*"]
struct Bundle;

/// An entry of vite's manifest.
#[derive(Debug, Deserialize)]
struct Chunk {
    file: String,
    #[serde(default)]
    css: Vec<String>,
    #[serde(default)]
    imports: Vec<String>,
}

/// The files that a page loads, as addresses.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct PageFiles {
    /// The page's own script.
    pub(super) script: String,
    /// Scripts to preload.
    pub(super) preload: Vec<String>,
    /// Style sheets, the most general first.
    pub(super) styles: Vec<String>,
}

/// Vite's manifest: chunks by the path of their source.
type Manifest = BTreeMap<String, Chunk>;

static MANIFEST: LazyLock<Manifest> = LazyLock::new(|| {
    let file = Bundle::get("bundle/manifest.json");
    file.and_then(|file| serde_json::from_slice(&file.data).ok()).unwrap_or_default()
});

/// The files of a page; None if the server was built without its viewer.
pub(super) fn files_of(page: &str) -> Option<PageFiles> {
    files_in(&MANIFEST, page)
}

/// Whether the server was built with this page's script.
pub(super) fn is_built(page: &str) -> bool {
    MANIFEST.contains_key(&format!("src/pages/{page}.ts"))
}

fn files_in(manifest: &Manifest, page: &str) -> Option<PageFiles> {
    let entry = manifest.get(&format!("src/pages/{page}.ts"))?;
    let mut files = PageFiles { script: format!("/{}", entry.file), ..PageFiles::default() };
    collect(manifest, entry, &mut files);
    Some(files)
}

/// Adds the files of a chunk, after those of its imports.
fn collect(manifest: &Manifest, chunk: &Chunk, files: &mut PageFiles) {
    for import in &chunk.imports {
        let Some(other) = manifest.get(import) else { continue };
        collect(manifest, other, files);
        let address = format!("/{}", other.file);
        if !files.preload.contains(&address) {
            files.preload.push(address);
        }
    }
    for style in &chunk.css {
        let address = format!("/{style}");
        if !files.styles.contains(&address) {
            files.styles.push(address);
        }
    }
}

/// `GET /assets/{file}`.
pub(in crate::http) async fn asset(Path(name): Path<String>, headers: HeaderMap) -> Response {
    let path = format!("bundle/assets/{name}");
    let Some(file) = Bundle::get(&path) else {
        let message = format!(
            "no file {}: the page is from another version of this server; reload it",
            shortened(&name)
        );
        return Problem::new(Code::NotFound, message).into_response();
    };
    let packed = CODINGS
        .iter()
        .filter(|(coding, _)| takes(&headers, coding))
        .find_map(|(coding, ending)| Some((*coding, Bundle::get(&format!("{path}.{ending}"))?)));
    let kind = HeaderValue::from_str(file.metadata.mimetype());
    let mut response = match packed {
        Some((coding, packed)) => ([(CONTENT_ENCODING, coding)], bytes(packed)).into_response(),
        None => bytes(file).into_response(),
    };
    let headers = response.headers_mut();
    headers.insert(CONTENT_TYPE, kind.unwrap_or(HeaderValue::from_static("application/octet-stream")));
    headers.insert(CACHE_CONTROL, HeaderValue::from_static(IMMUTABLE));
    headers.insert(VARY, HeaderValue::from_static("accept-encoding"));
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    response
}

fn bytes(file: EmbeddedFile) -> (StatusCode, Vec<u8>) {
    (StatusCode::OK, file.data.into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_each_file_once_after_those_that_it_imports() {
        let manifest = serde_json::from_value(serde_json::json!({
            "src/pages/live.ts": {
                "file": "assets/live.js", "css": ["assets/live.css"], "imports": ["_scene.js", "_base.js"]
            },
            "_scene.js": { "file": "assets/scene.js", "css": ["assets/scene.css"], "imports": ["_base.js"] },
            "_base.js": { "file": "assets/base.js", "css": ["assets/base.css"] },
            "src/pages/wall.ts": { "file": "assets/wall.js" },
        }));
        let manifest = manifest.expect("a manifest");
        let files = files_in(&manifest, "live").expect("its files");
        assert_eq!(files.script, "/assets/live.js");
        assert_eq!(files.preload, ["/assets/base.js", "/assets/scene.js"]);
        assert_eq!(files.styles, ["/assets/base.css", "/assets/scene.css", "/assets/live.css"]);
        assert_eq!(files_in(&manifest, "team"), None);
    }

    #[test]
    fn the_files_of_every_page_are_there() {
        if MANIFEST.is_empty() {
            println!("SKIP: built without the viewer");
            return;
        }
        for page in ["leaderboard", "live", "replay", "team", "wall", "admin", "docs"] {
            let files = files_of(page).expect(page);
            let all = files.styles.iter().chain(&files.preload).chain([&files.script]);
            for address in all {
                assert!(Bundle::get(&format!("bundle{address}")).is_some(), "{page}: {address}");
            }
        }
    }
}
