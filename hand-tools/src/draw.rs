//! Draws images as SVG or PNG; and the figure of a closure.

use crate::figure::{Curve, Figure, Panel, range};
use crate::view::{View, span};
use anyhow::{Context, anyhow, bail};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::path::Path;

/// Font for layout and PNG; an SVG viewer uses its own.
const FONT: &[u8] = include_bytes!("../assets/dejavu-sans/DejaVuSans.ttf");

/// Colours that people with common kinds of colour blindness can distinguish (Okabe and Ito 2008).
pub(crate) const COLOURS: [RGBColor; 6] = [
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
];
pub(crate) const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
pub(crate) const FAINT: RGBColor = RGBColor(0x88, 0x88, 0x88);
pub(crate) const GRID: RGBColor = RGBColor(0xe4, 0xe4, 0xe4);

/// Sizes in the units of an SVG.
const PANEL_WIDTH: u32 = 430;
const PANEL_HEIGHT: u32 = 270;
pub(crate) const MARGIN: u32 = 14;
const TITLE_HEIGHT: u32 = 34;
const NOTE_HEIGHT: u32 = 20;

/// Pixels of a PNG per unit; each pixel is the mean of OVERSAMPLING² drawn ones.
const PNG_SCALE: u32 = 2;
const OVERSAMPLING: u32 = 2;

/// An image that can be drawn.
pub(crate) trait Drawable {
    /// Width and height in the units of an SVG.
    fn size(&self) -> (u32, u32);
    /// Draws itself with `scale` pixels per unit.
    fn paint<DB: DrawingBackend>(&self, area: &Area<DB>, scale: u32) -> anyhow::Result<()>;
}

/// Draws to a file; the name's ending selects SVG or PNG.
pub(crate) fn draw(picture: &impl Drawable, file: &Path) -> anyhow::Result<()> {
    register_font("sans-serif", FontStyle::Normal, FONT)
        .map_err(|_| anyhow!("the font that comes with the program is broken"))?;
    let kind = file.extension().map(|e| e.to_ascii_lowercase()).unwrap_or_default();
    let bytes = match kind.to_str() {
        Some("svg") => svg(picture)?.into_bytes(),
        Some("png") => png(picture)?,
        _ => bail!("{}: unknown image format; valid: a name that ends in .svg or .png", file.display()),
    };
    std::fs::write(file, bytes).with_context(|| format!("cannot write {}", file.display()))
}

/// Columns and rows of panels.
fn grid(panels: usize) -> (u32, u32) {
    let columns = match panels {
        0 | 1 => 1,
        2 | 4 => 2,
        _ => 3,
    };
    (columns, (panels as u32).max(1).div_ceil(columns))
}

fn head_height(figure: &Figure) -> u32 {
    TITLE_HEIGHT + NOTE_HEIGHT * figure.notes.len() as u32 + MARGIN
}

impl Drawable for Figure {
    fn size(&self) -> (u32, u32) {
        let (columns, rows) = grid(self.views.len() + self.panels.len());
        // A single panel leaves space for the title.
        ((columns * PANEL_WIDTH).max(2 * PANEL_WIDTH), rows * PANEL_HEIGHT + head_height(self))
    }

    fn paint<DB: DrawingBackend>(&self, area: &Area<DB>, scale: u32) -> anyhow::Result<()> {
        paint(area, self, scale)
    }
}

fn svg(picture: &impl Drawable) -> anyhow::Result<String> {
    let mut text = String::new();
    picture.paint(&SVGBackend::with_string(&mut text, picture.size()).into_drawing_area(), 1)?;
    Ok(joined(&text))
}

/// The same picture in fewer bytes: the backend writes every dash of a line as an element of its own. Dashes in a row with
/// the same look become one path, and words stand in the line of their element.
fn joined(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len());
    let mut open = None;
    for line in svg.lines() {
        let dash = line
            .strip_prefix("<polyline ")
            .and_then(|rest| rest.strip_suffix("\"/>")?.split_once("points=\""));
        if open.is_some() && open != dash.map(|(look, _)| look) {
            out.push_str("\"/>\n");
            open = None;
        }
        let Some((look, points)) = dash else {
            out.push_str(line);
            if !line.starts_with("<text") && line.ends_with('>') {
                out.push('\n');
            }
            continue;
        };
        if open.is_none() {
            out.push_str(&format!("<path {look}d=\""));
            open = Some(look);
        }
        out.push('M');
        out.push_str(points.trim_end());
    }
    out
}

