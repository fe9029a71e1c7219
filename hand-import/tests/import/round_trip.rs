//! A hand that is built in, imported from its own folder, has the same closed form.

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

#[test]
fn an_imported_built_in_hand_has_the_closed_form_of_the_original() {
    let folders = folders();
    assert!(folders.len() >= 3, "{folders:?}");
    for folder in folders {
        let out = tempfile::tempdir().expect("a folder");
        let imported = import(&folder, &Options::default()).expect("imported");
        let problems: Vec<_> = imported.problems().collect();
        assert!(problems.is_empty(), "{}: {problems:?}", folder.display());
        imported.write(out.path(), true).expect("written");
        let (original, copy) =
            (hand(&folder, &LoadOptions::default()), hand(out.path(), &LoadOptions::default()));
        compare(&original.expect("loads").hand, &copy.expect("loads").hand);
    }
}
