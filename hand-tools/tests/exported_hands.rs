//! A built-in hand that was exported and imported again has the same equilibria under pushes.

use palmares_hand_import::export::{ExportTarget, export};
use palmares_hand_import::{ImportOptions, import};
use palmares_models::builtin::builtin_hands;
use palmares_models::hand::Hand;
use palmares_models::read::{LoadOptions, hand};
use palmares_models::{Pose, Vec3};
use palmares_sim::statics::prediction::{largest_difference, solve_loaded};
use palmares_sim::{Config, Push};

/// A number between −1 and 1 that looks random, of two counters.
fn noise(k: usize, n: usize) -> f64 {
    let x = (k as f64 * 12.9898 + n as f64 * 78.233).rem_euclid(7.0) * 43.758_545_3;
    2.0 * x.rem_euclid(1.0) - 1.0
}

fn push(hand: &Hand, k: usize) -> Push {
    let link = 1 + k % (hand.links.len() - 1);
    let force = Vec3::new(noise(k, 1), noise(k, 2), noise(k, 3)) * 0.5;
    Push { link, point: hand.links[link].inertia.com, force }
}

#[test]
fn exported_hands_have_the_same_equilibrium_under_ten_pushes() {
    let config = Config::with_step(1e-3);
    for original in builtin_hands() {
        for target in [ExportTarget::Urdf, ExportTarget::Mjcf] {
            let (folder, back) =
                (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
            export(&original.name, target).expect("exported").write(folder.path(), true).expect("written");
            let imported = import(folder.path(), &ImportOptions::default()).expect("imported");
            imported.write(back.path(), true).expect("written");
            let copy = hand(back.path(), &LoadOptions::default()).expect("loads").hand;
            for k in 0..10 {
                let sigma: Vec<f64> =
                    (0..original.motors.len()).map(|m| 0.3 + 0.2 * noise(k, 10 + m)).collect();
                let pushes = [push(original, k)];
                let of = |hand: &Hand| solve_loaded(&config, hand, Pose::IDENTITY, &sigma, &pushes);
                match (of(original), of(&copy)) {
                    (Ok(a), Ok(b)) => {
                        let off =
                            largest_difference(&a.q, &b.q).max(largest_difference(&a.tension, &b.tension));
                        assert!(off < 1e-9, "{} {target:?}, push {k}: {off:e}", original.name);
                    }
                    (a, b) => assert_eq!(a.is_err(), b.is_err(), "{} {target:?}, push {k}", original.name),
                }
            }
        }
    }
}
