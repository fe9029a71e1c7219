//! Published descriptions of hands in every format, with their meshes: what an import writes loads, or it says why not.

use crate::hand;
use crate::parts::{self, Seeds};
use palmares_hand_import::decision::DecisionKind;
use palmares_hand_import::source::Source;
use palmares_hand_import::{ImportOptions, import_source};
use palmares_models::read::{Files, LoadOptions, from_files};
use std::path::{Path, PathBuf};

pub(crate) fn run(data: &[u8]) -> bool {
    // The fuzzer's time is for readers; the algorithms after them take longer with every triangle.
    if data.len() > 64 << 10 {
        return false;
    }
    let files = parts::split(data);
    let entries = files.iter().map(|(name, content)| (PathBuf::from(name), content.to_vec())).collect();
    let Ok(source) = Source::memory(Path::new("source"), entries) else { return false };
    let Ok(imported) = import_source(&source, &ImportOptions::default()) else { return false };
    if imported.decisions.iter().any(|decision| decision.kind == DecisionKind::Problem) {
        return false;
    }
    let files = Files::Archive { file: PathBuf::new(), folder: PathBuf::new(), entries: imported.files };
    let loaded = from_files(files, None, &LoadOptions::default()).expect("an import without problems loads");
    hand::play_within_limits(loaded)
}

pub(crate) fn seeds() -> Seeds {
    macro_rules! input {
        ($name:literal) => {
            ($name, include_bytes!(concat!("../inputs/import/", $name)).as_slice())
        };
    }
    let part = input!("part.obj");
    let (link, palm) = (input!("link.xml"), ("palm.xml", input!("link.xml").1));
    let seed = |name: &str, files: &[(&str, &[u8])]| (name.to_owned(), parts::joined(files));
    vec![
        seed("urdf", &[input!("claw.urdf"), input!("part.dae")]),
        seed("mjcf", &[input!("gripper.xml"), part]),
        seed("sdf", &[input!("gripper.sdf"), part]),
        seed("klampt", &[input!("gripper.rob"), input!("part.off"), input!("part.tri")]),
        seed("openrave", &[input!("claw.robot.xml"), input!("part.off")]),
        seed("graspit", &[input!("claw.xml"), palm, link, input!("box.iv")]),
    ]
}
