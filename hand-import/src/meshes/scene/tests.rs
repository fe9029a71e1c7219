//! Scenes with known volumes and extents.

use std::f64::consts::PI;

use super::*;

const INVENTOR: &str = "#Inventor V2.1 ascii\n";
const VRML97: &str = "#VRML V2.0 utf8\n";
/// A square pyramid of base 2 × 2 and height 3: four faces and the base, outside to the left.
const PYRAMID: &str = "point [ 1 1 0, -1 1 0, -1 -1 0, 1 -1 0, 0 0 3 ]";
const FACES: &str = "coordIndex [ 0 1 4 -1 1 2 4 -1 2,3,4,-1, 3 0 4 -1 3 2 1 0 -1 ]";

fn none(name: &str) -> Result<String, String> {
    Err(format!("'{name}' is not there"))
}

fn drawn(text: &str) -> Drawn {
    read(text, &none).unwrap_or_else(|problem| panic!("{problem}: {text}"))
}

#[track_caller]
fn refused(text: &str, problem: &str) {
    let error = read(text, &none).expect_err(text);
    assert!(error.contains(problem), "{error}");
}

/// By the divergence theorem; negative if the triangles are turned over.
fn volume(corners: &Corners) -> f64 {
    corners.iter().map(|[a, b, c]| a.dot(b.cross(*c)) / 6.0).sum()
}

fn bounds(corners: &Corners) -> [Vec3; 2] {
    let all = corners.iter().flatten();
    all.fold([Vec3::splat(1e9), Vec3::splat(-1e9)], |[low, high], p| [low.min(*p), high.max(*p)])
}

#[track_caller]
fn near(a: Vec3, b: [f64; 3]) {
    assert!((a - Vec3::from_array(b)).length() < 1e-12, "{a} instead of {b:?}");
}

#[track_caller]
fn is(x: f64, expected: f64) {
    assert!((x - expected).abs() < 1e-9 * expected.abs().max(1.0), "{x} instead of {expected}");
}

#[test]
fn faces_are_the_same_in_each_format() {
    let old = format!("Separator {{ Coordinate3 {{ {PYRAMID} }} IndexedFaceSet {{ {FACES} }} }}");
    for head in ["#Inventor V1.0 ascii\n", INVENTOR, "#VRML V1.0 ascii\n"] {
        is(volume(&drawn(&(head.to_owned() + &old)).corners), 4.0);
    }
    let new =
        format!("Shape {{ geometry IndexedFaceSet {{ coord DEF c Coordinate {{ {PYRAMID} }} {FACES} }} }}");
    is(volume(&drawn(&format!("{VRML97}{new}")).corners), 4.0);
    let own = format!(
        "IndexedFaceSet {{ vertexProperty VertexProperty {{ {} }} {FACES} }}",
        PYRAMID.replace("point", "vertex")
    );
    is(volume(&drawn(&format!("{INVENTOR}{own}")).corners), 4.0);
    // In the order of their points.
    let points = "Coordinate3 { point [ 1 1 0, -1 1 0, 0 0 3, -1 1 0, -1 -1 0, 0 0 3, -1 -1 0, 1 -1 0, 0 0 3,\
                  1 -1 0, 1 1 0, 0 0 3, 1 -1 0, -1 -1 0, -1 1 0, 1 1 0 ] }";
    is(
        volume(&drawn(&format!("{INVENTOR}{points} FaceSet {{ numVertices [ 3, 3, 3, 3, 4 ] }}")).corners),
        4.0,
    );
    is(
        volume(&drawn(&format!("{INVENTOR}{points} FaceSet {{ numVertices [ 3, 3, 3, 3, -1 ] }}")).corners),
        4.0,
    );
}

