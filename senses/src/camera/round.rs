//! Capsules, spheres and cylinders, and their points on a ray.

use palmares_models::Vec3;

/// A capsule or cylinder in the optical frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round {
    a: Vec3,
    b: Vec3,
    axis: Vec3,
    length: f64,
    radius: f64,
    /// From the camera's centre to the axis, and the constant of every ray's quadratic.
    across: Vec3,
    constant: f64,
    /// a along the axis, and the constants of the quadratics of the spheres around a and b.
    start: f64,
    ends: [f64; 2],
    flat: bool,
}

/// The part of the image that can show it: where the discriminant of the infinite side, or of a sphere at an end, is not
/// negative.
pub(super) struct Outlines([Outline; 3]);

/// A symmetric matrix M: a ray d meets the surface if dᵀ M d ≥ 0.
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

    /// Least and largest x at which the row of rays (x, y, 1) meets the surface. They are infinite where no bound is known, such
    /// as for a camera within the surface.
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
    /// Least and largest x at which a row of rays (x, y, 1) can meet it, if it can. The outline of a capsule is the convex hull of
    /// its side's strip and of the spheres at its ends; an end of a cylinder is within such a sphere.
    pub(super) fn range(&self, y: f64) -> Option<(f64, f64)> {
        let ranges = self.0.iter().filter_map(|outline| outline.range(y));
        ranges.reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))
    }
}

impl Round {
    pub(super) fn new(a: Vec3, b: Vec3, radius: f64, flat: bool) -> Self {
        let length = (b - a).length();
        let axis = if length > 0.0 { (b - a) / length } else { Vec3::ZERO };
        let start = a.dot(axis);
        let across = a - axis * start;
        let constant = across.length_squared() - radius * radius;
        let ends = [a, b].map(|end| end.length_squared() - radius * radius);
        Round { a, b, axis, length, radius, across, constant, start, ends, flat }
    }

    /// No point of it has a smaller depth.
    pub(super) fn nearest(&self) -> f64 {
        self.a.z.min(self.b.z) - self.radius
    }

    /// Its outlines.
    pub(super) fn outlines(&self) -> Outlines {
        let [a, b] = self.ends;
        let side = Outline::new(self.across, self.constant, self.axis);
        Outlines([side, Outline::new(self.a, a, Vec3::ZERO), Outline::new(self.b, b, Vec3::ZERO)])
    }

    /// Depth at which a ray with z = 1 meets it: the side, where the squared distance from the axis minus the squared radius,
    /// a t² − 2 b t + c, is zero, or a sphere at an end.
    #[inline]
    pub(super) fn meet(&self, d: Vec3) -> Option<f64> {
        let (along, b, whole) = (d.dot(self.axis), d.dot(self.across), d.length_squared());
        let a = whole - along * along;
        let discriminant = b * b - a * self.constant;
        if discriminant < 0.0 {
            return None;
        }
        let side = if a > 0.0 { (b - discriminant.sqrt()) / a } else { f64::NEG_INFINITY };
        let at = side * along - self.start;
        if at >= 0.0 && at <= self.length && side > 0.0 {
            return Some(side);
        }
        if self.flat {
            return self.meet_cap(d, along);
        }
        let sphere = |end: Vec3, constant: f64| {
            let b = d.dot(end);
            let discriminant = b * b - whole * constant;
            let t = (b - discriminant.sqrt()) / whole;
            // Not a number when the ray misses the sphere.
            if t > 0.0 { t } else { f64::INFINITY }
        };
        let nearest = sphere(self.a, self.ends[0]).min(sphere(self.b, self.ends[1]));
        (nearest < f64::INFINITY).then_some(nearest)
    }

    /// Depth at which a ray meets an end of a cylinder.
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
            // A point on an end is well within the side.
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
