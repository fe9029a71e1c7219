//! The files of a task: `task.toml`, the objects' meshes, and a URDF for each object whose centre of mass or inertia is stated.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use palmares_models::pieces::TriangleMesh;
use palmares_models::read::Limits;
use palmares_models::{Pose, Rotation, Vec3};

use super::fixed::{Fixed, Furniture};
use super::scene::Body;
use super::shape::Shape;
use crate::decision::{At, Log};
use crate::draft::rpy;
use crate::write::number;

/// Goals that rules may have.
const MOST_GOALS: usize = 64;
/// Height of the hand's base above the objects and the furniture around them, m: a hand reaches 0.3 m from its base.
const ABOVE: f64 = 0.45;
/// Furniture nearer than this to the middle of the objects is around them, m.
const AROUND: f64 = 0.5;
/// Height by which an object is lifted for its point, m.
const LIFTED: f64 = 0.05;

/// The files by their path in the task's folder.
pub(super) fn files(
    name: &str,
    objects: &[Body],
    fixed: &Fixed,
    log: &mut Log,
) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let own: Vec<String> = objects.iter().map(|body| object(body, &mut files, log)).collect();
    let (rules, count) = (goals(objects), objects.len().min(MOST_GOALS));
    let text = format!(
        "states no goal: one point for each of {count} objects that is raised by {LIFTED} m, one after the other"
    );
    log.guessed(At::Hand, "world", text);
    let hand = above(objects, fixed);
    let text =
        format!("states no hand: its base begins at {} m, with the fingers down", list(&hand.to_array()));
    log.guessed(At::Hand, "world", text);
    let mut out = String::new();
    let file = log.file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let _ =
        writeln!(out, "# Imported from {file} (Klamp't world) by palmares {}.", env!("CARGO_PKG_VERSION"));
    for decision in &log.decisions {
        let line = format!("{}: {}: {}", decision.kind.word(), decision.element, decision.text);
        let _ = writeln!(
            out,
            "# {}",
            line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>()
        );
    }
    let _ = writeln!(
        out,
        "name = \"{name}\"\ndescription = \"Raise each object of the world {}.\"\ntick_s = 0.01\nstep_s = 0.001\ntime_limit_s = 120.0\n\n\
         [hand]\nposition = {}\nquat_xyzw = [0, 1, 0, 0]\n",
        file.replace(['"', '\\'], "'"),
        list(&hand.to_array())
    );
    let ground = &fixed.ground;
    let _ = writeln!(
        out,
        "[ground]\nheight = {}\nfriction = {}\ncolor = {}\ncenter = {}\nsize = {}\n",
        number(ground.height),
        number(ground.friction),
        list(&ground.color),
        list(&ground.center),
        list(&ground.size)
    );
    fixed.furniture.iter().for_each(|piece| furniture(&mut out, piece));
    let _ = writeln!(out, "[objects]\ncount = {}\n", objects.len());
    own.iter().for_each(|text| out += text);
    for body in objects {
        let Pose { translation, rotation } = body.pose;
        let _ = writeln!(
            out,
            "[[place.fixed]]\nobject = \"{}\"\nposition = {}\nquat_xyzw = {}\n",
            body.name,
            list(&translation.to_array()),
            list(&[rotation.x, rotation.y, rotation.z, rotation.w])
        );
    }
    out += &rules;
    files.insert(PathBuf::from("task.toml"), out.into_bytes());
    files
}

fn furniture(out: &mut String, piece: &Furniture) {
    let _ = writeln!(
        out,
        "[[furniture]]\nname = \"{}\"\nfriction = {}\ncolor = {}\nparts = [",
        piece.name,
        number(piece.friction),
        list(&piece.color)
    );
    for (low, high) in &piece.boxes {
        let (middle, half) = ((*low + *high) * 0.5, (*high - *low) * 0.5);
        let _ = writeln!(
            out,
            "    {{ position = {}, half_extents = {} }},",
            list(&middle.to_array()),
            list(&half.to_array())
        );
    }
    out.push_str("]\n\n");
}

/// The table of an object; its mesh or URDF is added to the files.
fn object(body: &Body, files: &mut BTreeMap<PathBuf, Vec<u8>>, log: &mut Log) -> String {
    let mut out = String::new();
    let geometry =
        body.geometry.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let _ = writeln!(
        out,
        "[[objects.own]]\nname = \"{}\"\nsource = \"{} of a Klamp't world, shape of {}; its author and licence are to be stated\"",
        body.name,
        body.element.replace(['"', '\\'], "'"),
        geometry.replace(['"', '\\'], "'")
    );
    let part = part(body, files, log);
    if body.com.is_none() && body.inertia.is_none() {
        let text = "states no centre of mass and no inertia, or `automass`: its mass is spread evenly over its shape";
        log.guessed(At::Hand, &body.element, text);
        let _ = writeln!(out, "parts = [{{ {} }}]\nmass = {}", part.toml, number(body.mass));
    } else {
        let file = PathBuf::from(format!("{}.urdf", body.name));
        let _ = writeln!(
            out,
            "urdf = \"{}\"\n{}",
            file.display(),
            if part.meshed { "mesh_rounding = 0.0" } else { "" }
        );
        files.insert(file, urdf(body, &part.urdf, log).into_bytes());
    }
    let _ = writeln!(
        out,
        "friction = {}\nrestitution = {}\ncolor = {}\n",
        number(body.friction),
        number(body.restitution),
        list(&body.color)
    );
    out
}

/// The shape of an object.
struct Part {
    /// The fields of a part in `task.toml`.
    toml: String,
    /// `<origin>` and `<geometry>` of a URDF.
    urdf: String,
    meshed: bool,
}

