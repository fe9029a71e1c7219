//! The choices of an import.

/// The caller's choices.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions {
    /// The robot of a source with several: the path of its file, an end of it, or its name without extension.
    pub robot: Option<String>,
    /// Only this link and what it carries: the hand of an arm.
    pub root: Option<String>,
    /// Links without a collision shape touch with what pictures show.
    pub visual_as_collision: bool,
    /// Replaces the robot's name.
    pub name: Option<String>,
    /// Ignores a `hand.toml` in the source, and adds commented tables for every coordinate and link to the written one.
    pub template: bool,
    /// Arguments of a xacro file: `side:=left`.
    pub xacro_arguments: Vec<String>,
}
