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
    has(&imported, DecisionKind::Taken, "link 'palm'", "its unit of 0.001 m is applied");
    sized(&imported, [0.01, 0.02, 0.03]);
    assert!(imported.files[Path::new("meshes/part.stl")].len() == 84 + 12 * 50);
}

#[test]
fn the_up_axis_of_collada_is_said_and_not_applied() {
    let imported = with_mesh("part.dae", dae("0.001", "Y_UP").as_bytes());
    has(&imported, DecisionKind::Taken, "link 'palm'", "it states Y_UP");
    sized(&imported, [0.01, 0.02, 0.03]);
}

#[test]
fn a_mesh_in_millimetres_is_recognised_by_its_size() {
    let imported = with_mesh("part.obj", obj(30.0).as_bytes());
    has(&imported, DecisionKind::Guessed, "link 'palm'", "taken to be mm");
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
    has(&with_mesh("part.stl", pointer), DecisionKind::Problem, "link 'palm'", "git lfs pull");
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
    has(&imported, DecisionKind::Guessed, "link 'palm'", "convex hull is written");
    sized(&imported, [0.03; 3]);
}

/// COLLADA with the nodes of a scene; `#g` is a tetrahedron of 20 units along each axis.
fn scene(unit: &str, nodes: &str, libraries: &str, set: &str) -> String {
    format!(
        "<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset><unit meter='{unit}'/></asset>\
         <library_geometries><geometry id='g'><mesh><source id='p'><float_array id='a' count='12'>0 0 0 20 0 0 0 20 0 0 0 20\
         </float_array><technique_common><accessor source='#a' count='4' stride='3'/></technique_common></source>\
         <vertices id='v'><input semantic='POSITION' source='#p'/></vertices>{set}</mesh></geometry>\
         <geometry id='unused'><mesh><source id='q'><float_array id='b' count='9'>900 0 0 0 900 0 0 0 900</float_array>\
         <technique_common><accessor source='#b' count='3' stride='3'/></technique_common></source><vertices id='w'>\
         <input semantic='POSITION' source='#q'/></vertices><triangles count='1'><input semantic='VERTEX' source='#w' offset='0'/>\
         <p>0 1 2</p></triangles></mesh></geometry></library_geometries>{libraries}\
         <library_visual_scenes><visual_scene id='s'>{nodes}</visual_scene></library_visual_scenes>\
         <scene><instance_visual_scene url='#s'/></scene></COLLADA>"
    )
}

const TETRAHEDRON: &str = "<triangles count='4'><input semantic='VERTEX' source='#v' offset='1'/>\
    <input semantic='NORMAL' source='#nowhere' offset='0'/><p>0 0 0 2 0 1 0 0 0 1 0 3 0 0 0 3 0 2 0 1 0 2 0 3</p></triangles>";

/// Lowest and highest corner of the palm's mesh as it is written, mm, and the number of its triangles.
#[track_caller]
fn written(file: &str, bytes: &[u8]) -> ([f64; 3], [f64; 3], usize) {
    let imported = with_mesh(file, bytes);
    no_problems(&imported);
    let stl = &imported.files[&Path::new("meshes").join(file).with_extension("stl")];
    let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
    for triangle in stl[84..].chunks_exact(50) {
        for (k, x) in triangle[12..48].chunks_exact(4).enumerate() {
            let x = f64::from(f32::from_le_bytes([x[0], x[1], x[2], x[3]]));
            let x = (x * 1e5).round() / 100.0;
            (low[k % 3], high[k % 3]) = (low[k % 3].min(x), high[k % 3].max(x));
        }
    }
    (low, high, (stl.len() - 84) / 50)
}

