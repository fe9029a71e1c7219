//! Fingers of a hand and their links.

use super::Hand;

/// A branch of links on the palm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finger {
    /// Name of its first link.
    pub name: String,
    /// Its links, as indices into [`Hand::links`].
    pub links: Vec<usize>,
}

impl Hand {
    /// The fingers: the palm is the first link, from the base on, with more than one child; each child begins
    /// a finger. A hand without such a link has one finger: all links below its base.
    pub fn fingers(&self) -> Vec<Finger> {
        let children = |link: usize| {
            (0..self.links.len()).filter(move |k| self.links[*k].parent == Some(link)).collect::<Vec<_>>()
        };
        let palm = (0..self.links.len()).find(|link| children(*link).len() > 1).unwrap_or(0);
        let mut fingers: Vec<Finger> = children(palm)
            .into_iter()
            .map(|first| Finger { name: self.links[first].name.clone(), links: vec![first] })
            .collect();
        // Parents come before their children.
        for (k, link) in self.links.iter().enumerate() {
            if let Some(finger) = fingers
                .iter_mut()
                .find(|finger| link.parent.is_some_and(|parent| finger.links.contains(&parent)))
            {
                finger.links.push(k);
            }
        }
        fingers
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hands_have_the_fingers_that_one_sees() {
        let fingers = |name: &str| {
            let hand = Hand::builtin(name).expect("built in");
            hand.fingers().into_iter().map(|finger| (finger.name, finger.links.len())).collect::<Vec<_>>()
        };
        let all = |names: &[(&str, usize)]| {
            names.iter().map(|(name, links)| ((*name).to_owned(), *links)).collect::<Vec<_>>()
        };
        assert_eq!(fingers("pinch"), all(&[("left_proximal", 2), ("right_proximal", 2)]));
        assert_eq!(fingers("reflex"), all(&[("swivel_1", 3), ("swivel_2", 3), ("proximal_3", 2)]));
        assert_eq!(fingers("softhand").len(), 5);
    }
}
