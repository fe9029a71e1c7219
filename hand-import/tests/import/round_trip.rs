//! A hand that is built in, imported from its own folder or from what was exported, has the same closed form.

use nalgebra::{DMatrix, DVector};
use palmares_hand_import::export::{ExportTarget, export};
use palmares_models::builtin::builtin_hands;

use super::*;

fn folders() -> Vec<PathBuf> {
    let hands = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/hands");
    let entries = std::fs::read_dir(hands).expect("hands").map(|entry| entry.expect("an entry").path());
    entries.filter(|path| path.join("hand.urdf").is_file()).collect()
}

#[track_caller]
fn close(what: &str, a: f64, b: f64) {
    assert!(a == b || (a - b).abs() < 1e-9, "{what}: {a} and {b}");
}

fn compare(a: &Hand, b: &Hand) {
    assert_eq!(a.coordinates.len(), b.coordinates.len());
    for (a, b) in a.coordinates.iter().zip(&b.coordinates) {
        assert_eq!(a.name, b.name);
        close(&a.name, a.lower, b.lower);
        close(&a.name, a.upper, b.upper);
        close(&a.name, a.stiffness, b.stiffness);
        close(&a.name, a.damping, b.damping);
        close(&a.name, a.rest, b.rest);
        close(&a.name, a.friction, b.friction);
    }
    assert_eq!(a.tendons.len(), b.tendons.len());
    let q: Vec<f64> =
        a.coordinates.iter().map(|c| 0.3 * c.lower.max(-3.0) + 0.7 * c.upper.min(3.0)).collect();
    for (a, b) in a.tendons.iter().zip(&b.tendons) {
        assert_eq!(a.name, b.name);
        close(&a.name, a.length(&q), b.length(&q));
        let (mut row, mut other) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        a.gradient(&q, |i, r| row[i] += r);
        b.gradient(&q, |i, r| other[i] += r);
        row.iter().zip(&other).for_each(|(x, y)| close(&a.name, *x, *y));
        close(&a.name, a.stiffness, b.stiffness);
        close(&a.name, a.force_limit, b.force_limit);
    }
    assert_eq!(a.motors.len(), b.motors.len());
    for (a, b) in a.motors.iter().zip(&b.motors) {
        close(&a.name, a.scaling, b.scaling);
        close(&a.name, a.offset, b.offset);
        close(&a.name, a.speed_limit, b.speed_limit);
    }
    assert_eq!(a.links.len(), b.links.len());
    for (a, b) in a.links.iter().zip(&b.links) {
        assert_eq!((&a.name, a.geoms.len()), (&b.name, b.geoms.len()));
        close(&a.name, a.inertia.mass, b.inertia.mass);
        close(&a.name, (a.inertia.com - b.inertia.com).length(), 0.0);
    }
}

/// Coordinates and tensions by the closed form of adaptive synergies, for wound lengths s; the hand's springs make E invertible.
fn closed_form(hand: &Hand, s: &[f64]) -> Option<Vec<f64>> {
    let (n, m) = (hand.coordinates.len(), hand.tendons.len());
    let sprung = hand.coordinates.iter().all(|c| c.stiffness > 0.0);
    if !sprung || hand.tendons.iter().any(|tendon| !tendon.elements.is_empty()) {
        return None;
    }
    let mut r = DMatrix::zeros(m, n);
    for (t, tendon) in hand.tendons.iter().enumerate() {
        tendon.moment_arms.iter().for_each(|&(c, arm)| r[(t, c)] += arm);
    }
    let compliance = DVector::from_iterator(n, hand.coordinates.iter().map(|c| 1.0 / c.stiffness));
    let rest = DVector::from_iterator(n, hand.coordinates.iter().map(|c| c.rest));
    let cable = DVector::from_iterator(m, hand.tendons.iter().map(|tendon| 1.0 / tendon.stiffness));
    let e = DMatrix::from_diagonal(&compliance);
    let p = (&r * &e * r.transpose() + DMatrix::from_diagonal(&cable)).try_inverse()?;
    let f = p * (DVector::from_column_slice(s) - &r * &rest);
    let q = rest + e * r.transpose() * &f;
    Some(q.iter().chain(f.iter()).copied().collect())
}

fn compare_closed_forms(a: &Hand, b: &Hand) {
    for k in 1..=10 {
        let s: Vec<f64> =
            (0..a.tendons.len()).map(|t| 0.01 * f64::from(k) * (1.0 + 0.3 * t as f64)).collect();
        match (closed_form(a, &s), closed_form(b, &s)) {
            (Some(x), Some(y)) => x.iter().zip(&y).for_each(|(x, y)| close(&a.name, *x, *y)),
            (x, y) => assert!(x.is_none() && y.is_none(), "{}: both have a closed form, or neither", a.name),
        }
    }
}

