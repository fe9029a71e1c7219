//! Klamp't's `.rob`, as its manual of file types documents it: one keyword a line, values for all links in order.

mod drivers;
mod lines;
mod robot;

use palmares_models::{Mat3, Pose, Rotation, Vec3};

use self::lines::{Line, lines};
use self::robot::Robot;
use super::reading::Reading;
use crate::decision::At;
use crate::draft::{Draft, Geometry, Inertial, Joint, JointKind, Link, Origin, Part};
use crate::error::ImportError;
use crate::format::{Content, Format, recognise};

/// Keywords about planning and pictures.
const SILENT: [&str; 10] = [
    "accmax",
    "accmaxdeg",
    "powermax",
    "q",
    "qdeg",
    "selfcollision",
    "geommargin",
    "velmin",
    "velmindeg",
    "autotorque",
];

/// Reads a `.rob`.
pub(crate) fn read(text: &str, reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let lines = lines(text);
    let names =
        lines.iter().find(|line| line.keyword == "links").map(|line| line.words.clone()).unwrap_or_default();
    if names.is_empty() {
        return Err(ImportError::unreadable(&reading.log.file, "has no `links`"));
    }
    let name = reading.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let mut draft = Draft { name, ..Draft::default() };
    let robot = Robot::new(&names, &lines, reading);
    robot.links(&mut draft, reading);
    robot.joints(&mut draft, reading);
    drivers::drivers(&robot, &lines, &mut draft, reading);
    for line in &lines {
        robot.rest(line, &mut draft, reading)?;
    }
    Ok(draft)
}

