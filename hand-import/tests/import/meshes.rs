//! Meshes in other formats and units.

use super::urdf::cube_stl;
use super::*;

/// A cube of this edge as OBJ.
fn obj(edge: f64) -> String {
    let mut text = String::from("mtllib none.mtl\n");
    for k in 0..8 {
        let bit = |shift: usize| if k >> shift & 1 == 1 { edge } else { 0.0 };
        text += &format!("v {} {} {}\n", bit(0), bit(1), bit(2));
    }
    text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
}

/// A box of 10 × 20 × 30 units as COLLADA.
fn dae(unit: &str, up: &str) -> String {
    let mut points = String::new();
    for k in 0..8 {
        let bit = |shift: usize, edge: f64| if k >> shift & 1 == 1 { edge } else { 0.0 };
        points += &format!("{} {} {} ", bit(0, 10.0), bit(1, 20.0), bit(2, 30.0));
    }
    let faces = "0 2 3 0 3 1 4 5 7 4 7 6 0 1 5 0 5 4 2 6 7 2 7 3 0 4 6 0 6 2 1 3 7 1 7 5";
    format!(
        "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>\
         <asset><unit name='u' meter=\"{unit}\"/><up_axis>{up}</up_axis></asset>\
         <library_geometries><geometry id='g' name='g'><mesh>\
         <source id='p'><float_array id='pa' count='24'>{points}</float_array><technique_common>\
         <accessor source='#pa' count='8' stride='3'><param name='X' type='float'/><param name='Y' type='float'/>\
         <param name='Z' type='float'/></accessor></technique_common></source>\
         <vertices id='v'><input semantic='POSITION' source='#p'/></vertices>\
         <triangles count='12'><input semantic='VERTEX' source='#v' offset='0'/><p>{faces}</p></triangles>\
         </mesh></geometry></library_geometries>\
         <library_visual_scenes><visual_scene id='s'><node id='n'><instance_geometry url='#g'/></node></visual_scene>\
         </library_visual_scenes><scene><instance_visual_scene url='#s'/></scene></COLLADA>"
    )
}

fn with_mesh(file: &str, bytes: &[u8]) -> Imported {
    let text = finger("").replacen("<box size='0.02 0.02 0.04'/>", &format!("<mesh filename='{file}'/>"), 1);
    let source = Source::new(&[("claw.urdf", &text)]);
    source.write(file, bytes);
    source.import("claw.urdf")
}

/// Size of the palm's shape.
fn size(imported: &Imported) -> palmares_models::Vec3 {
    let hand = loaded(imported);
    let palmares_models::shape::Shape::Hull { points, .. } = &hand.links[0].geoms[0].shape else {
        panic!("no hull")
    };
    let points = points.iter().map(|p| palmares_models::Vec3::from_array(*p));
    let (low, high) = points
        .fold((palmares_models::Vec3::splat(1e9), palmares_models::Vec3::splat(-1e9)), |(low, high), p| {
            (low.min(p), high.max(p))
        });
    high - low
}

#[track_caller]
fn sized(imported: &Imported, expected: [f64; 3]) {
    no_problems(imported);
    // The hull is given without the rounding, at most 2 mm on each side.
    let off = (size(imported) - palmares_models::Vec3::from_array(expected)).abs().max_element();
    assert!(off < 4.1e-3, "{} instead of {expected:?}", size(imported));
}

#[test]
fn obj_and_collada_become_stl() {
    sized(&with_mesh("part.obj", obj(0.03).as_bytes()), [0.03; 3]);
    let imported = with_mesh("part.dae", dae("0.001", "Z_UP").as_bytes());
    has(&imported, Kind::Taken, "link 'palm'", "its unit of 0.001 m is applied");
    sized(&imported, [0.01, 0.02, 0.03]);
    assert!(imported.files[Path::new("meshes/part.stl")].len() == 84 + 12 * 50);
}

#[test]
fn the_up_axis_of_collada_is_said_and_not_applied() {
    let imported = with_mesh("part.dae", dae("0.001", "Y_UP").as_bytes());
    has(&imported, Kind::Taken, "link 'palm'", "it states Y_UP");
    sized(&imported, [0.01, 0.02, 0.03]);
}

#[test]
fn a_mesh_in_millimetres_is_recognised_by_its_size() {
    let imported = with_mesh("part.obj", obj(30.0).as_bytes());
    has(&imported, Kind::Guessed, "link 'palm'", "taken to be mm");
    sized(&imported, [0.03; 3]);
}

#[test]
fn a_binary_stl_that_begins_with_solid_is_read() {
    let mut bytes = cube_stl(0.03);
    bytes[..29].copy_from_slice(b"solid exported by SolidWorks ");
    sized(&with_mesh("part.stl", &bytes), [0.03; 3]);
}

#[test]
fn a_pointer_of_git_lfs_is_named() {
    let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12\n";
    has(&with_mesh("part.stl", pointer), Kind::Problem, "link 'palm'", "git lfs pull");
    let source = Source::new(&[]);
    source.write("claw.urdf", pointer);
    assert!(source.refusal("claw.urdf").contains("git lfs pull"));
    assert!(source.refusal("").contains("git lfs pull"));
}

#[test]
fn a_mesh_beyond_the_limits_becomes_its_hull() {
    // A sheet of 180 × 300 squares over a cube: more vertices than a hand's mesh may have.
    let mut text = obj(0.03);
    let (rows, columns) = (180, 300);
    for i in 0..=rows {
        for j in 0..=columns {
            text +=
                &format!("v {} {} 0.015\n", 0.03 * i as f64 / rows as f64, 0.03 * j as f64 / columns as f64);
        }
    }
    let at = |i: usize, j: usize| 9 + i * (columns + 1) + j;
    for i in 0..rows {
        for j in 0..columns {
            text += &format!("f {} {} {} {}\n", at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        }
    }
    let imported = with_mesh("part.obj", text.as_bytes());
    has(&imported, Kind::Guessed, "link 'palm'", "convex hull is written");
    sized(&imported, [0.03; 3]);
}
