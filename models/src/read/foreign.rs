//! Recognises files of another format than expected, so that the error names the command that helps.

use std::path::Path;

use super::files::has_extension;
use super::report::Report;
use crate::error::ModelError;

/// First line of the pointer that Git LFS keeps in a repository instead of a file.
const LFS: &[u8] = b"version https://git-lfs.github.com/spec/";
/// The command that makes a hand of other formats.
const IMPORT: &str = "a URDF: `palmares hand import FILE --out my-hand/` writes one";

/// Rejects a pointer of Git LFS.
pub(super) fn check_pointer(bytes: &[u8], element: &str, report: &Report) -> Result<(), ModelError> {
    if !bytes.starts_with(LFS) {
        return Ok(());
    }
    let problem = "is a pointer of Git LFS; the file itself is not here";
    Err(report.bad(element, problem, "the file: run `git lfs pull` in its repository"))
}

/// Rejects a file that is no URDF but another format that is known.
pub(super) fn check_urdf(file: &Path, text: &str, report: &Report) -> Result<(), ModelError> {
    check_pointer(text.as_bytes(), "URDF", report)?;
    let format = match first_tag(text) {
        _ if has_extension(file, "rob") => "a robot of Klamp't",
        Some("mujoco" | "mujocoinclude") => "MJCF, a model of MuJoCo",
        Some("sdf") => "SDF, a model of Gazebo",
        Some("COLLADA") => "COLLADA, a mesh",
        Some("robot") if has_extension(file, "xacro") || text.contains("<xacro:") => {
            let problem = "is xacro, a URDF with macros";
            let valid =
                "a URDF: `palmares hand import FILE --out my-hand/`, or `xacro FILE > hand.urdf`, writes one";
            return Err(report.bad("URDF", problem, valid));
        }
        _ => return Ok(()),
    };
    Err(report.bad("URDF", format!("is {format}"), IMPORT))
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
