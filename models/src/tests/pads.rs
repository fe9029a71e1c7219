//! Soft surfaces of `hand.toml`.

use crate::hand::{Hand, Pad};
use crate::read::{self, LoadOptions};
use std::path::Path;

const BODY: &str = r#"<inertial><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
    <collision><geometry><sphere radius="0.01"/></geometry></collision>"#;

/// Two fingers; the first one's tip is fixed to it.
fn hand(settings: &str) -> Result<Hand, String> {
    let link = |name: &str| format!("<link name='{name}'>{BODY}</link>");
    let joint = |parent: &str, child: &str, kind: &str| {
        format!(
            r#"<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
            <origin xyz="0 0 0.1"/><axis xyz="0 1 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>"#
        )
    };
    let urdf = format!(
        r#"<robot name="two">{}{}{}{}{}{}{}</robot>"#,
        link("base"),
        link("other"),
        link("finger"),
        link("tip"),
        joint("base", "finger", "revolute"),
        joint("finger", "tip", "fixed"),
        joint("base", "other", "revolute"),
    );
    let files = (Path::new("hand.urdf"), Path::new("hand.toml"));
    read::from_text((files.0, &urdf), Some((files.1, settings)), None, &LoadOptions::default())
        .map(|loaded| loaded.hand)
        .map_err(|error| error.to_string())
}

#[test]
fn a_pad_lies_on_the_shapes_of_its_link_where_fixed_joints_took_them() {
    let hand = hand(
        "[links.tip]\npad = { thickness = 0.003, modulus = 2e5 }\n[links.other]\npad = { modulus = 1e6 }\n",
    )
    .expect("a hand");
    let pads: Vec<(&str, usize, Pad)> =
        hand.pads.iter().map(|on| (hand.links[on.link].name.as_str(), on.geom, on.pad)).collect();
    let layer = Pad { thickness: Some(3e-3), modulus: 2e5 };
    let body = Pad { thickness: None, modulus: 1e6 };
    // The finger's own sphere is its first shape.
    assert!(pads.contains(&("finger", 1, layer)) && pads.contains(&("other", 0, body)), "{pads:?}");
    assert_eq!(pads.len(), 2);
}

#[test]
fn a_pad_counts_in_the_hash_and_a_hand_without_is_as_before() {
    let hash = |settings: &str| hand(settings).expect("a hand").content_hash();
    let soft = hash("[links.tip]\npad = { modulus = 2e5 }\n");
    assert_ne!(soft, hash(""));
    assert_ne!(soft, hash("[links.tip]\npad = { modulus = 3e5 }\n"));
    assert_ne!(soft, hash("[links.other]\npad = { modulus = 2e5 }\n"));
    assert_ne!(soft, hash("[links.tip]\npad = { thickness = 0.001, modulus = 2e5 }\n"));
}

#[test]
fn pads_that_are_none_are_refused() {
    for (settings, expected) in [
        ("pad = { modulus = 0 }", "[links.tip]: has pad.modulus 0; valid: pad.modulus of more than 0"),
        ("pad = { thickness = -0.001, modulus = 1e5 }", "[links.tip]: has pad.thickness -0.001"),
        ("pad = { thickness = nan, modulus = 1e5 }", "pad.thickness NaN"),
        ("pad = { thickness = 0.003 }", "modulus"),
        ("pad = { modulus = 1e99 }", "pad.modulus"),
        ("pad = { modulus = 1e5, radius = 1 }", "radius"),
    ] {
        let error = hand(&format!("[links.tip]\n{settings}\n")).expect_err(settings);
        assert!(error.contains(expected), "{settings}: {error}");
    }
}
