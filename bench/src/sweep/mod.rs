//! Sweeps of the step: the figure of a case at many steps beside its bound, so that no step between those of the gates hides
//! an outcome of its own, and no wide bound hides an outlier. The page is docs/report/steps.md.

mod command;
pub(crate) mod finished;
pub(crate) mod jobs;
mod map;
pub(crate) mod page;
pub(crate) mod played;
pub(crate) mod reasons;
mod scenes;

pub use command::SweepOptions;
pub use played::{Point, Row, bound, outliers, play, scene, steps};
pub use scenes::{RANGE_S, SCENES, Scene};
