//! Pictures, drawn where no tick waits for them.

use crate::compute::background::{Background, Level};
use palmares_tasks::image::CameraImage;
use palmares_tasks::run::Exposure;
use std::sync::Arc;

/// Pictures that have been taken.
#[derive(Debug, Default)]
pub(crate) struct Film {
    /// Those that are wanted.
    pub(super) wanted: Vec<Arc<Exposure>>,
    /// Those that will be wanted next by who goes on looking through the same cameras.
    pub(super) upcoming: Vec<Arc<Exposure>>,
}

/// Draws them here.
pub(super) fn drawn(exposures: &[Arc<Exposure>]) -> Vec<CameraImage> {
    exposures.iter().map(|exposure| exposure.develop().clone()).collect()
}

/// The wanted pictures, drawn on a thread that no tick needs. Those that come next are drawn as well, and nobody waits for
/// it.
pub(crate) async fn develop(background: &Background, Film { wanted, upcoming }: Film) -> Vec<CameraImage> {
    let draw = |level: Level, exposures: Vec<Arc<Exposure>>| {
        let background = background.clone();
        async move { background.run(level, move || drawn(&exposures)).await }
    };
    let images = match wanted.iter().all(|exposure| exposure.is_developed()) {
        true => drawn(&wanted),
        false => draw(Level::Awaited, wanted).await.unwrap_or_else(|error| {
            tracing::error!(%error, "pictures could not be drawn");
            Vec::new()
        }),
    };
    if upcoming.iter().any(|exposure| !exposure.is_developed()) {
        tokio::spawn(draw(Level::Awaited, upcoming));
    }
    images
}
