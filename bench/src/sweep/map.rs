//! The map of a sweep, as SVG: a line for each case, a column for each step, and a colour for the distance to the bound.

use super::played::{Point, Row};
use super::scenes::RANGE_S;
use std::fmt::Write;

/// Colours by the largest distance of each; the last is beyond the bound. They differ in lightness as well.
const COLOURS: [(f64, &str, &str); 6] = [
    (0.01, "#e3eef9", "< 0.01"),
    (0.1, "#b5d0ea", "< 0.1"),
    (0.3, "#7fb0db", "< 0.3"),
    (0.6, "#4a8ac4", "< 0.6"),
    (1.0, "#1f5c99", "to 1"),
    (f64::INFINITY, "#e8590c", "beyond"),
];
/// Index of the colour of a step that is not claimed.
const UNCLAIMED: usize = COLOURS.len();

/// Size of the columns together, of a line, of the names, and of the space above, pixels.
const WIDTH: f64 = 600.0;
const LINE: f64 = 12.0;
const NAMES: f64 = 160.0;
const ABOVE: f64 = 46.0;

/// Background, letters and what is not claimed, in light and dark.
const STYLE: &str = "<style>text{font:10px sans-serif;fill:#222}.b{fill:#fff}.n{stroke:#ccc}\
    @media(prefers-color-scheme:dark){text{fill:#ddd}.b{fill:#15181c}.n{stroke:#444}}</style>";

/// The colour of a point.
fn colour(row: &Row, point: &Point) -> usize {
    if !row.scene.claims(point.dt_s) {
        return UNCLAIMED;
    }
    let part = point.of_bound();
    let within = part <= 1.0;
    COLOURS[..5].iter().position(|(most, ..)| within && (part < *most || *most == 1.0)).unwrap_or(5)
}

/// Draws the rows in their order.
pub(super) fn map(rows: &[&Row]) -> String {
    let height = ABOVE + LINE * rows.len() as f64 + 6.0;
    let whole = NAMES + WIDTH + 12.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {whole} {height}\" width=\"{whole}\" height=\"{height}\">\n\
         <title>Distance of each case to its bound at each step</title>\n{STYLE}\n<rect class=\"b\" width=\"{whole}\" \
         height=\"{height}\"/>\n"
    );
    legend(&mut svg, rows.first().map_or(1, |row| row.points.len().max(1)));
    for (line, row) in rows.iter().enumerate() {
        let y = ABOVE + LINE * (line as f64 + 0.75);
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{y}\" text-anchor=\"end\">{}</text>",
            NAMES - 5.0,
            row.scene.name
        );
    }
    for kind in 0..=UNCLAIMED {
        let path = cells(rows, kind);
        let stroke = match COLOURS.get(kind) {
            Some((_, colour, _)) => format!("stroke=\"{colour}\""),
            None => "class=\"n\"".to_owned(),
        };
        if !path.is_empty() {
            let _ = writeln!(svg, "<path {stroke} stroke-width=\"{}\" d=\"{path}\"/>", LINE - 2.0);
        }
    }
    svg + "</svg>\n"
}

/// Neighbours of one colour are one stroke.
fn cells(rows: &[&Row], kind: usize) -> String {
    let mut path = String::new();
    for (line, row) in rows.iter().enumerate() {
        let y = ABOVE + LINE * (line as f64 + 0.5);
        let width = WIDTH / row.points.len().max(1) as f64;
        let mut k = 0;
        while k < row.points.len() {
            let like = row.points[k..].iter().take_while(|point| colour(row, point) == kind).count();
            if like > 0 {
                let _ = write!(path, "M{:.1} {y}h{:.1}", NAMES + width * k as f64, width * like as f64);
            }
            k += like.max(1);
        }
    }
    path
}

/// The colours, and the steps above the middles of `columns`.
fn legend(svg: &mut String, columns: usize) {
    let entry = |svg: &mut String, k: usize, stroke: &str, text: &str| {
        let x = NAMES + 76.0 * k as f64;
        let _ = writeln!(
            svg,
            "<path {stroke} stroke-width=\"10\" d=\"M{x} 12h14\"/><text x=\"{}\" y=\"16\">{text}</text>",
            x + 18.0
        );
    };
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"16\" text-anchor=\"end\">distance to the bound</text>",
        NAMES - 5.0
    );
    for (k, (_, colour, text)) in COLOURS.iter().enumerate() {
        entry(svg, k, &format!("stroke=\"{colour}\""), &text.replace('<', "&lt;"));
    }
    entry(svg, UNCLAIMED, "class=\"n\"", "not claimed");
    let _ = writeln!(svg, "<text x=\"{}\" y=\"36\" text-anchor=\"end\">step, ms</text>", NAMES - 5.0);
    let (low, high) = RANGE_S;
    for dt_s in [0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3] {
        let part = libm::log(dt_s / low) / libm::log(high / low);
        let x = NAMES + WIDTH * (part * (columns as f64 - 1.0) + 0.5) / columns as f64;
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"36\" text-anchor=\"middle\">{}</text>", 1e3 * dt_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::played::scene;
    use crate::sweep::played::tests::made_up;

    #[test]
    fn each_distance_has_its_colour_and_what_is_not_claimed_has_none_of_them() {
        let palm = Row { scene: scene("turning_palm").expect("a scene"), points: Vec::new() };
        let at = |dt_s: f64, figure: f64| colour(&palm, &Point { dt_s, figure, bound: 1.0 });
        let found = [0.0, 0.05, 0.2, 0.5, 1.0, 1.01, f64::INFINITY].map(|figure| at(1e-3, figure));
        assert_eq!(found, [0, 1, 2, 3, 4, 5, 5]);
        assert_eq!(at(16e-3, 0.0), UNCLAIMED);
    }

    #[test]
    fn neighbours_of_one_colour_are_one_stroke() {
        let row = Row { scene: scene("free_flight").expect("a scene"), points: made_up(Some(20)) };
        let strokes = |kind: usize| cells(&[&row], kind).matches('M').count();
        // 5 h of the bound: from 0.01 at 2 ms on; one step of 0.7.
        assert_eq!((strokes(0), strokes(1), strokes(4), strokes(5)), (2, 1, 1, 0));
        let svg = map(&[&row]);
        assert!(svg.starts_with("<svg") && svg.contains(">free_flight<") && svg.ends_with("</svg>\n"));
    }
}
