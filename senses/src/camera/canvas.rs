//! The z-buffer while bodies are drawn into it, and rectangles of its pixels.

use super::intrinsics::Intrinsics;
use super::round::Round;
use palmares_models::Vec3;

/// A rectangle of pixels: its first row and column, and the ones after its last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Area {
    pub(super) left: usize,
    pub(super) right: usize,
    pub(super) top: usize,
    pub(super) bottom: usize,
}

impl Area {
    pub(super) fn whole(lens: &Intrinsics) -> Self {
        Area { left: 0, right: lens.width as usize, top: 0, bottom: lens.height as usize }
    }

    /// The pixels that can show a sphere; none when it is out of view. A sphere around the camera can be in every pixel.
    pub(super) fn of_sphere(center: Vec3, radius: f64, lens: &Intrinsics) -> Option<Self> {
        if center.z <= -radius {
            return None;
        }
        if center.z <= radius * (1.0 + 1e-9) {
            return Some(Self::whole(lens));
        }
        // Tangents from the camera's centre to the circle in the plane of one axis and z.
        let bounds = |x: f64, f: f64, c: f64, most: u32| {
            let (z, r) = (center.z, radius);
            let root = (x * x + z * z - r * r).max(0.0).sqrt();
            let slope = |sign: f64| (x * z + sign * r * root) / (z * z - r * r);
            let low = (f * slope(-1.0) + c - 0.5).ceil().max(0.0);
            let high = (f * slope(1.0) + c - 0.5).floor().min(f64::from(most) - 1.0);
            (low <= high).then(|| (low as usize, high as usize + 1))
        };
        let (left, right) = bounds(center.x, lens.fx, lens.cx, lens.width)?;
        let (top, bottom) = bounds(center.y, lens.fy, lens.cy, lens.height)?;
        Some(Area { left, right, top, bottom })
    }

    pub(super) fn union(self, other: Self) -> Self {
        Area {
            left: self.left.min(other.left),
            right: self.right.max(other.right),
            top: self.top.min(other.top),
            bottom: self.bottom.max(other.bottom),
        }
    }

    pub(super) fn within(self, other: Self) -> Option<Self> {
        let area = Area {
            left: self.left.max(other.left),
            right: self.right.min(other.right),
            top: self.top.max(other.top),
            bottom: self.bottom.min(other.bottom),
        };
        (area.left < area.right && area.top < area.bottom).then_some(area)
    }
}

/// The z-buffer while a primitive is drawn.
pub(super) struct Canvas<'a> {
    pub(super) width: usize,
    /// x of the ray of every column.
    pub(super) columns: &'a [f64],
    pub(super) inverse: &'a mut [f64],
    pub(super) primitive: &'a mut [u32],
    pub(super) number: u32,
}

impl Canvas<'_> {
    /// A row of a flat primitive: 1/z is `start + step · x`, with x of the ray.
    pub(super) fn flat_row(&mut self, v: usize, left: usize, right: usize, start: f64, step: f64) {
        let row = v * self.width;
        let inverse = &mut self.inverse[row + left..row + right];
        let primitive = &mut self.primitive[row + left..row + right];
        for ((inverse, primitive), x) in inverse.iter_mut().zip(primitive).zip(&self.columns[left..right]) {
            let here = start + step * x;
            let nearer = here > *inverse;
            *inverse = if nearer { here } else { *inverse };
            *primitive = if nearer { self.number } else { *primitive };
        }
    }

    pub(super) fn round(&mut self, round: &Round, area: Area, lens: &Intrinsics) {
        let outlines = round.outlines();
        let nearest = round.nearest();
        let most = if nearest > 0.0 { 1.0 / nearest } else { f64::INFINITY };
        for v in area.top..area.bottom {
            let y = lens.row(v);
            let Some((first, last)) = outlines.range(y) else { continue };
            // One more pixel on each side: at the outline itself rounding decides.
            let left = (first * lens.fx + lens.cx - 1.5).max(area.left as f64) as usize;
            let right = (last * lens.fx + lens.cx + 1.5).min(area.right as f64) as usize;
            for u in left..right {
                // The pixel has something nearer, wherever the ray meets the surface.
                if self.inverse[v * self.width + u] >= most {
                    continue;
                }
                if let Some(z) = round.meet(Vec3::new(self.columns[u], y, 1.0)) {
                    let (here, pixel) = (1.0 / z, v * self.width + u);
                    if here > self.inverse[pixel] {
                        self.inverse[pixel] = here;
                        self.primitive[pixel] = self.number;
                    }
                }
            }
        }
    }
}
