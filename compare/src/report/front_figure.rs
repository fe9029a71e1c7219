//! README's figure: the time of every peer over ours in every scene.

use super::comparison::{Comparison, distinct};
use super::dominance::{PeerResult, SettingsResult};
use super::plots::{Area, SANS, colour, failed, register};
use anyhow::Result;
use plotters::prelude::*;

/// Width of the picture, px: its letters are legible on a telephone, too.
const WIDTH: u32 = 520;
const ROW: i32 = 17;
const TOP: i32 = 64;
const LEFT: i32 = 172;
/// Ends of the axis.
const RATIOS: [f64; 2] = [0.3, 400.0];
/// Width of the column of each peer without a ratio.
const COLUMN: i32 = 26;

/// Least ratio of a peer's time to that of ours at no larger error, with any settings that solve the scene.
fn ratio(result: &PeerResult) -> Option<f64> {
    let solving = result.settings.iter().filter(|with| with.done > 0);
    solving.filter_map(|with| with.least_advantage).reduce(f64::min)
}

/// The place of a peer among others in a scene: [`ratio`], 0 where it is ahead of ours at any step.
pub(super) fn place(result: &PeerResult) -> Option<f64> {
    match Mark::of(result)? {
        Mark::Ratio(ratio) => Some(ratio),
        Mark::Beyond => Some(0.0),
        Mark::Fails | Mark::Unfinished | Mark::NotPlayed => None,
    }
}

/// Name of an engine as its authors write it.
pub(super) fn title(engine: &str) -> &str {
    match engine {
        "mujoco" => "MuJoCo",
        "drake" => "Drake",
        other => other,
    }
}

/// A peer in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mark {
    /// Its time over ours.
    Ratio(f64),
    /// It is more exact than ours at any step, or solves what ours does not.
    Beyond,
    /// It solves the scene at no step.
    Fails,
    /// Its runs did not end in their time.
    Unfinished,
    /// Its adapter does not pass on what the scene needs.
    NotPlayed,
}

impl Mark {
    fn of(result: &PeerResult) -> Option<Self> {
        let solved = result.settings.iter().any(|with| with.done > 0);
        let ahead = result.settings.iter().any(|with| !with.ahead_ms.is_empty());
        let all = |of: fn(&SettingsResult) -> usize| result.settings.iter().map(of).sum::<usize>();
        Some(match ratio(result) {
            _ if solved && result.own_done == 0 => Mark::Beyond,
            Some(ratio) if ahead && ratio >= 1.0 => Mark::Beyond,
            Some(ratio) => Mark::Ratio(ratio),
            None if solved => Mark::Beyond,
            None if all(|with| with.tried) == 0 => Mark::NotPlayed,
            None if all(|with| with.unfinished) > 0 => Mark::Unfinished,
            None if result.own_done > 0 => Mark::Fails,
            None => return None,
        })
    }

    /// Its sign in the column of a peer.
    fn sign(self) -> Option<&'static str> {
        match self {
            Mark::Ratio(_) | Mark::Beyond => None,
            Mark::Fails => Some("×"),
            Mark::Unfinished => Some("?"),
            Mark::NotPlayed => Some("–"),
        }
    }
}

/// A scene with its marks, by peer.
struct Row<'a> {
    case: &'a str,
    marks: Vec<(&'a str, Mark)>,
}

impl Row<'_> {
    /// The best of the peers first.
    fn rank(&self) -> f64 {
        let of = |(_, mark): &(&str, Mark)| match mark {
            Mark::Beyond => 0.0,
            Mark::Ratio(ratio) => *ratio,
            _ => f64::INFINITY,
        };
        self.marks.iter().map(of).fold(f64::INFINITY, f64::min)
    }
}

