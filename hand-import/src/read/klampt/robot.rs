//! The lines of a `.rob` by link.

use super::lines::{self, Line};
use crate::decision::At;
use crate::read::reading::Reading;

/// The lines by what they say of each link.
pub(super) struct Robot<'a> {
    pub(super) names: &'a [String],
    pub(super) lines: &'a [Line],
    pub(super) parents: Vec<Option<usize>>,
    /// Joint types, `normal` where none is stated.
    pub(super) kinds: Vec<&'static str>,
    pub(super) scale: f64,
}

impl<'a> Robot<'a> {
    pub(super) fn new(names: &'a [String], lines: &'a [Line], reading: &mut Reading<'_>) -> Robot<'a> {
        let mut robot = Robot {
            names,
            lines,
            parents: vec![None; names.len()],
            kinds: vec!["normal"; names.len()],
            scale: 1.0,
        };
        robot.scale =
            robot.list("scale", 1, 1, reading).and_then(|list| list.first().copied()).unwrap_or(1.0);
        let parents = robot.list("parents", 1, names.len(), reading);
        // Without parents it is one chain.
        robot.parents = match parents {
            Some(list) => list.iter().map(|&p| (p >= 0.0).then_some(p as usize)).collect(),
            None => (0..names.len()).map(|i| i.checked_sub(1)).collect(),
        };
        let stated = |keyword: &str| lines.iter().any(|line| line.keyword == keyword);
        // Without `joint` lines every link moves, but for a base whose speed is 0. With them, those that they name.
        let still = robot.angles("velmax", reading);
        for i in (0..names.len()).filter(|&i| robot.parents[i].is_none()) {
            if stated("joint") || still.as_ref().is_some_and(|list| list[i] == 0.0) {
                robot.kinds[i] = "weld";
            }
        }
        for line in lines.iter().filter(|line| line.keyword == "joint") {
            let kind = line.words.first().map(|word| word.to_lowercase()).unwrap_or_default();
            let Some(index) = line.words.get(1).and_then(|word| robot.index(word)) else { continue };
            let known = ["normal", "spin", "weld", "floating", "floatingplanar", "ballandsocket"];
            match known.into_iter().find(|known| *known == kind) {
                Some("ballandsocket") => {}
                Some(kind @ ("floating" | "floatingplanar")) => {
                    let base = line.words.get(2).and_then(|word| robot.index(word)).unwrap_or(index);
                    for i in base..=index {
                        robot.kinds[i] = "weld";
                    }
                    let text = format!(
                        "the joint '{kind}' is left out: the base of a hand moves with the controller's arm"
                    );
                    reading.log.taken(At::Hand, format!("joint {kind} {index}"), text);
                }
                Some(kind) => robot.kinds[index] = kind,
                None => {
                    reading.log.problem(At::Hand, format!("joint {kind}"), "is no known type of joint");
                }
            }
        }
        robot
    }

    /// A link by index or name.
    pub(super) fn index(&self, word: &str) -> Option<usize> {
        let named = || self.names.iter().position(|name| name == word);
        word.parse().ok().filter(|i| *i < self.names.len()).or_else(named)
    }

    /// The joint that moves a link has the link's name.
    pub(super) fn joint_name(&self, i: usize) -> String {
        format!("{}_joint", self.names[i])
    }

    /// The numbers of a keyword: `each` for each of `count`; anything else is a problem.
    pub(super) fn list(
        &self,
        keyword: &str,
        each: usize,
        count: usize,
        reading: &mut Reading<'_>,
    ) -> Option<Vec<f64>> {
        let line = self.lines.iter().rev().find(|line| line.keyword == keyword)?;
        let list: Vec<f64> = line.words.iter().map_while(|word| lines::number(word)).collect();
        if list.len() == each * count && list.len() == line.words.len() {
            return Some(list);
        }
        let text = format!(
            "has {} values of which {} are numbers, not {}",
            line.words.len(),
            list.len(),
            each * count
        );
        reading.log.problem(At::Hand, format!("`{keyword}`"), text);
        None
    }

    /// As `list`, in radians if the keyword with `deg` is there instead.
    pub(super) fn angles(&self, keyword: &str, reading: &mut Reading<'_>) -> Option<Vec<f64>> {
        let count = self.names.len();
        let degrees = self.list(&format!("{keyword}deg"), 1, count, reading);
        self.list(keyword, 1, count, reading)
            .or_else(|| degrees.map(|list| list.into_iter().map(f64::to_radians).collect()))
    }
}