fn png(picture: &impl Drawable) -> anyhow::Result<Vec<u8>> {
    let (width, height) = picture.size();
    let scale = PNG_SCALE * OVERSAMPLING;
    let mut fine = vec![0xff; (width * scale * height * scale * 3) as usize];
    {
        let backend = BitMapBackend::with_buffer(&mut fine, (width * scale, height * scale));
        picture.paint(&backend.into_drawing_area(), scale)?;
    }
    let (width, height) = (width * PNG_SCALE, height * PNG_SCALE);
    let pixels = shrunk(&fine, width as usize, height as usize);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(bytes)
}

/// Averages blocks of pixels, for smooth lines.
fn shrunk(fine: &[u8], width: usize, height: usize) -> Vec<u8> {
    let n = OVERSAMPLING as usize;
    let mut out = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            for channel in 0..3 {
                let at = |i: usize| ((y * n + i / n) * width * n + x * n + i % n) * 3 + channel;
                let sum: usize = (0..n * n).map(|i| usize::from(fine[at(i)])).sum();
                out.push((sum / (n * n)) as u8);
            }
        }
    }
    out
}

pub(crate) type Area<DB> = DrawingArea<DB, Shift>;
type Chart<'a, DB> = ChartContext<'a, DB, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Converts an error of plotters.
pub(crate) fn drawing_error<E: std::error::Error + Send + Sync>(
    error: DrawingAreaErrorKind<E>,
) -> anyhow::Error {
    anyhow!("cannot draw: {error}")
}

/// Text style, `size` units high.
pub(crate) fn text_style(size: u32, colour: RGBColor, scale: u32) -> TextStyle<'static> {
    let mut style: TextStyle = ("sans-serif", size * scale).into();
    style.color = colour.to_backend_color();
    style.pos(Pos::new(HPos::Left, VPos::Top))
}

fn paint<DB: DrawingBackend>(area: &Area<DB>, figure: &Figure, scale: u32) -> anyhow::Result<()> {
    area.fill(&WHITE).map_err(drawing_error)?;
    let left = (MARGIN * scale) as i32;
    let title = text_style(20, INK, scale);
    area.draw_text(&figure.title, &title, (left, (10 * scale) as i32)).map_err(drawing_error)?;
    for (i, note) in figure.notes.iter().enumerate() {
        let top = TITLE_HEIGHT + NOTE_HEIGHT * i as u32 + 4;
        area.draw_text(note, &text_style(13, FAINT, scale), (left, (top * scale) as i32))
            .map_err(drawing_error)?;
    }
    let (_, below) = area.split_vertically(head_height(figure) * scale);
    let (columns, rows) = grid(figure.views.len() + figure.panels.len());
    let cells = below.split_evenly((rows as usize, columns as usize));
    let (for_views, for_panels) = cells.split_at(figure.views.len());
    for (cell, view) in for_views.iter().zip(&figure.views) {
        paint_view(cell, view, span(&figure.views), scale)?;
    }
    for (cell, panel) in for_panels.iter().zip(&figure.panels) {
        paint_panel(cell, figure, panel, scale)?;
    }
    area.present().map_err(drawing_error)
}

