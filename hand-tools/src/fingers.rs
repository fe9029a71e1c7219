//! The coordinates of a hand by finger, with short names.

use palmares_models::hand::Hand;

/// Maximum number of curves in a panel.
const CURVES_PER_PANEL: usize = 6;

/// The content of a panel: title, unit, and coordinates with their short names.
pub(crate) struct Group {
    pub(crate) title: String,
    pub(crate) unit: &'static str,
    pub(crate) members: Vec<(usize, String)>,
}

/// Groups the coordinates of a hand by finger, that is by the child link of the base above them.
pub(crate) fn fingers(hand: &Hand) -> Vec<Group> {
    let all: Vec<&str> = hand.coordinates.iter().map(|c| c.name.as_str()).collect();
    let (head, tail) = affixes(&all);
    let mut groups: Vec<(usize, &'static str, Vec<usize>)> = Vec::new();
    for c in 0..hand.coordinates.len() {
        let moved = hand.links.iter().position(|l| l.joint.as_ref().is_some_and(|j| j.coordinate == c));
        let mut root = moved.unwrap_or(0);
        while let Some(parent) = hand.links[root].parent.filter(|&p| p != 0) {
            root = parent;
        }
        let unit = if hand.slides(c) { "m" } else { "rad" };
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

/// Lengths of the common prefix (up to an underscore) and suffix (from an underscore) of all names; 0 for a single name.
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
    fn names_lose_common_prefix_and_suffix() {
        assert_eq!(affixes(&["soft_hand_a_b_joint", "soft_hand_c_joint"]), (10, 6));
        assert_eq!(affixes(&["left_1", "right_1"]), (0, 2));
        assert_eq!(affixes(&["alone_joint"]), (0, 0));
        assert_eq!(affixes(&["a_joint", "a_joint"]), (2, 0));
        assert_eq!(affixes(&["é_a", "è_a"]), (0, 2));
    }
}