#[test]
fn strips_and_nets_have_all_their_triangles() {
    // A unit cube in strips: its sides around z, then bottom and top.
    let cube = "Coordinate3 { point [ 0 0 0, 0 0 1, 1 0 0, 1 0 1, 1 1 0, 1 1 1, 0 1 0, 0 1 1 ] }";
    let strips = "IndexedTriangleStripSet { coordIndex [ 1 0 3 2 5 4 7 6 1 0 -1 0 6 2 4 -1 7 1 5 3 ] }";
    is(volume(&drawn(&format!("{INVENTOR}{cube} {strips}")).corners), 1.0);
    let net = "Coordinate3 { point [ 0 0 5, 1 0 5, 3 0 5, 0 2 5, 1 2 5, 3 2 5 ] }\
               QuadMesh { verticesPerRow 3 verticesPerColumn 2 }";
    let corners = drawn(&format!("{INVENTOR}{net}")).corners;
    assert_eq!(corners.len(), 4);
    let area: f64 = corners.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum();
    is(area, 6.0);
}

#[test]
fn clockwise_faces_and_mirrors_are_turned_outward() {
    let set = format!("Coordinate3 {{ {PYRAMID} }} IndexedFaceSet {{ {FACES} }}");
    is(volume(&drawn(&format!("{INVENTOR}ShapeHints {{ vertexOrdering CLOCKWISE }} {set}")).corners), -4.0);
    is(volume(&drawn(&format!("{INVENTOR}Scale {{ scaleFactor -2 1 1 }} {set}")).corners), 8.0);
    let shape = format!(
        "Shape {{ geometry IndexedFaceSet {{ ccw FALSE coord Coordinate {{ {PYRAMID} }} {FACES} }} }}"
    );
    is(volume(&drawn(&format!("{VRML97}{shape}")).corners), -4.0);
}

#[test]
fn solids_have_the_defaults_and_volumes_of_their_kinds() {
    // A prism and a ball of 24 points around.
    let prism = 12.0 * (PI / 12.0).sin();
    for (text, expected) in [
        ("Cube { }", 8.0),
        ("Cube { width 1 height 2 depth 3 }", 6.0),
        ("Cylinder { }", 2.0 * prism),
        ("Cylinder { parts (SIDES | TOP) radius 3 height .5 }", 4.5 * prism),
        ("Cone { }", 2.0 / 3.0 * prism),
        ("Cone { bottomRadius 2 height 3 }", 4.0 * prism),
    ] {
        is(volume(&drawn(&format!("{INVENTOR}{text}")).corners), expected);
    }
    is(volume(&drawn(&format!("{VRML97}Shape {{ geometry Box {{ size 1 2 4 }} }}")).corners), 8.0);
    let ball = volume(&drawn(&format!("{INVENTOR}Sphere {{ }}")).corners);
    assert!(ball < 4.0 / 3.0 * PI && ball > 0.97 * 4.0 / 3.0 * PI, "{ball}");
    // The axis of a cylinder is y.
    let [low, high] = bounds(&drawn(&format!("{INVENTOR}Cylinder {{ height 8 }}")).corners);
    near(low, [-1.0, -4.0, -1.0]);
    near(high, [1.0, 4.0, 1.0]);
    // The tip of a cone is at +y.
    let cone = drawn(&format!("{INVENTOR}Cone {{ }}"));
    assert!(cone.corners.iter().flatten().filter(|p| p.y > 0.0).all(|p| p.x == 0.0 && p.z == 0.0));
}

#[test]
fn a_separator_restores_what_a_group_keeps() {
    let cube = "Cube { width 2 height 2 depth 2 }";
    let [low, high] = bounds(
        &drawn(&format!("{INVENTOR}Separator {{ Translation {{ translation 5 0 0 }} }} {cube}")).corners,
    );
    near(low, [-1.0; 3]);
    near(high, [1.0; 3]);
    for group in ["Group", "Separator"] {
        let inside = format!("{INVENTOR}{group} {{ Translation {{ translation 5 0 0 }} {cube} }} {cube}");
        let [low, high] = bounds(&drawn(&inside).corners);
        near(low, if group == "Group" { [4.0, -1.0, -1.0] } else { [-1.0; 3] });
        near(high, [6.0, 1.0, 1.0]);
    }
    // A `TransformSeparator` keeps the points.
    let kept = format!(
        "{INVENTOR}TransformSeparator {{ Coordinate3 {{ {PYRAMID} }} Scale {{ scaleFactor 9 9 9 }} }} IndexedFaceSet {{ {FACES} }}"
    );
    is(volume(&drawn(&kept).corners), 4.0);
    // Each group of VRML 97 restores.
    let twice = format!(
        "{VRML97}Transform {{ translation 5 0 0 children [ Shape {{ geometry Box {{ }} }} ] }} Shape {{ geometry Box {{ }} }}"
    );
    near(bounds(&drawn(&twice).corners)[0], [-1.0; 3]);
}