/// A view of the hand, with a scale bar. `whole` is the area of all views, which share their scale.
fn paint_view<DB: DrawingBackend>(
    cell: &Area<DB>,
    view: &View,
    whole: (f64, f64, f64, f64),
    scale: u32,
) -> anyhow::Result<()> {
    let s = f64::from(scale);
    cell.draw_text(&view.title, &text_style(15, INK, scale), ((60.0 * s) as i32, (4.0 * s) as i32))
        .map_err(drawing_error)?;
    let (left, right, bottom, top) = whole;
    if left > right {
        return Ok(());
    }
    // Below the title, above the bar.
    let (width, height) = cell.dim_in_pixel();
    let room = (f64::from(width) - 40.0 * s, f64::from(height) - 66.0 * s);
    let per_metre = (room.0 / (right - left).max(1e-9)).min(room.1 / (top - bottom).max(1e-9));
    let middle = f64::from(width) / 2.0 - per_metre * (left + right) / 2.0;
    let ground = 28.0 * s + room.1 + per_metre * bottom;
    let place = |&(x, y): &(f64, f64)| ((middle + per_metre * x) as i32, (ground - per_metre * y) as i32);
    for outline in &view.outlines {
        let colour = outline.finger.map_or(FAINT, |finger| COLOURS[finger % COLOURS.len()]);
        let points: Vec<(i32, i32)> = outline.points.iter().map(place).collect();
        let edge: Vec<(i32, i32)> = points.iter().chain(points.first()).copied().collect();
        // Pale and opaque, so that shapes behind do not show through.
        let pale = |x: u8| (255 - (255 - u16::from(x)) * 45 / 100) as u8;
        let fill = RGBColor(pale(colour.0), pale(colour.1), pale(colour.2));
        cell.draw(&Polygon::new(points, fill.filled())).map_err(drawing_error)?;
        cell.draw(&PathElement::new(edge, colour.stroke_width(scale))).map_err(drawing_error)?;
    }
    let bar = if right - left >= 0.1 { (0.05, "5 cm") } else { (0.01, "1 cm") };
    let (x, y) = ((20.0 * s) as i32, height as i32 - (18.0 * s) as i32);
    let end = x + (bar.0 * per_metre) as i32;
    cell.draw(&PathElement::new(vec![(x, y), (end, y)], INK.stroke_width(2 * scale)))
        .map_err(drawing_error)?;
    let label = text_style(12, INK, scale).pos(Pos::new(HPos::Left, VPos::Center));
    cell.draw_text(bar.1, &label, (end + (6.0 * s) as i32, y)).map_err(drawing_error)
}

fn paint_panel<DB: DrawingBackend>(
    cell: &Area<DB>,
    figure: &Figure,
    panel: &Panel,
    scale: u32,
) -> anyhow::Result<()> {
    let (low, high) = range(figure, &panel.axis);
    let end = figure.time.last().copied().unwrap_or(1.0).max(1e-3);
    // Names are at the right end of the curves, in the margin.
    let widest =
        figure.panels.iter().flat_map(|p| &p.curves).map(|c| c.name.chars().count()).max().unwrap_or(0)
            as u32;
    let names_width = (widest.clamp(4, 20) * 8 + 14) * scale;
    let title = text_style(15, INK, scale);
    let (width, _) = cell.estimate_text_size(&panel.title, &title).map_err(drawing_error)?;
    cell.draw_text(&panel.title, &title, ((60 * scale) as i32, (4 * scale) as i32)).map_err(drawing_error)?;
    let unit_at = ((66 * scale + width) as i32, (6 * scale) as i32);
    cell.draw_text(&panel.axis, &text_style(12, FAINT, scale), unit_at).map_err(drawing_error)?;

    let mut chart = ChartBuilder::on(cell)
        .margin_top(26 * scale)
        .margin_bottom(4 * scale)
        .margin_right(names_width)
        .x_label_area_size(34 * scale)
        .y_label_area_size(60 * scale)
        .build_cartesian_2d(0.0..end, low..high)
        .map_err(drawing_error)?;
    chart
        .configure_mesh()
        .x_labels(6)
        .y_labels(6)
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID.stroke_width(scale))
        .axis_style(FAINT.stroke_width(scale))
        .set_all_tick_mark_size(3 * scale)
        .label_style(text_style(12, INK, scale))
        .y_label_formatter(&|y| tick(*y, high - low))
        .x_label_formatter(&|x| tick(*x, end))
        .x_desc(figure.across)
        .axis_desc_style(text_style(12, FAINT, scale))
        .draw()
        .map_err(drawing_error)?;
    for (at, what) in &figure.marks {
        let line =
            DashedLineSeries::new([(*at, low), (*at, high)], 2 * scale, 3 * scale, FAINT.stroke_width(scale));
        chart.draw_series(line).map_err(drawing_error)?;
        let (x, y) = chart.backend_coord(&(*at, high));
        let (x0, y0) = cell.get_base_pixel();
        let small = text_style(11, FAINT, scale).pos(Pos::new(HPos::Left, VPos::Bottom));
        let s = scale as i32;
        cell.draw_text(what, &small, (x - x0 - 3 * s, y - y0 - 3 * s)).map_err(drawing_error)?;
    }
    for (i, (curve, colour)) in panel.curves.iter().zip(COLOURS.iter().cycle()).enumerate() {
        // A curve that later ones cover is wider.
        let hidden = panel.curves[i + 1..].iter().filter(|c| alike(c, curve, 0.01 * (high - low))).count();
        let style = colour.stroke_width((2 + 3 * hidden as u32) * scale);
        paint_curve(&mut chart, &figure.time, curve, style, scale)?;
    }
    paint_names(cell, &chart, panel, end, scale)
}

