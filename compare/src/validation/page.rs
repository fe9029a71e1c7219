//! The page docs/validation: a table of contents, then one section per measurement.

use super::ends::Ends;
use super::outcome::{Effort, Outcome};
use super::plot;
use anyhow::{Context, Result};
use palmares_bench::measured::{Measured, Spread};
use palmares_bench::record::Record;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Measurements that were not found, with the places of the search.
const NOT_FOUND: &str = "\
| SoftHand Pro: grip force against weight | Gailey et al. 2017 (PMC6411533): the steady grip of 23 people rises with the weight (p < 0.001); no number for a weight in the open sources |
| SoftHand 2 Pro: forces | no numbers found in the open sources |
| PneuFlex: stiffness of a finger | no numbers found in the open sources |
| i-HY: force and stiffness of a fingertip | the paper (Odhner et al., IJRR 33(5), 2014) has figures; its text beyond the introduction could not be read |
| T42, Model O: pull tests | Ma, Odhner, Dollar (ICRA 2013), Ma and Dollar (RAM 2017): tables could not be read; the project's pages have the Model T's |
| LEAP: pull-out force | no numbers found in the open sources |
| Allegro: force of a fingertip | no numbers found in the open sources; it holds more than 1.5 kg, without a protocol |
| Barrett: force of a fingertip, closing time | 15 N is recalled; the support pages have gears and sensors; 2 kg a finger of the BH8-262 is a limit |
| NIST: strength of fingers and grasps | the draft and the articles could be found, not their tables; the hands are others |
| YCB: scores of grippers | no numbers found in the open sources |
| Robotiq 3F: payload of 10 kg around an object, 2.5 kg between the fingertips | a recommendation without a protocol |
| Rocchi and Hauser, figures 5 and 6 | curves without numbers |
| qb SoftHand's data sheet | not found: 1.1 s from open to fist is recalled |
| how the SoftHand's disc was read | the paper names an ATI Nano17; the maker rates it for far less torque than 2 N·m, so another sensor or a lever may have been used |
";

const T42_RECORDINGS: &str = r#"The *Rutgers Underactuated-hand Manipulation* (RUM) data set has recordings of a real T42 and Model O. It is not shipped. Its
format, from github.com/avishais/underactuated_hand_benchmarking (commit cb26ac18): a Python pickle of a list of episodes; each
has `time_stamps` (N), `states` (N × 14: object position x, y; its orientation; four finger markers x, y; load of both
actuators), `actions` (N × 2) and `next_states`. The units of actions and loads, the camera's frame, the finger lengths and the
grasp at the start are not part of it. Where a user has the files, what does not depend on these is compared: the angle between
the motions that the two motors give the object, and the ratio of their lengths.

```
python -c 'import json, pickle, sys
for e in pickle.load(open(sys.argv[1], "rb"), encoding="latin1"):
    print(json.dumps({k: e[k].tolist() for k in ("states", "actions")}))' raw_t42_cyl35_d.obj > t42.jsonl
cargo xtask validate --t42 t42.jsonl
```

A pickle can run code: convert only files that you trust.
"#;

/// Writes the page and its picture.
pub(super) fn write(outcomes: &[Outcome], effort: Effort, folder: &Path) -> Result<()> {
    plot::draw(outcomes, &folder.join("ratios.svg"))?;
    let file = folder.join("README.md");
    fs::write(&file, text(outcomes, effort)?).with_context(|| format!("{}", file.display()))
}

fn text(outcomes: &[Outcome], effort: Effort) -> Result<String> {
    let mut page = String::new();
    let step_ms = effort.setup.dt_s * 1e3;
    write!(
        page,
        "# Validation against published measurements\n\n\
         Measurements on real hands, repeated on ours. Written by\n\n```\ncargo xtask validate{}\n```\n\n\
         at a step of {step_ms} ms.\n\n{}\n\n\
         A value of ours is the mean over placements, with the least and the largest. A placement in which the hand does not \
         keep the object counts as lost, not as zero. A *calibration* is a measurement that a number of the hand was chosen for: it \
         tests nothing. A *prediction* is one that no number was chosen for. Over the ranges: the least and the largest value with \
         each number of the hand's `[uncertain]` at the ends of its range, one after another, at one placement; and whether the \
         published value is among them.\n\n\
         ![Ours over published, mean and range, for every measurement with a published number](ratios.svg)\n\n",
        if effort.few { " --quick" } else { "" },
        Record::now("validation")?.line(),
    )?;
    page.push_str(
        "| measurement | kind | published | ours | range | lost | over the ranges of the hand |\n|---|---|---|---|---|---|---|\n",
    );
    for outcome in outcomes {
        let study = outcome.study;
        let published =
            study.published.map_or("not found".into(), |x| format!("{} {}", number(x), unit(study.unit)));
        let (mean, range) = spread(outcome.spread(), study.unit);
        let first = outcome.measured.first();
        let (lost, all) = first.map_or((0, 0), |m| (m.lost(), m.placements.len()));
        writeln!(
            page,
            "| [{}](#{}) | {} | {published} | {mean} | {range} | {lost} of {all} | {} |",
            study.title,
            anchor(study.title),
            study.kind.name(),
            over_ranges(outcome)
        )?;
    }
    for outcome in outcomes {
        section(&mut page, outcome)?;
    }
    write!(page, "\n## Recordings of a T42\n\n{T42_RECORDINGS}")?;
    write!(
        page,
        "\n## No numbers found in the open sources\n\n| looked for | found |\n|---|---|\n{NOT_FOUND}"
    )?;
    Ok(page)
}

