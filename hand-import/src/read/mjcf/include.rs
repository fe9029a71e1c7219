//! `<include>`: the elements of another file take its place.

use std::path::{Path, PathBuf};

use crate::error::ImportError;
use crate::read::element::{Element, parse};
use crate::source::Source;

/// Largest number of files that include each other.
const MAX_DEPTH: usize = 32;

/// The root element of a file, each `<include file>` replaced by the children of that file's root.
///
/// # Errors
/// A file cannot be read, is no XML, or files include each other in a circle.
pub(crate) fn parse_with_includes(source: &Source, file: &Path) -> Result<Element, ImportError> {
    read(source, file, file, &mut Vec::new())
}

fn read(source: &Source, main: &Path, file: &Path, open: &mut Vec<PathBuf>) -> Result<Element, ImportError> {
    let at = source.display(file);
    if open.iter().any(|other| other == file) || open.len() >= MAX_DEPTH {
        return Err(ImportError::unreadable(at, "includes itself"));
    }
    open.push(file.to_owned());
    let text = source.text(file, "source")?;
    let mut root = parse(&at, &text).map_err(|problem| ImportError::unreadable(&at, problem))?;
    replace(&mut root, source, main, file, open)?;
    open.pop();
    Ok(root)
}

fn replace(
    element: &mut Element,
    source: &Source,
    main: &Path,
    file: &Path,
    open: &mut Vec<PathBuf>,
) -> Result<(), ImportError> {
    let mut children = Vec::with_capacity(element.children.len());
    for mut child in std::mem::take(&mut element.children) {
        if child.name == "include" {
            let wrong = |problem: String| {
                let problem = format!("line {}: <include>: {problem}", child.line);
                ImportError::unreadable(source.display(file), problem)
            };
            let name = child.get("file").ok_or_else(|| wrong("has no file".to_owned()))?;
            // MuJoCo looks beside the main file; some models expect the including file's folder.
            let found = source.resolve(main, name).or_else(|_| source.resolve(file, name)).map_err(wrong)?;
            children.extend(read(source, main, &found.path, open)?.children);
        } else {
            replace(&mut child, source, main, file, open)?;
            children.push(child);
        }
    }
    element.children = children;
    Ok(())
}
