//! Meshes that are not convex, and their convex pieces.

use core::f64::consts::PI;

use proptest::prelude::*;

use super::meshes::{Corners, cells, cup, ell, inside_out, mug, torus};
use crate::Vec3;
use crate::pieces::{DecompositionOptions, Fit, PiecesError, Surface, TriangleMesh, compare, decompose};
use crate::read::Limits;
use crate::read::report::Report;
use crate::read::stl;
use crate::shape::Shape;
use crate::shape::hull::sharp_hull;

/// Coarser than the command's: tests are compiled with little optimisation.
const COARSE: DecompositionOptions = DecompositionOptions { pieces: 16, resolution: 40 };

fn pieces(corners: &Corners, options: DecompositionOptions) -> (Vec<Vec<Vec3>>, Fit) {
    let mesh = TriangleMesh::new(corners);
    let pieces = decompose(&mesh, options, &mut |_| ()).unwrap();
    assert!(pieces.len() <= options.pieces as usize, "{}", pieces.len());
    assert!(pieces.iter().all(|points| (4..=64).contains(&points.len())));
    let fit = compare(&mesh, &pieces).unwrap();
    (pieces, fit)
}

fn volume(corners: &Corners) -> f64 {
    match TriangleMesh::new(corners).surface() {
        Surface::Closed { volume, inward: false, cavities: 0.0 } => volume,
        other => panic!("{other:?}"),
    }
}