#[test]
fn an_exported_built_in_hand_comes_back_from_urdf_and_mjcf() {
    for original in builtin_hands() {
        for target in [ExportTarget::Urdf, ExportTarget::Mjcf] {
            let (folder, back) =
                (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
            let exported = export(&original.name, target).expect("exported");
            exported.write(folder.path(), true).expect("written");
            let imported = import(folder.path(), &ImportOptions::default()).expect("imported");
            let problems: Vec<_> = imported.problems().collect();
            assert!(problems.is_empty(), "{} {target:?}: {problems:?}", original.name);
            imported.write(back.path(), true).expect("written");
            let copy = hand(back.path(), &LoadOptions::default()).expect("loads").hand;
            compare(original, &copy);
            compare_closed_forms(original, &copy);
            let inertia =
                |hand: &Hand| hand.links.iter().map(|link| link.inertia.about_com).collect::<Vec<_>>();
            for (a, b) in inertia(original).iter().zip(inertia(&copy)) {
                let off = *a - b;
                let off = off.x_axis.length() + off.y_axis.length() + off.z_axis.length();
                close(&original.name, off, 0.0);
            }
            assert_eq!(original.no_collision, copy.no_collision, "{} {target:?}", original.name);
        }
    }
}

/// Other programs read no hand.toml, which takes inertias from the shapes.
#[test]
fn an_exported_urdf_states_the_inertias_of_the_hand() {
    for original in builtin_hands() {
        let exported = export(&original.name, ExportTarget::Urdf).expect("exported");
        let folder = tempfile::tempdir().expect("a folder");
        exported.write(folder.path(), true).expect("written");
        let settings = fs::read_to_string(folder.path().join("hand.toml")).expect("text");
        let mut settings: toml::Table = settings.parse().expect("TOML");
        settings.remove("inertia");
        fs::write(folder.path().join("hand.toml"), settings.to_string()).expect("written");
        let copy = hand(folder.path(), &LoadOptions::default()).expect("loads").hand;
        for (a, b) in original.links.iter().zip(&copy.links) {
            let name = format!("{}: {}", original.name, a.name);
            let (a, b) = (a.inertia, b.inertia);
            let size = a.about_com.to_cols_array().iter().fold(0.0f64, |size, x| size.max(x.abs()));
            let off =
                (a.about_com - b.about_com).to_cols_array().iter().fold(0.0f64, |off, x| off.max(x.abs()));
            assert!(off <= 1e-9 * size, "{name}: {:?} and {:?}", a.about_com, b.about_com);
            assert!((a.com - b.com).length() < 1e-12 && (a.mass - b.mass).abs() < 1e-12, "{name}");
        }
    }
}

#[test]
fn an_imported_built_in_hand_has_the_closed_form_of_the_original() {
    let folders = folders();
    assert!(folders.len() >= 3, "{folders:?}");
    for folder in folders {
        let out = tempfile::tempdir().expect("a folder");
        let imported = import(&folder, &ImportOptions::default()).expect("imported");
        let problems: Vec<_> = imported.problems().collect();
        assert!(problems.is_empty(), "{}: {problems:?}", folder.display());
        imported.write(out.path(), true).expect("written");
        let (original, copy) =
            (hand(&folder, &LoadOptions::default()), hand(out.path(), &LoadOptions::default()));
        compare(&original.expect("loads").hand, &copy.expect("loads").hand);
    }
}

#[test]
fn friction_of_joints_goes_along_and_that_of_cables_is_named() {
    let (urdf, toml) = palmares_models::builtin::builtin_texts("pinch").expect("it is built in");
    let rubbing = "[tendons.curl]\nrouting = ['left_tip', 'right_tip']\nfriction = 0.1\nwrap_angle = 1.0\n";
    let toml = toml.replace("[tendons.curl]\n", rubbing) + "\n[coordinates.left_tip]\nfriction = 0.01\n";
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("hand.urdf"), urdf).expect("written");
    std::fs::write(folder.path().join("hand.toml"), toml).expect("written");
    let exported = export(&folder.path().display().to_string(), ExportTarget::Mjcf).expect("exported");
    let capstan = |d: &palmares_hand_import::decision::Decision| {
        d.element == "tendon 'curl'" && d.text.contains("capstan")
    };
    assert!(exported.decisions.iter().any(|d| capstan(d) && d.kind == DecisionKind::Dropped));
    // Without hand.toml, MJCF has the friction of joints alone.
    let text = String::from_utf8(exported.files[Path::new("hand.xml")].clone()).expect("text");
    let alone = tempfile::tempdir().expect("a folder");
    std::fs::write(alone.path().join("hand.xml"), text).expect("written");
    let back = tempfile::tempdir().expect("a folder");
    import(alone.path(), &ImportOptions::default())
        .expect("imported")
        .write(back.path(), true)
        .expect("written");
    let copy = hand(back.path(), &LoadOptions::default()).expect("loads").hand;
    let friction: Vec<f64> = copy.coordinates.iter().map(|c| c.friction).collect();
    assert_eq!(friction, [0.0, 0.01, 0.0, 0.0]);
}
