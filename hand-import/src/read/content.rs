//! The content of files: which format a description has, and which file of a source is the description.

use std::path::{Path, PathBuf};

use super::{Format, foreign};
use crate::error::ImportError;
use crate::glance::{Glance, is_lfs_pointer, lfs_problem};
use crate::source::Source;

/// The content of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Content {
    /// A robot.
    Robot(Format),
    /// A stand-in for a file that Git LFS stores elsewhere.
    LfsPointer,
    /// A format that is not read, in words with the remedy.
    Foreign(String),
    /// XML with another root element.
    OtherXml(String),
    /// A part for other files, such as macros or materials, without a robot of its own.
    Macros,
    /// Anything else.
    Unknown,
}

impl Content {
    /// Why it is no description, and the remedy.
    pub(crate) fn problem(&self) -> String {
        let formats = Format::names();
        match self {
            Content::Robot(format) => format!("is {}", format.name()),
            Content::LfsPointer => lfs_problem(),
            Content::Foreign(words) => words.clone(),
            Content::OtherXml(root) => {
                format!("is XML with the root element <{root}>; known formats: {formats}")
            }
            Content::Macros => {
                "only has parts for other files, such as macros; name the file that uses them".to_owned()
            }
            Content::Unknown => format!("has an unknown format; known formats: {formats}"),
        }
    }
}

/// Recognises the content of a file.
pub(crate) fn recognise(text: &str) -> Content {
    if is_lfs_pointer(text.as_bytes()) {
        return Content::LfsPointer;
    }
    let file = Glance::new(text);
    if let Some(words) = foreign::recognised(text, &file) {
        return Content::Foreign(words);
    }
    match (Format::ALL.iter().rev().find(|format| format.is(&file)), file.root) {
        (Some(format), _) => Content::Robot(*format),
        (None, "") => Content::Unknown,
        (None, "robot") => Content::Macros,
        (None, root) => Content::OtherXml(root.chars().take(40).collect()),
    }
}

/// The description to import, and its format: the named file, or the only one of the source that `robot` selects.
///
/// # Errors
/// There is none, or there are several.
pub(crate) fn description(source: &Source, robot: Option<&str>) -> Result<(PathBuf, Format), ImportError> {
    if let Some(named) = source.named() {
        let text = source.text(named, "source")?;
        return match recognise(&text) {
            Content::Robot(format) => Ok((named.to_owned(), format)),
            Content::Foreign(words) => robot_of_world(source, named, &text)
                .ok_or_else(|| ImportError::unreadable(source.display(named), words)),
            content => Err(ImportError::unreadable(source.display(named), content.problem())),
        };
    }
    let mut found: Vec<(PathBuf, Format)> = Vec::new();
    let (mut pointers, mut foreign) = (0, None);
    for path in source.paths().iter().filter(|path| may_describe(path)) {
        let Ok(text) = source.text(path, "source") else { continue };
        match recognise(&text) {
            Content::Robot(format) => found.push((path.clone(), format)),
            Content::LfsPointer => pointers += 1,
            Content::Foreign(words) => foreign = foreign.or(Some((path.clone(), words))),
            _ => {}
        }
    }
    let chosen: Vec<&(PathBuf, Format)> = match robot {
        Some(robot) => found.iter().filter(|(path, _)| selects(robot, path)).collect(),
        None => {
            let own = found.iter().filter(|(path, _)| path == Path::new("hand.urdf"));
            let own: Vec<_> = own.collect();
            if own.is_empty() { found.iter().collect() } else { own }
        }
    };
    let named = |list: &[&(PathBuf, Format)]| {
        list.iter().map(|(path, format)| format!("{} ({})", path.display(), format.name())).collect()
    };
    match (chosen.as_slice(), robot) {
        ([one], _) => Ok((one.0.clone(), one.1)),
        ([], Some(robot)) if !found.is_empty() => {
            let all: Vec<String> = named(&found.iter().collect::<Vec<_>>());
            let problem = format!("no robot '{robot}'; there are: {}", all.join(", "));
            Err(ImportError::unreadable(source.root(), problem))
        }
        ([], _) => {
            let mut problem = format!("has no robot in a known format ({})", Format::names());
            if let Some((path, words)) = foreign {
                problem += &format!("; {} {words}", path.display());
            }
            if pointers > 0 {
                problem += &format!("; {pointers} files are Git LFS pointers: run `git lfs pull` there");
            }
            Err(ImportError::unreadable(source.root(), problem))
        }
        (several, _) => {
            Err(ImportError::Several { source_path: source.root().to_owned(), robots: named(several) })
        }
    }
}