#[test]
fn a_scene_of_collada_places_its_geometries() {
    const AT: &str = "<instance_geometry url='#g'/>";
    let dae = |nodes: &str, libraries: &str| {
        written("part.dae", scene("0.001", nodes, libraries, TETRAHEDRON).as_bytes())
    };
    // Places are in the unit of the file, and a geometry that no node names is not there.
    let moved = format!("<node><translate>100 0 5</translate>{AT}</node>");
    assert_eq!(dae(&moved, ""), ([100.0, 0.0, 5.0], [120.0, 20.0, 25.0], 4));
    // Twice in the scene, the second time mirrored.
    let twice = format!("<node>{AT}</node><node><scale>-1 1 1</scale>{AT}</node>");
    assert_eq!(dae(&twice, ""), ([-20.0, 0.0, 0.0], [20.0, 20.0, 20.0], 8));
    // From the outside to the inside, in the order of the elements.
    let nested = format!(
        "<node><rotate>0 0 1 90</rotate><node><translate>100 0 0</translate><scale>2 1 1</scale>{AT}</node></node>"
    );
    assert_eq!(dae(&nested, ""), ([-20.0, 100.0, 0.0], [0.0, 140.0, 20.0], 4));
    let matrix = format!("<node><matrix>0 -1 0 7  1 0 0 0  0 0 1 0  0 0 0 1</matrix>{AT}</node>");
    assert_eq!(dae(&matrix, ""), ([-13.0, 0.0, 0.0], [7.0, 20.0, 20.0], 4));
    // Points along y shear along x by 45°.
    let skew = format!("<node><skew>45 0 1 0 1 0 0</skew>{AT}</node>");
    assert_eq!(dae(&skew, ""), ([0.0, 0.0, 0.0], [20.0, 20.0, 20.0], 4));
    let shifted = format!("<node><skew>45 0 1 0 1 0 0</skew><translate>0 10 0</translate>{AT}</node>");
    assert_eq!(dae(&shifted, "").0, [10.0, 10.0, 0.0]);
    // From the eye, x is to the right, y up and z backwards.
    let look = format!("<node><lookat>100 0 0  100 1 0  0 0 1</lookat>{AT}</node>");
    assert_eq!(dae(&look, ""), ([100.0, -20.0, 0.0], [120.0, 0.0, 20.0], 4));
    let library =
        format!("<library_nodes><node id='n'><translate>0 30 0</translate>{AT}</node></library_nodes>");
    let instance = "<node><translate>10 0 0</translate><instance_node url='#n'/></node>";
    assert_eq!(dae(instance, &library).0, [10.0, 30.0, 0.0]);
    let skin = "<library_controllers><controller id='c'><skin source='#g'><bind_shape_matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1\
                </bind_shape_matrix></skin></controller></library_controllers>";
    let bones = "<node><translate>0 0 1</translate><instance_controller url='#c'/></node>";
    assert_eq!(dae(bones, skin).0, [5.0, 0.0, 1.0]);
}

#[test]
fn all_faces_of_collada_are_read() {
    let faces = |set: &str| {
        let set = set.replace("<p>", "<input semantic='VERTEX' source='#v' offset='0'/><p>");
        let text = scene("0.001", "<node><instance_geometry url='#g'/></node>", "", &set);
        written("part.dae", text.as_bytes()).2
    };
    assert_eq!(faces("<polylist count='3'><vcount>3 4 3</vcount><p>0 2 1 0 1 3 2 0 3 1</p></polylist>"), 4);
    // A second <p> without another <input>.
    let two = "<polygons count='2'><p>0 2 1</p></polygons><tristrips count='1'><p>0 1 2 3</p></tristrips>";
    assert_eq!(faces(two), 3);
    assert_eq!(faces("<trifans count='1'><p>0 1 2 3</p></trifans><lines count='1'><p>0 1</p></lines>"), 2);
}

