//! What a picture of a closure shows, before anything is drawn: panels of curves with their predictions.

use super::view::View;
use palmares_models::hand::{Hand, HingeKind};

/// More curves than this are not told apart in one panel.
const CURVES_PER_PANEL: usize = 6;

/// A picture: panels over one time axis.
#[derive(Clone, Debug, Default)]
pub(super) struct Figure {
    pub(super) title: String,
    /// Smaller lines below the title.
    pub(super) notes: Vec<String>,
    /// s
    pub(super) time: Vec<f64>,
    /// Vertical lines: when, and what happens there.
    pub(super) marks: Vec<(f64, String)>,
    pub(super) panels: Vec<Panel>,
    /// The hand itself, drawn before the panels, all at one scale.
    pub(super) views: Vec<View>,
}

/// Curves on one pair of axes.
#[derive(Clone, Debug, Default)]
pub(super) struct Panel {
    pub(super) title: String,
    /// What is on the vertical axis, with its unit. Panels with the same one share their range.
    pub(super) axis: String,
    pub(super) curves: Vec<Curve>,
}

/// A curve and where it was predicted to end.
#[derive(Clone, Debug, Default)]
pub(super) struct Curve {
    pub(super) name: String,
    /// One per time.
    pub(super) values: Vec<f64>,
    /// From when to when the value was predicted, s, and the value.
    pub(super) predicted: Vec<(f64, f64, f64)>,
}

/// A panel to be: title, unit, and coordinates with their short names.
pub(super) struct Group {
    pub(super) title: String,
    pub(super) unit: &'static str,
    pub(super) members: Vec<(usize, String)>,
}

/// The coordinates of a hand by finger: by the link on the base that they are on or beyond.
pub(super) fn fingers(hand: &Hand) -> Vec<Group> {
    let all: Vec<&str> = hand.coordinates.iter().map(|c| c.name.as_str()).collect();
    let (head, tail) = affixes(&all);
    let mut groups: Vec<(usize, &'static str, Vec<usize>)> = Vec::new();
    for c in 0..hand.coordinates.len() {
        let moved = hand.links.iter().position(|l| l.joint.as_ref().is_some_and(|j| j.coordinate == c));
        let mut root = moved.unwrap_or(0);
        while let Some(parent) = hand.links[root].parent.filter(|&p| p != 0) {
            root = parent;
        }
        let joint = moved.and_then(|link| hand.links[link].joint.as_ref());
        let slides = joint.is_some_and(|j| j.hinges.iter().any(|h| h.kind == HingeKind::Prismatic));
        let unit = if slides { "m" } else { "rad" };
        let fits =
            |g: &&mut (usize, &str, Vec<usize>)| g.0 == root && g.1 == unit && g.2.len() < CURVES_PER_PANEL;
        match groups.iter_mut().find(fits) {
            Some(group) => group.2.push(c),
            None => groups.push((root, unit, vec![c])),
        }
    }
    let short = |name: &str| name[head..name.len() - tail].to_owned();
    groups
        .into_iter()
        .map(|(root, unit, members)| {
            let names: Vec<String> = members.iter().map(|&c| short(all[c])).collect();
            let plain: Vec<&str> = names.iter().map(String::as_str).collect();
            let (common, _) = affixes(&plain);
            let title = match names[0][..common].trim_matches('_') {
                "" if names.len() == 1 => names[0].clone(),
                "" => hand.links[root].name.clone(),
                common => common.to_owned(),
            };
            let members = members.iter().zip(&names).map(|(&c, name)| (c, name[common..].to_owned()));
            Group { title, unit, members: members.collect() }
        })
        .collect()
}

/// Lengths of what all names begin and end with, up to and from an underscore; nothing of a single name.
fn affixes(names: &[&str]) -> (usize, usize) {
    let Some((first, others)) = names.split_first().filter(|(_, others)| !others.is_empty()) else {
        return (0, 0);
    };
    let head = first
        .char_indices()
        .rfind(|&(i, c)| c == '_' && others.iter().all(|o| o.get(..=i) == first.get(..=i)))
        .map_or(0, |(i, _)| i + 1);
    let ends_alike = |&i: &usize| {
        let tail = &first[i..];
        others.iter().all(|o| o.len() > head + tail.len() && o.ends_with(tail))
    };
    let underscores = first.char_indices().filter(|&(i, c)| c == '_' && i >= head).map(|(i, _)| i);
    let tail = underscores.filter(|i| *i > head).find(ends_alike).map_or(0, |i| first.len() - i);
    (head, tail)
}

/// The range of panels with this axis, with a little room.
pub(super) fn range(figure: &Figure, axis: &str) -> (f64, f64) {
    let mut low = f64::INFINITY;
    let mut high = f64::NEG_INFINITY;
    for panel in figure.panels.iter().filter(|p| p.axis == axis) {
        for curve in &panel.curves {
            let predicted = curve.predicted.iter().map(|p| p.2);
            for y in curve.values.iter().copied().chain(predicted).filter(|y| y.is_finite()) {
                low = low.min(y);
                high = high.max(y);
            }
        }
    }
    if low > high {
        return (0.0, 1.0);
    }
    let room = 0.06 * (high - low).max(1e-6 * high.abs()).max(1e-9);
    (low - room, high + room)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_softhand_has_five_fingers() {
        let groups = fingers(&Hand::builtin("softhand").expect("it is built in"));
        let titles: Vec<&str> = groups.iter().map(|g| g.title.as_str()).collect();
        assert_eq!(titles, ["thumb", "index", "middle", "ring", "little"]);
        let names: Vec<&str> = groups[1].members.iter().map(|(_, name)| name.as_str()).collect();
        assert_eq!(names, ["abd", "inner", "middle", "outer"]);
        assert_eq!(groups.iter().map(|g| g.members.len()).sum::<usize>(), 19);
    }

    #[test]
    fn names_lose_what_all_of_them_have() {
        assert_eq!(affixes(&["soft_hand_a_b_joint", "soft_hand_c_joint"]), (10, 6));
        assert_eq!(affixes(&["left_1", "right_1"]), (0, 2));
        assert_eq!(affixes(&["alone_joint"]), (0, 0));
        assert_eq!(affixes(&["a_joint", "a_joint"]), (2, 0));
        assert_eq!(affixes(&["é_a", "è_a"]), (0, 2));
    }

    #[test]
    fn ranges_are_shared_and_never_empty() {
        let curve = |y: f64| Curve { values: vec![0.0, y], ..Curve::default() };
        let panel =
            |axis: &str, y: f64| Panel { axis: axis.into(), curves: vec![curve(y)], ..Panel::default() };
        let figure =
            Figure { panels: vec![panel("a", 1.0), panel("a", -2.0), panel("b", 0.0)], ..Figure::default() };
        let (low, high) = range(&figure, "a");
        assert!(low < -2.0 && high > 1.0 && high < 1.5);
        let (low, high) = range(&figure, "b");
        assert!(low < high);
        assert_eq!(range(&figure, "c"), (0.0, 1.0));
    }
}
