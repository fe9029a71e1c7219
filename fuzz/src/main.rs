//! libFuzzer on the target that `PALMARES_FUZZ_TARGET` names. With `PALMARES_FUZZ_SEEDS` it writes the first inputs of the
//! target into that folder and ends. `cargo xtask fuzz` builds and runs it.

#![no_main]

use libfuzzer_sys::fuzz_target;
use palmares_fuzz::{FuzzTarget, TARGETS};
use std::sync::OnceLock;

static TARGET: OnceLock<FuzzTarget> = OnceLock::new();

fn prepare() {
    let name = std::env::var("PALMARES_FUZZ_TARGET").unwrap_or_default();
    let target = TARGETS.into_iter().find(|target| target.name == name);
    let target = target.expect("PALMARES_FUZZ_TARGET names a target");
    if let Some(folder) = std::env::var_os("PALMARES_FUZZ_SEEDS") {
        for (name, input) in (target.seeds)() {
            std::fs::write(std::path::Path::new(&folder).join(name), input)
                .expect("the folder can be written");
        }
        std::process::exit(0);
    }
    TARGET.get_or_init(|| target);
}

fuzz_target!(init: prepare(), |data: &[u8]| {
    if let Some(target) = TARGET.get() {
        (target.run)(data);
    }
});
