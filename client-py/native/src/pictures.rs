//! Pictures of many worlds, drawn by the pool into arrays that Python gets without a copy.

use crate::aligned::Aligned;
use crate::analysis::arrays::{Seven, pose, value_error};
use crate::workers::Workers;
use palmares_senses::camera::{Film, GBuffer};
use palmares_tasks::image::CameraImage;
use palmares_tasks::run::View;
use palmares_tasks::{Run, Sensing};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::cell::RefCell;
use std::mem::take;

thread_local! {
    static DRAWN: RefCell<(GBuffer, Film)> = RefCell::default();
}

/// Kinds of pictures, in the order of [`Frame`].
const KINDS: [&str; 5] = ["depth", "depth_mm", "rgb", "bodies", "film"];

/// A camera as Python describes it.
#[derive(FromPyObject)]
pub(crate) struct PictureRequest {
    /// Name of a camera of task or hand.
    camera: Option<String>,
    /// Without a name: pose of the optical frame in a link or in the world, field of view, range.
    pose: Option<Seven>,
    link: Option<String>,
    fov_deg: f64,
    range_m: (f64, f64),
    /// Width and height.
    size: Option<(u32, u32)>,
}

impl PictureRequest {
    fn view(&self, run: &Run) -> PyResult<View> {
        match (&self.camera, self.pose) {
            (Some(name), _) => run.view(name, self.size).map_err(value_error),
            (None, Some(at)) => {
                let size = self.size.unwrap_or((320, 240));
                let link = self.link.as_deref();
                run.own_view(pose("pose", at)?, link, self.fov_deg, size, self.range_m).map_err(value_error)
            }
            (None, None) => Err(value_error("camera: wanted a name or a pose")),
        }
    }
}

/// A world and its part of each array; empty where it is not wanted.
struct Frame<'a> {
    run: &'a mut Run,
    depth: &'a mut [f32],
    millimetres: &'a mut [u16],
    rgb: &'a mut [u8],
    bodies: &'a mut [u16],
    film: &'a mut [u8],
}

impl Frame<'_> {
    fn draw(&mut self, view: &View) {
        DRAWN.with_borrow_mut(|(drawn, film)| {
            if !self.film.is_empty() {
                self.film.copy_from_slice(&self.run.still().picture(view, film));
            }
            let others = [self.depth.len(), self.millimetres.len(), self.rgb.len(), self.bodies.len()];
            if others == [0; 4] {
                return;
            }
            drawn.with_normals(!self.rgb.is_empty());
            self.run.draw(view, drawn);
            for (to, z) in self.depth.iter_mut().zip(&drawn.depth) {
                *to = if z.is_finite() { *z as f32 } else { 0.0 };
            }
            for (to, z) in self.millimetres.iter_mut().zip(&drawn.depth) {
                *to = if *z < 65.535 { (1e3 * z + 0.5) as u16 } else { 0 };
            }
            if !self.rgb.is_empty() {
                self.rgb.copy_from_slice(&self.run.colours(view, drawn));
            }
            if !self.bodies.is_empty() {
                self.bodies.copy_from_slice(&drawn.body);
            }
        });
    }
}

