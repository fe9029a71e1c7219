//! Scenes of Open Inventor, VRML 1 and VRML 97 as text: what is drawn becomes triangles, or shapes of a hand.
//!
//! 1. `nodes.rs` reads the text, [`Walk`] visits its nodes in order. A node such as `Translation` or `Coordinate3` changes
//!    the state for those after it; a `Separator`, and each group of VRML 97, restores it.
//! 2. `frame.rs` has the maps of nodes, `solids.rs` the shapes with a formula, `faces.rs` those of points.
//!
//! Sources: The Inventor Mentor (1994) and the manual pages of its nodes; VRML 1.0c; ISO/IEC 14772-1 (VRML 97).

mod faces;
mod frame;
mod nodes;
mod solids;
#[cfg(test)]
mod tests;

use std::rc::Rc;

use palmares_models::{Pose, Vec3};

use self::frame::Frame;
use self::nodes::{Node, Tree};
use self::solids::Solid;
use super::text::Corners;
use crate::draft::Geometry;
use crate::source::limits;

/// Visited nodes; each `USE` counts.
const MAX_VISITS: usize = 200_000;
/// Nodes that are being visited, inside each other.
const MAX_DEPTH: usize = 256;
/// Files that a file names, also through others.
const MAX_FILES: usize = 8;
/// Numbers in all visited nodes.
const MAX_NUMBERS: usize = 50_000_000;
/// Solids that a file may have to become shapes of a link. With more, its triangles are one mesh.
const MAX_SOLIDS: usize = 6;

/// The triangles and shapes that a scene draws.
#[derive(Debug, Default)]
pub(crate) struct Drawn {
    pub(crate) corners: Corners,
    /// The same as shapes of a hand, if all of it is a few of them.
    pub(crate) shapes: Vec<(Pose, Geometry)>,
}

/// The text of a file that a scene names.
pub(crate) type Open<'a> = &'a dyn Fn(&str) -> Result<String, String>;

/// Whether a text is of one of these formats.
pub(super) fn is_scene(text: &str) -> bool {
    ["#Inventor", "#VRML"].iter().any(|start| text.starts_with(start))
}

/// Reads a scene; `open` reads the files that it names.
pub(crate) fn read(text: &str, open: Open<'_>) -> Result<Drawn, String> {
    let mut walk = Walk { open, drawn: Drawn::default(), all_shapes: true, visits: 0, numbers: 0, files: 0 };
    let state = TraversalState {
        frame: Frame::IDENTITY,
        points: Rc::default(),
        metres: 1.0,
        clockwise: false,
        separate: false,
    };
    walk.file(text, &mut state.clone(), 0)?;
    if !walk.all_shapes || walk.drawn.shapes.len() > MAX_SOLIDS {
        walk.drawn.shapes.clear();
    }
    Ok(walk.drawn)
}

/// The state that a node passes on to the nodes after it.
#[derive(Clone)]
struct TraversalState {
    frame: Frame,
    /// Points of the last node with coordinates.
    points: Rc<Vec<Vec3>>,
    /// Metres per unit by the last `Units`.
    metres: f64,
    /// Whether the edges of faces run clockwise about their outside.
    clockwise: bool,
    /// Whether every group restores the state, as in VRML 97.
    separate: bool,
}

struct Walk<'a> {
    open: Open<'a>,
    drawn: Drawn,
    all_shapes: bool,
    visits: usize,
    numbers: usize,
    files: usize,
}

