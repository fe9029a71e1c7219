//! Finds the `task.toml` and URDF files that name a mesh, in the folders above it.

use std::path::{Path, PathBuf};

use roxmltree::Node;

use super::files::{has_extension, read_limited};
use super::limits::Limits;
use super::report::Report;
use super::urdf::xml::document;

/// A reference to a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshUse {
    /// The `task.toml` or URDF.
    pub file: PathBuf,
    /// The task's own object, or the link.
    pub owner: String,
    /// The mesh's name in that file.
    pub name: String,
    /// Its scale in that file.
    pub scale: [f64; 3],
    /// Its position, m.
    pub at: [f64; 3],
    /// Its rotation, rad.
    pub rpy: [f64; 3],
    /// Kind of file.
    pub kind: UseKind,
}

/// A file that names meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UseKind {
    /// A part of `[[objects.own]]`.
    Task,
    /// A `<collision>`.
    Urdf,
}

/// Number of folders above a mesh that are searched.
const FOLDERS: usize = 4;

/// Every reference to this mesh, in the nearest folder above it that has one. Unreadable files are skipped:
/// playing them reports the error.
pub fn mesh_uses(mesh: &Path) -> Vec<MeshUse> {
    let Ok(mesh) = mesh.canonicalize() else { return Vec::new() };
    for folder in mesh.ancestors().skip(1).take(FOLDERS) {
        let Ok(entries) = folder.read_dir() else { continue };
        let mut files: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
        files.sort();
        let mut found = Vec::new();
        for file in files {
            let task = file.file_name().is_some_and(|name| name == "task.toml");
            if !task && !has_extension(&file, "urdf") {
                continue;
            }
            let limits = Limits::default();
            let Ok(bytes) = read_limited(&file, "file", limits.text_bytes) else { continue };
            let Ok(text) = String::from_utf8(bytes) else { continue };
            let same = |name: &str| folder.join(path_of(name)).canonicalize().is_ok_and(|real| real == mesh);
            let uses =
                if task { in_task(&file, &text, &same) } else { in_urdf(&file, &text, &limits, &same) };
            found.extend(uses.unwrap_or_default());
        }
        if !found.is_empty() {
            return found;
        }
    }
    Vec::new()
}

/// A mesh's path below the folder of the referring file.
fn path_of(name: &str) -> &str {
    match name.strip_prefix("package://") {
        Some(rest) => rest.split_once('/').map_or(rest, |(_, path)| path),
        None => name.strip_prefix("file://").unwrap_or(name),
    }
}

fn in_task(file: &Path, text: &str, same: &dyn Fn(&str) -> bool) -> Option<Vec<MeshUse>> {
    let task: toml::Table = text.parse().ok()?;
    let numbers = |part: &toml::Value, field: &str, default: [f64; 3]| {
        let list = part.get(field).and_then(toml::Value::as_array);
        let list: Option<Vec<f64>> = list.map(|list| {
            list.iter().filter_map(|x| x.as_float().or_else(|| x.as_integer().map(|n| n as f64))).collect()
        });
        list.and_then(|list| list.try_into().ok()).unwrap_or(default)
    };
    let mut uses = Vec::new();
    for own in task.get("objects")?.get("own")?.as_array()? {
        let owner = own.get("name").and_then(toml::Value::as_str).unwrap_or_default();
        for part in own.get("parts").and_then(toml::Value::as_array).into_iter().flatten() {
            let Some(name) = part.get("file").and_then(toml::Value::as_str).filter(|name| same(name)) else {
                continue;
            };
            uses.push(MeshUse {
                file: file.to_owned(),
                owner: owner.to_owned(),
                name: name.to_owned(),
                scale: numbers(part, "scale", [1.0; 3]),
                at: numbers(part, "at", [0.0; 3]),
                rpy: numbers(part, "rpy", [0.0; 3]),
                kind: UseKind::Task,
            });
        }
    }
    Some(uses)
}

fn in_urdf(file: &Path, text: &str, limits: &Limits, same: &dyn Fn(&str) -> bool) -> Option<Vec<MeshUse>> {
    let document = document(text, limits, &Report::new(file)).ok()?;
    let numbers = |node: Option<Node<'_, '_>>, field: &str, default: [f64; 3]| {
        let text = node.and_then(|node| node.attribute(field));
        let list: Option<Vec<f64>> =
            text.and_then(|text| text.split_whitespace().map(|x| x.parse().ok()).collect());
        list.and_then(|list| list.try_into().ok()).unwrap_or(default)
    };
    let mut uses = Vec::new();
    for mesh in document.descendants().filter(|node| node.has_tag_name("mesh")) {
        let collision = mesh.ancestors().find(|node| node.has_tag_name("collision"));
        let link = mesh.ancestors().find(|node| node.has_tag_name("link"));
        let (Some(collision), Some(link)) = (collision, link) else { continue };
        let Some(name) = mesh.attribute("filename").filter(|name| same(name)) else { continue };
        let origin = collision.children().find(|node| node.has_tag_name("origin"));
        uses.push(MeshUse {
            file: file.to_owned(),
            owner: link.attribute("name").unwrap_or_default().to_owned(),
            name: name.to_owned(),
            scale: numbers(Some(mesh), "scale", [1.0; 3]),
            at: numbers(origin, "xyz", [0.0; 3]),
            rpy: numbers(origin, "rpy", [0.0; 3]),
            kind: UseKind::Urdf,
        });
    }
    Some(uses)
}
