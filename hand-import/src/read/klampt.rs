//! Klamp't's `.rob`, as its manual of file types documents it: one keyword a line, values for all links in order.

mod drivers;
mod join;
pub(crate) mod lines;
mod robot;
pub(crate) mod rotation;
mod touching;

use palmares_models::{Pose, Rotation, Vec3};

use self::join::join;
use self::lines::{Line, lines};
use self::robot::Robot;
use self::rotation::{columns, rotation};
use super::Format;
use super::content::{Content, recognise};
use super::reading::Reading;
use crate::decision::At;
use crate::draft::{Draft, Geometry, Inertial, Joint, JointKind, Link, LinkShape, Mesh, Origin, Triangles};
use crate::error::ImportError;
use crate::glance::Glance;

/// Keywords that have no place in a hand, and why.
const DROPPED: [(&str, &str); 13] = [
    ("accmax", "a motor's acceleration follows from its force"),
    ("accmaxdeg", "a motor's acceleration follows from its force"),
    ("powermax", "a motor's power is the product of its force and speed"),
    ("velmin", "a motor is as fast backwards as forwards: `velmax` counts"),
    ("velmindeg", "a motor is as fast backwards as forwards: `velmaxdeg` counts"),
    ("q", "the start is that of the motors; [start] of hand.toml states another one"),
    ("qdeg", "the start is that of the motors; [start] of hand.toml states another one"),
    ("geommargin", "shapes are without margin"),
    ("autotorque", "torques that are not stated are guessed"),
    ("translation", "places the robot in a world"),
    ("rotation", "places the robot in a world"),
    ("collision", "names links that touch the world; here all do"),
    ("nocollision", "names links that do not touch the world; here all do"),
];

/// A `.rob` has a keyword at the start of each line, among them the names of its links and their parents.
pub(super) fn is(file: &Glance<'_>) -> bool {
    if !file.root.is_empty() {
        return false;
    }
    let keywords = || file.text.lines().filter_map(|line| line.split_whitespace().next());
    let has = |word: &str| keywords().any(|found| found.eq_ignore_ascii_case(word));
    let poses = ["TParent", "axis", "alpha", "alphadeg"].into_iter().any(has);
    (has("links") && has("parents")) || ((has("links") || has("parents")) && poses)
}

/// Reads a `.rob`.
pub(super) fn read(reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let lines = lines(&reading.text);
    let names = names(&lines);
    if names.is_empty() {
        return Err(ImportError::unreadable(&reading.log.file, "has no `links` and no `parents`"));
    }
    let name = reading.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let mut draft = Draft { name, ..Draft::default() };
    let robot = Robot::new(&names, &lines, reading);
    robot.links(&mut draft, reading);
    robot.joints(&mut draft, reading);
    robot.touching(&mut draft, reading);
    drivers::drivers(&robot, &lines, &mut draft, reading);
    for line in &lines {
        robot.rest(line, &mut draft, reading)?;
    }
    Ok(draft)
}

/// Names of the links; Klamp't numbers them where the file states none.
fn names(lines: &[Line]) -> Vec<String> {
    let of = |keyword: &str| lines.iter().rev().find(|line| line.keyword == keyword);
    match (of("links"), of("parents")) {
        (Some(links), _) => links.words.clone(),
        (None, Some(parents)) => (0..parents.words.len()).map(|i| format!("Link_{i}")).collect(),
        (None, None) => Vec::new(),
    }
}

