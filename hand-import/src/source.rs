//! The files of a description: a folder, a ZIP archive, or a file with the package around it. A path never leads outside.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use palmares_models::error::ModelError;
use palmares_models::read::{Files, Limits, read_limited};

use crate::error::ImportError;

/// Files of a source; published packages of whole robots have some thousands.
const MAX_FILES: usize = 20_000;
/// Nested folders of a source.
const MAX_DEPTH: usize = 16;
/// Folders above a file in which its package is searched.
const MAX_UP: usize = 6;
/// Bytes of a description: the largest published MJCF and SDF files have about a megabyte.
const TEXT_BYTES: u64 = 8 << 20;
/// Bytes of a mesh file; text formats need several times what a binary STL needs.
const MESH_BYTES: u64 = 128 << 20;

/// The limits of a source: more than those of a hand, as whole packages are larger.
pub fn limits() -> Limits {
    Limits {
        text_bytes: TEXT_BYTES,
        mesh_bytes: MESH_BYTES,
        archive_bytes: 256 << 20,
        archive_entries: MAX_FILES,
        archive_unpacked_bytes: 512 << 20,
        mesh_vertices: 6_000_000,
        ..Limits::default()
    }
}

/// The files of a source.
#[derive(Clone, Debug)]
pub struct Source {
    files: Files,
    /// Paths of all its files, ascending.
    paths: Vec<PathBuf>,
    /// Folders of ROS packages by name.
    packages: BTreeMap<String, PathBuf>,
    named: Option<PathBuf>,
}

/// A file that a description names, in the source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Its path in the source.
    pub path: PathBuf,
    /// How it was found, if not at the named place.
    pub note: Option<String>,
}

impl Source {
    /// Opens a folder, an archive or a file. The source of a file is its ROS package, or its folder.
    ///
    /// # Errors
    /// It cannot be read or has too many files.
    pub fn open(path: &Path) -> Result<Source, ImportError> {
        let limits = limits();
        if path.is_dir() {
            return Source::folder(path, None);
        }
        let zip = path.extension().is_some_and(|kind| kind.eq_ignore_ascii_case("zip"));
        if zip && path.is_file() {
            let bytes = read_limited(path, "archive", limits.archive_bytes)?;
            let files = Files::archive_with(path, &bytes, &limits, |path| !hidden(path))?;
            let Files::Archive { entries, .. } = &files else {
                return Err(ImportError::unreadable(path, "is no archive"));
            };
            let paths = entries.keys().cloned().collect();
            return Source::new(files, paths, None);
        }
        let real = path.canonicalize().map_err(|error| ModelError::Read { file: path.to_owned(), error })?;
        let folder = real.parent().unwrap_or(Path::new("/"));
        let root = package_above(folder).unwrap_or_else(|| beside(folder).to_owned());
        let named = real.strip_prefix(&root).map(Path::to_owned).unwrap_or_else(|_| real.clone());
        Source::folder(&root, Some(named))
    }

    /// A source whose files are in memory; `name` is its path in messages.
    ///
    /// # Errors
    /// As [`Source::open`].
    pub fn memory(name: &Path, entries: BTreeMap<PathBuf, Vec<u8>>) -> Result<Source, ImportError> {
        let paths = entries.keys().cloned().collect();
        let files = Files::Archive { file: name.to_owned(), folder: PathBuf::new(), entries };
        Source::new(files, paths, None)
    }

    fn folder(root: &Path, named: Option<PathBuf>) -> Result<Source, ImportError> {
        let mut paths = Vec::new();
        let mut open = vec![(PathBuf::new(), 0)];
        while let Some((folder, depth)) = open.pop() {
            let place = root.join(&folder);
            let failed = |error| ModelError::Read { file: place.clone(), error };
            for entry in std::fs::read_dir(&place).map_err(failed)? {
                let entry = entry.map_err(failed)?;
                let path = folder.join(entry.file_name());
                let kind = entry.file_type().map_err(failed)?;
                if hidden(&path) || depth >= MAX_DEPTH {
                    continue;
                }
                if kind.is_dir() {
                    open.push((path, depth + 1));
                } else {
                    paths.push(path);
                }
                if paths.len() > MAX_FILES {
                    let problem =
                        format!("has more than {MAX_FILES} files; name the robot's own folder or file");
                    return Err(ImportError::unreadable(root, problem));
                }
            }
        }
        paths.sort();
        Source::new(Files::Folder(root.to_owned()), paths, named)
    }

