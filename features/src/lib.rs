//! No code: `Cargo.toml` lists the features of dependencies on which the programs differ. cargo chooses features by the
//! packages of a command; without this list, `cargo xtask wheel` compiles geometry, physics and server again after
//! `cargo xtask demo`. A test of `palmares-tests` (`source`) finds what is missing here.
