//! The appearance of links is read in addition to their collision shapes.

use crate::Vec3;
use crate::read::{self, Files, LoadOptions, Look};
use std::fs;

const URDF: &str = r#"<robot name="looks">
  <link name="palm"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><origin xyz="0 0 0.1"/><geometry><box size="0.2 0.1 0.05"/></geometry></visual></link>
  <link name="cover">
    <visual><origin xyz="0 0 1"/><geometry><mesh filename="meshes/cover.stl" scale="0.001 0.001 0.001"/></geometry></visual>
    <visual><geometry><mesh filename="meshes/none.stl"/></geometry></visual>
    <visual><geometry><mesh filename="meshes/cover.dae"/></geometry></visual>
    <visual><geometry><mesh filename="../secret.stl"/></geometry></visual>
    <visual><geometry><mesh filename="meshes/cover.stl"/></geometry></visual>
    <visual><geometry><sphere radius="-1"/></geometry></visual></link>
  <link name="finger"><inertial><mass value="0.1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="glued" type="fixed"><parent link="palm"/><child link="cover"/><origin xyz="0 0.5 0"/></joint>
  <joint name="knuckle" type="revolute"><parent link="palm"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>"#;

/// In millimetres: without its scale it would be 90 m wide, and is skipped.
const STL: &str = "solid c\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 90 0 0\nvertex 0 90 0\nendloop\nendfacet\nendsolid c\n";

#[test]
fn parts_stand_on_the_links_that_the_hand_has_and_what_cannot_be_read_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("meshes")).unwrap();
    fs::write(folder.path().join("hand.urdf"), URDF).unwrap();
    fs::write(folder.path().join("meshes/cover.stl"), STL).unwrap();
    let visuals = read::visuals(Files::Folder(folder.path().to_owned()), &LoadOptions::default()).unwrap();
    let [block, cover] = &visuals[..] else { panic!("{visuals:?}") };
    assert!(matches!(&block.look, Look::Shape(_)) && block.link == 0);
    assert_eq!(block.link_from_visual.translation, Vec3::new(0.0, 0.0, 0.1));
    // The cover is a part of the palm, by a fixed joint.
    assert_eq!((cover.link, cover.link_from_visual.translation), (0, Vec3::new(0.0, 0.5, 1.0)));
    let Look::Mesh(triangles) = &cover.look else { panic!("no mesh") };
    assert_eq!(triangles[..], [[[0.0, 0.0, 0.0], [0.09, 0.0, 0.0], [0.0, 0.09, 0.0]]]);
}
