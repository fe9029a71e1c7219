//! Notes about meshes whose hull differs from them, and their suggestion of pieces.

use std::path::Path;

use super::meshes::{Corners, cells, cup, ell, inside_out, mug, stl, torus, turned};
use crate::Vec3;
use crate::error::{LoadWarning, ModelError};
use crate::object::Object;
use crate::pieces::{DecompositionOptions, TriangleMesh, compare, decompose};
use crate::read::{self, Files, LoadOptions, OwnObject, tells_of_filled_hollows};
use crate::shape::Shape;

const OWN: &str = r#"name = "thing"
source = "made in a test"
mass = 0.3
friction = 0.5
"#;

/// An object of these parts, from a folder with these meshes.
fn object(parts: &str, meshes: &[(String, Vec<u8>)]) -> Result<(Object, Vec<LoadWarning>), ModelError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in meshes {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let own: OwnObject = toml::from_str(&format!("{OWN}parts = [{parts}]")).unwrap();
    own.read(Path::new("task.toml"), Some(&Files::Folder(folder.path().to_owned())))
}

/// Notes about one mesh.
fn warnings_of(corners: &Corners, more: &str) -> Vec<String> {
    let part = format!("{{ shape = \"mesh\", file = \"a.stl\"{more} }}");
    let (_, warnings) = object(&part, &[("a.stl".to_owned(), stl(corners))]).unwrap();
    warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn a_hull_that_fills_hollows_is_reported_with_both_volumes_and_the_command() {
    let [warning] = &warnings_of(&torus(0.04, 0.01, 64), "")[..] else { panic!("one warning") };
    assert!(
        warning.starts_with("task.toml: objects.own `thing`: part 0: mesh 'a.stl': its convex hull has "),
        "{warning}"
    );
    assert!(
        warning.contains("1.8 times its volume (143 cm³ for 78.3 cm³): holes and hollows are filled;"),
        "{warning}"
    );
    assert!(
        warning.contains("`palmares task decompose ") && warning.contains("a.stl` writes convex"),
        "{warning}"
    );
    for hollow in [mug(), cup(0.04, 0.09, 0.004, 32), ell(), inside_out(&ell())] {
        let warnings = warnings_of(&hollow, "");
        assert!(warnings.len() == 1 && warnings[0].contains("times its volume ("), "{warnings:?}");
    }
    // In millimetres, too.
    let large: Corners = ell().iter().map(|t| t.map(|p| p * 1e3)).collect();
    let warnings = warnings_of(&large, ", scale = [0.001, 0.001, 0.001]");
    assert!(warnings[0].contains("1.2 times its volume (28.0 cm³ for 24.0 cm³)"), "{warnings:?}");
}

#[test]
fn convex_meshes_are_not_worth_a_word_however_they_are_made() {
    let cube = cells(0.05, &|_| true, 1);
    let mut twisted = cube.clone();
    twisted[3].swap(0, 1);
    let half_circle = |k: i32| {
        let (sin, cos) = libm::sincos(core::f64::consts::PI * f64::from(k) / 24.0);
        [if k % 24 == 0 { 0.0 } else { 0.04 * sin }, -0.04 * cos]
    };
    let ball = turned(&(0..=24).map(half_circle).collect::<Vec<_>>(), 48);
    let mut open = ball.clone();
    open.remove(500);
    for convex in [cube.clone(), open, twisted, inside_out(&cube), ball] {
        assert_eq!(warnings_of(&convex, ""), Vec::<String>::new());
    }
    // A cavity is not visible from outside.
    let inner: Corners = inside_out(&cells(0.03, &|_| true, 1));
    let shell: Corners =
        cube.into_iter().chain(inner.into_iter().map(|t| t.map(|p| p + Vec3::splat(0.01)))).collect();
    assert_eq!(warnings_of(&shell, ""), Vec::<String>::new());
}

#[test]
fn a_hollow_mesh_that_is_not_closed_is_reported_with_the_error_of_its_hull() {
    let mut open = cup(0.04, 0.09, 0.004, 32);
    open.pop();
    let [warning] = &warnings_of(&open, "")[..] else { panic!("one warning") };
    assert!(
        warning.contains(
            "it is not closed (3 open edges), so that its volume is unknown, and its convex hull of 449"
        ) && warning.contains(" cm³ stands up to 34.3 mm off its surface")
            && warning.contains("holes and hollows are filled"),
        "{warning}"
    );
    let mut twisted = ell();
    twisted[0].swap(0, 1);
    let warnings = warnings_of(&twisted, "");
    assert!(warnings[0].contains("triangles that face opposite sides (3 edges)"), "{warnings:?}");
}

#[test]
fn points_that_lose_much_of_a_hull_are_reported() {
    // A needle: rounding its tip takes centimetres.
    let needle = turned(&[[0.0, 0.0], [0.01, 0.0], [0.0, 0.2]], 24);
    let warnings = warnings_of(&needle, "");
    assert!(
        warnings.len() == 1 && warnings[0].contains("points are kept, with edges rounded: "),
        "{warnings:?}"
    );
    assert!(warnings[0].contains("% of the hull's volume is lost, and corners up to "), "{warnings:?}");
    assert_eq!(warnings_of(&needle, ", rounding = 0.0"), Vec::<String>::new());
}

#[test]
fn rounding_is_bounded_and_0_keeps_the_corners() {
    let cube = [("a.stl".to_owned(), stl(&cells(0.05, &|_| true, 1)))];
    let part = |rounding: &str| format!("{{ shape = \"mesh\", file = \"a.stl\", rounding = {rounding} }}");
    for wrong in ["-0.001", "0.2", "nan", "inf"] {
        let error = object(&part(wrong), &cube).unwrap_err().to_string();
        assert!(
            error.contains("part 0: mesh 'a.stl' has rounding ") && error.contains("valid: 0 to 0.1 m"),
            "{error}"
        );
    }
    for (rounding, expected) in [("0.0", 0.05), ("-0.0", 0.05), ("0.01", 0.03)] {
        let (object, _) = object(&part(rounding), &cube).unwrap();
        let Shape::Hull { points, .. } = &object.parts[0].1 else { panic!("a hull") };
        let most = |axis: usize| points.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
        let least = |axis: usize| points.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
        assert!(points.len() == 8 && (most(0) - least(0) - expected).abs() < 1e-8, "{rounding}: {points:?}");
    }
}

#[test]
fn an_object_of_pieces_has_mass_properties_within_the_reported_error() {
    for corners in [torus(0.04, 0.01, 48), mug(), ell(), inside_out(&ell())] {
        let mesh = TriangleMesh::new(&corners);
        let pieces =
            decompose(&mesh, DecompositionOptions { pieces: 32, resolution: 48 }, &mut |_| ()).unwrap();
        let fit = compare(&mesh, &pieces).unwrap();
        let (mut parts, mut meshes) = (String::new(), Vec::new());
        for (k, points) in pieces.iter().enumerate() {
            parts += &format!("{{ shape = \"mesh\", file = \"{k}.stl\", rounding = 0.0 }},");
            meshes.push((format!("{k}.stl"), TriangleMesh::hull(points).unwrap().to_stl("a piece")));
        }
        let (object, warnings) = object(&parts, &meshes).unwrap();
        assert_eq!(warnings, []);
        let volume: f64 = object.parts.iter().map(|(_, shape)| crate::shape::inertia::volume(shape)).sum();
        assert!((volume / fit.pieces_volume - 1.0).abs() < 1e-9, "{volume} {fit:?}");
        let of_mesh = mesh.inertia(object.mass).unwrap();
        let shift = (object.com - of_mesh.com).length();
        assert!((shift - fit.com_shift.unwrap()).abs() < 1e-9, "{shift} {fit:?}");
        let own = crate::hand::Inertia { mass: object.mass, com: object.com, about_com: object.inertia };
        for (a, b) in own.principal().into_iter().zip(of_mesh.principal()) {
            assert!((a / b - 1.0).abs() <= fit.inertia_error.unwrap() + 1e-9, "{a} {b} {fit:?}");
        }
    }
}

#[test]
fn a_warning_for_a_link_names_its_own_command_and_corners_can_be_kept() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("palm.stl"), stl(&ell())).unwrap();
    let urdf = r#"<robot name="r"><link name="palm">
        <inertial><mass value="0.1"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
        <collision><geometry><mesh filename="palm.stl"/></geometry></collision></link></robot>"#;
    std::fs::write(folder.path().join("hand.urdf"), urdf).unwrap();
    let load = |settings: &str| {
        std::fs::write(folder.path().join("hand.toml"), settings).unwrap();
        read::hand(folder.path(), &LoadOptions::default())
    };
    let rounding = |settings: &str| {
        let loaded = load(settings).unwrap();
        let hollow: Vec<&LoadWarning> =
            loaded.warnings.iter().filter(|w| tells_of_filled_hollows(w)).collect();
        let [warning] = hollow[..] else { panic!("{:?}", loaded.warnings) };
        assert!(
            warning.element == "link 'palm'" && warning.message.contains("`palmares hand decompose "),
            "{warning}"
        );
        match &loaded.hand.links[0].geoms[0].shape {
            Shape::Hull { rounding, .. } => *rounding,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(rounding(""), 2e-3);
    assert_eq!(rounding("[links.palm]\nmesh_rounding = 0.0\n"), 0.0);
    assert_eq!(rounding("[links.palm]\nmesh_rounding = 0.001\nrounding = 0.01\n"), 1e-3);
    for (settings, expected) in [
        ("[links.palm]\nmesh_rounding = -1.0\n", "hand.toml: [links.palm]: has mesh_rounding -1"),
        ("[links.palm]\nmesh_rounding = 1.0\n", "hand.urdf: link 'palm': mesh 'palm.stl' has rounding 1"),
    ] {
        let error = load(settings).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}
