//! The space in the file system of a folder.

use std::io;
use std::path::Path;

/// The space in a file system.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Space {
    /// Free bytes, without those that only root may use.
    pub free_bytes: u64,
    /// All bytes.
    pub size_bytes: u64,
}

/// The space in the file system of a folder.
pub fn space(folder: &Path) -> io::Result<Space> {
    let system = rustix::fs::statvfs(folder)?;
    let bytes = |blocks: u64| blocks.saturating_mul(system.f_frsize);
    Ok(Space { free_bytes: bytes(system.f_bavail), size_bytes: bytes(system.f_blocks) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_the_space_of_its_file_system() {
        let folder = tempfile::tempdir().expect("folder");
        let Space { free_bytes, size_bytes } = space(folder.path()).expect("space");
        assert!(0 < free_bytes && free_bytes <= size_bytes, "{free_bytes} of {size_bytes} bytes");
        assert!(space(&folder.path().join("nowhere")).is_err());
    }
}
