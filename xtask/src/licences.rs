//! The licences of all parts of the program: crates, and the pages' packages.

use crate::cargo::cargo;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

const LINE: &str = "--------------------------------------------------------------------------------";

/// One text: each licence once, after the names of its packages.
pub(crate) fn third_party() -> Result<String> {
    let mut by_text: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut add = |name: String, licence: &str, folder: &Path| -> Result<()> {
        let texts = texts(folder)?;
        if texts.is_empty() {
            by_text
                .entry(format!("{licence} (the package brings no text)"))
                .or_default()
                .insert(name.clone());
        }
        for text in texts {
            by_text.entry(text).or_default().insert(name.clone());
        }
        Ok(())
    };
    for package in crates()? {
        let folder = package["manifest_path"].as_str().map(Path::new).and_then(Path::parent);
        let name = format!("{} {}", text(&package["name"]), text(&package["version"]));
        add(name, text(&package["license"]), folder.context("cargo metadata: a package without a folder")?)?;
    }
    let viewer = workspace::root().join("viewer");
    let lock = std::fs::read(viewer.join("package-lock.json")).context("viewer/package-lock.json")?;
    let lock: Value = serde_json::from_slice(&lock).context("viewer/package-lock.json")?;
    let packages = lock["packages"].as_object().context("viewer/package-lock.json: no `packages`")?;
    // The root has no name; packages that only build the pages are not part of them.
    for (path, package) in
        packages.iter().filter(|(path, package)| !path.is_empty() && package["dev"] != true)
    {
        let name = path.rsplit_once("node_modules/").map_or(path.as_str(), |(_, name)| name);
        let folder = viewer.join(path);
        // Optional packages for other systems are not installed.
        if folder.is_dir() {
            add(format!("{name} {}", text(&package["version"])), text(&package["license"]), &folder)?;
        }
    }
    let mut out =
        String::from("Palmares contains the following packages, each under the licence after its name.\n");
    for (licence, names) in &by_text {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        write!(out, "\n{LINE}\n{}\n{LINE}\n\n{}\n", names.join(", "), licence.trim())?;
    }
    Ok(out)
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

/// The crates of others that the program and the Python module link on Linux.
fn crates() -> Result<Vec<Value>> {
    let mut metadata = cargo();
    metadata.args(["metadata", "--format-version", "1", "--locked", "--filter-platform", "host-tuple"]);
    let output = metadata.output().context("cannot start cargo")?;
    ensure!(output.status.success(), "cargo metadata: {}", String::from_utf8_lossy(&output.stderr));
    let all: Value = serde_json::from_slice(&output.stdout).context("cargo metadata")?;
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let nodes: BTreeMap<String, Value> =
        list(&all["resolve"]["nodes"]).into_iter().map(|node| (text(&node["id"]).to_owned(), node)).collect();
    let own = ["palmares", "palmares-native"];
    let packages = list(&all["packages"]);
    let mut waiting: Vec<String> = packages
        .iter()
        .filter(|package| own.contains(&text(&package["name"])) && package["source"].is_null())
        .map(|package| text(&package["id"]).to_owned())
        .collect();
    let mut linked = BTreeSet::new();
    while let Some(id) = waiting.pop() {
        if !linked.insert(id.clone()) {
            continue;
        }
        for needed in nodes.get(&id).map(|node| list(&node["deps"])).unwrap_or_default() {
            // `kind` of a dependency that is linked is null; others are `build` and `dev`.
            if list(&needed["dep_kinds"]).iter().any(|kind| kind["kind"].is_null()) {
                waiting.push(text(&needed["pkg"]).to_owned());
            }
        }
    }
    let of_others = |package: &Value| !package["source"].is_null() && linked.contains(text(&package["id"]));
    Ok(packages.into_iter().filter(of_others).collect())
}

/// The texts of licences in a package's folder.
fn texts(folder: &Path) -> Result<BTreeSet<String>> {
    let mut found = BTreeSet::new();
    for entry in std::fs::read_dir(folder).with_context(|| format!("{}", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().to_uppercase()).unwrap_or_default();
        let licence = ["LICENSE", "LICENCE", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE"];
        if path.is_file() && licence.iter().any(|start| name.starts_with(start)) {
            found.insert(
                String::from_utf8_lossy(&std::fs::read(&path)?).replace("\r\n", "\n").trim().to_owned(),
            );
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    #[test]
    fn licences_of_linked_crates_are_found() {
        let crates = super::crates().expect("sound");
        let names: Vec<&str> = crates.iter().filter_map(|package| package["name"].as_str()).collect();
        assert!(names.contains(&"parry3d-f64") && names.contains(&"pyo3"), "{names:?}");
        // For tests only.
        assert!(!names.contains(&"proptest") && !names.contains(&"palmares-sim"), "{names:?}");
    }
}
