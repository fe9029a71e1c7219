//! The archive of a team's hand, as the server checks it.

use crate::parts::{self, Seeds};
use crate::{hand, mesh};

pub(crate) fn run(data: &[u8]) -> bool {
    parts::archive(data).is_some_and(|archive| palmares_server::untrusted::hand_upload(&archive))
}

pub(crate) fn seeds() -> Seeds {
    let mut seeds = Seeds::new();
    for (name, files) in hand::seeds() {
        seeds.push((format!("{name}.txt"), files));
    }
    let meshes = mesh::seeds();
    for (name, stl) in &meshes {
        let files: [(&str, &[u8]); 2] = [("a/hand.urdf", mesh::URDF.as_bytes()), ("a/tip.stl", stl)];
        seeds.push((format!("{name}.txt"), parts::joined(&files)));
        seeds.extend(parts::archive(&parts::joined(&files)).map(|zip| (format!("{name}.zip"), zip)));
    }
    seeds
}
