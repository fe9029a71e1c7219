//! Installs Debian packages that are missing.

use crate::python::succeeds;
use std::process::Command;

/// Installs a package. This needs Debian and root; a failure prints nothing.
pub(crate) fn install(package: &str) -> bool {
    println!("installing Debian's package {package}");
    let install = || {
        let mut apt = Command::new("apt-get");
        succeeds(apt.env("DEBIAN_FRONTEND", "noninteractive").args(["install", "--yes", package]))
    };
    let updated = || succeeds(Command::new("apt-get").arg("update"));
    install() || (updated() && install())
}

/// A Chromium for the tests of the pages, installed if it is missing.
pub(crate) fn chromium() -> Option<&'static str> {
    let there = || {
        let usual = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
        usual.into_iter().find(|path| std::path::Path::new(path).is_file())
    };
    there().or_else(|| install("chromium").then(there).flatten())
}

/// Whether there is a Postgres for the tests of the database, installed if it is missing.
pub(crate) fn postgres() -> bool {
    let there = || {
        let servers = std::fs::read_dir("/usr/lib/postgresql").into_iter().flatten().flatten();
        servers
            .map(|entry| entry.path())
            .chain(["/usr/local".into(), "/usr".into()])
            .any(|folder| folder.join("bin/initdb").is_file() && folder.join("bin/postgres").is_file())
    };
    there() || (install("postgresql") && there())
}

/// Whether there is an OSMesa, by which MuJoCo draws without a screen, installed if it is missing.
pub(crate) fn osmesa() -> bool {
    let there = || {
        let libraries = Command::new("ldconfig").arg("-p").output();
        libraries.is_ok_and(|list| String::from_utf8_lossy(&list.stdout).contains("libOSMesa.so"))
    };
    there() || (install("libosmesa6") && there())
}
