//! The parts and their pages, as palmares-bench declares them.

use anyhow::{Context, Result};
use toml::{Table, Value};

const FILE: &str = "bench/src/record/pages.toml";

/// Pages that one command makes.
pub(super) struct DeclaredPart {
    /// Its name.
    pub name: String,
    /// The content of its pages.
    pub about: String,
    /// Usual time on two idle cores, where it has been seen.
    pub minutes: Option<f64>,
    /// Cases of palmares-bench that it plays.
    pub cases: Vec<String>,
    /// Their steps, ms, by commas; empty for those of a report.
    pub steps_ms: String,
    /// Its pages, from the root of the repository.
    pub pages: Vec<String>,
}

/// All parts, in the order in which they are made.
pub(super) fn parts() -> Result<Vec<DeclaredPart>> {
    let declared: Table = include_str!("../../../bench/src/record/pages.toml").parse().context(FILE)?;
    let parts =
        declared.get("part").and_then(Value::as_array).with_context(|| format!("{FILE}: no [[part]]"))?;
    parts.iter().map(part).collect()
}

fn part(declared: &Value) -> Result<DeclaredPart> {
    let text = |key: &str| declared.get(key).and_then(Value::as_str).map(str::to_owned);
    let name = text("name").with_context(|| format!("{FILE}: a part has no name"))?;
    let list = |key: &str| -> Vec<String> {
        let values = declared.get(key).and_then(Value::as_array).into_iter().flatten();
        values.filter_map(|value| value.as_str().map(str::to_owned)).collect()
    };
    let steps = declared.get("steps_ms").and_then(Value::as_array).into_iter().flatten();
    let steps: Vec<String> = steps.filter_map(Value::as_float).map(|step| step.to_string()).collect();
    Ok(DeclaredPart {
        about: text("about").unwrap_or_default(),
        minutes: declared.get("minutes").and_then(Value::as_float),
        cases: list("cases"),
        steps_ms: steps.join(","),
        pages: list("pages"),
        name,
    })
}
