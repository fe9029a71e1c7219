//! Formats that are recognised and not read: what is in the file, and what to do.

use std::path::Path;

use super::element::{Element, parse};
use crate::glance::Glance;

/// Names that a message lists.
const SHOWN: usize = 6;

/// What a file of another program is, in words; none if it is not recognised.
pub(super) fn recognised(text: &str, file: &Glance<'_>) -> Option<String> {
    if text.starts_with("#usda") || text.starts_with("PXR-USDC") {
        return Some(
            "is USD, which is not read: import the URDF or MJCF that it was made of, or write one with the program that wrote this \
             file, such as Isaac Sim's URDF exporter"
                .to_owned(),
        );
    }
    let root = file.root.to_ascii_lowercase();
    let of_openrave = root == "environment" && text.to_ascii_lowercase().contains("<kinbody");
    if root != "world" && !of_openrave {
        return None;
    }
    let document = parse(Path::new(""), text).ok()?;
    if root == "world" {
        let objects = names(&document, "rigidobject");
        let terrains = names(&document, "terrain");
        return Some(format!(
            "is a world of Klamp't with {}, {} and {}: name the file of one robot; `palmares task import` makes a task of objects and terrains",
            listed("robots", &files(&document)),
            listed("objects", &objects),
            listed("terrains", &terrains)
        ));
    }
    let robots = [names(&document, "robot"), names(&document, "kinbody")].concat();
    Some(format!(
        "is an environment of OpenRAVE with {}: name the file of one robot, or write its <Robot> into a file of its own",
        listed("robots and kinbodies", &robots)
    ))
}

/// The robot's file of a Klamp't world that has one.
pub(super) fn robot_of_world(text: &str) -> Option<String> {
    let document = parse(Path::new(""), text).ok().filter(|document| document.name == "world")?;
    match files(&document).as_slice() {
        [one] => Some(one.clone()),
        _ => None,
    }
}

fn files(world: &Element) -> Vec<String> {
    world.all("robot").filter_map(|robot| robot.get("file")).map(str::to_owned).collect()
}

/// Names of all elements of this kind; OpenRAVE's names have no case.
fn names(element: &Element, kind: &str) -> Vec<String> {
    let inside = element.children.iter().flat_map(|child| names(child, kind));
    let own =
        element.name.eq_ignore_ascii_case(kind).then(|| element.get("name").map(str::to_owned)).flatten();
    own.into_iter().chain(inside).collect()
}

fn listed(what: &str, names: &[String]) -> String {
    let shown = names.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    let more = if names.len() > SHOWN { ", …" } else { "" };
    if names.is_empty() { format!("no {what}") } else { format!("{} {what} ({shown}{more})", names.len()) }
}