fn rows(reports: &[Comparison]) -> Vec<Row<'_>> {
    let results: Vec<&PeerResult> = reports.iter().flat_map(|report| &report.results).collect();
    let cases = distinct(results.iter().map(|result| &result.case));
    let row = |case| {
        let of = results.iter().filter(|result| result.case == case);
        Row { case, marks: of.filter_map(|result| Some((&*result.peer, Mark::of(result)?))).collect() }
    };
    let mut rows: Vec<Row> = cases.into_iter().map(row).filter(|row| !row.marks.is_empty()).collect();
    rows.sort_by(|a, b| a.rank().total_cmp(&b.rank()));
    rows
}

/// Factor within which times of one run differ from those of another: nine of ten timed runs have all theirs within it.
fn undecided(reports: &[Comparison]) -> f64 {
    let timed = reports.iter().flat_map(|report| &report.runs).filter(|run| run.cpu_s_between[0] > 0.0);
    let mut spreads: Vec<f64> = timed.map(|run| run.cpu_s_between[1] / run.cpu_s_between[0]).collect();
    spreads.sort_by(f64::total_cmp);
    spreads.get(spreads.len() * 9 / 10).copied().unwrap_or(1.0)
}

/// The picture as SVG; none without a comparison.
///
/// # Errors
/// The drawing failed.
pub(super) fn picture(reports: &[Comparison]) -> Result<Option<String>> {
    let rows = rows(reports);
    if rows.is_empty() {
        return Ok(None);
    }
    let peers = distinct(reports.iter().flat_map(|report| &report.results).map(|result| &result.peer));
    let height = TOP + ROW * rows.len() as i32 + 62;
    let mut svg = String::new();
    register()?;
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, height as u32)).into_drawing_area();
        draw(&area, &rows, &peers, undecided(reports))?;
        area.present().map_err(failed)?;
    }
    Ok(Some(svg))
}

fn draw(area: &Area, rows: &[Row], peers: &[&str], band: f64) -> Result<()> {
    area.fill(&WHITE).map_err(failed)?;
    let right = WIDTH as i32 - 12 - COLUMN * peers.len() as i32;
    let bottom = TOP + ROW * rows.len() as i32;
    let across = |ratio: f64| {
        let part = (ratio / RATIOS[0]).ln() / (RATIOS[1] / RATIOS[0]).ln();
        LEFT + (f64::from(right - LEFT) * part.clamp(0.0, 1.0)).round() as i32
    };
    let text = |words: &str, at: (i32, i32), size: i32| {
        area.draw(&Text::new(words.to_owned(), at, (SANS, size))).map_err(failed)
    };
    let line = |from, to, ink: RGBColor| area.draw(&PathElement::new(vec![from, to], ink)).map_err(failed);
    let grey = RGBColor(232, 232, 232);
    let band = Rectangle::new([(across(1.0 / band), TOP - 4), (across(band), bottom)], grey.filled());
    area.draw(&band).map_err(failed)?;
    for ratio in [1.0, 10.0, 100.0] {
        let x = across(ratio);
        line((x, TOP - 4), (x, bottom), if ratio == 1.0 { BLACK } else { RGBColor(205, 205, 205) })?;
        text(&format!("{ratio}"), (x - 5 * format!("{ratio}").len() as i32 / 2, bottom + 4), 13)?;
    }
    text("CPU time of the peer / ours, our error not larger", (LEFT, bottom + 20), 13)?;
    text("left of 1 the peer is ahead; grey: within the spread of the times", (10, bottom + 40), 13)?;
    text("◂ peer more exact, or alone · × no step · ? unfinished · – not played", (10, 30), 13)?;
    for (k, peer) in peers.iter().enumerate() {
        let at = (10 + 120 * k as i32, 14);
        mark(area, k, (at.0 + 5, at.1 + 3), colour(peer))?;
        text(title(peer), (at.0 + 16, at.1 - 4), 13)?;
        mark(area, k, (right + COLUMN * k as i32 + 18, TOP - 10), colour(peer))?;
    }
    for (place, row) in rows.iter().enumerate() {
        let y = TOP + ROW * place as i32;
        text(&row.case.replace('_', " "), (10, y + 3), 12)?;
        for (peer, found) in &row.marks {
            let k = peers.iter().position(|other| other == peer).unwrap_or_default();
            let middle = y + ROW / 2;
            match found {
                Mark::Ratio(ratio) => mark(area, k, (across(*ratio), middle), colour(peer))?,
                Mark::Beyond => {
                    let style = (SANS, 14).into_font().color(&colour(peer));
                    area.draw(&Text::new("◂", (LEFT + 9 * k as i32, y + 3), style)).map_err(failed)?;
                }
                _ => text(found.sign().unwrap_or_default(), (right + COLUMN * k as i32 + 14, y + 3), 13)?,
            }
        }
    }
    Ok(())
}

