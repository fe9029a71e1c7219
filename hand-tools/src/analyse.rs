//! `palmares hand analyse`: synergies, stiffness and order of closing of a hand; with contacts, the grasp.

use crate::describe::short;
use crate::draw::draw;
use crate::figure::{Curve, Figure, Panel};
use crate::fingers::fingers;
use crate::load::{hint, link_of, load_hand, parse_sigma};
use crate::show::one_per_motor;
use crate::table::{json, table};
use crate::view::view_of;
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use nalgebra::DMatrix;
use palmares_analysis::closing::{Closing, close};
use palmares_analysis::closure::{Closure, ForceClosure, force_closure, form_closure};
use palmares_analysis::contact::{Contact, ContactModel, DEFAULT_ARM, LinkContact};
use palmares_analysis::ellipsoid::ellipsoid;
use palmares_analysis::equilibrium::{Rest, rest};
use palmares_analysis::grasp::Grasp;
use palmares_analysis::hand::{CompliantHand, Tendons};
use palmares_analysis::quality::{Norm, Quality, QualitySettings, quality};
use palmares_analysis::quasistatic::{ContactStiffness, QuasiStatic};
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::Config;
use palmares_sim::statics::rest::Method;
use serde_json::{Value, json as value};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

/// Samples of the closing.
const STEPS: usize = 50;
/// Fractions of a joint's travel in the order of closing.
const FRACTIONS: [f64; 3] = [0.1, 0.5, 0.9];
/// Edges of the pyramids inside the friction cones.
const EDGES: usize = 8;

/// Arguments of `hand analyse`.
#[derive(Debug, Args)]
pub struct AnalyseArgs {
    /// A URDF file, a folder or .zip with one, or the name of a built-in hand
    hand: String,
    /// Motor positions of the equilibrium, from 0 (open) to 1: one for all motors, or one per motor
    #[arg(long, value_delimiter = ',', value_parser = parse_sigma, default_value = "0.6")]
    sigma: Vec<f64>,
    /// A virtual contact on a link: link:x,y,z:nx,ny,nz with its point, m, and its normal out of the hand, in the link's
    /// frame; can be given several times
    #[arg(long, value_name = "LINK:X,Y,Z:NX,NY,NZ", allow_hyphen_values = true)]
    contact: Vec<ContactArg>,
    /// Model of the contacts
    #[arg(long, value_enum, default_value = "hard-finger")]
    model: ModelArg,
    /// Friction coefficient of the contacts
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    friction: f64,
    /// Arm of the friction moment of soft fingers, m
    #[arg(long, default_value_t = DEFAULT_ARM, value_parser = positive)]
    arm: f64,
    /// Stiffness k of the contacts along every direction, N/m; about the normal of soft fingers k · arm², N·m/rad
    #[arg(long, default_value_t = 1e4, value_parser = positive)]
    contact_stiffness: f64,
    /// Origin of the object's frame in the world, m; the middle of the contacts if it is not given
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = vector)]
    object: Option<Vec3>,
    /// Tendons of fixed length instead of their own stiffness
    #[arg(long)]
    fixed_tendons: bool,
    /// Print one JSON object with all arrays instead of text
    #[arg(long)]
    json: bool,
    /// Draw the closing into this .svg or .png file
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
}

/// Models by their names.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum ModelArg {
    /// The normal force
    Frictionless,
    /// A force
    HardFinger,
    /// A force, and a moment about the normal
    SoftFinger,
}

/// A contact on the command line.
#[derive(Clone, Debug)]
struct ContactArg {
    link: String,
    point: Vec3,
    normal: Vec3,
}

fn positive(text: &str) -> anyhow::Result<f64> {
    let number: f64 = text.trim().parse().with_context(|| format!("`{text}` is not a number"))?;
    if !(number > 0.0 && number.is_finite()) {
        bail!("{number} is out of range; valid: above 0");
    }
    Ok(number)
}

fn vector(text: &str) -> anyhow::Result<Vec3> {
    let parts = text
        .split(',')
        .map(|x| x.trim().parse().with_context(|| format!("`{x}` is not a number")))
        .collect::<anyhow::Result<Vec<f64>>>()?;
    match parts.as_slice() {
        &[x, y, z] if parts.iter().all(|part| part.is_finite()) => Ok(Vec3::new(x, y, z)),
        _ => bail!("`{text}` is no vector; valid: three finite numbers, x,y,z"),
    }
}