/// The values over the ranges of the hand, and whether the published one is among them.
fn over_ranges(outcome: &Outcome) -> String {
    let Some(ends) = &outcome.ends else { return "–".to_owned() };
    let Ends { least, largest, most } = ends;
    let range = format!("{} to {} {}", number(*least), number(*largest), unit(outcome.study.unit));
    let contains = match outcome.study.published {
        Some(published) if ends.contain(published) => ": contain it",
        Some(_) => ": do not contain it",
        None => "",
    };
    format!("{range}, most by `{most}`{contains}")
}

fn section(page: &mut String, outcome: &Outcome) -> Result<()> {
    let study = outcome.study;
    write!(
        page,
        "\n## {}\n\n| | |\n|---|---|\n| kind | {} |\n| source | {} |\n| protocol | {} |\n| here | {} |\n| published | {} |\n\
         | why they differ | {} |\n",
        study.title,
        study.kind.name(),
        study.source,
        study.protocol,
        study.here,
        study.theirs,
        study.why
    )?;
    page.push_str("\n| quantity | published | mean | range | lost |\n|---|---|---|---|---|\n");
    for measured in &outcome.measured {
        let (mean, range) = spread(measured.spread(), &measured.unit);
        let (lost, all) = (measured.lost(), measured.placements.len());
        let published =
            measured.published.map_or("–".into(), |x| format!("{} {}", number(x), unit(&measured.unit)));
        writeln!(page, "| {} | {published} | {mean} | {range} | {lost} of {all} |", measured.quantity)?;
    }
    if let Some(first) = outcome.measured.first().filter(|m| m.placements.len() > 1) {
        writeln!(page, "\n{}.", placements(first))?;
    }
    Ok(())
}

fn placements(measured: &Measured) -> String {
    let one = |(name, value): &(String, Option<f64>)| match value {
        Some(value) => format!("{name} {}", number(*value)),
        None => format!("{name} lost"),
    };
    let all: Vec<String> = measured.placements.iter().map(one).collect();
    format!("Placements ({}): {}", unit(&measured.unit), all.join("; "))
}

/// Mean and range with unit.
fn spread(spread: Option<Spread>, unit_name: &str) -> (String, String) {
    let unit = unit(unit_name);
    match spread {
        Some(Spread { mean, least, largest }) => {
            (format!("{} {unit}", number(mean)), format!("{} to {} {unit}", number(least), number(largest)))
        }
        None => ("never held".into(), "–".into()),
    }
}

/// A unit as text; none for ratios.
fn unit(unit: &str) -> &str {
    if unit == "1" { "" } else { unit }
}

/// Three digits.
fn number(x: f64) -> String {
    let size = x.abs();
    if size == 0.0 {
        "0".into()
    } else if size < 1e-3 {
        format!("{x:.1e}")
    } else {
        let digits = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{x:.digits$}")
    }
}

/// The anchor of a heading, as Markdown viewers make it.
fn anchor(title: &str) -> String {
    let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
}

#[cfg(test)]
mod tests {
    use super::{anchor, number, text};
    use crate::validation::ends::Ends;
    use crate::validation::outcome::{Effort, Kind, Outcome};
    use crate::validation::studies::STUDIES;
    use palmares_bench::cases::Setup;
    use palmares_bench::measured::Measured;

    #[test]
    fn a_fitted_measurement_is_a_calibration_and_another_one_a_prediction_that_may_miss() {
        let made = |kind: Kind, most: f64| {
            let wanted =
                |study: &&super::super::outcome::Study| study.kind == kind && study.published.is_some();
            let study = STUDIES.iter().find(wanted).expect("a study");
            let measured = Measured {
                quantity: "force".into(),
                unit: study.unit.into(),
                hand: "hand".into(),
                published: study.published,
                placements: vec![("here".into(), Some(1.0))],
            };
            let ends = Ends { least: 0.5, largest: most, most: "friction".into() };
            Outcome { study, measured: vec![measured], ends: Some(ends) }
        };
        let outcomes = [made(Kind::Calibration, 1e3), made(Kind::Prediction, 0.6)];
        let page = text(&outcomes, Effort { setup: Setup::own(1e-3), few: true }).expect("a page");
        let row = |outcome: &Outcome| {
            let begins = format!("| [{}]", outcome.study.title);
            page.lines().find(|line| line.starts_with(&begins)).expect("a row").to_owned()
        };
        let [fitted, free] = [row(&outcomes[0]), row(&outcomes[1])];
        assert!(
            fitted.contains("| calibration |") && fitted.ends_with("most by `friction`: contain it |"),
            "{fitted}"
        );
        assert!(
            free.contains("| prediction |") && free.ends_with("most by `friction`: do not contain it |"),
            "{free}"
        );
    }

    #[test]
    fn numbers_have_three_digits() {
        assert_eq!(number(19.6123), "19.6");
        assert_eq!(number(235.0), "235");
        assert_eq!(number(1.0 / 3.0), "0.333");
        assert_eq!(number(2.0e-12), "2.0e-12");
        assert_eq!(number(0.0), "0");
    }

    #[test]
    fn a_heading_has_the_anchor_of_markdown() {
        assert_eq!(anchor("Robotiq 2F-85: grip force"), "robotiq-2f-85-grip-force");
    }
}
