//! The inertias of links as the hand has them: `hand.toml` may take them from the shapes, and other programs read the URDF alone.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use palmares_models::read::{Files, LoadOptions, from_text};
use palmares_models::shape::inertia::Inertia;
use palmares_models::{Pose, Rotation};

use crate::complete::Complete;
use crate::draft::{Inertial, Origin};

/// Replaces the inertia of each link in the draft by the one that the written files give it.
pub(super) fn own(hand: &mut Complete, written: &BTreeMap<PathBuf, Vec<u8>>) {
    let text = |name: &str| {
        written
            .get(Path::new(name))
            .map(|bytes| String::from_utf8_lossy(bytes).into_owned())
            .unwrap_or_default()
    };
    let (urdf, settings) = (text("hand.urdf"), text("hand.toml"));
    let Ok(document) = roxmltree::Document::parse(&urdf) else { return };
    let settings: toml::Table = settings.parse().unwrap_or_default();
    let files = Files::Archive { file: PathBuf::new(), folder: PathBuf::new(), entries: written.clone() };
    for node in document.root_element().children().filter(|node| node.has_tag_name("link")) {
        let name = node.attribute("name").unwrap_or_default();
        let Some(link) = hand.draft.links.iter_mut().find(|link| link.name == name) else { continue };
        let stated = link.inertial.filter(|inertial| inertial.mass > 0.0);
        let alone = format!("<robot name=\"one\">{}</robot>", &urdf[node.range()]);
        if let Some(found) = stated.and_then(|_| of_link(&alone, &of_one(&settings, name), &files)) {
            link.inertial = Some(inertial(&found));
        }
    }
}

/// The settings that count for the inertia of this link.
fn of_one(settings: &toml::Table, link: &str) -> String {
    let mut own = toml::Table::new();
    if let Some(policy) = settings.get("inertia") {
        own.insert("inertia".to_owned(), policy.clone());
    }
    if let Some(table) = settings.get("links").and_then(|links| links.get(link)) {
        let links = toml::Table::from_iter([(link.to_owned(), table.clone())]);
        own.insert("links".to_owned(), toml::Value::Table(links));
    }
    own.to_string()
}

/// The inertia of the only link of a robot.
fn of_link(urdf: &str, settings: &str, files: &Files) -> Option<Inertia> {
    let (urdf, settings) = ((Path::new("hand.urdf"), urdf), (Path::new("hand.toml"), settings));
    let loaded = from_text(urdf, Some(settings), Some(files), &LoadOptions::default()).ok()?;
    loaded.hand.links.first().map(|link| link.inertia)
}

fn inertial(of: &Inertia) -> Inertial {
    let [x, y, z] = [of.about_com.x_axis, of.about_com.y_axis, of.about_com.z_axis];
    Inertial {
        origin: Origin::from_pose(&Pose::from_parts(of.com, Rotation::IDENTITY)),
        mass: of.mass,
        inertia: [x.x, x.y, x.z, y.y, y.z, z.z],
    }
}