    fn new(files: Files, paths: Vec<PathBuf>, named: Option<PathBuf>) -> Result<Source, ImportError> {
        let mut source = Source { files, paths, packages: BTreeMap::new(), named };
        for path in source.paths.clone() {
            if path.file_name().is_some_and(|name| name == "package.xml") {
                let folder = path.parent().unwrap_or(Path::new("")).to_owned();
                let name = source.text(&path, "package").ok().and_then(|text| package_name(&text));
                let own = folder.file_name().map(|name| name.to_string_lossy().into_owned());
                for name in [name, own].into_iter().flatten() {
                    source.packages.entry(name).or_insert_with(|| folder.clone());
                }
            }
        }
        Ok(source)
    }

    /// The folder or the archive.
    pub fn root(&self) -> &Path {
        self.files.path()
    }

    /// Folders of the ROS packages in it, by name; absolute for a folder on disk.
    pub fn packages(&self) -> impl Iterator<Item = (&str, PathBuf)> {
        self.packages.iter().map(|(name, folder)| (name.as_str(), self.root().join(folder)))
    }

    /// Name of a file in messages.
    pub fn display(&self, path: &Path) -> PathBuf {
        self.files.display(path)
    }

    /// Paths of all files, ascending.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// A file's bytes; `element` names it.
    ///
    /// # Errors
    /// It is not there, leads outside or is too large.
    pub fn bytes(&self, path: &Path, element: &str, limit: u64) -> Result<Vec<u8>, ModelError> {
        self.files.read(path, element, limit)
    }

    /// A file's text. Bytes that are no UTF-8 become replacement characters: they occur in comments.
    ///
    /// # Errors
    /// As [`Source::bytes`].
    pub fn text(&self, path: &Path, element: &str) -> Result<String, ModelError> {
        let bytes = self.bytes(path, element, TEXT_BYTES)?;
        if let Some(text) = utf16(&bytes) {
            return Ok(text);
        }
        Ok(String::from_utf8_lossy(&bytes).trim_start_matches('\u{feff}').to_owned())
    }

    /// The description that the caller named, if it is a file.
    pub fn named(&self) -> Option<&Path> {
        self.named.as_deref()
    }

    /// The file that a description at `from` calls `name`: a relative path, `package://…`, `model://…`, `file://…`.
    ///
    /// # Errors
    /// The reason why there is no such file in the source.
    pub fn resolve(&self, from: &Path, name: &str) -> Result<Found, String> {
        let found = self.resolve_as_written(from, name);
        match percent_decoded(name) {
            Some(decoded) if found.is_err() => self.resolve_as_written(from, &decoded).or(found),
            _ => found,
        }
    }

