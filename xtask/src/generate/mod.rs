//! `cargo xtask generate`: the files that are derived from the Rust types of messages and HTTP bodies.
//!
//! The program writes JSON Schema and OpenAPI into docs/schema; the types of Python and TypeScript are derived from
//! these. A test of the program compares docs/schema with the Rust types, a test here the other files with docs/schema.

mod python;
mod schema;
mod typescript;

use crate::cargo::build;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use schema::Types;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Names of the files in docs/schema, and arguments of `palmares schema`.
const SCHEMAS: [&str; 4] = ["control", "watch", "openapi", "replay"];

/// Writes all generated files.
pub(crate) fn run(program: &Path) -> Result<()> {
    let root = workspace::root();
    for name in SCHEMAS {
        let output = Command::new(program).args(["schema", name]).output();
        let output = output.with_context(|| format!("cannot start {}", program.display()))?;
        let error = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "palmares schema {name}: {error}");
        write(&root.join(format!("docs/schema/{name}.json")), &String::from_utf8(output.stdout)?)?;
    }
    derived(&root)?.iter().try_for_each(|(path, text)| write(&root.join(path), text))?;
    let pages = Command::new(build("palmares-bench", false)?).args(["pages", "--write"]).status();
    ensure!(
        pages.context("cannot start palmares-bench")?.success(),
        "docs/pages-of-record.md is not written"
    );
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<()> {
    fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))?;
    println!("{}", path.display());
    Ok(())
}

/// Path and text of each file that is derived from docs/schema.
fn derived(root: &Path) -> Result<[(&'static str, String); 3]> {
    let read = |name: &str| -> Result<Value> {
        let path = root.join(format!("docs/schema/{name}.json"));
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        serde_json::from_str(&text).with_context(|| path.display().to_string())
    };
    let [control, watch, openapi, replay] = SCHEMAS.map(read);
    let replay = replay?;
    let types = Types::of(&control?, &watch?, &openapi?, &replay)?;
    Ok([
        ("client-py/src/palmares/wire.py", python::module(&types)?),
        ("viewer/src/wire/messages.ts", typescript::module(&types)),
        ("viewer/src/wire/telemetry.ts", typescript::protobuf(&replay)?),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn python_and_typescript_have_the_types_of_docs_schema() {
        let root = workspace::root();
        for (path, text) in derived(&root).expect("docs/schema is readable") {
            let committed = fs::read_to_string(root.join(path)).unwrap_or_default();
            let line = committed.lines().zip(text.lines()).take_while(|(a, b)| a == b).count() + 1;
            assert!(committed == text, "{path}:{line} is out of date: run `cargo xtask generate`");
        }
    }
}
