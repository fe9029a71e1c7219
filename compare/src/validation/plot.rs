//! The picture of the page: ours over published, mean and range.

use super::outcome::Outcome;
use crate::report::plots::{SANS, failed, on_page};
use anyhow::Result;
use palmares_bench::measured::Spread;
use plotters::prelude::*;
use std::path::Path;

const LEFT: i32 = 330;
const ROW: i32 = 26;
const WIDTH: u32 = 860;
/// The axis: ours from this part of the published value to this multiple.
const RANGE: (f64, f64) = (0.05, 5.0);
const INK: RGBColor = RGBColor(0, 90, 181);

/// Draws the measurements that have a published number other than zero.
pub(super) fn draw(outcomes: &[Outcome], path: &Path) -> Result<()> {
    let rows: Vec<(&str, f64, Option<Spread>)> = outcomes
        .iter()
        .filter_map(|o| Some((o.study.title, o.study.published.filter(|x| *x > 0.0)?, o.spread())))
        .collect();
    let height = 70 + ROW as u32 * rows.len() as u32;
    let x = |ratio: f64| {
        let ratio = ratio.clamp(RANGE.0, RANGE.1);
        let part = (ratio / RANGE.0).ln() / (RANGE.1 / RANGE.0).ln();
        LEFT + (f64::from(WIDTH as i32 - LEFT - 30) * part) as i32
    };
    on_page(path, (WIDTH, height), |area| {
        let bottom = height as i32 - 34;
        area.draw(&Text::new("ours / published", (LEFT, 8), (SANS, 14))).map_err(failed)?;
        for ratio in [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0] {
            let ink = if ratio == 1.0 { BLACK } else { RGBColor(205, 205, 205) };
            area.draw(&PathElement::new(vec![(x(ratio), 28), (x(ratio), bottom)], ink)).map_err(failed)?;
            area.draw(&Text::new(format!("{ratio}"), (x(ratio) - 8, bottom + 6), (SANS, 12)))
                .map_err(failed)?;
        }
        for (k, (title, published, spread)) in rows.iter().enumerate() {
            let y = 40 + ROW * k as i32;
            area.draw(&Text::new(*title, (10, y - 7), (SANS, 12))).map_err(failed)?;
            let Some(Spread { mean, least, largest }) = spread else { continue };
            let ends = vec![(x(least / published), y), (x(largest / published), y)];
            area.draw(&PathElement::new(ends, INK.stroke_width(2))).map_err(failed)?;
            area.draw(&Circle::new((x(mean / published), y), 4, INK.filled())).map_err(failed)?;
        }
        Ok(())
    })
}
