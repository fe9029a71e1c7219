//! The picture of the page: ours over published, mean and range. It is narrow, so that it can be read on a telephone.

use super::outcome::{Kind, Outcome};
use crate::report::plots::{Area, SANS, failed, on_page};
use anyhow::Result;
use plotters::prelude::*;
use std::path::Path;

const WIDTH: u32 = 400;
const SIDE: i32 = 14;
/// Height of a measurement: its title above its line.
const ROW: i32 = 38;
/// Height of the legend, and of the numbers of the axis below.
const LEGEND: i32 = 96;
const BELOW: i32 = 26;
/// The axis: ours from this part of the published value to this multiple.
const RANGE: (f64, f64) = (0.2, 5.0);
/// Ratios with a line and a number.
const TICKS: [f64; 5] = [0.2, 0.5, 1.0, 2.0, 5.0];
const GRID: RGBColor = RGBColor(215, 215, 215);

/// Dots are full for predictions and empty for calibrations: the colours are told apart without colour, too.
fn ink(kind: Kind) -> RGBColor {
    match kind {
        Kind::Prediction => RGBColor(0, 90, 181),
        Kind::Calibration => RGBColor(200, 90, 0),
    }
}

fn x(ratio: f64) -> i32 {
    let part = (ratio.clamp(RANGE.0, RANGE.1) / RANGE.0).ln() / (RANGE.1 / RANGE.0).ln();
    SIDE + (f64::from(WIDTH as i32 - 2 * SIDE) * part) as i32
}

fn dot(area: &Area, kind: Kind, at: (i32, i32)) -> Result<()> {
    area.draw(&Circle::new(at, 5, WHITE.filled())).map_err(failed)?;
    match kind {
        Kind::Prediction => area.draw(&Circle::new(at, 5, ink(kind).filled())),
        Kind::Calibration => area.draw(&Circle::new(at, 5, ink(kind).stroke_width(2))),
    }
    .map_err(failed)
}

fn line(area: &Area, from: (i32, i32), to: (i32, i32), style: ShapeStyle) -> Result<()> {
    area.draw(&PathElement::new(vec![from, to], style)).map_err(failed)
}

fn text(area: &Area, text: &str, at: (i32, i32), size: i32) -> Result<()> {
    area.draw(&Text::new(text.to_owned(), at, (SANS, size))).map_err(failed)
}

/// The range of the hand's own numbers: a pale bar.
fn ends(area: &Area, kind: Kind, from: i32, to: i32, y: i32) -> Result<()> {
    let style = ink(kind).mix(0.25).filled();
    area.draw(&Rectangle::new([(from, y - 5), (to, y + 5)], style)).map_err(failed)
}

/// Draws the measurements that have a published number other than zero.
pub(super) fn draw(outcomes: &[Outcome], path: &Path) -> Result<()> {
    let drawn = |outcome: &&Outcome| outcome.study.published.is_some_and(|x| x > 0.0);
    let rows: Vec<&Outcome> = outcomes.iter().filter(drawn).collect();
    let height = LEGEND + ROW * rows.len() as i32 + BELOW;
    on_page(path, (WIDTH, height as u32), |area| {
        legend(area)?;
        let bottom = height - BELOW;
        for ratio in TICKS {
            text(area, &format!("{ratio}"), (x(ratio) - 8, bottom + 6), 13)?;
        }
        for (k, outcome) in rows.iter().enumerate() {
            row(area, outcome, LEGEND + ROW * k as i32)?;
        }
        Ok(())
    })
}

/// A measurement below `top`.
fn row(area: &Area, outcome: &Outcome, top: i32) -> Result<()> {
    let (study, published) = (outcome.study, outcome.study.published.unwrap_or(1.0));
    let (kind, y) = (study.kind, top + 25);
    let Some(spread) = outcome.spread() else {
        return text(area, &format!("{}: never held", study.title), (SIDE, top), 13);
    };
    let mean = spread.mean / published;
    let beyond = if (RANGE.0..=RANGE.1).contains(&mean) { String::new() } else { format!(" ({mean:.2})") };
    text(area, &format!("{}{beyond}", study.title), (SIDE, top), 13)?;
    for ratio in TICKS {
        let style: ShapeStyle = if ratio == 1.0 { (&BLACK).into() } else { (&GRID).into() };
        line(area, (x(ratio), top + 16), (x(ratio), top + ROW - 4), style)?;
    }
    if let Some(over) = &outcome.ends {
        ends(area, kind, x(over.least / published), x(over.largest / published), y)?;
    }
    let style = ink(kind).stroke_width(2);
    line(area, (x(spread.least / published), y), (x(spread.largest / published), y), style)?;
    dot(area, kind, (x(mean), y))
}

fn legend(area: &Area) -> Result<()> {
    text(area, "ours / published", (SIDE, 6), 15)?;
    for (kind, says, left) in [
        (Kind::Prediction, "prediction", SIDE),
        (Kind::Calibration, "calibration: fitted, tests nothing", SIDE + 110),
    ] {
        dot(area, kind, (left + 8, 36))?;
        text(area, says, (left + 20, 29), 13)?;
    }
    line(area, (SIDE, 56), (SIDE + 16, 56), ink(Kind::Prediction).stroke_width(2))?;
    text(area, "placements", (SIDE + 20, 49), 13)?;
    ends(area, Kind::Prediction, SIDE + 110, SIDE + 126, 56)?;
    text(area, "uncertain numbers of the hand", (SIDE + 130, 49), 13)
}
