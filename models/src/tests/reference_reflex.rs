//! The published ReFlex of the 2016 challenge against ours; `reference.rs` says where its data come from.

use std::path::Path;
use std::sync::Arc;

use serde_json::Value;

use crate::hand::da_vinci::DaVinciGeometry;
use crate::hand::path::TendonPath;
use crate::hand::{Geom, Hand};
use crate::{Mat3, Pose, Rotation, Vec3};

pub(super) fn compare(file: &Path) {
    let all: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let data = &all["reflex"];
    links_move_as_published(data);
    limits_masses_and_pulleys_are_the_published_ones(data);
    fingers_have_the_published_extents(data);
}

fn reflex() -> Arc<Hand> {
    Hand::builtin("reflex").unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn vector(value: &Value) -> Vec3 {
    Vec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

fn rotation(rows: &Value) -> Rotation {
    let rows = [vector(&rows[0]), vector(&rows[1]), vector(&rows[2])];
    Rotation::from_mat3(&Mat3::from_cols(rows[0], rows[1], rows[2]).transpose())
}

/// Frames of the published links at one angle per link.
fn frames(links: &[Value], angle: impl Fn(&str) -> f64) -> Vec<Pose> {
    let mut poses: Vec<Pose> = Vec::new();
    for link in links {
        let parent = usize::try_from(link["parent"].as_i64().unwrap()).map_or(Pose::IDENTITY, |p| poses[p]);
        let (sin, cos) = libm::sincos(0.5 * angle(link["name"].as_str().unwrap()));
        let v = vector(&link["axis"]) * sin;
        let turn = Pose::from_rotation(Rotation::from_xyzw(v.x, v.y, v.z, cos));
        poses.push(
            parent * Pose::from_parts(vector(&link["t_parent"]), rotation(&link["R_parent_rows"])) * turn,
        );
    }
    poses
}

fn links_move_as_published(data: &Value) {
    let hand = reflex();
    let links = data["links"].as_array().unwrap();
    for sigma in [0.0, 0.3, 1.0] {
        let q = [hand.motors[3].scaling * sigma, 0.2 + sigma, 0.9 * sigma, 0.7, -0.2, 1.9, 0.4];
        let ours = hand.base_from_links(&q);
        let theirs = frames(links, |name| match name {
            "swivel_1" => number(&data["swivel_affine"]["scale"][0]) * sigma,
            "swivel_2" => number(&data["swivel_affine"]["scale"][1]) * sigma,
            _ => hand.coordinate(name).map_or(0.0, |i| q[i]),
        });
        let mut compared = 0;
        for (i, link) in links.iter().enumerate() {
            let Some(at) = hand.link(link["name"].as_str().unwrap()) else { continue };
            let (a, b) = (ours[at], theirs[i]);
            assert!((a.translation - b.translation).length() < 1e-12, "{sigma} {}", link["name"]);
            assert!(a.rotation.dot(b.rotation).abs() > 1.0 - 1e-12, "{sigma} {}", link["name"]);
            compared += 1;
        }
        assert_eq!(compared, hand.links.len());
    }
}

fn limits_masses_and_pulleys_are_the_published_ones(data: &Value) {
    let hand = reflex();
    for link in data["links"].as_array().unwrap() {
        let name = link["name"].as_str().unwrap();
        let mass = |part: &str| {
            let all = data["links"].as_array().unwrap();
            number(&all.iter().find(|l| l["name"] == part).unwrap()["mass"])
        };
        if let Some(i) = hand.coordinate(name).filter(|_| name.starts_with("proximal")) {
            let c = &hand.coordinates[i];
            assert_eq!((c.lower, c.upper), (number(&link["qmin"]), number(&link["qmax"])));
            assert_eq!(c.rest, number(&data["emulator"]["q_u_rest"][0]));
        }
        let Some(i) = hand.link(name) else { continue };
        let pad = format!("{}pad{}", &name[..name.len() - 1], &name[name.len() - 2..]);
        let expected = match name {
            "base" => mass("base") + mass("pad"),
            _ if name.starts_with("swivel") => mass(name),
            // README: the 0.05 kg of distal_1 alone count as an error in the file.
            "distal_1" => mass("distal_2") + mass("distal_pad_2"),
            _ => mass(name) + mass(&pad),
        };
        assert!((hand.links[i].inertia.mass - expected).abs() < 1e-12, "{name}");
    }
    for tendon in &hand.tendons[..3] {
        let TendonPath::DaVinci(mechanism) = &tendon.elements[0].path else { panic!("no mechanism") };
        let DaVinciGeometry { r0, r1, r2, a1, b1, l1, a2, b2 } = *mechanism.geometry();
        let ours = [r0, r1, r2, a1, b1, l1, a2, b2];
        let names = ["r0", "r1", "r2", "a1", "b1", "l1", "a2", "b2"];
        assert_eq!(ours, names.map(|name| number(&data["da_vinci"][name])));
        for (angle, arm) in data["R_distal_samples"].as_object().unwrap() {
            let ours = mechanism.length(angle.parse().unwrap()).slope;
            assert!((ours - number(arm)).abs() < 1e-12, "{angle}: {ours} {arm}");
        }
    }
}

/// Smallest and largest coordinates of a shape in its link's frame.
fn extents(geom: &Geom) -> [Vec3; 2] {
    let (shape, up) = geom.shape.to_parry().unwrap();
    let bounds = shape.compute_aabb(&(geom.link_from_geom * up));
    [bounds.mins, bounds.maxs]
}

fn fingers_have_the_published_extents(data: &Value) {
    let hand = reflex();
    let links = data["links"].as_array().unwrap();
    let zero = frames(links, |_| 0.0);
    let mut compared = 0;
    for (i, link) in links.iter().enumerate() {
        let name = link["name"].as_str().unwrap();
        if !name.starts_with("proximal") && !name.starts_with("distal") {
            continue;
        }
        let mesh = &data["mesh_props"][format!("{name}.STL")];
        let offset = &link["geom_transform_4x4"];
        let offset = if offset.is_null() {
            Vec3::ZERO
        } else {
            Vec3::new(number(&offset[3]), number(&offset[7]), number(&offset[11]))
        };
        let (owner, shape) = match name.split_once("_pad_") {
            Some((phalanx, finger)) => (format!("{phalanx}_{finger}"), 1),
            None => (name.to_owned(), 0),
        };
        let at = hand.link(&owner).unwrap();
        let owner_frame = links.iter().position(|l| l["name"] == owner).unwrap();
        let link_from_mesh = zero[owner_frame].inv_mul(&zero[i]);
        let corner = |key: &str| link_from_mesh.transform_point(vector(&mesh[key]) + offset);
        let (a, b) = (corner("bbox_min"), corner("bbox_max"));
        let [least, most] = extents(&hand.links[at].geoms[shape]);
        assert!((least - a.min(b)).abs().max_element() < 2e-4, "{name}: {least} {}", a.min(b));
        assert!((most - a.max(b)).abs().max_element() < 2e-4, "{name}: {most} {}", a.max(b));
        compared += 1;
    }
    assert_eq!(compared, 12);
}