/// Pictures of runs: of each kind an array (lead, height, width), of colours with three more.
pub(crate) fn pictures<'py>(
    py: Python<'py>,
    runs: Vec<&mut Run>,
    workers: Option<&Workers>,
    request: &PictureRequest,
    kinds: &[String],
    lead: &[usize],
) -> PyResult<Bound<'py, PyDict>> {
    if let Some(unknown) = kinds.iter().find(|kind| !KINDS.contains(&kind.as_str())) {
        return Err(value_error(format!("kinds: found {unknown:?}; wanted some of {}", KINDS.join(", "))));
    }
    let count = runs.len();
    let Some(view) = runs.first().map(|run| request.view(run)).transpose()? else {
        return Err(value_error("there is no world"));
    };
    let pixels = view.lens().pixels();
    let len = |kind: &str, each: usize| if kinds.iter().any(|it| it == kind) { each * pixels } else { 0 };
    let each = [len("depth", 1), len("depth_mm", 1), len("rgb", 3), len("bodies", 1), len("film", 3)];
    let mut depth = Aligned::<f32>::zeros(count * each[0]);
    let [mut millimetres, mut bodies] = [each[1], each[3]].map(|each| Aligned::<u16>::zeros(count * each));
    let [mut rgb, mut film] = [each[2], each[4]].map(|each| Aligned::<u8>::zeros(count * each));
    {
        let (mut a, mut b) = (parts(depth.numbers(), each[0]), parts(millimetres.numbers(), each[1]));
        let (mut c, mut d) = (parts(rgb.numbers(), each[2]), parts(bodies.numbers(), each[3]));
        let mut e = parts(film.numbers(), each[4]);
        let mut frames: Vec<Frame> = runs
            .into_iter()
            .map(|run| Frame { run, depth: a(), millimetres: b(), rgb: c(), bodies: d(), film: e() })
            .collect();
        py.detach(|| match workers {
            Some(workers) => workers.each(&mut frames, |frame| frame.draw(&view)),
            None => frames.iter_mut().for_each(|frame| frame.draw(&view)),
        });
    }
    let dict = PyDict::new(py);
    let size = [view.lens().height as usize, view.lens().width as usize];
    let shape: Vec<usize> = lead.iter().copied().chain(size).collect();
    let coloured = [&shape[..], &[3]].concat();
    for kind in kinds {
        let array = match kind.as_str() {
            "depth" => take(&mut depth).array(py, &shape),
            "depth_mm" => take(&mut millimetres).array(py, &shape),
            "rgb" => take(&mut rgb).array(py, &coloured),
            "film" => take(&mut film).array(py, &coloured),
            _ => take(&mut bodies).array(py, &shape),
        };
        dict.set_item(kind, array?)?;
    }
    Ok(dict)
}

/// Depth of named cameras as their messages have it, m, 0 without a reading: for each an array (N, height, width).
pub(crate) fn depths<'py>(
    py: Python<'py>,
    runs: Vec<&mut Run>,
    workers: &Workers,
    cameras: &[String],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let Some(first) = runs.first() else { return Err(value_error("there is no world")) };
    let mut shots = Vec::new();
    for camera in cameras {
        let shot = first.shots(std::slice::from_ref(camera), Sensing::Sensors).map_err(value_error)?;
        shots.push(shot);
    }
    let mut taken: Vec<(&mut Run, Vec<Taken>)> = runs.into_iter().map(|run| (run, Vec::new())).collect();
    py.detach(|| {
        workers.each(&mut taken, |(run, images)| {
            images.extend(shots.iter().map(|shot| run.expose(shot).first().map(|it| depth_of(it.render()))));
        });
    });
    for (k, camera) in cameras.iter().enumerate() {
        let images: Vec<&([usize; 2], Vec<f64>)> =
            taken.iter().filter_map(|(_, images)| images.get(k)?.as_ref()).collect();
        let Some((size, _)) = images.first() else { return Err(value_error("there is no image")) };
        let shape = [images.len(), size[0], size[1]];
        let values: Vec<f64> = images.iter().flat_map(|(_, depth)| depth.iter().copied()).collect();
        dict.set_item(camera, Aligned::of(&values).array(py, &shape)?)?;
    }
    Ok(dict)
}

/// Rows and columns of an image, and its depths; none for a camera that gave no image.
type Taken = Option<([usize; 2], Vec<f64>)>;

fn depth_of(image: &CameraImage) -> ([usize; 2], Vec<f64>) {
    let steps = image.depth.iter().flat_map(|depth| depth.0.as_chunks::<2>().0);
    let depth = steps.map(|bytes| f64::from(u16::from_le_bytes(*bytes)) * image.depth_unit).collect();
    ([image.height as usize, image.width as usize], depth)
}

/// Its parts of a length, one after the other; empty ones for the length 0.
fn parts<'a, T>(all: &'a mut [T], len: usize) -> impl FnMut() -> &'a mut [T] {
    let mut chunks = all.chunks_mut(len.max(1));
    move || chunks.next().unwrap_or_default()
}