#[test]
fn frames_follow_their_definitions() {
    let low = |text: &str| bounds(&drawn(text).corners)[0];
    let cube = "Cube { width 2 height 4 depth 6 }";
    // Later nodes act first.
    near(
        low(&format!("{INVENTOR}Translation {{ translation 10 0 0 }} Scale {{ scaleFactor 2 1 1 }} {cube}")),
        [8.0, -2.0, -3.0],
    );
    near(
        low(&format!("{INVENTOR}Scale {{ scaleFactor 2 1 1 }} Translation {{ translation 10 0 0 }} {cube}")),
        [18.0, -2.0, -3.0],
    );
    near(
        low(&format!("{INVENTOR}RotationXYZ {{ axis Z angle 1.5707963267948966 }} {cube}")),
        [-2.0, -1.0, -3.0],
    );
    near(low(&format!("{INVENTOR}RotationXYZ {{ angle 1.5707963267948966 }} {cube}")), [-1.0, -3.0, -2.0]);
    near(
        low(&format!("{INVENTOR}Rotation {{ rotation 0 7 0 1.5707963267948966 }} {cube}")),
        [-3.0, -2.0, -1.0],
    );
    // The last row of a matrix moves; its first row is the image of x.
    let matrix = "MatrixTransform { matrix 0 3 0 0  -1 0 0 0  0 0 1 0  10 20 30 1 }";
    near(low(&format!("{INVENTOR}{matrix} {cube}")), [8.0, 17.0, 27.0]);
    // About (1, 0, 0): x from -1 to 1 becomes x = 1, y from -2 to 0, doubled along the turned y, moved by 10.
    let transform = "translation 10 0 0 rotation 0 0 1 1.5707963267948966 center 1 0 0 scaleFactor 2 1 1";
    near(low(&format!("{INVENTOR}Transform {{ {transform} }} {cube}")), [9.0, -4.0, -3.0]);
    let new = transform.replace("scaleFactor", "scale");
    let shape = "children Shape { geometry Box { size 2 4 6 } }";
    near(low(&format!("{VRML97}Transform {{ {shape} {new} }}")), [9.0, -4.0, -3.0]);
    // A scale along an axis at 45°: only in its own frame is it a diagonal.
    let along = "Transform { scaleFactor 3 1 1 scaleOrientation 0 0 1 0.7853981633974483 }";
    let [low, high] = bounds(&drawn(&format!("{INVENTOR}{along} Cube {{ }}")).corners);
    near(low, [-3.0, -3.0, -1.0]);
    near(high, [3.0, 3.0, 1.0]);
}

#[test]
fn units_scale_what_comes_after_them() {
    let high = |text: &str| bounds(&drawn(&format!("{INVENTOR}{text}")).corners)[1];
    near(high("Units { units INCHES } Cube { }"), [0.0254; 3]);
    near(high("Units { units MILLIMETERS } Units { units METERS } Cube { }"), [1.0; 3]);
    near(high("Separator { Units { units MILLIMETERS } } Cube { }"), [1.0; 3]);
    refused(&format!("{INVENTOR}Units {{ units ELLS }} Cube {{ }}"), "unknown unit 'ELLS'");
}

#[test]
fn nodes_are_used_again() {
    let text = format!(
        "{INVENTOR}DEF a Separator {{ Cube {{ }} }} Translation {{ translation 5 0 0 }} USE a Translation {{ translation 5 0 0 }} USE a"
    );
    let all = drawn(&text);
    is(volume(&all.corners), 24.0);
    near(bounds(&all.corners)[1], [11.0, 1.0, 1.0]);
    refused(&format!("{INVENTOR}USE a"), "no DEF before it");
}

