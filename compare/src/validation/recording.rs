//! Recordings of a real T42 that a user has: the object's motion under small motions of the two motors, beside ours.
//!
//! The data set of Rutgers (RUM) has episodes of states and actions. Its camera's frame and the units of its actions are not
//! published, so only what does not depend on them is compared: the angle between the motions that the two motors give the
//! object, and the ratio of their lengths.

use super::grips::{T42, in_fingertips};
use super::outcome::{Effort, Kind, Study};
use anyhow::{Context, Result, ensure};
use palmares_bench::measured::Measured;
use palmares_bench::recorder::Recorder;
use serde::Deserialize;
use std::fs;
use std::path::Path;

/// The study of a recording.
pub(crate) const STUDY: Study = Study {
    key: "yale_t42_recording",
    kind: Kind::Prediction,
    title: "Yale T42: motion of a held object under each motor",
    source: "a recording of the RUM data set, given by its path",
    protocol: "A T42 holds a cylinder of 35 mm; at 10 Hz each motor takes a step of −1, 0 or 1; a camera reads the object",
    here: "A cylinder of 35 mm between the fingertips; each motor moves a little and back",
    published: None,
    theirs: "from the file, by least squares over all transitions",
    unit: "degrees",
    why: "Finger lengths, flexures and the grasp of the recorded hand are not part of the data set",
    measure: |_| Ok(Vec::new()),
    ends: None,
};

/// Radius of the recorded cylinder, m.
const RADIUS_M: f64 = 0.0175;

/// One line of the file.
#[derive(Deserialize)]
struct Episode {
    /// Object position and orientation, markers, loads.
    states: Vec<Vec<f64>>,
    /// Steps of both motors.
    actions: Vec<Vec<f64>>,
}

/// Motions of the object in a plane under a unit of each motor.
type Motions = [[f64; 2]; 2];

/// Numbers that do not depend on the plane's frame or a common unit: the angle between the motions, degrees, and the second's
/// length over the first's.
fn invariants([a, b]: Motions) -> [f64; 2] {
    let cross = a[0] * b[1] - a[1] * b[0];
    let dot = a[0] * b[0] + a[1] * b[1];
    let length = |v: [f64; 2]| libm::hypot(v[0], v[1]);
    [libm::atan2(cross.abs(), dot).to_degrees(), length(b) / length(a)]
}

/// Least squares of the object's displacement over the motors' steps.
fn fitted(episodes: &[Episode]) -> Result<Motions> {
    let (mut gram, mut moved) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
    let mut count = 0;
    for Episode { states, actions } in episodes {
        ensure!(
            states.len() == actions.len(),
            "an episode has {} states, {} actions",
            states.len(),
            actions.len()
        );
        for (pair, action) in states.windows(2).zip(actions) {
            ensure!(pair[0].len() >= 2 && action.len() == 2, "a state has at least 2 numbers, an action 2");
            for i in 0..2 {
                for j in 0..2 {
                    gram[i][j] += action[i] * action[j];
                    moved[i][j] += action[i] * (pair[1][j] - pair[0][j]);
                }
            }
            count += 1;
        }
    }
    let det = gram[0][0] * gram[1][1] - gram[0][1] * gram[1][0];
    ensure!(det > 1e-9 * gram[0][0] * gram[1][1], "{count} transitions do not move both motors on their own");
    let row = |a: f64, b: f64| [0, 1].map(|j| (a * moved[0][j] + b * moved[1][j]) / det);
    Ok([row(gram[1][1], -gram[0][1]), row(-gram[1][0], gram[0][0])])
}

/// Reads a file of one JSON object per episode.
fn read(path: &Path) -> Result<Vec<Episode>> {
    let text = fs::read_to_string(path).with_context(|| format!("{}", path.display()))?;
    let episode = |(k, line): (usize, &str)| {
        serde_json::from_str(line).with_context(|| format!("{}, line {}", path.display(), k + 1))
    };
    text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()).map(episode).collect()
}

/// Compares a recording with our hand.
pub(super) fn measure(effort: &Effort, path: &Path) -> Result<Vec<Measured>> {
    let theirs = invariants(fitted(&read(path)?).with_context(|| format!("{}", path.display()))?);
    let ours = in_fingertips(effort, &T42, RADIUS_M, &mut Recorder::default())?;
    let ours = ours.map(invariants);
    let one = |k: usize, quantity: &str, unit: &str| Measured {
        quantity: quantity.to_owned(),
        unit: unit.to_owned(),
        hand: T42.hand.to_owned(),
        published: Some(theirs[k]),
        placements: vec![("between the fingertips".to_owned(), ours.map(|o| o[k]))],
    };
    Ok(vec![
        one(0, "angle between the motions under the two motors", "degrees"),
        one(1, "length of the second over the first", "1"),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Motions that are put into a recording come out of it, whatever the camera's frame and the unit.
    #[test]
    fn a_made_recording_gives_its_motions_back() {
        let (first, second) = ([0.3, 0.4], [-1.0, 0.0]);
        let steps = [[1.0, 0.0], [0.0, 1.0], [1.0, -1.0], [-1.0, 0.0], [0.0, 0.0]];
        let mut states = vec![vec![0.0, 0.0, 9.0]];
        for [a, b] in steps {
            let last = states.last().expect("it has one").clone();
            let to = |j: usize| last[j] + a * first[j] + b * second[j];
            states.push(vec![to(0), to(1), 9.0]);
        }
        let actions = steps.iter().chain([&[0.0, 0.0]]).map(|a| a.to_vec()).collect();
        let motions = fitted(&[Episode { states, actions }]).expect("both motors move");
        for (found, put) in motions.iter().flatten().zip([first, second].iter().flatten()) {
            assert!((found - put).abs() < 1e-12, "{motions:?}");
        }
        let [angle, ratio] = invariants(motions);
        assert!((ratio - 2.0).abs() < 1e-12 && (angle - 126.869_897_645_844).abs() < 1e-9, "{angle} {ratio}");
        let still = Episode { states: vec![vec![0.0; 14]; 3], actions: vec![vec![1.0, 1.0]; 3] };
        assert!(fitted(&[still]).is_err(), "motors that move together identify nothing");
    }
}