#[test]
fn a_wrong_collada_file_is_a_problem() {
    const AT: &str = "<node><instance_geometry url='#g'/></node>";
    let good = scene("0.001", AT, "", TETRAHEDRON);
    for (from, to, wanted) in [
        ("0 0 0 2 0 1", "0 0 0 2 0 9", "vertices that are not there"),
        ("stride='3'", "stride='0'", "positions of 0 numbers"),
        ("url='#g'", "url='#h'", "'#h', which is not there"),
        ("semantic='VERTEX' source='#v'", "semantic='VERTEX' source='#u'", "'#u'"),
        ("meter='0.001'", "meter='x'", "unit 'x'"),
        ("<p>0 0", "<p>-1 0", "'-1' where an index"),
        ("0 0 0 20 0", "0 0 nan 20 0", "no finite number"),
    ] {
        assert!(good.contains(from), "{from}");
        let imported = with_mesh("part.dae", good.replace(from, to).as_bytes());
        has(&imported, DecisionKind::Problem, "link 'palm'", wanted);
    }
    // Nodes that name each other, and nodes that double at each level.
    let circle = scene("1", "<node id='n'><instance_node url='#n'/></node>", "", TETRAHEDRON);
    has(&with_mesh("part.dae", circle.as_bytes()), DecisionKind::Problem, "link 'palm'", "inside each other");
    let doubled = |k: usize| {
        format!("<node id='n{k}'><instance_node url='#n{0}'/><instance_node url='#n{0}'/></node>", k + 1)
    };
    let nodes: String = (0..40).map(doubled).collect::<String>() + "<node id='n40'/>";
    let doubled = scene("1", &nodes, "", TETRAHEDRON);
    has(&with_mesh("part.dae", doubled.as_bytes()), DecisionKind::Problem, "link 'palm'", "in all");
}

/// Binary glTF: a tetrahedron of 20 mm, in a node turned by 90° about x that a node moves.
fn glb(change: impl Fn(String) -> String) -> Vec<u8> {
    let mut binary = Vec::new();
    for x in [0.0_f32, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0, 0.04] {
        binary.extend(x.to_le_bytes());
    }
    binary.extend([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3].into_iter().flat_map(u16::to_le_bytes));
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"translation":[0.1,0,0],"children":[1]},{"mesh":0,"rotation":[0.7071067811865476,0,0,0.7071067811865476]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
                     {"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
        "buffers":[{"byteLength":72}]}"#;
    let mut json = change(json.to_owned()).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF".to_vec();
    let words = |bytes: &mut Vec<u8>, n: usize| bytes.extend((n as u32).to_le_bytes());
    words(&mut bytes, 2);
    words(&mut bytes, 28 + json.len() + binary.len());
    words(&mut bytes, json.len());
    bytes.extend(b"JSON");
    bytes.extend(json);
    words(&mut bytes, binary.len());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

#[test]
fn binary_gltf_is_read() {
    // y becomes z, and z becomes -y.
    let (low, high, triangles) = written("part.glb", &glb(|json| json));
    assert_eq!((low, high, triangles), ([100.0, -40.0, 0.0], [120.0, 0.0, 20.0], 4));
    let without_indices = glb(|json| json.replace(",\"indices\":1", ",\"mode\":5"));
    assert_eq!(written("part.glb", &without_indices).2, 2);
    for (from, to, wanted) in [
        ("\"count\":12", "\"count\":13", "ends too early"),
        ("\"byteLength\":48}", "\"byteLength\":4800}", "ends too early"),
        ("\"children\":[1]", "\"children\":[0]", "inside each other"),
        ("\"children\":[1]", "\"children\":[7]", "node 7"),
        ("\"scene\":0", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]", "without compression"),
        ("{\"byteLength\":72}", "{\"byteLength\":72,\"uri\":\"a.bin\"}", "one .glb"),
    ] {
        let imported = with_mesh("part.glb", &glb(|json| json.replace(from, to)));
        has(&imported, DecisionKind::Problem, "link 'palm'", wanted);
    }
    let bytes = glb(|json| json);
    for end in (0..bytes.len()).step_by(7) {
        with_mesh("part.glb", &bytes[..end]);
    }
}

#[test]
fn a_picture_that_cannot_be_read_is_dropped() {
    for mesh in ["part.blend", "missing.stl"] {
        let picture = format!("<visual><geometry><mesh filename='{mesh}'/></geometry></visual><collision>");
        let source = Source::new(&[("claw.urdf", &finger("").replacen("<collision>", &picture, 1))]);
        source.write("part.blend", b"BLENDER");
        let imported = source.import("claw.urdf");
        no_problems(&imported);
        has(&imported, DecisionKind::Dropped, "link 'palm'", "picture: mesh");
    }
}