#[test]
fn a_switch_shows_the_child_that_it_names() {
    let choice = |which: &str| format!("{INVENTOR}Switch {{ {which} Cube {{ }} Cube {{ width 4 }} }}");
    assert!(drawn(&choice("")).corners.is_empty());
    assert!(drawn(&choice("whichChild -1")).corners.is_empty());
    assert!(drawn(&choice("whichChild 7")).corners.is_empty());
    is(volume(&drawn(&choice("whichChild 1")).corners), 16.0);
    is(volume(&drawn(&choice("whichChild -3")).corners), 24.0);
    let new = "Switch { whichChoice 0 choice [ Shape { geometry Box { } } Shape { geometry Sphere { } } ] }";
    is(volume(&drawn(&format!("{VRML97}{new}")).corners), 8.0);
    is(volume(&drawn(&format!("{INVENTOR}LOD {{ range [ 5 ] Cube {{ }} Sphere {{ }} }}")).corners), 8.0);
}

#[test]
fn a_few_solids_become_shapes_of_a_hand() {
    let text = format!(
        "{INVENTOR}Separator {{ Translation {{ translation 1 2 3 }} RotationXYZ {{ axis Z angle 1.5707963267948966 }} Scale {{ scaleFactor 2 2 2 }}\
         Cylinder {{ radius 1 height 5 }} Sphere {{ radius 3 }} Scale {{ scaleFactor 1 3 1 }} Cube {{ }} Sphere {{ }} }}"
    );
    let shapes = drawn(&text).shapes;
    assert_eq!(shapes.len(), 4);
    let (pose, geometry) = &shapes[0];
    near(pose.translation, [1.0, 2.0, 3.0]);
    // y is turned to -x; a hand's cylinder has its axis along z.
    near((pose.rotation * Vec3::Z).abs(), [1.0, 0.0, 0.0]);
    let Geometry::Cylinder { radius, length } = geometry else { panic!("{geometry:?}") };
    is(*radius, 2.0);
    is(*length, 10.0);
    assert!(matches!(shapes[1].1, Geometry::Sphere { radius } if (radius - 6.0).abs() < 1e-12));
    assert!(
        matches!(shapes[2].1, Geometry::Box([x, y, _]) if (x - 4.0).abs() < 1e-12 && (y - 12.0).abs() < 1e-12)
    );
    assert!(
        matches!(shapes[3].1, Geometry::Ellipsoid([x, y, _]) if (x - 2.0).abs() < 1e-12 && (y - 6.0).abs() < 1e-12)
    );
    // With anything else beside them, or sheared, all is one mesh.
    let faces = format!("Coordinate3 {{ {PYRAMID} }} IndexedFaceSet {{ {FACES} }}");
    for more in ["Cone { }", "Scale { scaleFactor 2 1 1 } Cylinder { }", "Cube { width -1 }", &faces] {
        assert!(drawn(&format!("{INVENTOR}Cube {{ }} {more}")).shapes.is_empty(), "{more}");
    }
    let sheared = "Scale { scaleFactor 2 1 1 } RotationXYZ { axis Z angle 0.5 } Cube { }";
    assert!(drawn(&format!("{INVENTOR}{sheared}")).shapes.is_empty());
    assert!(drawn(&format!("{INVENTOR}{}", "Cube { } ".repeat(7))).shapes.is_empty());
}

#[test]
fn other_files_are_read_where_they_are_named() {
    let open = |name: &str| match name {
        "cube.iv" => Ok(format!("{INVENTOR}Cube {{ }}")),
        "loop.iv" => Ok(format!("{INVENTOR}File {{ name \"loop.iv\" }}")),
        _ => none(name),
    };
    let moved = format!("{INVENTOR}Translation {{ translation 5 0 0 }} File {{ name \"cube.iv\" }}");
    near(bounds(&read(&moved, &open).expect("read").corners)[1], [6.0, 1.0, 1.0]);
    let inline = format!("{VRML97}Inline {{ url [ \"cube.iv\" ] }}");
    is(volume(&read(&inline, &open).expect("read").corners), 8.0);
    let error = read(&format!("{INVENTOR}File {{ name \"none.iv\" }}"), &open).expect_err("not there");
    assert!(error.contains("'none.iv' is not there"), "{error}");
    let error = read(&format!("{INVENTOR}File {{ name \"loop.iv\" }}"), &open).expect_err("a circle");
    assert!(error.contains("more than 8 files"), "{error}");
}

