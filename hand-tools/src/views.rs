//! A hand from three sides: its collision shapes, filled when open and as outlines when closed.

use crate::draw::{Area, COLOURS, Drawable, FAINT, GRID, INK, MARGIN, draw, drawing_error, text_style};
use crate::outline::outline;
use palmares_models::hand::Hand;
use palmares_models::measure::number;
use palmares_models::{Pose, Vec3};
use plotters::prelude::*;
use std::path::Path;

/// Width and height of a view, in the units of an SVG.
const VIEW: u32 = 400;
const HEAD: u32 = 62;
const TITLE: u32 = 24;

/// Three views of a hand, in its base's frame.
pub(crate) struct Views {
    title: String,
    note: String,
    views: [View; 3],
    /// Width and height of each view, m.
    span: f64,
}

/// Draws a hand from three sides; the file's name selects SVG or PNG.
///
/// # Errors
/// The name does not end in .svg or .png, or the file cannot be written.
pub fn draw_hand(hand: &Hand, file: &Path) -> anyhow::Result<()> {
    draw(&Views::of(hand), file)
}

/// A view along one axis.
struct View {
    title: &'static str,
    /// Centre of the view, m.
    middle: (f64, f64),
    /// Shapes of the open hand, the farthest first: link and outline, m.
    open: Vec<(usize, Vec<(f64, f64)>)>,
    /// Outlines of the closed hand, m.
    closed: Vec<Vec<(f64, f64)>>,
}