impl FromStr for ContactArg {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let valid = "valid: link:x,y,z:nx,ny,nz";
        let (rest, normal) = text.rsplit_once(':').context(valid)?;
        let (link, point) = rest.rsplit_once(':').context(valid)?;
        let (point, normal) = (vector(point)?, vector(normal)?);
        if normal.length() < 1e-9 {
            bail!("the normal has no direction");
        }
        Ok(ContactArg { link: link.to_owned(), point, normal })
    }
}

impl AnalyseArgs {
    fn contacts(&self, hand: &Hand) -> anyhow::Result<Vec<LinkContact>> {
        let model = match self.model {
            ModelArg::Frictionless => ContactModel::Frictionless,
            ModelArg::HardFinger => ContactModel::HardFinger,
            ModelArg::SoftFinger => ContactModel::SoftFinger,
        };
        let on = |given: &ContactArg| {
            let in_link = Contact::new(given.point, given.normal, model, self.friction, self.arm);
            Ok(LinkContact { link: link_of(hand, &given.link)?, in_link })
        };
        self.contact.iter().map(on).collect()
    }
}

/// Everything that is known of a grasp.
struct Held {
    grasp: Grasp,
    linear: QuasiStatic,
    form: Closure,
    force: ForceClosure,
    quality: Quality,
    length: f64,
}

/// Computes, prints and draws.
pub(crate) fn analyse(args: &AnalyseArgs) -> anyhow::Result<ExitCode> {
    let found = load_hand(&args.hand);
    let hand = found.with_context(|| hint(&args.hand).unwrap_or_else(|| args.hand.clone()))?.hand;
    let config = Config::default();
    let sigma = one_per_motor(&hand, &args.sigma)?;
    let at = rest(&config, &hand, Pose::IDENTITY, &sigma, &[], &[])?;
    let tendons = if args.fixed_tendons { Tendons::Fixed } else { Tendons::Compliant };
    let compliant = CompliantHand::tendon_driven(&hand, at.posture(), tendons, config.limit_stiffness, None)?;
    let (open, closed) = (vec![0.0; hand.motors.len()], vec![1.0; hand.motors.len()]);
    let closing = close(&config, &hand, Pose::IDENTITY, &open, &closed, STEPS)?;
    let contacts = args.contacts(&hand)?;
    let held = if contacts.is_empty() { None } else { Some(hold(args, &hand, &at, &compliant, &contacts)?) };
    if let Some(file) = &args.figure {
        draw(&figure(&hand, &sigma, &at, &closing), file)?;
    }
    let text = if args.json {
        json(&report(&hand, &sigma, &at, &compliant, &closing, held.as_ref())) + "\n"
    } else {
        let mut text = hand_text(&hand, &sigma, &at, &compliant, &closing);
        if let Some(held) = &held {
            text += &grasp_text(&hand, held);
        }
        if let Some(file) = &args.figure {
            let _ = writeln!(text, "wrote {}", file.display());
        }
        text
    };
    write!(std::io::stdout().lock(), "{text}")?;
    Ok(ExitCode::SUCCESS)
}

fn hold(
    args: &AnalyseArgs,
    hand: &Hand,
    at: &Rest,
    compliant: &CompliantHand,
    contacts: &[LinkContact],
) -> anyhow::Result<Held> {
    let q = &at.equilibrium.q;
    let points = contacts.iter().map(|contact| at.links[contact.link].transform_point(contact.in_link.point));
    let middle = points.sum::<Vec3>() / contacts.len() as f64;
    let object = Pose::from_translation(args.object.unwrap_or(middle));
    let grasp = Grasp::new(hand, Pose::IDENTITY, q, contacts, object)?;
    let k = ContactStiffness::Equal(args.contact_stiffness).of(&grasp.contacts)?;
    let linear = QuasiStatic::new(compliant, &grasp.g, &grasp.j, &k, None)?;
    let rows = [0, 1, 2, 3, 4, 5];
    let form = form_closure(&grasp.contacts, &grasp.g, &rows);
    let force = force_closure(&grasp.contacts, &grasp.g, &grasp.j, &rows);
    let far = grasp.contacts.iter().map(|contact| (contact.point - object.translation).length());
    let length = far.fold(1e-6, f64::max);
    let settings = QualitySettings { norm: Norm::Total, edges: EDGES, length };
    let quality = quality(&grasp.contacts, &grasp.g, &rows, settings)?;
    Ok(Held { grasp, linear, form, force, quality, length })
}