#[test]
fn what_is_not_read_is_named() {
    refused("#Inventor V2.1 binary\n", "binary Open Inventor");
    refused("solid a", "no Open Inventor or VRML");
    refused("#X3D V3.0 utf8\nPROFILE Immersive", "no Open Inventor or VRML");
    refused(&format!("{VRML97}Shape {{ geometry Extrusion {{ }} }}"), "node Extrusion");
    refused(&format!("{VRML97}PROTO A [ ] {{ }} A {{ }}"), "PROTO");
    assert!(
        drawn(&format!("{INVENTOR}Text3 {{ string \"a\" }} Unknown {{ a 1 b [ 2 ] Cube {{ }} }}"))
            .corners
            .len()
            == 12
    );
}

#[test]
fn hostile_scenes_are_errors() {
    let set = |points: &str, faces: &str| {
        format!("{INVENTOR}Coordinate3 {{ point [ {points} ] }} IndexedFaceSet {{ coordIndex [ {faces} ] }}")
    };
    refused(&set("0 0 0 1 0 0 0 1 0", "0 1 99999999999 -1"), "not there");
    refused(&set("0 0 0 1 0 0 0 1 0", "0 1 3 -1"), "not there");
    refused(&set("0 0 0 1 0 0 0 1 0", "0 1 0.5 -1"), "index");
    refused(&set("0 0 0 1 0", ""), "no multiple of 3");
    refused(&set("nan 0 0", "0 0 0"), "multiple of 3");
    refused(&set("1e400 0 0", "0 0 0"), "finite");
    refused(
        &format!("{INVENTOR}Coordinate3 {{ point 0 0 0 }} FaceSet {{ numVertices 1000000000 }}"),
        "more vertices",
    );
    refused(
        &format!("{INVENTOR}QuadMesh {{ verticesPerRow 999999999 verticesPerColumn 999999999 }}"),
        "more vertices",
    );
    refused(&format!("{INVENTOR}Translation {{ translation 1 2 }}"), "2 numbers instead of 3");
    // Each name doubles the last: 2³⁰ cubes.
    let mut doubled = format!("{INVENTOR}Switch {{ DEF a0 Group {{ Sphere {{ }} }} ");
    for k in 1..=30 {
        doubled += &format!("DEF a{k} Group {{ USE a{} USE a{} }} ", k - 1, k - 1);
    }
    refused(&format!("{doubled} }} USE a30"), "vertices; the limit");
    refused(&format!("{} }} USE a30", doubled.replace("Sphere { }", "")), "uses its nodes more than");
    // Each name is one deeper than the last.
    let mut deep = format!("{INVENTOR}Switch {{ DEF a0 Group {{ }} ");
    for k in 1..=20_000 {
        deep += &format!("DEF a{k} Group {{ USE a{} }} ", k - 1);
    }
    refused(&format!("{deep} }} USE a20000"), "inside each other");
    // Many points, used many times.
    let heavy = format!(
        "{INVENTOR}DEF p Coordinate3 {{ point [ {} ] }} {}",
        "0 0 0 ".repeat(100_000),
        "USE p ".repeat(1000)
    );
    refused(&heavy, "more than 50000000 numbers");
}

#[test]
fn a_text_that_is_cut_anywhere_is_an_error_or_a_scene() {
    let text = format!(
        "{VRML97}DEF a Transform {{ rotation 0 1 0 .5 children [ Shape {{ geometry IndexedFaceSet {{ coord Coordinate {{ {PYRAMID} }} {FACES} }} }}\
         DEF b Switch {{ whichChoice 0 choice [ USE a, Shape {{ geometry Cone {{ }} }} ] }} ] }}"
    );
    for end in 0..text.len() {
        let _ = read(&text[..end], &none);
        let _ = read(&format!("{}{}", &text[..end], &text[end / 2..]), &none);
    }
}