/// Title, and the directions right, up, and towards the viewer.
fn sides() -> [(&'static str, Vec3, Vec3, Vec3); 3] {
    [
        ("front (along −x): y, z", Vec3::Y, Vec3::Z, Vec3::X),
        ("side (along y): x, z", Vec3::X, Vec3::Z, -Vec3::Y),
        ("top (along −z): x, y", Vec3::X, Vec3::Y, Vec3::Z),
    ]
}

impl Views {
    /// The views of a hand.
    pub(crate) fn of(hand: &Hand) -> Views {
        let (open, closed) = (hand.base_from_links(&hand.open()), hand.base_from_links(&hand.closed()));
        let mut span: f64 = 1e-3;
        let views = sides().map(|(title, right, up, near)| {
            let shapes = |poses: &[Pose]| {
                type Outline = Vec<(f64, f64)>;
                let mut out: Vec<(f64, usize, Outline)> = Vec::new();
                for (i, (link, pose)) in hand.links.iter().zip(poses).enumerate() {
                    for geom in &link.geoms {
                        let at = *pose * geom.link_from_geom;
                        out.push((at.translation.dot(near), i, outline(&geom.shape, &at, right, up)));
                    }
                }
                out.sort_by(|a, b| a.0.total_cmp(&b.0));
                out
            };
            let (open, closed) = (shapes(&open), shapes(&closed));
            let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
            for (x, y) in open.iter().chain(&closed).flat_map(|(_, _, points)| points) {
                low = (low.0.min(*x), low.1.min(*y));
                high = (high.0.max(*x), high.1.max(*y));
            }
            if low.0 > high.0 {
                (low, high) = ((0.0, 0.0), (0.0, 0.0));
            }
            span = span.max(high.0 - low.0).max(high.1 - low.1);
            View {
                title,
                middle: (0.5 * (low.0 + high.0), 0.5 * (low.1 + high.1)),
                open: open.into_iter().map(|(_, link, points)| (link, points)).collect(),
                closed: closed.into_iter().map(|(_, _, points)| points).collect(),
            }
        });
        let size = |q: &[f64]| {
            let size = hand.bounding_box(q).map_or(Vec3::ZERO, |(low, high)| high - low);
            size.to_array().map(number).join(" × ")
        };
        let note = format!(
            "filled: open, {} m; outlines: closed, {} m; grid: {} m; cross: the base's origin",
            size(&hand.open()),
            size(&hand.closed()),
            number(grid(span))
        );
        Views { title: hand.name.clone(), note, views, span: 1.1 * span }
    }
}

/// Distance of grid lines, m: a power of ten, at least 1 cm.
fn grid(span: f64) -> f64 {
    let mut step = 0.01;
    while span / step > 30.0 {
        step *= 10.0;
    }
    step
}

impl Drawable for Views {
    fn size(&self) -> (u32, u32) {
        (3 * VIEW, HEAD + TITLE + VIEW)
    }

    fn paint<DB: DrawingBackend>(&self, area: &Area<DB>, scale: u32) -> anyhow::Result<()> {
        area.fill(&WHITE).map_err(drawing_error)?;
        let s = |x: u32| (x * scale) as i32;
        area.draw_text(&self.title, &text_style(20, INK, scale), (s(MARGIN), s(10)))
            .map_err(drawing_error)?;
        area.draw_text(&self.note, &text_style(13, FAINT, scale), (s(MARGIN), s(38)))
            .map_err(drawing_error)?;
        for (k, view) in self.views.iter().enumerate() {
            self.paint_view(area, view, k as u32 * VIEW, scale)?;
        }
        area.present().map_err(drawing_error)
    }
}

impl Views {
    fn paint_view<DB: DrawingBackend>(
        &self,
        area: &Area<DB>,
        view: &View,
        left: u32,
        scale: u32,
    ) -> anyhow::Result<()> {
        let s = |x: u32| (x * scale) as i32;
        let title = text_style(14, INK, scale);
        area.draw_text(view.title, &title, (s(left + MARGIN), s(HEAD))).map_err(drawing_error)?;
        let per_m = f64::from((VIEW - 2 * MARGIN) * scale) / self.span;
        let centre = (s(left + VIEW / 2), s(HEAD + TITLE + VIEW / 2));
        let place = |(x, y): (f64, f64)| {
            let (x, y) = ((x - view.middle.0) * per_m, (y - view.middle.1) * per_m);
            (centre.0 + x.round() as i32, centre.1 - y.round() as i32)
        };
        let (half, step) = (0.5 * self.span, grid(self.span / 1.1));
        for (middle, upright) in [(view.middle.0, true), (view.middle.1, false)] {
            let lines = ((middle - half) / step).ceil() as i64..=((middle + half) / step).floor() as i64;
            for at in lines.map(|k| k as f64 * step) {
                let ends = if upright {
                    [(at, view.middle.1 - half), (at, view.middle.1 + half)]
                } else {
                    [(view.middle.0 - half, at), (view.middle.0 + half, at)]
                };
                let line = PathElement::new(ends.map(place).to_vec(), GRID.stroke_width(scale));
                area.draw(&line).map_err(drawing_error)?;
            }
        }
        for (link, points) in &view.open {
            let colour = COLOURS[link % COLOURS.len()];
            let points: Vec<(i32, i32)> = points.iter().copied().map(place).collect();
            area.draw(&Polygon::new(points.clone(), colour.mix(0.45))).map_err(drawing_error)?;
            area.draw(&PathElement::new(around(points), colour.stroke_width(scale)))
                .map_err(drawing_error)?;
        }
        for points in &view.closed {
            let points: Vec<(i32, i32)> = points.iter().copied().map(place).collect();
            area.draw(&PathElement::new(around(points), FAINT.stroke_width(scale))).map_err(drawing_error)?;
        }
        let ((x, y), arm) = (place((0.0, 0.0)), s(5));
        for ends in [[(x - arm, y), (x + arm, y)], [(x, y - arm), (x, y + arm)]] {
            area.draw(&PathElement::new(ends.to_vec(), INK.stroke_width(scale))).map_err(drawing_error)?;
        }
        Ok(())
    }
}

/// Closes a path.
fn around(mut points: Vec<(i32, i32)>) -> Vec<(i32, i32)> {
    points.extend(points.first().copied());
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_is_in_each_of_three_views() {
        let hand = Hand::builtin("softhand").expect("it is built in");
        let views = Views::of(&hand);
        let shapes: usize = hand.links.iter().map(|l| l.geoms.len()).sum();
        for view in &views.views {
            assert_eq!((view.open.len(), view.closed.len()), (shapes, shapes), "{}", view.title);
        }
        let (low, high) = hand.bounding_box(&hand.open()).expect("shapes");
        assert!(views.span >= (high - low).max_element());
        let folder = std::env::temp_dir().join(format!("palmares-views-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let file = folder.join("a.svg");
        draw(&views, &file).expect("it draws");
        let text = std::fs::read_to_string(&file).expect("text");
        for part in ["softhand", "front", "side", "top", "<polygon"] {
            assert!(text.contains(part), "'{part}' is not in the image");
        }
        std::fs::remove_dir_all(folder).expect("removed");
    }
}
