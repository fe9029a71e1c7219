//! Output of `decompose` for people.

use super::report::Report;
use palmares_models::Vec3;
use palmares_models::pieces::{Fit, Surface, TriangleMesh};
use palmares_models::read::cubic_cm;
use std::fmt::Write as _;

/// Error of the volume, or of a distance relative to the longest side, above which the fit is poor.
const POOR: f64 = 0.05;

/// Describes the surface of a mesh.
pub(super) fn surface(mesh: &TriangleMesh) -> String {
    match mesh.surface() {
        Surface::Closed { volume, inward, cavities } => {
            let mut out = format!("closed, {}", cubic_cm(volume));
            if cavities > 0.0 {
                let _ = write!(out, ", and a closed cavity of {}, which is filled", cubic_cm(cavities));
            }
            if inward {
                out += "; its triangles face inward, which has no effect here";
            }
            out
        }
        Surface::Open { edges } => {
            format!("not closed ({edges} open edges), so its volume is unknown")
        }
        Surface::Twisted { edges } => format!(
            "with neighbouring triangles that face opposite sides ({edges} edges), so its volume is unknown"
        ),
        Surface::Empty => "closed, but without volume".to_owned(),
    }
}

fn mm(x: f64) -> String {
    format!("{:.1} mm", x * 1e3)
}

fn percent(x: f64) -> String {
    format!("{:+.1} %", x * 100.0)
}

/// Volumes and distances in one line.
fn fit(fit: &Fit, of_hull: bool) -> String {
    let mut out = cubic_cm(fit.pieces_volume - fit.overlap_volume);
    if let Some(error) = fit.volume_error() {
        let _ = write!(out, " ({})", percent(error));
    }
    let _ = write!(out, ", up to {} beyond the mesh", mm(fit.beyond.distance));
    if !of_hull {
        let _ = write!(out, ", up to {} of the mesh not covered", mm(fit.uncovered.distance));
    }
    out
}

/// Advice for a better fit.
fn advice(report: &Report, of_pieces: &Fit, of_hull: &Fit) -> String {
    let longest = report.size_m.iter().copied().fold(0.0, f64::max);
    // Cavities cannot be represented.
    let poor = |fit: &Fit| {
        fit.mesh_volume
            .is_some_and(|mesh| fit.pieces_volume - fit.overlap_volume > (1.0 + POOR) * (mesh + fit.cavities))
    };
    if of_hull.beyond.distance <= POOR * longest && !poor(of_hull) {
        return "  the convex hull fits well: you can keep the mesh\n".to_owned();
    }
    let place = |at: Vec3| at.to_array().map(|x| format!("{:.1}", x * 1e3)).join(" ");
    let (beyond, uncovered) = (&of_pieces.beyond, &of_pieces.uncovered);
    let mut out = String::new();
    if poor(of_pieces) || beyond.distance > POOR * longest {
        let at = place(beyond.at);
        let _ = writeln!(
            out,
            "  largest protrusion at ({at}) mm in the mesh's frame; more --pieces or a higher --resolution fit better"
        );
    }
    if uncovered.distance > POOR * longest {
        let at = place(uncovered.at);
        let _ =
            writeln!(out, "  largest gap at ({at}) mm in the mesh's frame; a piece has at most 64 points");
    }
    out
}

/// The whole text.
pub(super) fn report(report: &Report, of_pieces: &Fit, of_hull: &Fit) -> String {
    let mut out = String::new();
    let size = report.size_m.map(|x| format!("{:.1}", x * 1e3)).join(" x ");
    let _ = writeln!(out, "{}: {size} mm, {} triangles, {}", report.mesh, report.triangles, report.surface);
    let count = report.pieces.len();
    let pieces = if count == 1 { "1 piece".to_owned() } else { format!("{count} pieces") };
    let _ = writeln!(out, "  convex hull: {}", fit(of_hull, true));
    let _ = writeln!(out, "  {pieces}: {}", fit(of_pieces, false));
    if of_pieces.overlap_volume > 0.0 {
        let overlap = cubic_cm(of_pieces.overlap_volume);
        let _ = writeln!(out, "  the pieces overlap by {overlap}, which counts twice for the mass");
    }
    if let (Some(shift), Some(error)) = (of_pieces.com_shift, of_pieces.inertia_error) {
        let _ = writeln!(
            out,
            "  with uniform density: error of the centre of mass {}, of the moments of inertia up to {:.1} %",
            mm(shift),
            error * 100.0
        );
    }
    let _ = writeln!(out, "  distances are measured at points {} apart", mm(of_pieces.spacing));
    out += &advice(report, of_pieces, of_hull);
    let (first, last) = (report.pieces.first(), report.pieces.last());
    if let (Some(first), Some(last)) = (first, last) {
        let names = if count == 1 { first.file.clone() } else { format!("{} to {}", first.file, last.file) };
        let _ = writeln!(out, "\nwrote {}: {names}", report.folder);
    }
    for place in &report.places {
        let _ = writeln!(out, "\n{}:\n", place.place);
        place.lines.iter().for_each(|line| out += &format!("    {line}\n"));
        if let Some(also) = &place.also {
            let _ = writeln!(out, "\nand {also}");
        }
    }
    out
}