/// The mark of a peer: their forms differ as well as their colours.
fn mark(area: &Area, peer: usize, at: (i32, i32), ink: RGBColor) -> Result<()> {
    match peer {
        0 => area.draw(&Circle::new(at, 5, ink.filled())),
        1 => area.draw(&Rectangle::new([(at.0 - 4, at.1 - 4), (at.0 + 5, at.1 + 5)], ink.filled())),
        _ => area.draw(&TriangleMarker::new(at, 6, ink.filled())),
    }
    .map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(done: usize, tried: usize, least_advantage: Option<f64>) -> SettingsResult {
        SettingsResult {
            settings: "s".into(),
            done,
            tried,
            unfinished: 0,
            not_played: usize::from(tried == 0),
            ahead_ms: Vec::new(),
            least_advantage,
            overlap_mm: None,
            differs: None,
        }
    }

    fn result(own_done: usize, settings: Vec<SettingsResult>) -> PeerResult {
        PeerResult {
            case: "c".into(),
            peer: "p".into(),
            steps_ms: vec![1.0],
            settings,
            timed: true,
            own_done,
            own_differs: None,
            unit: "mm".into(),
        }
    }

    /// A run that is more exact than any of ours has no ratio: its scene would count by the ratios of worse runs.
    #[test]
    fn a_scene_in_which_a_peer_is_ahead_comes_before_all_others() {
        let ahead = SettingsResult { ahead_ms: vec![1.0], ..with(5, 5, None) };
        assert_eq!(place(&result(5, vec![with(5, 5, Some(21.7)), ahead])), Some(0.0));
        assert_eq!(place(&result(5, vec![with(5, 5, Some(21.7))])), Some(21.7));
        assert_eq!(place(&result(5, vec![with(0, 5, None)])), None, "it solves nothing");
    }

    #[test]
    fn each_outcome_has_its_mark() {
        let of = |own, settings| Mark::of(&result(own, settings));
        assert_eq!(of(5, vec![with(1, 5, Some(9.0)), with(2, 5, Some(3.0))]), Some(Mark::Ratio(3.0)));
        assert_eq!(of(5, vec![with(1, 5, Some(0.5))]), Some(Mark::Ratio(0.5)));
        assert_eq!(of(5, vec![with(0, 5, Some(0.5))]), Some(Mark::Fails), "settings that solve nothing");
        assert_eq!(of(0, vec![with(1, 5, None)]), Some(Mark::Beyond), "the peer alone");
        assert_eq!(of(5, vec![with(1, 5, None)]), Some(Mark::Beyond), "more exact at any step");
        let ahead = SettingsResult { ahead_ms: vec![1.0], ..with(2, 5, Some(4.0)) };
        assert_eq!(of(5, vec![ahead]), Some(Mark::Beyond), "more exact at one step");
        assert_eq!(of(5, vec![with(0, 0, None)]), Some(Mark::NotPlayed));
        assert_eq!(of(5, vec![SettingsResult { unfinished: 2, ..with(0, 5, None) }]), Some(Mark::Unfinished));
        assert_eq!(of(0, vec![with(0, 5, None)]), None, "nobody");
    }
}
