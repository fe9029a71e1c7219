//! The files that the build script embeds.

use flate2::read::GzDecoder;
use std::borrow::Cow;
use std::io::Read;

type Embedded = (&'static str, &'static [u8], bool);

static EMBEDDED: &[Embedded] = &include!(concat!(env!("OUT_DIR"), "/documents.rs"));

/// A file of the repository.
#[derive(Clone, Copy, Debug)]
pub struct File {
    /// Path in the repository.
    pub path: &'static str,
    /// Its bytes, as gzip if `packed`.
    pub kept: &'static [u8],
    /// Whether the bytes are compressed.
    pub packed: bool,
}

/// All files of this program.
pub(super) fn embedded() -> Vec<File> {
    EMBEDDED.iter().map(|&(path, kept, packed)| File { path, kept, packed }).collect()
}

impl File {
    /// Its content.
    pub fn bytes(&self) -> Cow<'static, [u8]> {
        if !self.packed {
            return Cow::Borrowed(self.kept);
        }
        let mut bytes = Vec::new();
        GzDecoder::new(self.kept).read_to_end(&mut bytes).expect("the build script packed it");
        Cow::Owned(bytes)
    }

    /// Its content as text.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.bytes()).into_owned()
    }

    /// Its media type. Sources are text: a browser shows them.
    pub fn media_type(&self) -> &'static str {
        match self.path.rsplit('.').next() {
            Some("png") => "image/png",
            Some("svg") => "image/svg+xml",
            Some("json" | "ipynb") => "application/json",
            _ => "text/plain; charset=utf-8",
        }
    }
}
