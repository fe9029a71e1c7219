//! Overlaps of a hand at its start.

use std::fmt;

/// Kind of thing that a hand overlaps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// Furniture or a container.
    Furniture,
    /// An object of the scene.
    Object,
    /// A region of the rules.
    Region,
    /// The volume in which any seed may place objects.
    Placing,
}

/// A link of a hand that touches something where the hand starts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Overlap {
    /// Name of the link.
    pub link: String,
    /// Kind of the touched thing.
    pub obstacle: Obstacle,
    /// Name of the thing: `shelf`, `ball_3`.
    pub name: String,
}

impl fmt::Display for Overlap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let does = match self.obstacle {
            Obstacle::Furniture | Obstacle::Object => "touches",
            Obstacle::Region => "reaches into region",
            Obstacle::Placing => "reaches to where objects are placed in",
        };
        write!(f, "link `{}` {does} `{}`", self.link, self.name)
    }
}
