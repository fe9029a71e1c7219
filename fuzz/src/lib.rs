//! Fuzz targets: the readers of bytes that may come from anybody.
//!
//! A target takes any bytes and must not panic, hang or take much memory; it also checks what must hold for every input. The
//! tests run it on the kept corpus and on a fixed number of changed inputs. `cargo xtask fuzz` runs it under libFuzzer, which
//! looks for inputs that reach new code.

mod backup;
mod competition;
mod control;
mod hand;
mod import;
mod mesh;
pub mod mutate;
mod parts;
mod replay;
mod task;
mod upload;
mod watch;

use parts::Seeds;

/// A reader of bytes from outside.
#[derive(Clone, Copy)]
pub struct FuzzTarget {
    /// Its name, also of its corpus.
    pub name: &'static str,
    /// Reads the bytes; whether they are valid. It panics if it finds a fault.
    pub run: fn(&[u8]) -> bool,
    /// The first inputs, from files of the project. They are valid.
    pub seeds: fn() -> Seeds,
    /// Changed inputs in a test.
    pub tries: u32,
}

/// All targets.
pub const TARGETS: [FuzzTarget; 10] = [
    FuzzTarget { name: "control", run: control::run, seeds: control::seeds, tries: 20_000 },
    FuzzTarget { name: "watch", run: watch::run, seeds: watch::seeds, tries: 20_000 },
    FuzzTarget { name: "hand", run: hand::run, seeds: hand::seeds, tries: 300 },
    FuzzTarget { name: "import", run: import::run, seeds: import::seeds, tries: 300 },
    FuzzTarget { name: "mesh", run: mesh::run, seeds: mesh::seeds, tries: 300 },
    FuzzTarget { name: "upload", run: upload::run, seeds: upload::seeds, tries: 300 },
    FuzzTarget { name: "task", run: task::run, seeds: task::seeds, tries: 300 },
    FuzzTarget { name: "competition", run: competition::run, seeds: competition::seeds, tries: 3_000 },
    FuzzTarget { name: "replay", run: replay::run, seeds: replay::seeds, tries: 1_000 },
    FuzzTarget { name: "backup", run: backup::run, seeds: backup::seeds, tries: 500 },
];