fn sigmas(sigma: &[f64]) -> String {
    sigma.iter().map(|s| short(*s)).collect::<Vec<_>>().join(", ")
}

fn cells<'a>(name: &str, numbers: impl IntoIterator<Item = &'a f64>) -> Vec<String> {
    std::iter::once(name.to_owned()).chain(numbers.into_iter().map(|x| number(*x))).collect()
}

/// A number with four digits.
fn number(x: f64) -> String {
    if x == 0.0 || x.abs() < 1e-12 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&x.abs()) {
        let digits = (3 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
        format!("{x:.digits$}")
    } else {
        format!("{x:.3e}")
    }
}

fn row(matrix: &DMatrix<f64>, k: usize) -> Vec<f64> {
    matrix.row(k).iter().copied().collect()
}

fn hand_text(hand: &Hand, sigma: &[f64], at: &Rest, compliant: &CompliantHand, closing: &Closing) -> String {
    let found = &at.equilibrium;
    let method = match found.method {
        Method::ClosedForm => "closed form",
        Method::Newton => "Newton's method",
    };
    let mut text = format!("{}, σ = {}: {method}\n", hand.name, sigmas(sigma));
    for reason in &found.beyond_closed_form {
        let _ = writeln!(text, "  {reason}");
    }
    let motors = || hand.motors.iter().map(|motor| format!("dq/dσ {}", motor.name));
    let mut rows =
        vec![["coordinate", "q", "1/stiffness"].map(str::to_owned).into_iter().chain(motors()).collect()];
    for (i, c) in hand.coordinates.iter().enumerate() {
        let mut numbers = vec![found.q[i], compliant.compliance[(i, i)]];
        numbers.extend(row(&compliant.motion, i));
        rows.push(cells(&c.name, &numbers));
    }
    let _ = write!(text, "\nCoordinates: q, compliance ∂q/∂τ, synergies ∂q/∂σ\n{}", table(&rows));
    let motors = || hand.motors.iter().map(|motor| format!("df/dσ {}", motor.name));
    let mut rows = vec![["tendon", "f"].map(str::to_owned).into_iter().chain(motors()).collect()];
    for (t, tendon) in hand.tendons.iter().enumerate() {
        let mut numbers = vec![found.tension[t]];
        match compliant.acting.iter().position(|acting| *acting == t) {
            Some(k) => numbers.extend(row(&compliant.tension, k)),
            None => numbers.extend(vec![0.0; hand.motors.len()]),
        }
        rows.push(cells(&tendon.name, &numbers));
    }
    let _ = write!(text, "\nTendons: tension, ∂f/∂σ (0: slack or at its limit)\n{}", table(&rows));
    let mut rows = vec![["coordinate", "travel", "10 %", "50 %", "90 %"].map(str::to_owned).to_vec()];
    for joint in closing.order(&FRACTIONS) {
        let mut cells = cells(&hand.coordinates[joint.coordinate].name, [&joint.travel]);
        cells.extend(joint.reached.iter().map(|reached| reached.map_or("-".to_owned(), number)));
        rows.push(cells);
    }
    let _ = write!(
        text,
        "\nOrder of closing: σ at which a coordinate has done this part of its travel\n{}",
        table(&rows)
    );
    text
}