#[test]
fn closed_meshes_enclose_what_they_should() {
    let (large, small) = (0.04, 0.01);
    let ring = 2.0 * PI * PI * large * small * small;
    assert!((volume(&torus(large, small, 200)) / ring - 1.0).abs() < 2e-3);
    let cup_volume = PI * (0.04 * 0.04 * 0.09 - 0.036 * 0.036 * 0.086);
    assert!((volume(&cup(0.04, 0.09, 0.004, 400)) / cup_volume - 1.0).abs() < 1e-3);
    assert!((volume(&ell()) - 3.0 * 0.02_f64.powi(3)).abs() < 1e-15);
    // Far from the origin, too.
    let far: Corners = ell().iter().map(|t| t.map(|p| p + Vec3::splat(5.0))).collect();
    assert!((volume(&far) - volume(&ell())).abs() < 1e-15);
    let inertia = TriangleMesh::new(&far).inertia(1.0).unwrap();
    let at_home = TriangleMesh::new(&ell()).inertia(1.0).unwrap();
    assert!((inertia.com - at_home.com - Vec3::splat(5.0)).length() < 1e-12);
    for (a, b) in inertia.principal().into_iter().zip(at_home.principal()) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    let turned = TriangleMesh::new(&inside_out(&ell()));
    let Surface::Closed { volume, inward: true, .. } = turned.surface() else {
        panic!("{:?}", turned.surface())
    };
    assert!((volume - 2.4e-5).abs() < 1e-15);
    for (a, b) in turned.inertia(1.0).unwrap().principal().into_iter().zip(at_home.principal()) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
fn a_mesh_that_is_not_closed_says_how() {
    let mut open = ell();
    open.pop();
    assert_eq!(TriangleMesh::new(&open).surface(), Surface::Open { edges: 3 });
    assert!(TriangleMesh::new(&open).inertia(1.0).is_none());
    let mut twisted = ell();
    twisted[0].swap(0, 1);
    assert_eq!(TriangleMesh::new(&twisted).surface(), Surface::Twisted { edges: 3 });
    let mut sheet = ell()[..2].to_vec();
    sheet.extend(inside_out(&sheet));
    assert_eq!(TriangleMesh::new(&sheet).surface(), Surface::Empty);
    assert_eq!(TriangleMesh::new(&[]).surface(), Surface::Open { edges: 0 });
}

#[test]
fn parts_that_are_inside_out_are_turned_over_and_cavities_are_not() {
    let shell = |size: f64| -> Corners {
        let cube = cells(size, &|_| true, 1);
        cube.iter().map(|t| t.map(|p| p - Vec3::splat(0.5 * size))).collect()
    };
    let moved = |corners: &Corners| -> Corners { corners.iter().map(|t| t.map(|p| p + Vec3::X)).collect() };
    let surface = |parts: [&Corners; 2]| TriangleMesh::new(&parts.map(Clone::clone).concat()).surface();
    let (large, small) = (shell(0.04), shell(0.02));
    let (outer, inner) = (0.04_f64.powi(3), 0.02_f64.powi(3));
    let cases = [
        // A cavity, and the same inside out.
        (surface([&large, &inside_out(&small)]), outer - inner, false, inner),
        (surface([&inside_out(&large), &small]), outer - inner, true, inner),
        // Side by side, one or both inside out.
        (surface([&large, &moved(&small)]), outer + inner, false, 0.0),
        (surface([&large, &inside_out(&moved(&small))]), outer + inner, true, 0.0),
        (surface([&inside_out(&large), &inside_out(&moved(&small))]), outer + inner, true, 0.0),
    ];
    for (k, (surface, expected, turned, hollow)) in cases.into_iter().enumerate() {
        let Surface::Closed { volume, inward, cavities } = surface else { panic!("{k}: {surface:?}") };
        assert!((volume - expected).abs() < 1e-12 && inward == turned, "{k}: {surface:?}");
        assert!((cavities - hollow).abs() < 1e-12, "{k}: {surface:?}");
    }
    // A mug whose handle is inside out is the same mug.
    let (whole, mut mixed) = (mug(), mug());
    let handle = cup(0.04, 0.09, 0.004, 48).len();
    mixed[handle..].iter_mut().for_each(|t| t.swap(1, 2));
    let Surface::Closed { volume: turned, .. } = TriangleMesh::new(&mixed).surface() else {
        panic!("closed")
    };
    assert!((turned - volume(&whole)).abs() < 1e-12);
}

#[test]
fn a_torus_keeps_its_hole() {
    let ring = torus(0.04, 0.01, 64);
    let (_, fit) = pieces(&ring, COARSE);
    let error = fit.volume_error().unwrap();
    assert!(error.abs() < 0.05, "{error}");
    // A voxel has 2.6 mm.
    assert!(fit.gap() < 2.6e-3, "{fit:?}");
    assert!(fit.com_shift.unwrap() < 5e-4 && fit.inertia_error.unwrap() < 0.05, "{fit:?}");
    // The point in the middle is in none of them; as one hull it is.
    let mesh = TriangleMesh::new(&ring);
    let hull = compare(&mesh, std::slice::from_ref(&mesh.vertices)).unwrap();
    assert!(hull.volume_error().unwrap() > 0.5 && hull.beyond.distance > 0.02, "{hull:?}");
    assert!(hull.uncovered.distance < 1e-6, "{hull:?}");
}

#[test]
fn a_mug_stays_hollow_and_keeps_its_handle() {
    let (pieces, fit) = pieces(&mug(), DecompositionOptions { pieces: 24, resolution: 64 });
    let error = fit.volume_error().unwrap();
    assert!(error.abs() < 0.2 && fit.gap() < 5e-3, "{error} {fit:?}");
    let inside = |p: Vec3| {
        pieces.iter().any(|points| {
            let hull = TriangleMesh::hull(points).unwrap();
            hull.winding(p).abs() > 0.5
        })
    };
    assert!(!inside(Vec3::new(0.0, 0.0, 0.05)), "the cup is filled");
    assert!(!inside(Vec3::new(0.05, 0.0, 0.045)), "the handle is filled");
    assert!(inside(Vec3::new(0.0, 0.0, 0.002)) && inside(Vec3::new(0.063, 0.0, 0.045)));
}

#[test]
fn an_ell_is_two_boxes() {
    let (pieces, fit) = pieces(&ell(), DecompositionOptions { pieces: 16, resolution: 100 });
    assert_eq!(pieces.len(), 2, "{pieces:?}");
    assert!(fit.volume_error().unwrap().abs() < 0.01 && fit.gap() < 1e-3, "{fit:?}");
    assert!(fit.overlap_volume < 0.01 * fit.pieces_volume, "{fit:?}");
}

#[test]
fn a_convex_mesh_is_one_piece_and_fits_exactly() {
    let cube = cells(0.03, &|_| true, 1);
    let (pieces, fit) = pieces(&cube, COARSE);
    assert_eq!((pieces.len(), pieces[0].len()), (1, 8));
    assert!(fit.volume_error().unwrap().abs() < 1e-6 && fit.gap() < 1e-7, "{fit:?}");
    assert!(fit.inertia_error.unwrap() < 1e-6);
}

#[test]
fn the_same_mesh_gives_the_same_pieces_also_inside_out_and_in_other_units() {
    let ring = torus(0.04, 0.01, 32);
    let (first, _) = pieces(&ring, COARSE);
    let (again, _) = pieces(&ring, COARSE);
    assert_eq!(first, again);
    let mut shuffled = inside_out(&ring);
    shuffled.reverse();
    let (turned, fit) = pieces(&shuffled, COARSE);
    assert!(fit.volume_error().unwrap().abs() < 0.05, "{fit:?}");
    assert!(turned.len().abs_diff(first.len()) <= 2, "{} {}", turned.len(), first.len());
    // From micrometres to kilometres.
    for scale in [1e-6, 1e6] {
        let scaled: Corners = ring.iter().map(|t| t.map(|p| p * scale)).collect();
        let (_, fit) = pieces(&scaled, COARSE);
        assert!(fit.volume_error().unwrap().abs() < 0.05, "{scale}: {fit:?}");
    }
}

#[test]
fn what_has_no_inside_or_no_volume_is_refused() {
    let try_it = |corners: &Corners| decompose(&TriangleMesh::new(corners), COARSE, &mut |_| ()).unwrap_err();
    let mut bowl = cup(0.04, 0.09, 0.004, 32);
    // Without its outer wall.
    bowl.retain(|t| !t.iter().all(|p| (p.x.hypot(p.y) - 0.04).abs() < 1e-9));
    let error = try_it(&bowl);
    let PiecesError::Leaks { edges, voxel_m } = error else { panic!("{error:?}") };
    assert!(edges == 64 && voxel_m > 1e-3, "{error}");
    assert!(error.to_string().contains("not closed: 64 edges"), "{error}");
    let flat: Corners =
        cells(0.03, &|_| true, 1).iter().map(|t| t.map(|p| p * Vec3::new(1.0, 1.0, 0.0))).collect();
    // Five sides of a box, each twice.
    let mut tray = cells(0.03, &|_| true, 1)[..10].to_vec();
    tray.extend(inside_out(&tray));
    assert_eq!(try_it(&tray), PiecesError::Sheet);
    for corners in [vec![], vec![[Vec3::ZERO; 3]], vec![[Vec3::X, Vec3::Y, Vec3::Z]], flat] {
        let error = try_it(&corners);
        assert!(matches!(error, PiecesError::Flat { .. }), "{error}");
    }
}

/// At 100 voxels the library panics on this cup.
#[test]
fn where_the_library_gives_up_other_voxels_do() {
    let (pieces, fit) =
        pieces(&cup(0.04, 0.09, 0.004, 48), DecompositionOptions { pieces: 32, resolution: 100 });
    assert!(pieces.len() > 8 && fit.volume_error().unwrap() < 0.15 && fit.gap() < 5e-3, "{fit:?}");
}

#[test]
fn a_small_hole_does_not_matter() {
    let mut ring = torus(0.04, 0.01, 128);
    ring.pop();
    let (_, fit) = pieces(&ring, COARSE);
    assert!(fit.mesh_volume.is_none() && fit.com_shift.is_none() && fit.gap() < 2e-3, "{fit:?}");
}

#[test]
fn a_file_gives_back_the_points_that_were_written() {
    let (pieces, _) = pieces(&mug(), COARSE);
    for points in &pieces {
        let bytes = TriangleMesh::hull(points).unwrap().to_stl("piece 1 of 2 of tasse_ä.stl");
        let report = Report::new(std::path::Path::new("piece.stl"));
        let corners = stl::corners(&bytes, Vec3::ONE, "part 0", &Limits::default(), &report).unwrap();
        let Shape::Hull { points: read, rounding } = sharp_hull(&stl::points(&corners), 64).unwrap() else {
            panic!("not a hull")
        };
        let sort = |mut points: Vec<[f64; 3]>| {
            points.sort_by(|a, b| a.partial_cmp(b).unwrap());
            points
        };
        assert_eq!(rounding, 0.0);
        assert_eq!(sort(read), sort(points.iter().map(|p| p.to_array()).collect()));
    }
}

#[test]
fn a_sharp_hull_keeps_all_corners_or_the_ones_that_matter() {
    let corners: Vec<Vec3> = stl::points(&cells(0.03, &|_| true, 1));
    let Some(Shape::Hull { points, .. }) = sharp_hull(&corners, 64) else { panic!("a box") };
    assert_eq!(points.len(), 8);
    // A ball with a spike: the spike is kept.
    let mut ball: Vec<Vec3> =
        (0..5000).map(|i| crate::shape::support::fibonacci_direction(i, 5000) * 0.05).collect();
    ball.push(Vec3::new(0.0, 0.02, 0.08));
    let Some(Shape::Hull { points, .. }) = sharp_hull(&ball, 64) else { panic!("a ball") };
    assert!(points.len() == 64 && points.contains(&[0.0, 0.02, 0.08]), "{}", points.len());
    assert!(sharp_hull(&corners[..3], 64).is_none() && sharp_hull(&[], 64).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Random heaps of cells, with holes, edges shared by four faces and unconnected parts.
    #[test]
    fn pieces_of_random_cells_cover_them(filled in proptest::collection::vec(any::<bool>(), 27)) {
        prop_assume!(filled.contains(&true));
        let there = |[x, y, z]: [i32; 3]| filled[(x * 9 + y * 3 + z) as usize];
        let corners = cells(0.01, &there, 3);
        let mesh = TriangleMesh::new(&corners);
        let count = filled.iter().filter(|x| **x).count();
        let expected = count as f64 * 1e-6;
        let Surface::Closed { volume, .. } = mesh.surface() else { panic!("{:?}", mesh.surface()) };
        prop_assert!((volume - expected).abs() < 1e-15);
        let options = DecompositionOptions { pieces: 27, resolution: 32 };
        let found = decompose(&mesh, options, &mut |_| ()).unwrap();
        let fit = compare(&mesh, &found).unwrap();
        let hull = compare(&mesh, std::slice::from_ref(&mesh.vertices)).unwrap();
        let (error, of_hull) = (fit.volume_error().unwrap(), hull.volume_error().unwrap());
        prop_assert!(error < 0.3 && error <= of_hull + 1e-6 && error > -0.05, "{fit:?} {of_hull}");
        prop_assert!(fit.uncovered.distance < 1e-3, "{fit:?}");
    }

    /// Random surfaces with one radius in each direction, with spikes: never a panic, nothing lost.
    #[test]
    fn pieces_of_random_stars_cover_them(radii in proptest::collection::vec(0.2_f64..1.0, 12 * 5)) {
        let at = |row: usize, k: usize| {
            let (s, c) = libm::sincos(PI * (row as f64 + 1.0) / 6.0);
            let (sin, cos) = libm::sincos(2.0 * PI * (k % 12) as f64 / 12.0);
            Vec3::new(s * cos, s * sin, c) * (0.05 * radii[row * 12 + k % 12])
        };
        let (top, bottom) = (Vec3::Z * 0.02, Vec3::Z * -0.02);
        let mut corners = Vec::new();
        for k in 0..12 {
            corners.push([top, at(0, k), at(0, k + 1)]);
            corners.push([bottom, at(4, k + 1), at(4, k)]);
            for row in 0..4 {
                corners.push([at(row, k), at(row + 1, k), at(row + 1, k + 1)]);
                corners.push([at(row, k), at(row + 1, k + 1), at(row, k + 1)]);
            }
        }
        let mesh = TriangleMesh::new(&corners);
        let found = decompose(&mesh, COARSE, &mut |_| ()).unwrap();
        let fit = compare(&mesh, &found).unwrap();
        prop_assert!(fit.uncovered.distance < 4e-3, "{fit:?}");
        let hull = compare(&mesh, std::slice::from_ref(&mesh.vertices)).unwrap();
        prop_assert!(fit.volume_error().unwrap() <= hull.volume_error().unwrap() + 1e-6, "{fit:?}");
    }
}