fn paint_curve<DB: DrawingBackend>(
    chart: &mut Chart<'_, DB>,
    time: &[f64],
    curve: &Curve,
    style: ShapeStyle,
    scale: u32,
) -> anyhow::Result<()> {
    let colour = style.color;
    let points = time.iter().copied().zip(curve.values.iter().copied());
    chart.draw_series(LineSeries::new(points, style)).map_err(drawing_error)?;
    for &(from, to, value) in &curve.predicted {
        let ends = [(from, value), (to, value)];
        let dashes = DashedLineSeries::new(ends, 6 * scale, 4 * scale, colour.mix(0.8).stroke_width(scale));
        chart.draw_series(dashes).map_err(drawing_error)?;
        let ring = Circle::new((to, value), 4 * scale, colour.stroke_width(scale + scale / 2));
        chart.draw_series([ring]).map_err(drawing_error)?;
    }
    Ok(())
}

/// Whether two curves differ by less than `distance` throughout.
fn alike(a: &Curve, b: &Curve, distance: f64) -> bool {
    a.values.iter().zip(&b.values).all(|(a, b)| (a - b).abs() < distance)
}

/// Writes each name at the end of its curve, without overlaps.
fn paint_names<DB: DrawingBackend>(
    cell: &Area<DB>,
    chart: &Chart<'_, DB>,
    panel: &Panel,
    end: f64,
    scale: u32,
) -> anyhow::Result<()> {
    let (x0, y0) = cell.get_base_pixel();
    let mut places: Vec<(i32, i32, usize)> = Vec::new();
    for (i, curve) in panel.curves.iter().enumerate() {
        let Some(&last) = curve.values.last() else { continue };
        let (x, y) = chart.backend_coord(&(end, last));
        places.push((y - y0, x - x0 + 8 * scale as i32, i));
    }
    places.sort();
    let heights = spread(&places.iter().map(|p| p.0).collect::<Vec<_>>(), 15 * scale as i32);
    for (&(_, x, i), y) in places.iter().zip(heights) {
        let colour = COLOURS[i % COLOURS.len()];
        let style = text_style(12, colour, scale).pos(Pos::new(HPos::Left, VPos::Center));
        cell.draw_text(&panel.curves[i].name, &style, (x, y)).map_err(drawing_error)?;
    }
    Ok(())
}

/// Moves ascending heights as little as possible, so that neighbours differ by at least `gap`; a cluster keeps its centre.
fn spread(wanted: &[i32], gap: i32) -> Vec<i32> {
    // Sum of the members' heights relative to the cluster's first place, and their number.
    let mut clusters: Vec<(i32, i32)> = Vec::new();
    for &y in wanted {
        clusters.push((y, 1));
        while let [.., (a, n), (b, m)] = clusters[..] {
            if b / m >= a / n + n * gap {
                break;
            }
            clusters.truncate(clusters.len() - 2);
            // Members of b are n gaps further down than their first place in the joined cluster.
            clusters.push((a + b - m * n * gap, n + m));
        }
    }
    clusters.iter().flat_map(|&(sum, n)| (0..n).map(move |k| sum / n + k * gap)).collect()
}