fn grasp_text(hand: &Hand, held: &Held) -> String {
    let Held { grasp, linear, form, force, quality, length } = held;
    let mut rows = vec![["contact", "x", "y", "z", "nx", "ny", "nz"].map(str::to_owned).to_vec()];
    for (contact, &link) in grasp.contacts.iter().zip(&grasp.links) {
        let numbers: Vec<f64> =
            contact.point.to_array().into_iter().chain(contact.normal.to_array()).collect();
        rows.push(cells(&hand.links[link].name, &numbers));
    }
    let mut text = format!("\nContacts in the world\n{}", table(&rows));
    let names = ["x", "y", "z", "turn x", "turn y", "turn z"];
    let square = |matrix: &DMatrix<f64>| {
        let rows: Vec<Vec<String>> = (0..6).map(|k| cells(names[k], &row(matrix, k))).collect();
        table(&rows)
    };
    let _ = write!(
        text,
        "\nObject stiffness, N/m, N, N·m/rad; held in {} of 6 directions\n{}",
        linear.held,
        square(&linear.object_stiffness)
    );
    let _ = write!(text, "\nObject motion per σ, m and rad\n{}", square(&linear.object_per_input));
    let mut rows = Vec::new();
    for (contact, &link) in grasp.contacts.iter().zip(&grasp.links) {
        for part in ["f_n", "f_t", "f_o", "m_n"].iter().take(contact.model.components()) {
            let name = format!("{} {part}", hand.links[link].name);
            rows.push(cells(&name, &row(&linear.forces_per_input, rows.len())));
        }
    }
    let _ = write!(text, "\nContact forces per σ, N\n{}", table(&rows));
    let yes = |closed| if closed { "yes" } else { "no" };
    let velocity = ellipsoid(&linear.object_per_input);
    let forces = ellipsoid(&linear.forces_per_input);
    let list =
        |radii: &nalgebra::DVector<f64>| radii.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", ");
    let rows = [
        ("rank of G", form.rank.max(force.frictional.rank).to_string()),
        (
            "internal forces: all, controlled by σ",
            format!(
                "{}, {}",
                linear.internal_forces().ncols(),
                linear.controllable_internal_forces().ncols()
            ),
        ),
        ("form closure: margin", format!("{}: {}", yes(form.closed), number(form.margin))),
        (
            "frictional closure: margin",
            format!("{}: {}", yes(force.frictional.closed), number(force.frictional.margin)),
        ),
        ("force closure", yes(force.closed).to_owned()),
        ("ε (Σ f_n ≤ 1 N, moments over the length), N", number(quality.epsilon)),
        ("volume, N⁶", quality.volume.map_or("-".to_owned(), number)),
        ("length, m", number(*length)),
        ("semi-axes of object motion per |σ| = 1", list(&velocity.radii)),
        ("semi-axes of contact forces per |σ| = 1, N", list(&forces.radii)),
    ];
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(name, text)| vec![name.to_owned(), text]).collect();
    let _ = write!(text, "\nGrasp\n{}", table(&rows));
    text
}

fn rows_of(matrix: &DMatrix<f64>) -> Value {
    Value::from((0..matrix.nrows()).map(|k| row(matrix, k)).collect::<Vec<_>>())
}

