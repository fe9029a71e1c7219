//! Debian's packages, where they are missing and can be installed.

use std::process::{Command, Stdio};

/// A command that says nothing.
pub(crate) fn quiet(program: impl AsRef<std::ffi::OsStr>) -> Command {
    let mut command = Command::new(program);
    command.stdout(Stdio::null()).stderr(Stdio::null()).stdin(Stdio::null());
    command
}

/// Installs a package. Needs Debian and root; says nothing when it fails.
pub(crate) fn install(package: &str) -> bool {
    println!("installing Debian's package {package}");
    let install = || {
        let mut apt = quiet("apt-get");
        apt.env("DEBIAN_FRONTEND", "noninteractive").args(["install", "--yes", package]);
        apt.status().is_ok_and(|status| status.success())
    };
    let updated = || quiet("apt-get").arg("update").status().is_ok_and(|status| status.success());
    install() || (updated() && install())
}

/// Whether the tests of the database can have a Postgres: installed already, or now.
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