/// A tick label of an axis of length `span`, with as many digits as distinguish the ticks.
fn tick(x: f64, span: f64) -> String {
    let digits = (1.0 - (span / 5.0).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{x:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Outline;

    fn figure() -> Figure {
        let curve = |name: &str, y: f64| Curve {
            name: name.into(),
            values: vec![0.0, y, y],
            predicted: vec![(1.0, 2.0, y)],
        };
        let panel = Panel {
            title: "index".into(),
            axis: "q (rad)".into(),
            curves: vec![curve("inner", 0.7), curve("outer", 0.71)],
        };
        let outline = Outline { points: vec![(0.0, 0.0), (0.1, 0.0), (0.1, 0.2)], finger: Some(1) };
        let view = View { title: "open".into(), outlines: vec![outline] };
        Figure {
            title: "a hand".into(),
            notes: vec!["σ = 1".into()],
            time: vec![0.0, 1.0, 2.0],
            across: "t (s)",
            marks: vec![(1.5, "push".into())],
            panels: vec![panel],
            views: vec![view],
        }
    }

    #[test]
    fn dashes_become_one_path_and_words_one_line() {
        let dash = |look: &str, points: &str| {
            format!("<polyline fill=\"none\" stroke=\"{look}\" points=\"{points} \"/>\n")
        };
        let svg = [
            "<svg>\n",
            &dash("red", "1,2 3,4"),
            &dash("red", "5,6 7,8"),
            &dash("blue", "9,9 8,8"),
            "<text x=\"1\">\nopen\n</text>\n</svg>\n",
        ];
        let path =
            |look: &str, points: &str| format!("<path fill=\"none\" stroke=\"{look}\" d=\"{points}\"/>\n");
        let fewer = [
            "<svg>\n",
            &path("red", "M1,2 3,4M5,6 7,8"),
            &path("blue", "M9,9 8,8"),
            "<text x=\"1\">open</text>\n</svg>\n",
        ];
        assert_eq!(joined(&svg.concat()), fewer.concat());
    }

    #[test]
    fn a_figure_names_its_curves_and_is_valid_png() {
        let folder = std::env::temp_dir().join(format!("palmares-draw-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let (svg, png) = (folder.join("a.svg"), folder.join("a.PNG"));
        draw(&figure(), &svg).expect("it draws");
        draw(&figure(), &png).expect("it draws");
        let text = std::fs::read_to_string(&svg).expect("text");
        for part in [
            "<svg", "a hand", "open", "<polygon", "5 cm", "σ = 1", "index", "inner", "outer", "push", "t (s)",
        ] {
            assert!(text.contains(part), "'{part}' is not in the SVG");
        }
        let file = std::io::BufReader::new(std::fs::File::open(&png).expect("a file"));
        let mut reader = png::Decoder::new(file).read_info().expect("PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!(reader.info().size(), (figure().size().0 * PNG_SCALE, figure().size().1 * PNG_SCALE));
        let blue = COLOURS[0];
        assert!(pixels.chunks(3).any(|p| p == [blue.0, blue.1, blue.2]), "no curve was drawn");
        assert!(draw(&figure(), &folder.join("a.gif")).is_err());
        std::fs::remove_dir_all(folder).expect("removed");
    }

    #[test]
    fn names_move_as_little_as_possible() {
        assert_eq!(spread(&[0, 100], 10), [0, 100]);
        assert_eq!(spread(&[50, 50], 10), [45, 55]);
        assert_eq!(spread(&[0, 2, 4], 10), [-8, 2, 12]);
        assert!(spread(&[], 10).is_empty());
    }

    #[test]
    fn ticks_are_short() {
        assert_eq!(tick(0.2, 1.0), "0.2");
        assert_eq!(tick(-0.25, 1.0), "−0.25");
        assert_eq!(tick(-1e-17, 1.0), "0");
        assert_eq!(tick(20.0, 100.0), "20");
    }
}