impl Robot<'_> {
    fn links(&self, draft: &mut Draft, reading: &mut Reading<'_>) {
        let n = self.names.len();
        let mass = self.list("mass", 1, n, reading);
        let com = self.list("com", 3, n, reading);
        let full = self.list("inertia", 9, n, reading);
        let diagonal = self.list("inertiadiag", 3, n, reading);
        let files = self.lines.iter().find(|line| line.keyword == "geometry").map(|line| line.words.clone());
        let one = self.lines.iter().any(|line| line.keyword == "geomscale" && line.words.len() == 1);
        let scales = self.list("geomscale", 1, if one { 1 } else { n }, reading);
        let scales = scales.map(|list| if one { vec![list[0]; n] } else { list });
        if self.lines.iter().any(|line| line.keyword == "automass") {
            let text = "centres of mass and inertias come from the shapes";
            reading.log.taken(At::Hand, "`automass`", text);
        }
        if let Some(files) = files.as_ref().filter(|files| files.len() != n) {
            let text = format!("has {} files for {n} links", files.len());
            reading.log.problem(At::Hand, "`geometry`", text);
        }
        for (i, name) in self.names.iter().enumerate() {
            let inertia = match (&full, &diagonal) {
                (Some(m), _) => {
                    let m = &m[9 * i..9 * i + 9];
                    [m[0], m[1], m[2], m[4], m[5], m[8]]
                }
                (None, Some(m)) => [m[3 * i], 0.0, 0.0, m[3 * i + 1], 0.0, m[3 * i + 2]],
                (None, None) => [0.0; 6],
            };
            let inertial = mass.as_ref().map(|mass| Inertial {
                origin: Origin::at(
                    com.as_ref().map(|com| [com[3 * i], com[3 * i + 1], com[3 * i + 2]]).unwrap_or_default(),
                ),
                mass: mass[i],
                inertia,
            });
            let mut link = Link { name: name.clone(), inertial, ..Link::default() };
            let file = files.as_ref().and_then(|files| files.get(i)).filter(|file| !file.is_empty());
            if let Some(file) = file {
                let (at, element) = (At::Link(name.clone()), format!("link '{name}'"));
                let size = self.scale * scales.as_ref().map_or(1.0, |scales| scales[i]);
                if let Some(mut mesh) = reading.mesh(file, [size; 3], at, &element, false) {
                    let (origin, scale) = self.geometry_transform(i, reading);
                    mesh.scale = mesh.scale.map(|s| s * scale);
                    let part = LinkShape { origin, geometry: Geometry::Mesh(mesh) };
                    link.visuals.push(part.clone());
                    link.collisions.push(part);
                }
            }
            draft.links.push(link);
        }
    }

    /// `geomtransform`: a homogeneous matrix, row by row.
    fn geometry_transform(&self, i: usize, reading: &mut Reading<'_>) -> (Origin, f64) {
        let of_link = |line: &&Line| {
            line.keyword == "geomtransform" && line.words.first().and_then(|word| self.index(word)) == Some(i)
        };
        let Some(line) = self.lines.iter().find(of_link) else { return (Origin::default(), 1.0) };
        let m: Vec<f64> = line.words.iter().skip(1).map_while(|word| lines::number(word)).collect();
        let &[a, b, c, x, d, e, f, y, g, h, k, z, ..] = m.as_slice() else {
            reading.log.problem(
                At::Link(self.names[i].clone()),
                "`geomtransform`",
                "has fewer than 16 numbers",
            );
            return (Origin::default(), 1.0);
        };
        let columns = [Vec3::new(a, d, g), Vec3::new(b, e, h), Vec3::new(c, f, k)];
        let size = columns[0].length();
        let pose =
            rotation(columns).map(|rotation| Pose::from_parts(Vec3::new(x, y, z) * self.scale, rotation));
        match pose {
            Some(pose) => (Origin::from_pose(&pose), size),
            None => {
                let text = "is no rotation with one factor for all axes; it is left out";
                reading.log.problem(At::Link(self.names[i].clone()), "`geomtransform`", text);
                (Origin::default(), 1.0)
            }
        }
    }

    fn joints(&self, draft: &mut Draft, reading: &mut Reading<'_>) {
        let n = self.names.len();
        let axis = self.list("axis", 3, n, reading);
        let (low, high) = (self.angles("qmin", reading), self.angles("qmax", reading));
        let speed = self.angles("velmax", reading);
        let torque = self.list("torquemax", 1, n, reading);
        let types = self.lines.iter().find(|line| line.keyword == "jointtype").map(|line| line.words.clone());
        let poses = self.poses(reading);
        let roots: Vec<usize> = (0..n).filter(|&i| self.parents[i].is_none()).collect();
        // A base that moves needs a link that it moves on.
        let moves = roots.iter().any(|&root| self.kinds[root] != "weld");
        let world = roots.len() > 1 || moves;
        if world {
            draft.links.insert(0, Link { name: "world".to_owned(), ..Link::default() });
        }
        for (i, name) in self.names.iter().enumerate() {
            let parent = match self.parents[i] {
                Some(parent) if parent < n => self.names[parent].clone(),
                None if world => "world".to_owned(),
                None => continue,
                Some(parent) => {
                    let valid = format!("-1 to {}", n - 1);
                    let text =
                        format!("link '{name}' has the parent {parent}; valid: {valid}; it is left out");
                    reading.log.problem(At::Hand, "`parents`", text);
                    continue;
                }
            };
            let fixed = Joint::fixed(self.joint_name(i), parent, name);
            let joint = Joint { origin: poses[i], ..fixed };
            if self.kinds[i] == "weld" {
                draft.joints.push(joint);
                continue;
            }
            let slides = types.as_ref().and_then(|types| types.get(i)).is_some_and(|kind| kind == "p");
            let finite =
                |list: &Option<Vec<f64>>| list.as_ref().map(|list| list[i]).filter(|x| x.is_finite());
            let limits = finite(&low).zip(finite(&high)).map(|(low, high)| [low, high]);
            let kind = match (slides, limits, self.kinds[i]) {
                (true, ..) => JointKind::Prismatic,
                (false, _, "spin") | (false, None, _) => JointKind::Continuous,
                _ => JointKind::Revolute,
            };
            let axis = axis.as_ref().map_or([0.0, 0.0, 1.0], |a| [a[3 * i], a[3 * i + 1], a[3 * i + 2]]);
            let (velocity, effort) = (finite(&speed), finite(&torque));
            draft.joints.push(Joint { kind, axis, limits, velocity, effort, ..joint });
        }
    }

    /// Pose of each link in its parent: the rows of a rotation and a translation, or Denavit-Hartenberg parameters.
    fn poses(&self, reading: &mut Reading<'_>) -> Vec<Origin> {
        let n = self.names.len();
        if let Some(list) = self.list("tparent", 12, n, reading) {
            return (0..n)
                .map(|i| {
                    let t = &list[12 * i..12 * i + 12];
                    let place = Vec3::new(t[9], t[10], t[11]) * self.scale;
                    let Some(rotation) = rotation(columns(t)) else {
                        let (at, element) =
                            (At::Link(self.names[i].clone()), format!("link '{}'", self.names[i]));
                        reading.log.problem(at, element, "its `tparent` has no rotation; taken is none");
                        return Origin::at(place.to_array());
                    };
                    Origin::from_pose(&Pose::from_parts(place, rotation))
                })
                .collect();
        }
        let (alpha, theta) = (self.angles("alpha", reading), self.angles("theta", reading));
        let (a, d) = (self.list("a", 1, n, reading), self.list("d", 1, n, reading));
        let value = |list: &Option<Vec<f64>>, i: usize| list.as_ref().map_or(0.0, |list| list[i]);
        (0..n)
            .map(|i| {
                let about = |axis: Vec3, angle: f64| {
                    Pose::from_parts(Vec3::ZERO, Rotation::from_axis_angle(axis, angle))
                };
                // Craig's convention: about and along the parent's x, then about and along the joint's z.
                let along = |v: Vec3| Pose::from_parts(v * self.scale, Rotation::IDENTITY);
                let x = about(Vec3::X, value(&alpha, i)) * along(Vec3::X * value(&a, i));
                Origin::from_pose(&(x * about(Vec3::Z, value(&theta, i)) * along(Vec3::Z * value(&d, i))))
            })
            .collect()
    }

    /// Everything but links, joints and drivers.
    fn rest(&self, line: &Line, draft: &mut Draft, reading: &mut Reading<'_>) -> Result<(), ImportError> {
        const READ: [&str; 37] = [
            "links",
            "parents",
            "axis",
            "jointtype",
            "tparent",
            "alpha",
            "alphadeg",
            "theta",
            "thetadeg",
            "a",
            "d",
            "qmin",
            "qmindeg",
            "qmax",
            "qmaxdeg",
            "geometry",
            "geomscale",
            "geomtransform",
            "mass",
            "automass",
            "com",
            "inertia",
            "inertiadiag",
            "velmax",
            "velmaxdeg",
            "torquemax",
            "joint",
            "driver",
            "drivers",
            "servop",
            "servoi",
            "servod",
            "dryfriction",
            "viscousfriction",
            "scale",
            "selfcollision",
            "noselfcollision",
        ];
        let keyword = line.keyword.as_str();
        match keyword {
            "mount" => self.mount(line, draft, reading)?,
            "property" => {
                let what = line.words.first().cloned().unwrap_or_default();
                reading.log.dropped(At::Hand, format!("`property {what}`"), "is for Klamp't only");
            }
            keyword if READ.contains(&keyword) => {}
            keyword => {
                let known = DROPPED.iter().find(|(name, _)| *name == keyword);
                let text = known.map_or("is no known keyword", |(_, text)| text);
                let zero = |word: &String| lines::number(word) == Some(0.0);
                if known.is_none() || !line.words.iter().all(zero) {
                    reading.log.dropped(At::Hand, format!("`{keyword}`"), text);
                }
            }
        }
        Ok(())
    }

    /// `mount LINK "FILE" [12 numbers] [as "PREFIX"]`: another robot on a link.
    fn mount(&self, line: &Line, draft: &mut Draft, reading: &mut Reading<'_>) -> Result<(), ImportError> {
        const DEEPEST: usize = 4;
        let element = format!("`mount {}`", line.words.join(" "));
        let link = line.words.first().and_then(|word| self.index(word));
        let (Some(link), Some(file)) = (link, line.words.get(1)) else {
            reading.log.problem(At::Hand, element, "names no link and file");
            return Ok(());
        };
        let found = match reading.source.resolve(&reading.path, file) {
            Ok(found) if reading.mounted < DEEPEST => found.path,
            Ok(_) => {
                reading.log.problem(At::Hand, element, format!("more than {DEEPEST} files mount each other"));
                return Ok(());
            }
            Err(problem) => {
                reading.log.problem(At::Hand, element, problem);
                return Ok(());
            }
        };
        let prefixed = line.words.iter().position(|word| word == "as").and_then(|i| line.words.get(i + 1));
        let prefix = prefixed.map(|prefix| format!("{prefix}:")).unwrap_or_default();
        let t: Vec<f64> = line.words.iter().skip(2).map_while(|word| lines::number(word)).collect();
        let pose = match t.as_slice() {
            [] => Some(Pose::IDENTITY),
            t if t.len() == 12 => {
                rotation(columns(t)).map(|rotation| Pose::from_parts(Vec3::new(t[9], t[10], t[11]), rotation))
            }
            _ => None,
        };
        let origin = pose.map(|pose| Origin::from_pose(&pose)).unwrap_or_else(|| {
            let text =
                "its transform is not the 9 numbers of a rotation by rows and 3 of a place; taken is none";
            reading.log.problem(At::Hand, &element, text);
            Origin::default()
        });
        let kind = found.extension().map(|kind| kind.to_string_lossy().to_lowercase()).unwrap_or_default();
        if !["rob", "urdf"].contains(&kind.as_str()) {
            let part = LinkShape {
                origin,
                geometry: Geometry::Mesh(Mesh { triangles: Triangles::File(found), scale: [1.0; 3] }),
            };
            let name = &self.names[link];
            if let Some(link) = draft.links.iter_mut().find(|link| link.name == *name) {
                link.visuals.push(part.clone());
                link.collisions.push(part);
                reading.log.taken(At::Link(name.clone()), element, "its shape is one of the link");
            }
            return Ok(());
        }
        let mut inner = reading.of(&found, "mounted robot")?;
        let part = match recognise(&inner.text) {
            Content::Robot(Format::Klampt) => read(&mut inner)?,
            Content::Robot(Format::Urdf) => super::urdf::read(&mut inner)?,
            content => {
                reading.log.problem(At::Hand, element, format!("the file {}", content.problem()));
                return Ok(());
            }
        };
        reading.log.decisions.append(&mut inner.log.decisions);
        join(draft, part, &self.names[link], origin, &prefix);
        reading.log.taken(At::Hand, element, "the other robot is fixed to the link");
        Ok(())
    }
}