fn report(
    hand: &Hand,
    sigma: &[f64],
    at: &Rest,
    compliant: &CompliantHand,
    closing: &Closing,
    held: Option<&Held>,
) -> Value {
    let found = &at.equilibrium;
    let pose = |pose: &Pose| value!({"position": pose.translation.to_array(), "quat_xyzw": pose.rotation.to_array()});
    let order = closing.order(&FRACTIONS).into_iter().map(|joint| {
        value!({
            "coordinate": hand.coordinates[joint.coordinate].name,
            "travel": joint.travel,
            "reached": joint.reached,
        })
    });
    let mut report = value!({
        "hand": hand.name,
        "coordinates": hand.coordinates.iter().map(|c| &c.name).collect::<Vec<_>>(),
        "tendons": hand.tendons.iter().map(|t| &t.name).collect::<Vec<_>>(),
        "sigma": sigma,
        "equilibrium": {
            "q": found.q,
            "tension": found.tension,
            "beyond_closed_form": found.beyond_closed_form,
            "links": hand.links.iter().zip(&at.links).map(|(link, p)| (link.name.clone(), pose(p)))
                .collect::<serde_json::Map<_, _>>(),
        },
        "joint_compliance": rows_of(&compliant.compliance),
        "joints_per_sigma": rows_of(&compliant.motion),
        "tension_per_sigma": rows_of(&compliant.tension),
        "acting_tendons": compliant.acting,
        "closing": {
            "sigma": closing.sigma, "q": closing.q, "tension": closing.tension,
            "fractions": FRACTIONS, "order": order.collect::<Vec<_>>(),
        },
    });
    if let (Some(held), Some(report)) = (held, report.as_object_mut()) {
        let Held { grasp, linear, form, force, quality, length } = held;
        let contacts = grasp.contacts.iter().zip(&grasp.links).map(|(contact, &link)| {
            value!({
                "link": hand.links[link].name,
                "point": contact.point.to_array(),
                "axes": contact.axes().map(|axis| axis.to_array()),
                "model": contact.model,
                "friction": contact.friction,
                "arm": contact.arm,
            })
        });
        let closure = |closure: &Closure| value!({"closed": closure.closed, "rank": closure.rank, "margin": closure.margin, "forces": closure.forces.as_slice()});
        report.insert(
            "grasp".to_owned(),
            value!({
                "object": pose(&grasp.object),
                "contacts": contacts.collect::<Vec<_>>(),
                "G": rows_of(&grasp.g),
                "J": rows_of(&grasp.j),
                "object_stiffness": rows_of(&linear.object_stiffness),
                "object_per_sigma": rows_of(&linear.object_per_input),
                "forces_per_sigma": rows_of(&linear.forces_per_input),
                "joints_per_sigma": rows_of(&linear.joints_per_input),
                "tension_per_sigma": rows_of(&linear.tension_per_input),
                "input_stiffness": rows_of(&linear.input_stiffness),
                "internal_forces": rows_of(&linear.internal_forces()),
                "controllable_internal_forces": rows_of(&linear.controllable_internal_forces()),
                "held": linear.held,
                "form_closure": closure(form),
                "frictional_closure": closure(&force.frictional),
                "force_closure": force.closed,
                "epsilon": quality.epsilon,
                "epsilon_bound": quality.epsilon_bound,
                "volume": quality.volume,
                "length": length,
            }),
        );
    }
    report
}

/// The hand open and at σ, and its coordinates and tensions while it closes.
fn figure(hand: &Hand, sigma: &[f64], at: &Rest, closing: &Closing) -> Figure {
    let progress: Vec<f64> = (0..closing.q.len()).map(|k| k as f64 / STEPS as f64).collect();
    let mut panels = Vec::new();
    for group in fingers(hand) {
        let curve = |(c, name): &(usize, String)| Curve {
            name: name.clone(),
            values: closing.q.iter().map(|q| q[*c]).collect(),
            predicted: Vec::new(),
        };
        panels.push(Panel {
            title: group.title.clone(),
            axis: format!("q ({})", group.unit),
            curves: group.members.iter().map(curve).collect(),
        });
    }
    let curve = |(t, tendon): (usize, &palmares_models::hand::Tendon)| Curve {
        name: tendon.name.clone(),
        values: closing.tension.iter().map(|f| f[t]).collect(),
        predicted: Vec::new(),
    };
    if !hand.tendons.is_empty() {
        panels.push(Panel {
            title: "tensions".into(),
            axis: "f (N or N·m)".into(),
            curves: hand.tendons.iter().enumerate().map(curve).collect(),
        });
    }
    let open = view_of(hand, &closing.q[0], "open".into());
    let closed = view_of(hand, &at.equilibrium.q, format!("σ = {}", sigmas(sigma)));
    Figure {
        title: format!("{}: closing", hand.name),
        notes: vec!["equilibria of the free hand".to_owned()],
        time: progress,
        across: "σ of all motors",
        marks: Vec::new(),
        panels,
        views: vec![open, closed],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_a_contact() {
        let contact: ContactArg = "a:b:0.01,-2e-3,0:0,-1,0".parse().expect("it is well-formed");
        assert_eq!((contact.link.as_str(), contact.point), ("a:b", Vec3::new(0.01, -0.002, 0.0)));
        assert_eq!(contact.normal, Vec3::NEG_Y);
        for bad in ["", "a", "a:1,2,3", "a:1,2:0,0,1", "a:1,2,3:0,0,0", "a:x,2,3:0,0,1", "a:1,2,inf:0,0,1"] {
            assert!(bad.parse::<ContactArg>().is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_have_four_digits() {
        for (x, text) in
            [(0.0, "0"), (1.0, "1.000"), (-0.01234567, "-0.01235"), (12345.6, "12346"), (1.5e-7, "1.500e-7")]
        {
            assert_eq!(number(x), text);
        }
    }
}
