//! Pictures, drawn where no tick of others waits for them: here and now while nobody else computes, else in the background.

use crate::compute::Compute;
use crate::compute::background::Level;
use palmares_tasks::image::CameraImage;
use palmares_tasks::run::Exposure;
use std::sync::Arc;

/// Pictures that have been taken.
#[derive(Debug, Default)]
pub(crate) struct Pictures {
    /// Those that are wanted.
    pub(crate) wanted: Vec<Arc<Exposure>>,
    /// Those that will be wanted next by who goes on looking through the same cameras.
    pub(crate) upcoming: Vec<Arc<Exposure>>,
}

/// Draws them here.
pub(super) fn drawn(exposures: &[Arc<Exposure>]) -> Vec<CameraImage> {
    exposures.iter().map(|exposure| exposure.render().clone()).collect()
}

fn all_drawn(exposures: &[Arc<Exposure>]) -> bool {
    exposures.iter().all(|exposure| exposure.is_rendered())
}

/// The wanted pictures.
pub(crate) async fn render(compute: &Compute, wanted: Vec<Arc<Exposure>>) -> Vec<CameraImage> {
    if all_drawn(&wanted) {
        return drawn(&wanted);
    }
    if let Some(_permit) = compute.scheduler.spare() {
        return drawn(&wanted);
    }
    let images = compute.background.run(Level::Awaited, move || drawn(&wanted)).await;
    images.unwrap_or_else(|error| {
        tracing::error!(%error, "pictures could not be drawn");
        Vec::new()
    })
}

/// Draws what will be wanted next, if a core is free; nobody waits for it.
pub(crate) fn prepare(compute: &Compute, upcoming: Vec<Arc<Exposure>>) {
    if all_drawn(&upcoming) {
        return;
    }
    if let Some(permit) = compute.scheduler.spare() {
        tokio::task::spawn_blocking(move || {
            upcoming.iter().for_each(|exposure| {
                exposure.render();
            });
            drop(permit);
        });
    }
}
