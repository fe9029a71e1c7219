//! Recognises files of another format than expected, so that the error names the command that helps.

use std::path::Path;

use super::files::has_extension;
use super::report::Report;
use crate::error::ModelError;

/// First line of the pointer that Git LFS keeps in a repository instead of a file.
const LFS: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Rejects a pointer of Git LFS.
pub(super) fn check_pointer(bytes: &[u8], element: &str, report: &Report) -> Result<(), ModelError> {
    if !bytes.starts_with(LFS) {
        return Ok(());
    }
    let problem = "is a pointer of Git LFS; the file itself is not here";
    Err(report.bad(element, problem, "the file: run `git lfs pull` in its repository"))
}

/// Rejects a file that is no URDF: `palmares hand import` knows the other formats.
pub(super) fn check_urdf(file: &Path, text: &str, report: &Report) -> Result<(), ModelError> {
    check_pointer(text.as_bytes(), "URDF", report)?;
    let (problem, valid) = match first_tag(text) {
        Some("robot") if has_extension(file, "xacro") || text.contains("<xacro:") => {
            ("is xacro, a URDF with macros".to_owned(), ", or `xacro FILE > hand.urdf`, writes one")
        }
        Some("robot" | "") => return Ok(()),
        Some(root) => {
            let root: String = root.chars().take(40).collect();
            (format!("is no URDF: its root element is <{root}>"), " makes one of other programs' formats")
        }
        None => ("is no URDF: it is no XML".to_owned(), " makes one of other programs' formats"),
    };
    Err(report.bad("URDF", problem, format!("a URDF: `palmares hand import FILE --out my-hand/`{valid}")))
}

/// Name of the root element, without parsing the rest.
fn first_tag(text: &str) -> Option<&str> {
    let mut rest = text;
    loop {
        rest = &rest[rest.find('<')?..];
        let end = if rest.starts_with("<!--") {
            "-->"
        } else if rest.starts_with("<?") || rest.starts_with("<!") {
            ">"
        } else {
            let name = &rest[1..];
            return name.split(|c: char| !c.is_alphanumeric() && !"_-.:".contains(c)).next();
        };
        rest = &rest[rest.find(end)? + end.len()..];
    }
}
