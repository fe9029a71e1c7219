//! A small file system in memory, which a test fills.

use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// The file system. It is unmounted in the end.
pub(crate) struct SmallDisk {
    place: TempDir,
}

impl SmallDisk {
    /// Mounts one; none where this account may not, with the reason printed.
    pub(crate) fn mount(megabytes: u32) -> Option<Self> {
        let place = TempDir::new().expect("temporary directory");
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &format!("size={megabytes}m,mode=1777"), "palmares-test"]);
        let mounted = mount.arg(place.path()).stdin(Stdio::null()).output();
        match mounted {
            Ok(output) if output.status.success() => Some(SmallDisk { place }),
            Ok(output) => {
                println!("SKIP a full disk: {}", String::from_utf8_lossy(&output.stderr).trim());
                None
            }
            Err(error) => {
                println!("SKIP a full disk: mount: {error}");
                None
            }
        }
    }

    pub(crate) fn path(&self) -> &Path {
        self.place.path()
    }

    fn filler(&self) -> PathBuf {
        self.place.path().join("filler")
    }

    /// Takes every free byte.
    pub(crate) fn fill(&self) {
        let mut filler = File::options().create(true).append(true).open(self.filler()).expect("a file");
        for block in [1 << 20, 4096, 1] {
            let bytes = vec![0x5a; block];
            while match filler.write_all(&bytes) {
                Ok(()) => true,
                Err(error) if error.kind() == ErrorKind::StorageFull => false,
                Err(error) => panic!("the disk cannot be filled: {error}"),
            } {}
        }
    }

    /// Gives all that back.
    pub(crate) fn free(&self) {
        fs::remove_file(self.filler()).expect("removed");
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        // Lazily: a server that a failed test has left may still use it.
        let _ = Command::new("umount").arg("-l").arg(self.place.path()).status();
    }
}