fn part(body: &Body, files: &mut BTreeMap<PathBuf, Vec<u8>>, log: &mut Log) -> Part {
    let placed = |pose: &Pose, toml: String, urdf: String| {
        let (xyz, turn) = (pose.translation.to_array(), rpy(&pose.rotation));
        Part {
            toml: format!("{toml}, at = {}, rpy = {}", list(&xyz), list(&turn)),
            urdf: format!(
                "<origin xyz=\"{}\" rpy=\"{}\"/><geometry>{urdf}</geometry>",
                words(&xyz),
                words(&turn)
            ),
            meshed: false,
        }
    };
    match &body.shape {
        Shape::Sphere { center, radius } => {
            let radius = number(*radius);
            let pose = Pose::from_parts(*center, Rotation::IDENTITY);
            placed(
                &pose,
                format!("shape = \"sphere\", radius = {radius}"),
                format!("<sphere radius=\"{radius}\"/>"),
            )
        }
        Shape::Box { pose, size } => {
            let size = size.to_array();
            placed(
                pose,
                format!("shape = \"box\", size = {}", list(&size)),
                format!("<box size=\"{}\"/>", words(&size)),
            )
        }
        Shape::Cylinder { pose, radius, height } => {
            let (radius, height) = (number(*radius), number(*height));
            let toml = format!("shape = \"cylinder\", radius = {radius}, height = {height}");
            placed(pose, toml, format!("<cylinder radius=\"{radius}\" length=\"{height}\"/>"))
        }
        Shape::Mesh(corners) => {
            let limits = Limits::default();
            let mut mesh = TriangleMesh::new(corners);
            let hull = TriangleMesh::hull(&mesh.vertices)
                .filter(|_| 3 * mesh.triangles.len() > limits.mesh_vertices);
            if let Some(hull) = hull {
                let text = format!(
                    "its mesh has {} triangles, more than a third of {} vertices: its convex hull is written",
                    mesh.triangles.len(),
                    limits.mesh_vertices
                );
                log.guessed(At::Hand, &body.element, text);
                mesh = hull;
            }
            let path = Path::new("meshes").join(format!("{}.stl", body.name));
            let file = path.display().to_string();
            files.insert(path, mesh.to_stl(&format!("{}, imported", body.name)));
            Part {
                toml: format!("shape = \"mesh\", file = \"{file}\", rounding = 0.0"),
                urdf: format!("<geometry><mesh filename=\"{file}\"/></geometry>"),
                meshed: true,
            }
        }
    }
}

/// A link with the stated mass properties; what is missing beside them is the shape's.
fn urdf(body: &Body, shape: &str, log: &mut Log) -> String {
    let of_shape = TriangleMesh::new(&body.shape.triangles()).inertia(body.mass);
    let com = body.com.or(of_shape.map(|own| own.com)).unwrap_or(Vec3::ZERO);
    let inertia = body.inertia.or(of_shape.map(|own| own.about_com)).unwrap_or_default();
    if body.inertia.is_none() {
        let text = "states a centre of mass and no inertia: that of its shape is taken, about its own centre";
        log.guessed(At::Hand, &body.element, text);
    }
    let [x, y, z] = [inertia.x_axis, inertia.y_axis, inertia.z_axis];
    format!(
        "<robot name=\"{}\">\n  <link name=\"{}\">\n    <inertial><origin xyz=\"{}\"/><mass value=\"{}\"/>\n      \
         <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/></inertial>\n    \
         <collision>{shape}</collision>\n  </link>\n</robot>\n",
        body.name,
        body.name,
        words(&com.to_array()),
        number(body.mass),
        number(x.x),
        number(x.y),
        number(x.z),
        number(y.y),
        number(y.z),
        number(z.z)
    )
}

fn goals(objects: &[Body]) -> String {
    let mut out = String::from("[rules]\nkind = \"arrange\"\nsettle_s = 2.0\n");
    for body in objects.iter().take(MOST_GOALS) {
        let _ = writeln!(
            out,
            "\n[[rules.goals]]\nname = \"raised_{}\"\nobject = \"{}\"\nabove_m = {LIFTED}\npoints = 1.0",
            body.name, body.name
        );
    }
    out
}

/// Where the hand begins: above the objects.
fn above(objects: &[Body], fixed: &Fixed) -> Vec3 {
    let bounds: Vec<(Vec3, Vec3)> = objects.iter().map(|body| body.shape.bounds(&body.pose)).collect();
    let middle =
        bounds.iter().map(|(low, high)| (*low + *high) * 0.5).sum::<Vec3>() / bounds.len().max(1) as f64;
    let near = |sides: &&(Vec3, Vec3)| {
        (0..2).all(|axis| sides.0[axis] < middle[axis] + AROUND && sides.1[axis] > middle[axis] - AROUND)
    };
    let boxes = fixed.furniture.iter().flat_map(|piece| &piece.boxes).filter(near);
    let top = boxes.chain(&bounds).map(|sides| sides.1.z).fold(fixed.ground.height, f64::max);
    Vec3::new(middle.x, middle.y, top + ABOVE)
}

/// Places, sizes and colours without the digits of rounding.
fn list(numbers: &[f64]) -> String {
    let tidy = |x: &f64| number((x * 1e12).round() / 1e12 + 0.0);
    format!("[{}]", numbers.iter().map(tidy).collect::<Vec<_>>().join(", "))
}

fn words(numbers: &[f64]) -> String {
    numbers.iter().map(|x| number(*x)).collect::<Vec<_>>().join(" ")
}
