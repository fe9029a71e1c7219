//! Our SoftHand and ReFlex against those that others published. These files are not ours to distribute: the test is skipped unless
//! `PALMARES_PUBLISHED_HANDS` names a folder with them. `exported.rs` has the reader's tests.

use std::path::Path;

use parry3d_f64::transformation::try_convex_hull;

use super::softhand;
use crate::hand::{Geom, Hand};
use crate::measure::HandLimits;
use crate::read::report::Report;
use crate::read::{self, InertiaPolicy, Limits, LoadOptions, Loaded, stl};
use crate::shape::Shape;
use crate::{Pose, Vec3};

fn load(folder: &Path) -> Hand {
    let Loaded { hand, sources, .. } =
        read::hand(&folder.join("soft_hand.urdf"), &LoadOptions::default()).unwrap();
    assert_eq!(HandLimits::default().excesses(&hand.figures(), &sources), vec![]);
    hand
}

#[test]
fn our_hands_are_those_that_others_published() {
    let Some(folder) = std::env::var_os("PALMARES_PUBLISHED_HANDS") else {
        return println!(
            "SKIP: PALMARES_PUBLISHED_HANDS names no folder with soft_hand_2016 and hands_2016.json"
        );
    };
    let folder = Path::new(&folder);
    softhand_moves_like_the_published_one(&folder.join("soft_hand_2016"));
    primitives_stay_near_the_published_meshes(&folder.join("soft_hand_2016"));
    super::reference_reflex::compare(&folder.join("hands_2016.json"));
}

fn softhand_moves_like_the_published_one(folder: &Path) {
    let published = load(folder);
    let ours = softhand::load_with(InertiaPolicy::FromFile).hand;
    assert_eq!(published.tendons[0].moment_arms, ours.tendons[0].moment_arms);
    for step in 0..4 {
        let q: Vec<f64> = (0..19).map(|i| 0.2 * f64::from(step) * (1.0 + 0.02 * i as f64)).collect();
        for (a, b) in published.base_from_links(&q).iter().zip(ours.base_from_links(&q)).skip(1) {
            assert!((a.translation - b.translation).length() < 2e-7, "{a:?} {b:?}");
            assert!(a.rotation.dot(b.rotation).abs() > 1.0 - 1e-10, "{a:?} {b:?}");
        }
    }
}

/// Distance of a point to a shape's surface, negative inside.
fn signed_distance(geom: &Geom, point: Vec3) -> f64 {
    let p = geom.link_from_geom.inverse_transform_point(point);
    match geom.shape {
        Shape::Capsule { radius, half_length } => {
            (p - Vec3::new(0.0, 0.0, p.z.clamp(-half_length, half_length))).length() - radius
        }
        Shape::Box { half_extents, rounding } => {
            let outside = p.abs() - Vec3::from_array(half_extents) + Vec3::splat(rounding);
            outside.max(Vec3::ZERO).length() + outside.max_element().min(0.0) - rounding
        }
        _ => panic!("not used in the SoftHand's moving links"),
    }
}

/// Points spread over the convex hull of a mesh in proportion to area.
fn hull_surface(points: &[Vec3], spacing: f64) -> Vec<Vec3> {
    let (vertices, faces) = try_convex_hull(points).unwrap();
    let mut out = Vec::new();
    let (mut area_left, mut seed) = (0.0, 0.5);
    for face in faces {
        let [a, b, c] = face.map(|i| vertices[i as usize]);
        area_left += 0.5 * (b - a).cross(c - a).length();
        while area_left > spacing * spacing {
            area_left -= spacing * spacing;
            // Low-discrepancy barycentric coordinates.
            seed = f64::fract(seed + 0.618_033_988_749_895);
            let (mut u, mut v) = (seed, f64::fract(seed * 97.0));
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            out.push(a + (b - a) * u + (c - a) * v);
        }
    }
    out
}

/// Distances of our primitives from the published meshes' hulls: the figures that README.md quotes.
fn primitives_stay_near_the_published_meshes(folder: &Path) {
    let hand = softhand::load_with(InertiaPolicy::FromFile).hand;
    let palm_from_base = Pose::from_translation(-Vec3::new(0.002, 0.00695, 0.0905));
    // mesh, our link, mean and largest deviation, mm
    let cases = [
        ("fingertip", "index_distal", 0.5, 2.5),
        ("phalanx", "index_proximal", 1.0, 4.0),
        ("knuckle", "index_knuckle", 0.9, 4.0),
        ("thumb_knuckle_right", "thumb_knuckle", 0.9, 4.0),
        ("palm_right", "base", 1.4, 8.0),
    ];
    for (file, link, mean_limit, max_limit) in cases {
        let path = folder.join(format!("meshes/{file}_collision.stl"));
        let points = {
            let bytes = std::fs::read(&path).unwrap();
            let report = Report::new(&path);
            stl::points(&stl::corners(&bytes, Vec3::splat(1e-3), link, &Limits::default(), &report).unwrap())
        };
        let geoms = &hand.links[hand.link(link).unwrap()].geoms;
        let frame = if link == "base" { palm_from_base } else { Pose::IDENTITY };
        let mut placed: Vec<Geom> = geoms
            .iter()
            .filter(|g| !matches!(g.shape, Shape::Cylinder { .. }))
            .map(|g| Geom { link_from_geom: frame * g.link_from_geom, ..g.clone() })
            .collect();
        if link == "base" {
            // The knuckles cover the palm's edge.
            let poses = hand.base_from_links(&[0.0; 19]);
            for (link, pose) in hand.links.iter().zip(&poses).filter(|(l, _)| l.name.ends_with("_knuckle")) {
                let place = |g: &Geom| Geom { link_from_geom: frame * *pose * g.link_from_geom, ..g.clone() };
                placed.extend(link.geoms.iter().map(place));
            }
        }
        let mut deviations = Vec::new();
        for p in hull_surface(&points, 5e-4) {
            let d = placed.iter().map(|g| 1e3 * signed_distance(g, p)).fold(f64::INFINITY, f64::min);
            // The wrist's box covers the palm's foot.
            if file != "palm_right" || p.z > 0.009 {
                deviations.push((d, p));
            }
        }
        let mean = deviations.iter().map(|(d, _)| d.abs()).sum::<f64>() / deviations.len() as f64;
        let worst = deviations.iter().max_by(|a, b| a.0.abs().total_cmp(&b.0.abs())).unwrap();
        let front: Vec<f64> = deviations
            .iter()
            .filter(|(_, p)| file == "palm_right" && p.x > 0.0095)
            .map(|x| x.0.abs())
            .collect();
        let front = front.iter().sum::<f64>() / front.len().max(1) as f64;
        println!(
            "{file}: mean {mean:.2} mm, max {:.2} mm at {:.4}; palm surface mean {front:.2} mm",
            worst.0, worst.1
        );
        assert!(mean < mean_limit && worst.0.abs() < max_limit, "{file}: {mean} {worst:?}");
    }
}
