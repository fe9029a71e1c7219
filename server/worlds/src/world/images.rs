//! Camera images, rendered without delaying ticks: on this thread while no world computes, else in the background.

use crate::compute::Compute;
use crate::compute::background::JobPriority;
use palmares_tasks::image::CameraImage;
use palmares_tasks::run::Exposure;
use std::sync::Arc;

/// The camera images of a step.
#[derive(Debug, Default)]
pub struct StepImages {
    /// Images that the controller requested.
    pub requested: Vec<Arc<Exposure>>,
    /// Images of the next frame, for a controller that keeps asking for the same cameras.
    pub upcoming: Vec<Arc<Exposure>>,
}

/// Renders the images on this thread.
pub(super) fn render_here(exposures: &[Arc<Exposure>]) -> Vec<CameraImage> {
    exposures.iter().map(|exposure| exposure.render().clone()).collect()
}

fn all_rendered(exposures: &[Arc<Exposure>]) -> bool {
    exposures.iter().all(|exposure| exposure.is_rendered())
}

/// Renders the requested images.
pub async fn render(compute: &Compute, requested: Vec<Arc<Exposure>>) -> Vec<CameraImage> {
    if all_rendered(&requested) {
        return render_here(&requested);
    }
    if let Some(_permit) = compute.scheduler.spare() {
        return render_here(&requested);
    }
    let images = compute.background.run(JobPriority::Awaited, move || render_here(&requested)).await;
    images.unwrap_or_else(|error| {
        tracing::error!(%error, "images could not be rendered");
        Vec::new()
    })
}

/// Renders upcoming images ahead, if a core is free.
pub fn render_ahead(compute: &Compute, upcoming: Vec<Arc<Exposure>>) {
    if all_rendered(&upcoming) {
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