    fn resolve_as_written(&self, from: &Path, name: &str) -> Result<Found, String> {
        let name = name.trim().replace('\\', "/");
        let folder = from.parent().unwrap_or(Path::new(""));
        let mut tried = Vec::new();
        let rest = match ["package://", "model://"].iter().find_map(|scheme| name.strip_prefix(scheme)) {
            Some(rest) => {
                let (package, rest) = rest.split_once('/').unwrap_or(("", rest));
                if let Some(folder) = self.packages.get(package) {
                    tried.push(folder.join(rest));
                }
                tried.push(PathBuf::from(package).join(rest));
                tried.push(PathBuf::from(rest));
                rest
            }
            None => {
                let plain = name.strip_prefix("file://").unwrap_or(&name);
                // An absolute path of this machine that leads into the source.
                tried.extend(Path::new(plain).strip_prefix(self.root()).ok().map(Path::to_owned));
                tried.push(folder.join(plain));
                tried.push(PathBuf::from(plain));
                plain
            }
        };
        let there = |path: &PathBuf| self.paths.binary_search(path).is_ok();
        if let Some(path) = tried.iter().filter_map(|path| within(path)).find(there) {
            return Ok(Found { path, note: None });
        }
        // Exports keep paths of the machine that wrote them: the longest end of the path that one file has.
        let parts: Vec<&str> =
            rest.split('/').filter(|part| !part.is_empty() && *part != "." && *part != "..").collect();
        for first in 0..parts.len() {
            let end: PathBuf = parts[first..].iter().collect();
            let ends: Vec<&PathBuf> = self.paths.iter().filter(|path| ends_with(path, &end)).collect();
            match ends.as_slice() {
                [] => {}
                [one] => {
                    let note = format!("'{name}' is not at that place; taken is {}", one.display());
                    return Ok(Found { path: (*one).clone(), note: Some(note) });
                }
                several => {
                    let names: Vec<String> =
                        several.iter().take(4).map(|p| p.display().to_string()).collect();
                    return Err(format!("'{name}' fits {} files: {}", several.len(), names.join(", ")));
                }
            }
        }
        Err(format!(
            "'{name}' is not in {}; name the folder that holds it as the source",
            self.root().display()
        ))
    }
}

/// Text of UTF-16 with its mark, as some Windows programs write it.
fn utf16(bytes: &[u8]) -> Option<String> {
    let word: fn([u8; 2]) -> u16 = match bytes.get(..2)? {
        [0xff, 0xfe] => u16::from_le_bytes,
        [0xfe, 0xff] => u16::from_be_bytes,
        _ => return None,
    };
    let words = bytes[2..].chunks_exact(2).map(|pair| word([pair[0], pair[1]]));
    // Its declaration names an encoding that the text no longer has; parsers do not look at it.
    Some(char::decode_utf16(words).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect())
}

/// A path of a URI with `%20` and the like as what they stand for.
fn percent_decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        let code = (*first == b'%').then(|| after.get(..2)).flatten();
        let code = code.and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    String::from_utf8(bytes).ok().filter(|decoded| decoded != text)
}

fn ends_with(path: &Path, end: &Path) -> bool {
    let lower = |path: &Path| path.to_string_lossy().to_lowercase();
    Path::new(&lower(path)).ends_with(lower(end))
}

/// The path without `.` and `..`, or `None` if it leads out.
fn within(path: &Path) -> Option<PathBuf> {
    let mut out = PathBuf::new();
    for component in path.components() {
        match component {
            Component::Normal(part) => out.push(part),
            Component::CurDir => {}
            Component::ParentDir => {
                if !out.pop() {
                    return None;
                }
            }
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(out)
}

fn hidden(path: &Path) -> bool {
    path.components().any(|part| part.as_os_str().to_string_lossy().starts_with('.'))
}

/// The nearest folder at or above this one with a `package.xml`.
fn package_above(folder: &Path) -> Option<PathBuf> {
    let found = folder.ancestors().take(MAX_UP).find(|folder| folder.join("package.xml").is_file());
    found.map(Path::to_owned)
}

/// The folder, or the one above if this one only has descriptions and its neighbours have the meshes.
fn beside(folder: &Path) -> &Path {
    const ONLY_DESCRIPTIONS: [&str; 8] =
        ["urdf", "robots", "xacro", "xml", "mjcf", "sdf", "model", "description"];
    let name = folder.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
    match folder.parent() {
        Some(above) if ONLY_DESCRIPTIONS.contains(&name.as_str()) => above,
        _ => folder,
    }
}

fn package_name(text: &str) -> Option<String> {
    let (_, rest) = text.split_once("<name>")?;
    let name = rest.split_once("</name>")?.0.trim();
    (!name.is_empty()).then(|| name.to_owned())
}