impl Walk<'_> {
    fn file(&mut self, text: &str, state: &mut TraversalState, depth: usize) -> Result<(), String> {
        let first = text.lines().next().unwrap_or_default();
        if !is_scene(first) {
            return Err("is no Open Inventor or VRML file as text".to_owned());
        }
        if first.contains("binary") {
            return Err(
                "is a binary Open Inventor file, which is not read; save it as text, STL or OBJ".to_owned()
            );
        }
        let tree = nodes::parse(text)?;
        state.separate = first.starts_with("#VRML V2");
        for &root in &tree.roots {
            self.visit(&tree, root, state, depth)?;
        }
        Ok(())
    }

    fn visit(
        &mut self,
        tree: &Tree,
        index: usize,
        state: &mut TraversalState,
        depth: usize,
    ) -> Result<(), String> {
        self.visits += 1;
        if self.visits > MAX_VISITS || depth > MAX_DEPTH {
            return Err(format!(
                "uses its nodes more than {MAX_VISITS} times, or {MAX_DEPTH} inside each other"
            ));
        }
        let node = tree.node(index);
        self.numbers += tree.size(index) + if node.kind == "QuadMesh" { state.points.len() } else { 0 };
        if self.numbers > MAX_NUMBERS {
            return Err(format!("uses more than {MAX_NUMBERS} numbers"));
        }
        if let Some(solid) = Solid::of(node)? {
            return self.solid(&solid, state);
        }
        match node.kind.as_str() {
            // Not solid, so that nothing touches it.
            "LineSet" | "IndexedLineSet" | "PointSet" | "Text" | "Text2" | "Text3" | "AsciiText" => {
                return Ok(());
            }
            kind @ ("Extrusion"
            | "ElevationGrid"
            | "NurbsSurface"
            | "IndexedNurbsSurface"
            | "Array"
            | "MultipleCopy") => {
                return Err(format!("has a node {kind}, which is not read; save it as STL or OBJ"));
            }
            "Switch" => {
                let chosen = Self::chosen(node)?;
                return self.all(tree, &chosen, state, depth);
            }
            "LOD" | "LevelOfDetail" => {
                // The first level has the most detail.
                let levels = node.field("level").map_or(&node.children, |level| &level.nodes);
                let finest = levels.first().copied();
                return self.all(tree, finest.as_slice(), &mut state.clone(), depth);
            }
            "File" | "WWWInline" | "Inline" => {
                let Some(name) = node.word("name").or(node.word("url")) else { return Ok(()) };
                self.files += 1;
                if self.files > MAX_FILES {
                    return Err(format!("names more than {MAX_FILES} files"));
                }
                let text = (self.open)(name)?;
                let mut inner = state.clone();
                let read = self.file(&text, &mut inner, depth + 1);
                return read.map_err(|problem| format!("names '{}', which {problem}", name.escape_debug()));
            }
            "Units" => {
                let metres = frame::unit(node)?;
                state.frame = state.frame.after(Frame::scaled([metres / state.metres; 3]));
                state.metres = metres;
            }
            "ShapeHints" => match node.word("vertexOrdering") {
                Some("CLOCKWISE") => state.clockwise = true,
                Some(_) => state.clockwise = false,
                None => {}
            },
            _ => {}
        }
        if let Some(points) = faces::points(node)? {
            state.points = Rc::new(points);
        }
        if let Some(faces) = faces::faces(tree, node, &state.points)? {
            let clockwise = state.clockwise != (node.word("ccw") == Some("FALSE"));
            return self.triangles(faces, clockwise, &state.frame);
        }
        let moved = frame::of(node)?;
        let groups = node.children.iter();
        let below: Vec<usize> = ["children", "geometry"]
            .into_iter()
            .filter_map(|name| node.field(name))
            .flat_map(|value| &value.nodes)
            .chain(groups)
            .copied()
            .collect();
        let keeps =
            matches!(node.kind.as_str(), "Separator" | "TopLevelSeparator" | "Annotation" | "WWWAnchor");
        if keeps || state.separate {
            let mut inner = state.clone();
            inner.frame = moved.map_or(inner.frame, |frame| inner.frame.after(frame));
            return self.all(tree, &below, &mut inner, depth);
        }
        state.frame = moved.map_or(state.frame, |frame| state.frame.after(frame));
        let before = (state.frame, state.metres);
        self.all(tree, &below, state, depth)?;
        if node.kind == "TransformSeparator" {
            (state.frame, state.metres) = before;
        }
        Ok(())
    }

    fn all(
        &mut self,
        tree: &Tree,
        list: &[usize],
        state: &mut TraversalState,
        depth: usize,
    ) -> Result<(), String> {
        list.iter().try_for_each(|&index| self.visit(tree, index, state, depth + 1))
    }

    /// The children that a `Switch` shows.
    fn chosen(node: &Node) -> Result<Vec<usize>, String> {
        let all = node.field("choice").map_or(&node.children, |choice| &choice.nodes);
        let which = node.numbers::<1>("whichChild")?.or(node.numbers("whichChoice")?);
        Ok(match which.map_or(-1.0, |[which]| which) {
            -3.0 => all.clone(),
            which if which >= 0.0 => all.get(which as usize).copied().into_iter().collect(),
            _ => Vec::new(),
        })
    }

    fn solid(&mut self, solid: &Solid, state: &TraversalState) -> Result<(), String> {
        match solid.shape(&state.frame).filter(|_| self.drawn.shapes.len() <= MAX_SOLIDS) {
            Some(shape) => self.drawn.shapes.push(shape),
            None => self.all_shapes = false,
        }
        self.add(solid.triangles(), false, &state.frame)
    }

    fn triangles(&mut self, faces: Corners, clockwise: bool, frame: &Frame) -> Result<(), String> {
        self.all_shapes &= faces.is_empty();
        self.add(faces, clockwise, frame)
    }

    fn add(&mut self, faces: Corners, clockwise: bool, frame: &Frame) -> Result<(), String> {
        let (count, limit) = (3 * (self.drawn.corners.len() + faces.len()), limits().mesh_vertices);
        if count > limit {
            return Err(format!("has {count} vertices; the limit is {limit}"));
        }
        let mirrored = clockwise != (frame.linear.determinant() < 0.0);
        self.drawn.corners.extend(faces.into_iter().map(|corners| {
            let [a, b, c] = corners.map(|p| frame.point(p));
            if mirrored { [a, c, b] } else { [a, b, c] }
        }));
        Ok(())
    }
}