/// The only robot of a Klamp't world, if it is in the source.
fn robot_of_world(source: &Source, world: &Path, text: &str) -> Option<(PathBuf, Format)> {
    let found = source.resolve(world, &foreign::robot_of_world(text)?).ok()?;
    match recognise(&source.text(&found.path, "robot").ok()?) {
        Content::Robot(format) => Some((found.path, format)),
        _ => None,
    }
}

/// Whether a file's name is one that a description can have.
fn may_describe(path: &Path) -> bool {
    let kind = path.extension().map(|kind| kind.to_string_lossy().to_ascii_lowercase());
    let known = |kind: &String| Format::ALL.iter().any(|format| format.endings().contains(&kind.as_str()));
    kind.is_some_and(|kind| known(&kind) || matches!(&*kind, "usd" | "usda" | "usdc"))
}

/// Whether `--robot` means this file: by its path, an end of it, or its name without extensions.
fn selects(robot: &str, path: &Path) -> bool {
    let stem = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = stem.split('.').next().unwrap_or_default();
    path.ends_with(robot) || stem == robot
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_is_recognised_by_content() {
        let robot = |text: &str| match recognise(text) {
            Content::Robot(format) => format,
            content => panic!("{text}: {content:?}"),
        };
        assert_eq!(
            robot("<?xml version='1.0'?>\n<!-- <mujoco> --><robot name='a'><link name='b'/></robot>"),
            Format::Urdf
        );
        assert_eq!(robot("<robot name='a' xmlns:xacro='x'><link name='b'/></robot>"), Format::Urdf);
        assert_eq!(
            robot("<robot name='a' xmlns:xacro='x'><xacro:include filename='b'/></robot>"),
            Format::Xacro
        );
        assert_eq!(robot("<mujoco model='a'/>"), Format::Mjcf);
        assert_eq!(robot("<sdf version='1.7'><model name='a'/></sdf>"), Format::Sdf);
        assert_eq!(
            robot("<?xml version='1.0' ?><robot type='Hand'><palm>p.xml</palm></robot>"),
            Format::Graspit
        );
        assert_eq!(robot("<Robot name='g'><KinBody><Body name='b'/></KinBody></Robot>"), Format::OpenRave);
        assert_eq!(robot("<kinbody><body name='b'/></kinbody>"), Format::OpenRave);
        assert_eq!(robot("# a hand\nlinks \"a\" \"b\"\nparents -1 0\naxis 0 0 1 0 0 1\n"), Format::Klampt);
    }

    #[test]
    fn what_is_no_robot_has_a_remedy() {
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 4\n";
        assert_eq!(recognise(pointer), Content::LfsPointer);
        assert!(recognise(pointer).problem().contains("git lfs pull"));
        assert_eq!(recognise("<robot xmlns:xacro='x'><xacro:macro name='m'/></robot>"), Content::Macros);
        assert_eq!(recognise("<COLLADA/>"), Content::OtherXml("COLLADA".to_owned()));
        for (text, words) in [
            ("#usda 1.0\ndef Xform \"hand\" {}", "is USD, which is not read"),
            ("PXR-USDC\0\0", "is USD, which is not read"),
            (
                "<world><robot file='a.rob'/><robot file='b.rob'/></world>",
                "2 robots (a.rob, b.rob), no objects",
            ),
            (
                "<world><rigidObject name='o' file='o.obj'/><terrain name='t'/></world>",
                "no robots, 1 objects (o) and 1 terrains (t)",
            ),
            (
                "<Environment><Robot name='g'><KinBody/></Robot><KinBody name='mug'/></Environment>",
                "is an environment of OpenRAVE with 2 robots and kinbodies (g, mug)",
            ),
        ] {
            let problem = recognise(text).problem();
            assert!(problem.contains(words), "{problem}");
        }
        assert_eq!(recognise("solid a"), Content::Unknown);
    }
}
