//! Imports of small descriptions that use the features of published ones.

mod arm;
mod couplings;
mod fingers;
mod gaps;
mod graspit;
mod hostile;
mod klampt;
mod meshes;
mod mjcf;
mod openrave;
mod round_trip;
mod urdf;
mod xacro;

use std::fs;
use std::path::{Path, PathBuf};

use palmares_hand_import::decision::DecisionKind;
use palmares_hand_import::{ImportOptions, Imported, import};
use palmares_models::hand::Hand;
use palmares_models::read::{LoadOptions, hand};

/// A source of some files.
struct Source {
    folder: tempfile::TempDir,
}

impl Source {
    fn new(files: &[(&str, &str)]) -> Source {
        let source = Source { folder: tempfile::tempdir().expect("a folder") };
        files.iter().for_each(|(path, text)| source.write(path, text.as_bytes()));
        source
    }

    fn path(&self, path: &str) -> PathBuf {
        self.folder.path().join("source").join(path)
    }

    fn write(&self, path: &str, bytes: &[u8]) {
        let path = self.path(path);
        fs::create_dir_all(path.parent().expect("a parent")).expect("made");
        fs::write(path, bytes).expect("written");
    }

    fn import(&self, path: &str) -> Imported {
        self.import_with(path, &ImportOptions::default())
    }

    fn import_with(&self, path: &str, options: &ImportOptions) -> Imported {
        let imported = import(&self.path(path), options).unwrap_or_else(|error| panic!("{error}"));
        every_decision_is_a_comment(&imported);
        imported
    }

    fn refusal(&self, path: &str) -> String {
        import(&self.path(path), &ImportOptions::default()).expect_err("refused").to_string()
    }
}

fn every_decision_is_a_comment(imported: &Imported) {
    let text = |file: &str| String::from_utf8(imported.files[Path::new(file)].clone()).expect("text");
    let written = text("hand.urdf") + &text("hand.toml");
    for decision in &imported.decisions {
        // An XML comment has no two hyphens in a row.
        let sentence = decision.text.replace('\n', " ");
        let found = written.contains(&sentence) || written.contains(&sentence.replace("--", "- -"));
        assert!(found, "no comment has: {decision}");
    }
}

/// The hand as the loader reads the written files.
fn loaded(imported: &Imported) -> Hand {
    let out = tempfile::tempdir().expect("a folder");
    imported.write(out.path(), true).expect("written");
    hand(out.path(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}")).hand
}

#[track_caller]
fn has(imported: &Imported, kind: DecisionKind, element: &str, text: &str) {
    let found = imported.decisions.iter().any(|decision| {
        decision.kind == kind && decision.element.contains(element) && decision.text.contains(text)
    });
    let all: Vec<String> = imported.decisions.iter().map(ToString::to_string).collect();
    assert!(found, "no {kind:?} about {element} has '{text}':\n{}", all.join("\n"));
}

#[track_caller]
fn no_problems(imported: &Imported) {
    let problems: Vec<String> = imported.problems().map(ToString::to_string).collect();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[track_caller]
fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-9, "{a} and {b}");
}

/// A finger of two links on a palm: `extra` is further content of the robot.
fn finger(extra: &str) -> String {
    let link = |name: &str| {
        format!(
            "<link name='{name}'><inertial><mass value='0.05'/><origin xyz='0 0 0.02'/>\
             <inertia ixx='1e-5' iyy='1e-5' izz='1e-5' ixy='0' ixz='0' iyz='0'/></inertial>\
             <collision><origin xyz='0 0 0.02'/><geometry><box size='0.02 0.02 0.04'/></geometry></collision></link>"
        )
    };
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            "<joint name='{name}' type='revolute'><parent link='{parent}'/><child link='{child}'/>\
             <origin xyz='0 0 0.045'/><axis xyz='1 0 0'/>\
             <limit lower='-0.2' upper='1.4' effort='0.7' velocity='2'/><dynamics damping='0.01'/></joint>"
        )
    };
    format!(
        "<robot name='claw'>{}{}{}{}{}{extra}</robot>",
        link("palm"),
        link("proximal"),
        link("distal"),
        joint("base", "palm", "proximal"),
        joint("tip", "proximal", "distal")
    )
}
