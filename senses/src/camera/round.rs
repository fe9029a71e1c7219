//! Capsules, spheres and cylinders: where a ray meets them.

use palmares_models::Vec3;

/// The nearer root of a t² − 2 b t + c = 0, if there is one.
fn nearer(a: f64, b: f64, c: f64) -> Option<f64> {
    let discriminant = b * b - a * c;
    if discriminant < 0.0 || a <= 0.0 { None } else { Some((b - discriminant.sqrt()) / a) }
}

/// A capsule or cylinder in the optical frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round {
    a: Vec3,
    b: Vec3,
    axis: Vec3,
    length: f64,
    radius: f64,
    /// From the axis to the camera's centre, and what a ray's quadratic has in common.
    across: Vec3,
    constant: f64,
    flat: bool,
}

/// Where a picture may show it: where the discriminants are not negative, of the side without end and of the spheres at
/// the ends.
pub(super) struct Outlines([Outline; 3]);

/// A symmetric matrix M: a ray d meets the surface where dᵀ M d ≥ 0.
#[derive(Clone, Copy, Debug, Default)]
struct Outline {
    xx: f64,
    xy: f64,
    xz: f64,
    yy: f64,
    yz: f64,
    zz: f64,
}

impl Outline {
    /// w wᵀ − c (1 − a aᵀ).
    fn new(w: Vec3, c: f64, a: Vec3) -> Self {
        Outline {
            xx: w.x * w.x - c * (1.0 - a.x * a.x),
            xy: w.x * w.y + c * a.x * a.y,
            xz: w.x * w.z + c * a.x * a.z,
            yy: w.y * w.y - c * (1.0 - a.y * a.y),
            yz: w.y * w.z + c * a.y * a.z,
            zz: w.z * w.z - c * (1.0 - a.z * a.z),
        }
    }

    /// Between which x the row of rays (x, y, 1) meets the surface: everywhere when that cannot be told, as when the
    /// camera is within it.
    fn range(&self, y: f64) -> Option<(f64, f64)> {
        let (a, b) = (self.xx, self.xy * y + self.xz);
        let c = (self.yy * y + 2.0 * self.yz) * y + self.zz;
        let discriminant = b * b - a * c;
        if a >= 0.0 || !discriminant.is_finite() {
            Some((f64::NEG_INFINITY, f64::INFINITY))
        } else if discriminant < 0.0 {
            None
        } else {
            let root = discriminant.sqrt();
            Some(((-b + root) / a, (-b - root) / a))
        }
    }
}

impl Outlines {
    /// Between which x a row of rays (x, y, 1) may meet it, if anywhere: a capsule looks like the strip of its side and the
    /// spheres at its ends, of which the convex hull is taken; an end of a cylinder lies within such a sphere.
    pub(super) fn range(&self, y: f64) -> Option<(f64, f64)> {
        let ranges = self.0.iter().filter_map(|outline| outline.range(y));
        ranges.reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
    }
}

impl Round {
    pub(super) fn new(a: Vec3, b: Vec3, radius: f64, flat: bool) -> Self {
        let length = (b - a).length();
        let axis = if length > 0.0 { (b - a) / length } else { Vec3::ZERO };
        let across = a - axis * a.dot(axis);
        let constant = across.length_squared() - radius * radius;
        Round { a, b, axis, length, radius, across, constant, flat }
    }

    /// Its outlines.
    pub(super) fn outlines(&self) -> Outlines {
        let sphere =
            |end: Vec3| Outline::new(end, end.length_squared() - self.radius * self.radius, Vec3::ZERO);
        Outlines([Outline::new(self.across, self.constant, self.axis), sphere(self.a), sphere(self.b)])
    }

    /// Depth at which a ray with z = 1 meets it.
    pub(super) fn meet(&self, d: Vec3) -> Option<f64> {
        let along = d.dot(self.axis);
        let d_across = d - self.axis * along;
        let (a, b) = (d_across.length_squared(), d_across.dot(self.across));
        let discriminant = b * b - a * self.constant;
        if discriminant < 0.0 {
            return None;
        }
        let side = if a > 0.0 { (b - discriminant.sqrt()) / a } else { f64::NEG_INFINITY };
        let at = side * along - self.a.dot(self.axis);
        if (0.0..=self.length).contains(&at) && side > 0.0 {
            return Some(side);
        }
        if self.flat {
            self.meet_cap(d, along)
        } else {
            let ends = if self.length > 0.0 { [Some(self.a), Some(self.b)] } else { [Some(self.a), None] };
            let near = |end: Vec3| {
                nearer(d.length_squared(), d.dot(end), end.length_squared() - self.radius * self.radius)
            };
            let roots = ends.into_iter().flatten().filter_map(near).filter(|t| *t > 0.0);
            roots.reduce(f64::min)
        }
    }

    /// Where a ray meets an end of a cylinder.
    fn meet_cap(&self, d: Vec3, along: f64) -> Option<f64> {
        if along == 0.0 {
            return None;
        }
        let end = if along > 0.0 { self.a } else { self.b };
        let t = end.dot(self.axis) / along;
        let off = d * t - end;
        (t > 0.0 && off.length_squared() <= self.radius * self.radius).then_some(t)
    }

    /// Outward normal at a point of its surface.
    pub(super) fn normal(&self, point: Vec3) -> Vec3 {
        let at = (point - self.a).dot(self.axis);
        if self.flat {
            // On an end the point is well within the side.
            let off = point - self.a - self.axis * at;
            let inside = off.length() < self.radius * (1.0 - 1e-9);
            if inside && (at.abs() < 1e-9 || (at - self.length).abs() < 1e-9) {
                return if at < 0.5 * self.length { -self.axis } else { self.axis };
            }
            return off.normalize_or_zero();
        }
        (point - self.a - self.axis * at.clamp(0.0, self.length)).normalize_or_zero()
    }
}