impl Robot<'_> {
    fn links(&self, draft: &mut Draft, reading: &mut Reading<'_>) {
        let n = self.names.len();
        let mass = self.list("mass", 1, n, reading);
        let com = self.list("com", 3, n, reading);
        let full = self.list("inertia", 9, n, reading);
        let diagonal = self.list("inertiadiag", 3, n, reading);
        let files = self.lines.iter().find(|line| line.keyword == "geometry").map(|line| line.words.clone());
        let scales = self.list("geomscale", 1, n, reading);
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
                if let Some(mut mesh) = reading.mesh(file, [size; 3], at, &element) {
                    let (origin, scale) = self.geometry_transform(i, reading);
                    mesh.scale = mesh.scale.map(|s| s * scale);
                    let part = Part { origin, geometry: Geometry::Mesh(mesh) };
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
        if roots.len() > 1 {
            draft.links.insert(0, Link { name: "world".to_owned(), ..Link::default() });
        }
        for (i, name) in self.names.iter().enumerate() {
            let parent = match self.parents[i] {
                Some(parent) if parent < n => self.names[parent].clone(),
                None if roots.len() > 1 => "world".to_owned(),
                None => continue,
                Some(parent) => {
                    reading.log.problem(
                        At::Hand,
                        "`parents`",
                        format!("link '{name}' has the parent {parent}"),
                    );
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

    /// Pose of each link in its parent: the columns of a rotation and a translation, or Denavit-Hartenberg parameters.
    fn poses(&self, reading: &mut Reading<'_>) -> Vec<Origin> {
        let n = self.names.len();
        if let Some(list) = self.list("tparent", 12, n, reading) {
            return (0..n)
                .map(|i| {
                    let t = &list[12 * i..12 * i + 12];
                    let columns = [
                        Vec3::new(t[0], t[1], t[2]),
                        Vec3::new(t[3], t[4], t[5]),
                        Vec3::new(t[6], t[7], t[8]),
                    ];
                    let place = Vec3::new(t[9], t[10], t[11]) * self.scale;
                    let Some(rotation) = rotation(columns) else {
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
        const READ: [&str; 34] = [
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
            "servop",
            "servoi",
            "servod",
            "dryfriction",
            "viscousfriction",
            "scale",
        ];
        let keyword = line.keyword.as_str();
        match keyword {
            "noselfcollision" => {
                for pair in line.words.chunks_exact(2) {
                    if let (Some(a), Some(b)) = (self.index(&pair[0]), self.index(&pair[1])) {
                        draft.exclusions.push([self.names[a].clone(), self.names[b].clone()]);
                    }
                }
            }
            "mount" => self.mount(line, draft, reading)?,
            "property" => {
                let what = line.words.first().cloned().unwrap_or_default();
                reading.log.dropped(At::Hand, format!("`property {what}`"), "is for Klamp't only");
            }
            "translation" | "rotation" => {
                reading.log.dropped(At::Hand, format!("`{keyword}`"), "places the robot in a world");
            }
            keyword if READ.contains(&keyword) || SILENT.contains(&keyword) => {}
            keyword => reading.log.dropped(At::Hand, format!("`{keyword}`"), "is no known keyword"),
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
        let origin = match t.as_slice() {
            &[a, b, c, d, e, f, g, h, k, x, y, z] => {
                let rotation = rotation([Vec3::new(a, b, c), Vec3::new(d, e, f), Vec3::new(g, h, k)]);
                let rotation = rotation.unwrap_or(Rotation::IDENTITY);
                Origin::from_pose(&Pose::from_parts(Vec3::new(x, y, z), rotation))
            }
            _ => Origin::default(),
        };
        let text = reading.source.text(&found, "mounted robot")?;
        let mut inner = reading.of(&found);
        let part = match recognise(&text) {
            Content::Robot(Format::Klampt) => read(&text, &mut inner)?,
            Content::Robot(Format::Urdf) => super::urdf::read(&text, &mut inner)?,
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

/// Fixes a robot to a link of another one.
fn join(draft: &mut Draft, mut part: Draft, link: &str, origin: Origin, prefix: &str) {
    let name = |name: &mut String| *name = format!("{prefix}{name}");
    part.links.iter_mut().for_each(|link| name(&mut link.name));
    for joint in &mut part.joints {
        name(&mut joint.name);
        name(&mut joint.parent);
        name(&mut joint.child);
    }
    for coupling in &mut part.couplings {
        name(&mut coupling.joint);
        name(&mut coupling.leader);
    }
    for tendon in &mut part.tendons {
        name(&mut tendon.name);
        tendon.joints.iter_mut().for_each(|(joint, _)| name(joint));
        tendon.motors.iter_mut().for_each(|(motor, _)| name(motor));
    }
    for actuator in &mut part.actuators {
        name(&mut actuator.name);
        match &mut actuator.drive {
            crate::draft::Drive::Joint(joint) => name(joint),
            crate::draft::Drive::Tendon(tendon) => name(tendon),
        }
    }
    part.exclusions.iter_mut().flatten().for_each(name);
    let root = part.links.iter().find(|link| part.joints.iter().all(|joint| joint.child != link.name));
    if let Some(root) = root {
        let joint = Joint::fixed(format!("{}_mount", root.name), link, root.name.clone());
        draft.joints.push(Joint { origin, ..joint });
    }
    draft.links.append(&mut part.links);
    draft.joints.append(&mut part.joints);
    draft.couplings.append(&mut part.couplings);
    draft.tendons.append(&mut part.tendons);
    draft.actuators.append(&mut part.actuators);
    draft.exclusions.append(&mut part.exclusions);
}

/// The rotation with these columns, which may have one common length; `None` if they are not orthogonal and right-handed.
fn rotation(columns: [Vec3; 3]) -> Option<Rotation> {
    const EXACT: f64 = 1e-3;
    let size = columns[0].length();
    let [x, y, z] = columns.map(|column| column / size);
    let right = size > 0.0
        && size.is_finite()
        && (x.cross(y) - z).length() < EXACT
        && (y.length() - 1.0).abs() < EXACT
        && x.dot(y).abs() < EXACT;
    // Printed digits are few: the nearest exact axes.
    let x = x.normalize_or_zero();
    let y = (y - x * x.dot(y)).normalize_or_zero();
    right.then(|| Rotation::from_mat3(&Mat3::from_cols(x, y, x.cross(y))))
}
