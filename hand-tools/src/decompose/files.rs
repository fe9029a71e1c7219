//! The folder next to a mesh with its pieces.

use anyhow::{Context, bail};
use std::fs;
use std::path::{Path, PathBuf};

/// `mug_pieces` next to `mug.stl`, with `mug_01.stl` and so on.
pub(super) struct Folder {
    path: PathBuf,
    name: String,
    mesh_name: String,
    stem: String,
}

impl Folder {
    /// The folder of this mesh.
    pub(super) fn beside(mesh: &Path) -> anyhow::Result<Folder> {
        let text = |part: Option<&std::ffi::OsStr>| part.and_then(|part| part.to_str()).map(str::to_owned);
        let (Some(mesh_name), Some(stem)) = (text(mesh.file_name()), text(mesh.file_stem())) else {
            bail!("{}: its pieces are named after the mesh, whose name is not UTF-8", mesh.display());
        };
        let name = format!("{stem}_pieces");
        Ok(Folder { path: mesh.with_file_name(&name), name, mesh_name, stem })
    }

    /// Refuses an existing folder, unless `force` is set.
    pub(super) fn check(&self, force: bool) -> anyhow::Result<()> {
        if self.path.exists() && !self.path.is_dir() {
            bail!("{} exists and is not a folder; nothing was written", self.path.display());
        }
        if !force && self.path.exists() {
            bail!("{} exists; nothing was written (--force replaces the pieces in it)", self.path.display());
        }
        Ok(())
    }

    /// Names of `count` pieces.
    pub(super) fn names(&self, count: usize) -> Vec<String> {
        (1..=count).map(|k| format!("{}_{k:02}.stl", self.stem)).collect()
    }

    /// Whether a file of this name is a piece.
    fn is_piece(&self, name: &str) -> bool {
        let number = name.strip_prefix(&self.stem).and_then(|rest| rest.strip_prefix('_'));
        let number = number.and_then(|rest| rest.strip_suffix(".stl"));
        number.is_some_and(|number| number.len() == 2 && number.bytes().all(|b| b.is_ascii_digit()))
    }

    /// Writes the pieces, and removes earlier ones.
    pub(super) fn write(&self, files: &[(String, Vec<u8>)]) -> anyhow::Result<()> {
        fs::create_dir_all(&self.path).with_context(|| format!("cannot make {}", self.path.display()))?;
        let failed = |path: &Path| format!("cannot write {}", path.display());
        for entry in fs::read_dir(&self.path).with_context(|| failed(&self.path))? {
            let path = entry.with_context(|| failed(&self.path))?.path();
            if path.file_name().and_then(|name| name.to_str()).is_some_and(|name| self.is_piece(name)) {
                fs::remove_file(&path).with_context(|| failed(&path))?;
            }
        }
        for (name, bytes) in files {
            let path = self.path.join(name);
            fs::write(&path, bytes).with_context(|| failed(&path))?;
        }
        Ok(())
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn mesh_name(&self) -> &str {
        &self.mesh_name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn earlier_pieces_are_removed_and_other_files_stay() {
        let place = std::env::temp_dir().join(format!("palmares-pieces-{}", std::process::id()));
        fs::create_dir_all(&place).expect("made");
        let folder = Folder::beside(&place.join("mug.stl")).expect("a name");
        folder.check(false).expect("nothing is there");
        let files = |count: usize| -> Vec<(String, Vec<u8>)> {
            folder.names(count).into_iter().map(|name| (name, vec![0])).collect()
        };
        folder.write(&files(3)).expect("written");
        fs::write(place.join("mug_pieces/mug_handle.stl"), "mine").expect("written");
        let error = folder.check(false).expect_err("they are there").to_string();
        assert!(error.contains("mug_pieces exists") && error.contains("--force"), "{error}");
        folder.check(true).expect("allowed");
        folder.write(&files(1)).expect("written");
        let mut left: Vec<_> = fs::read_dir(folder.path())
            .expect("there")
            .map(|entry| entry.expect("there").file_name().into_string().expect("UTF-8"))
            .collect();
        left.sort();
        assert_eq!(left, ["mug_01.stl", "mug_handle.stl"]);
        fs::remove_dir_all(&place).expect("removed");
    }
}
