//! STL files, as a hand's collision shape and picture.

use crate::hand;
use crate::parts::Seeds;
use palmares_models::Vec3;
use palmares_models::read::{self, Files, LoadOptions};
use std::collections::BTreeMap;
use std::path::PathBuf;

pub(crate) const URDF: &str = include_str!("../inputs/mesh.urdf");

pub(crate) fn run(data: &[u8]) -> bool {
    // The fuzzer's time is for readers; the algorithms after them take longer with every triangle.
    if data.len() > 64 << 10 {
        return false;
    }
    let entries = BTreeMap::from([
        (PathBuf::from("hand.urdf"), URDF.as_bytes().to_vec()),
        (PathBuf::from("tip.stl"), data.to_vec()),
    ]);
    let files = Files::Archive { file: "hand.zip".into(), folder: PathBuf::new(), entries };
    let options = LoadOptions::default();
    let _ = read::visuals(files.clone(), &options);
    read::played_points(data, Vec3::new(1.0, 1.0, 1.0));
    read::from_files(files, None, &options).is_ok_and(hand::play_within_limits)
}

/// A tetrahedron with edges of about 3 cm, m.
const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [0.03, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.03]];
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

pub(crate) fn seeds() -> Seeds {
    let mut binary = vec![0; 80];
    binary.extend(4_u32.to_le_bytes());
    let mut text = String::from("solid tip\n");
    for face in FACES {
        binary.extend([0; 12]);
        text += "facet normal 0 0 0\nouter loop\n";
        for corner in face {
            let [x, y, z] = CORNERS[corner];
            binary.extend(CORNERS[corner].iter().flat_map(|x| x.to_le_bytes()));
            text += &format!("vertex {x} {y} {z}\n");
        }
        binary.extend([0; 2]);
        text += "endloop\nendfacet\n";
    }
    text += "endsolid tip\n";
    vec![("binary.stl".into(), binary), ("text.stl".into(), text.into_bytes())]
}
