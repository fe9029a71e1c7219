//! Figures of a hand, odd values among them, and those beyond a competition's limits.

mod excess;
mod figures;
mod limits;
mod plausible;
mod sources;

pub use self::excess::Excess;
pub(crate) use self::figures::bounding_box;
pub use self::figures::{Figure, HandPart, number};
pub use self::limits::{Bound, HandLimits, SPECS, Spec};
pub use self::plausible::{LOOSE, oddities};
pub use self::sources::{SourceLocation, Sources};
