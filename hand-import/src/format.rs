//! The formats of descriptions, recognised by what a file contains; its extension does not count.

/// Name of the text that lists tendons which only `hand.toml` states.
pub(crate) const STATED: &str = "tendons_of_settings";

/// Format of a description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Unified Robot Description Format of ROS.
    Urdf,
    /// URDF with macros.
    Xacro,
    /// MuJoCo's XML.
    Mjcf,
    /// Simulation Description Format of Gazebo.
    Sdf,
    /// Klamp't's `.rob`.
    Klampt,
    /// GraspIt!'s robot XML.
    Graspit,
}

impl Format {
    /// Names of all formats, for messages.
    pub const NAMES: &str = "URDF, xacro, MJCF, SDF, Klamp't .rob, GraspIt! XML";

    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Format::Urdf => "URDF",
            Format::Xacro => "xacro",
            Format::Mjcf => "MJCF",
            Format::Sdf => "SDF",
            Format::Klampt => "Klamp't .rob",
            Format::Graspit => "GraspIt! XML",
        }
    }
}

/// The content of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Content {
    /// A robot.
    Robot(Format),
    /// A stand-in for a file that Git LFS stores elsewhere.
    LfsPointer,
    /// XML with another root element.
    OtherXml(String),
    /// A part for other files, such as macros or materials, without a robot of its own.
    Macros,
    /// Anything else.
    Unknown,
}

impl Content {
    /// Why it is no description, and the remedy.
    pub fn problem(&self) -> String {
        let formats = Format::NAMES;
        match self {
            Content::Robot(format) => format!("is {}", format.name()),
            Content::LfsPointer => lfs_problem(),
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

/// Remedy for a Git LFS pointer.
pub fn lfs_problem() -> String {
    "is a Git LFS pointer, not the file itself; run `git lfs install` and `git lfs pull` in its repository"
        .to_owned()
}

/// Whether these are the bytes of a Git LFS pointer.
pub fn is_lfs_pointer(bytes: &[u8]) -> bool {
    bytes.starts_with(b"version https://git-lfs.github.com/spec/")
}

/// Recognises the content of a file.
pub fn recognise(text: &str) -> Content {
    if is_lfs_pointer(text.as_bytes()) {
        return Content::LfsPointer;
    }
    let Some(tag) = root_tag(text) else {
        return if is_klampt(text) { Content::Robot(Format::Klampt) } else { Content::Unknown };
    };
    let name: String = tag.chars().take_while(|c| !c.is_whitespace() && *c != '/').collect();
    let text = without_comments(text);
    match name.as_str() {
        "mujoco" => Content::Robot(Format::Mjcf),
        "sdf" | "gazebo" => Content::Robot(Format::Sdf),
        "robot" if text.contains("<palm>") || text.contains("<palm ") => Content::Robot(Format::Graspit),
        "robot" if text.contains("<xacro:") => {
            // Files of macros have a <robot> without a name.
            let named = tag.split_whitespace().any(|word| word == "name" || word.starts_with("name="));
            if named { Content::Robot(Format::Xacro) } else { Content::Macros }
        }
        "robot" if !text.contains("<link") => Content::Macros,
        "robot" => Content::Robot(Format::Urdf),
        _ => Content::OtherXml(name.chars().take(40).collect()),
    }
}

/// The text between `<` and `>` of the first element.
fn root_tag(text: &str) -> Option<&str> {
    let mut rest = text.trim_start();
    loop {
        let skipped = if rest.starts_with("<!--") {
            rest.split_once("-->")
        } else if rest.starts_with("<?") {
            rest.split_once("?>")
        } else if rest.starts_with("<!") {
            let inner = rest.find('[').filter(|open| rest.find('>').is_none_or(|end| *open < end));
            if inner.is_some() { rest.split_once("]>") } else { rest.split_once('>') }
        } else {
            break;
        };
        rest = skipped?.1.trim_start();
    }
    let tag = rest.strip_prefix('<')?.split_once('>')?.0;
    tag.starts_with(|c: char| c.is_alphabetic()).then_some(tag)
}

/// The text without XML comments: these can contain anything.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("<!--") {
        out.push_str(before);
        rest = after.split_once("-->").map_or("", |(_, after)| after);
    }
    out + rest
}

/// A `.rob` has a keyword at the start of each line, among them the names of its links and their parents.
fn is_klampt(text: &str) -> bool {
    let keywords = || text.lines().filter_map(|line| line.split_whitespace().next());
    let has = |word: &str| keywords().any(|found| found.eq_ignore_ascii_case(word));
    let poses = ["TParent", "axis", "alpha", "alphadeg"].into_iter().any(has);
    (has("links") && has("parents")) || ((has("links") || has("parents")) && poses)
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
        assert_eq!(robot("# a hand\nlinks \"a\" \"b\"\nparents -1 0\naxis 0 0 1 0 0 1\n"), Format::Klampt);
    }

    #[test]
    fn what_is_no_robot_has_a_remedy() {
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 4\n";
        assert_eq!(recognise(pointer), Content::LfsPointer);
        assert!(recognise(pointer).problem().contains("git lfs pull"));
        assert_eq!(recognise("<robot xmlns:xacro='x'><xacro:macro name='m'/></robot>"), Content::Macros);
        assert_eq!(recognise("<COLLADA/>"), Content::OtherXml("COLLADA".to_owned()));
        assert_eq!(recognise("solid a"), Content::Unknown);
    }
}
