//! Every target on its kept corpus, and on changed inputs, the same ones in every run.

use palmares_fuzz::mutate::{Source, changed};
use palmares_fuzz::{FuzzTarget, TARGETS};
use std::fs;
use std::panic::{catch_unwind, set_hook, take_hook};
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

/// Panics of this process, also those that a reader catches.
static PANICS: AtomicU32 = AtomicU32::new(0);

/// The kept inputs of a target, by name.
fn corpus(target: &FuzzTarget) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target.name);
    let entries =
        fs::read_dir(folder).expect("every target has a corpus").map(|entry| entry.expect("an entry"));
    let read = |path: &Path| fs::read(path).expect("an input");
    let mut inputs: Vec<(String, Vec<u8>)> = entries
        .map(|entry| (entry.file_name().to_string_lossy().into_owned(), read(&entry.path())))
        .collect();
    inputs.sort();
    inputs
}

/// Runs a target; whether the input is valid. An input that makes it fail is kept for the one who mends it.
fn run(target: &FuzzTarget, name: &str, input: &[u8]) -> bool {
    let before = PANICS.load(Ordering::SeqCst);
    let result = catch_unwind(|| (target.run)(input));
    if let Ok(valid) = result
        && PANICS.load(Ordering::SeqCst) == before
    {
        return valid;
    }
    let file = std::env::temp_dir().join(format!("palmares-fuzz-{}", target.name));
    fs::write(&file, input).expect("the input is kept");
    panic!("target {}, input {name}: it failed on the bytes in {}", target.name, file.display());
}

#[test]
fn no_input_makes_a_reader_fail() {
    let usual = take_hook();
    set_hook(Box::new(move |panic| {
        PANICS.fetch_add(1, Ordering::SeqCst);
        usual(panic);
    }));
    for target in &TARGETS {
        let seeds = (target.seeds)();
        for (name, input) in &seeds {
            assert!(run(target, name, input), "the first input {name} of {} is not valid", target.name);
        }
        let mut inputs = corpus(target);
        for (name, input) in &inputs {
            run(target, name, input);
        }
        inputs.extend(seeds);
        let mut source = Source::new(1);
        for k in 0..target.tries {
            let (_, input) = &inputs[source.below(inputs.len())];
            let (_, other) = &inputs[source.below(inputs.len())];
            run(target, &format!("change {k}"), &changed(input, other, &mut source));
        }
    }
}
