//! Lines for a task.toml or a URDF that replace a mesh by its pieces.

use super::owner::MeshOwner;
use palmares_models::read::{MeshUse, UseKind};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::Path;

/// A place that names the mesh, and its replacement.
#[derive(Debug, Serialize)]
pub(super) struct Place {
    /// The file to change, if one was found.
    file: Option<String>,
    /// Description of the object or link.
    pub(super) place: String,
    /// One line for each piece.
    pub(super) lines: Vec<String>,
    /// A further entry, and its place.
    pub(super) also: Option<String>,
}

/// All places that name the mesh; if there is none, a template.
pub(super) fn places(
    owner: MeshOwner,
    mesh: &Path,
    uses: &[MeshUse],
    scale: [f64; 3],
    folder: &str,
    pieces: &[String],
) -> Vec<Place> {
    if uses.is_empty() {
        let name = mesh.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let kind = match owner {
            MeshOwner::Task => UseKind::Task,
            MeshOwner::Hand => UseKind::Urdf,
        };
        let nowhere = MeshUse {
            file: mesh.to_owned(),
            owner: String::new(),
            name: name.to_owned(),
            scale,
            at: [0.0; 3],
            rpy: [0.0; 3],
            kind,
        };
        return vec![place(owner, &nowhere, scale, folder, pieces, false)];
    }
    uses.iter().map(|one| place(owner, one, scale, folder, pieces, true)).collect()
}

fn place(
    owner: MeshOwner,
    one: &MeshUse,
    scale: [f64; 3],
    folder: &str,
    pieces: &[String],
    found: bool,
) -> Place {
    let file = shown(&one.file);
    // The pieces are next to the mesh: only the last part of its name changes.
    let beside = one.name.rfind('/').map_or("", |k| &one.name[..=k]);
    let names = pieces.iter().map(|piece| format!("{beside}{folder}/{piece}"));
    let (name, owner_name) = (&one.name, &one.owner);
    match one.kind {
        UseKind::Task => Place {
            place: match found {
                true => format!(
                    "in {file}, objects.own `{owner_name}`: in `parts`, replace the part with file = {name:?}"
                ),
                false => format!(
                    "in the task.toml, [[objects.own]]: in `parts`; file names are relative to the folder of the task.toml, \
                     here that of {name}"
                ),
            },
            lines: names.map(|name| part(&name, one, scale)).collect(),
            also: None,
            file: found.then_some(file),
        },
        UseKind::Urdf => Place {
            place: match found {
                true => format!(
                    "in {file}, link '{owner_name}': replace the <collision> with filename=\"{}\"",
                    xml(name)
                ),
                false => format!(
                    "in the URDF, in the <link>; file names are relative to the folder of the URDF, here that of {name}"
                ),
            },
            lines: names.map(|name| collision(&name, one, scale)).collect(),
            also: Some(match (owner, found) {
                (MeshOwner::Hand, true) => {
                    format!("in hand.toml: [links.{owner_name:?}] mesh_rounding = 0.0")
                }
                (MeshOwner::Hand, false) => "in hand.toml, at the link: mesh_rounding = 0.0".to_owned(),
                (MeshOwner::Task, _) => "in the task.toml, next to `urdf`: mesh_rounding = 0.0".to_owned(),
            }),
            file: found.then_some(file),
        },
    }
}

/// A part of an object in a task.toml. Pieces have no rounding: it would leave a groove between two of them.
fn part(name: &str, one: &MeshUse, scale: [f64; 3]) -> String {
    let mut line = format!("{{ shape = \"mesh\", file = {name:?}, rounding = 0.0");
    for (field, value, default) in
        [("scale", scale, [1.0; 3]), ("at", one.at, [0.0; 3]), ("rpy", one.rpy, [0.0; 3])]
    {
        if value != default {
            let _ = write!(line, ", {field} = {value:?}");
        }
    }
    line + " },"
}

/// A collision element of a URDF.
fn collision(name: &str, one: &MeshUse, scale: [f64; 3]) -> String {
    let numbers = |value: [f64; 3]| value.map(|x| x.to_string()).join(" ");
    let (at, rpy) = (one.at != [0.0; 3], one.rpy != [0.0; 3]);
    let mut origin = String::new();
    if at || rpy {
        origin += "<origin";
        if at {
            let _ = write!(origin, " xyz=\"{}\"", numbers(one.at));
        }
        if rpy {
            let _ = write!(origin, " rpy=\"{}\"", numbers(one.rpy));
        }
        origin += "/>";
    }
    let scale = if scale == [1.0; 3] { String::new() } else { format!(" scale=\"{}\"", numbers(scale)) };
    let name = xml(name);
    format!("<collision>{origin}<geometry><mesh filename=\"{name}\"{scale}/></geometry></collision>")
}

/// A path relative to the current folder, if it is below it.
fn shown(file: &Path) -> String {
    let here = std::env::current_dir().and_then(|here| here.canonicalize());
    let below = here.ok().and_then(|here| file.strip_prefix(here).ok().map(Path::to_owned));
    below.as_deref().unwrap_or(file).display().to_string()
}

/// Escapes text for an attribute.
fn xml(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn used(kind: UseKind, name: &str) -> MeshUse {
        MeshUse {
            file: "/a/b".into(),
            owner: "mug".to_owned(),
            name: name.to_owned(),
            scale: [1e-3; 3],
            at: [0.0, 0.0, 0.01],
            rpy: [0.0; 3],
            kind,
        }
    }

    #[test]
    fn lines_keep_folder_scale_and_place() {
        let pieces = ["mug_01.stl".to_owned()];
        let one = used(UseKind::Task, "meshes/mug.stl");
        let [place] =
            &places(MeshOwner::Task, Path::new("mug.stl"), &[one], [1e-3; 3], "mug_pieces", &pieces)[..]
        else {
            panic!("one place")
        };
        assert_eq!(
            place.lines,
            [
                "{ shape = \"mesh\", file = \"meshes/mug_pieces/mug_01.stl\", rounding = 0.0, scale = [0.001, 0.001, 0.001], \
              at = [0.0, 0.0, 0.01] },"
            ]
        );
        let one = used(UseKind::Urdf, "package://hand/mug.stl");
        let [place] =
            &places(MeshOwner::Hand, Path::new("mug.stl"), &[one], [1e-3; 3], "mug_pieces", &pieces)[..]
        else {
            panic!("one place")
        };
        assert_eq!(
            place.lines,
            [
                "<collision><origin xyz=\"0 0 0.01\"/><geometry><mesh filename=\"package://hand/mug_pieces/mug_01.stl\" \
              scale=\"0.001 0.001 0.001\"/></geometry></collision>"
            ]
        );
        assert_eq!(place.also.as_deref(), Some("in hand.toml: [links.\"mug\"] mesh_rounding = 0.0"));
    }
}
