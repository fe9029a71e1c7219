//! Paths of tendons over a joint: the length s(q) of one coordinate, with its first two derivatives.

use super::da_vinci::{DaVinci, DaVinciGeometry};
use super::length::Length;
use super::number::{Field, Number, Visit};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Path of a tendon over a joint.
#[derive(Clone, Debug)]
pub enum TendonPath {
    /// Over two pulleys, one on either side of the joint.
    DaVinci(DaVinci),
    /// A polynomial of the coordinate.
    Polynomial(Polynomial),
    /// Measured lengths, and a smooth curve through them.
    Table(Table),
    /// A straight span between two eyelets, one on either side of the joint.
    Eyelets(Eyelets),
}

impl TendonPath {
    /// The same path with all lengths, and so its moment arms, multiplied by a positive factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            TendonPath::DaVinci(mechanism) => TendonPath::DaVinci(mechanism.scaled(factor)),
            TendonPath::Polynomial(Polynomial { coefficients }) => TendonPath::Polynomial(Polynomial {
                coefficients: coefficients.iter().map(|c| c * factor).collect(),
            }),
            TendonPath::Table(Table { points, bend }) => TendonPath::Table(Table {
                points: TablePoints {
                    at: points.at.clone(),
                    length: points.length.iter().map(|s| s * factor).collect(),
                },
                bend: bend.iter().map(|b| b * factor).collect(),
            }),
            TendonPath::Eyelets(eyelets) => TendonPath::Eyelets(eyelets.scaled(factor)),
        }
    }

    /// The length at coordinate q.
    #[inline]
    pub fn length(&self, q: f64) -> Length {
        match self {
            TendonPath::DaVinci(mechanism) => mechanism.length(q),
            TendonPath::Polynomial(polynomial) => polynomial.length(q),
            TendonPath::Table(table) => table.length(q),
            TendonPath::Eyelets(eyelets) => eyelets.length(q),
        }
    }
}

/// `s = c₁ q + c₂ q² + …`, without a constant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Polynomial {
    /// c₁, c₂, …
    pub coefficients: Vec<f64>,
}

/// Largest degree of a [`Polynomial`].
pub(crate) const MAX_DEGREE: usize = 8;

impl Polynomial {
    /// Checks that the coefficients are finite, and one at least is not zero.
    ///
    /// # Errors
    /// The problem of the coefficients.
    pub fn check(self) -> Result<Self, String> {
        let c = &self.coefficients;
        if c.is_empty() || c.len() > MAX_DEGREE || !c.iter().all(|c| c.is_finite()) {
            return Err(format!("has {} coefficients, or one that is not finite", c.len()));
        }
        if c.iter().all(|c| *c == 0.0) {
            return Err("all its coefficients are 0".to_owned());
        }
        Ok(self)
    }

    fn length(&self, q: f64) -> Length {
        let (mut value, mut slope, mut curvature) = (0.0, 0.0, 0.0);
        // Horner's scheme for the polynomial and its derivatives; the constant is 0.
        for &c in self.coefficients.iter().rev().chain(&[0.0]) {
            curvature = curvature * q + 2.0 * slope;
            slope = slope * q + value;
            value = value * q + c;
        }
        Length { value, slope, curvature }
    }
}

/// A length by measured points: the natural cubic spline through them, and straight lines beyond (two continuous derivatives).
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    points: TablePoints,
    /// d²s/dq² at every point; 0 at both ends.
    bend: Vec<f64>,
}

/// The points of a [`Table`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TablePoints {
    /// Coordinates, ascending: rad (m).
    pub at: Vec<f64>,
    /// s at each of them, in the tendon's unit.
    pub length: Vec<f64>,
}

/// Largest number of points of a [`Table`].
pub(crate) const MAX_POINTS: usize = 256;

impl Table {
    /// The spline through the points.
    ///
    /// # Errors
    /// The problem of the points.
    pub fn new(points: TablePoints) -> Result<Self, String> {
        let (x, y) = (&points.at, &points.length);
        let n = x.len();
        if !(2..=MAX_POINTS).contains(&n) || y.len() != n {
            return Err(format!("has {n} coordinates and {} lengths", y.len()));
        }
        if !x.iter().chain(y).all(|x| x.is_finite()) || !x.windows(2).all(|w| w[0] < w[1]) {
            return Err("its coordinates do not ascend, or a number is not finite".to_owned());
        }
        // The tridiagonal system of a natural spline, by elimination.
        let mut bend = vec![0.0; n];
        let (mut factor, mut right) = (vec![0.0; n], vec![0.0; n]);
        for i in 1..n - 1 {
            let (before, after) = (x[i] - x[i - 1], x[i + 1] - x[i]);
            let jump = 6.0 * ((y[i + 1] - y[i]) / after - (y[i] - y[i - 1]) / before);
            let pivot = 2.0 * (before + after) - before * factor[i - 1];
            factor[i] = after / pivot;
            right[i] = (jump - before * right[i - 1]) / pivot;
        }
        for i in (1..n - 1).rev() {
            bend[i] = right[i] - factor[i] * bend[i + 1];
        }
        let table = Table { points, bend };
        let smooth = table.bend.iter().all(|b| b.is_finite());
        if smooth { Ok(table) } else { Err("the points are too close to each other".to_owned()) }
    }

    /// Its points.
    pub fn points(&self) -> &TablePoints {
        &self.points
    }

    fn length(&self, q: f64) -> Length {
        let (x, y) = (&self.points.at, &self.points.length);
        let last = x.len() - 2;
        let i = x.partition_point(|x| *x <= q).saturating_sub(1).min(last);
        let (width, rise) = (x[i + 1] - x[i], y[i + 1] - y[i]);
        let (m0, m1) = (self.bend[i], self.bend[i + 1]);
        let at = |q: f64| {
            let (t, u) = ((q - x[i]) / width, (x[i + 1] - q) / width);
            let square = width * width / 6.0;
            Length {
                value: u * y[i] + t * y[i + 1] + square * ((u * u * u - u) * m0 + (t * t * t - t) * m1),
                slope: rise / width + width / 6.0 * ((3.0 * t * t - 1.0) * m1 - (3.0 * u * u - 1.0) * m0),
                curvature: u * m0 + t * m1,
            }
        };
        let inside = q.clamp(x[0], x[last + 1]);
        let end = at(inside);
        if inside == q {
            return end;
        }
        Length { value: end.value + end.slope * (q - inside), slope: end.slope, curvature: 0.0 }
    }
}

/// Two eyelets of a tendon, m: the joint is the origin; x and y span the plane that the joint turns in, and a positive coordinate
/// turns x towards y.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EyeletPositions {
    /// Eyelet on the link before the joint.
    #[serde(deserialize_with = "crate::exact::array")]
    pub before: [f64; 2],
    /// Eyelet on the link behind the joint, at coordinate 0.
    #[serde(deserialize_with = "crate::exact::array")]
    pub after: [f64; 2],
}

impl Field for Polynomial {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        self.coefficients.visit(number, name, each);
    }
}

impl Field for TablePoints {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        self.at.visit(number, name, each);
        self.length.visit(number, name, each);
    }
}

impl Field for EyeletPositions {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        [self.before, self.after].visit(number, name, each);
    }
}

impl Field for DaVinciGeometry {
    fn visit(&self, number: &Number, name: &str, each: &mut Visit<'_>) {
        let DaVinciGeometry { r0, r1, r2, a1, b1, l1, a2, b2 } = *self;
        [r0, r1, r2, a1, b1, l1, a2, b2].visit(number, name, each);
    }
}

/// A tendon that runs straight from one eyelet to the other: `s = L(0) − L(q)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eyelets {
    positions: EyeletPositions,
    /// Angle from the first eyelet to the second at coordinate 0, seen from the joint.
    angle: f64,
    /// a² + b² of the distances a and b of the eyelets from the joint.
    squares: f64,
    /// 2 a b
    product: f64,
    /// L(0), m.
    at_zero: f64,
}

impl Eyelets {
    /// Checks that the eyelets never meet, so that the length is smooth for every angle.
    ///
    /// # Errors
    /// The problem of the positions.
    pub fn new(positions: EyeletPositions) -> Result<Self, String> {
        let ([ax, ay], [bx, by]) = (positions.before, positions.after);
        let (a, b) = ((ax * ax + ay * ay).sqrt(), (bx * bx + by * by).sqrt());
        if !(a.is_finite() && b.is_finite() && a > 0.0 && b > 0.0) {
            return Err("an eyelet is at the joint, or a position is not finite".to_owned());
        }
        if (a - b).abs() < 1e-3 * a.max(b) {
            return Err(format!(
                "both eyelets are {a} m from the joint: they meet at some angle, where the length has a corner"
            ));
        }
        let angle = libm::atan2(ax * by - ay * bx, ax * bx + ay * by);
        let mut eyelets =
            Eyelets { positions, angle, squares: a * a + b * b, product: 2.0 * a * b, at_zero: 0.0 };
        eyelets.at_zero = -eyelets.length(0.0).value;
        Ok(eyelets)
    }

    /// Both eyelets at a multiple of their distance from the joint.
    fn scaled(&self, factor: f64) -> Self {
        let Eyelets { positions: EyeletPositions { before, after }, angle, squares, product, at_zero } =
            *self;
        let positions =
            EyeletPositions { before: before.map(|x| x * factor), after: after.map(|x| x * factor) };
        let square = factor * factor;
        Eyelets {
            positions,
            angle,
            squares: squares * square,
            product: product * square,
            at_zero: at_zero * factor,
        }
    }

    /// Its positions.
    pub fn positions(&self) -> &EyeletPositions {
        &self.positions
    }

    fn length(&self, q: f64) -> Length {
        // L² = a² + b² − 2 a b cos(angle + q)
        let (sin, cos) = libm::sincos(self.angle + q);
        let l = (self.squares - self.product * cos).sqrt();
        let slope = 0.5 * self.product * sin / l;
        let curvature = (0.5 * self.product * cos - slope * slope) / l;
        Length { value: self.at_zero - l, slope: -slope, curvature: -curvature }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths() -> Vec<TendonPath> {
        let polynomial = Polynomial { coefficients: vec![0.01, -0.002, 0.0005] }.check();
        let at: Vec<f64> = (0..9).map(|k| -0.4 + 0.25 * f64::from(k)).collect();
        let length = at.iter().map(|q| 0.01 * (q + 0.3 * q.sin())).collect();
        let eyelets = EyeletPositions { before: [-0.012, 0.006], after: [0.02, 0.004] };
        vec![
            TendonPath::Polynomial(polynomial.expect("coefficients")),
            TendonPath::Table(Table::new(TablePoints { at, length }).expect("points")),
            TendonPath::Eyelets(Eyelets::new(eyelets).expect("eyelets")),
        ]
    }

    #[test]
    fn arms_are_the_gradient_of_the_length() {
        let h = 1e-5;
        for path in paths() {
            for k in -20..60 {
                // Not a point of the table, where the third derivative jumps.
                let q = 0.031 * f64::from(k) + 0.0007;
                let [before, here, after] = [q - h, q, q + h].map(|q| path.length(q));
                let slope = (after.value - before.value) / (2.0 * h);
                assert!((here.slope - slope).abs() < 1e-9, "{path:?} at {q}: {} {slope}", here.slope);
                let curvature = (after.slope - before.slope) / (2.0 * h);
                assert!(
                    (here.curvature - curvature).abs() < 1e-7,
                    "{path:?} at {q}: {} {curvature}",
                    here.curvature
                );
            }
        }
    }

    #[test]
    fn a_scaled_path_has_scaled_lengths_and_arms() {
        for path in paths() {
            let scaled = path.scaled(1.1);
            for k in -20..60 {
                let q = 0.031 * f64::from(k);
                let (Length { value, slope, curvature }, wanted) = (scaled.length(q), path.length(q));
                for (found, wanted) in
                    [(value, wanted.value), (slope, wanted.slope), (curvature, wanted.curvature)]
                {
                    assert!((found - 1.1 * wanted).abs() < 1e-12, "{path:?} at {q}: {found} {wanted}");
                }
            }
        }
    }

    #[test]
    fn a_table_passes_through_its_points_and_goes_on_straight() {
        let points = TablePoints { at: vec![0.0, 0.5, 1.5], length: vec![0.0, 0.006, 0.014] };
        let table = Table::new(points.clone()).expect("points");
        for (at, length) in points.at.iter().zip(&points.length) {
            assert!((table.length(*at).value - length).abs() < 1e-15);
        }
        let (end, beyond) = (table.length(1.5), table.length(1.7));
        assert!((beyond.value - end.value - 0.2 * end.slope).abs() < 1e-15 && beyond.curvature == 0.0);
    }

    #[test]
    fn a_span_is_the_distance_of_its_eyelets() {
        let positions = EyeletPositions { before: [-0.012, 0.006], after: [0.02, 0.004] };
        let eyelets = Eyelets::new(positions).expect("eyelets");
        let distance = |q: f64| {
            let ([x, y], (sin, cos)) = (positions.after, q.sin_cos());
            let (x, y) = (x * cos - y * sin + 0.012, x * sin + y * cos - 0.006);
            (x * x + y * y).sqrt()
        };
        for k in 0..30 {
            let q = 0.1 * f64::from(k) - 1.0;
            assert!((eyelets.length(q).value - (distance(0.0) - distance(q))).abs() < 1e-15);
        }
    }

    #[test]
    fn paths_that_are_not_smooth_are_refused() {
        assert!(Eyelets::new(EyeletPositions { before: [-0.01, 0.0], after: [0.0, 0.01] }).is_err());
        assert!(Eyelets::new(EyeletPositions { before: [0.0, 0.0], after: [0.0, 0.01] }).is_err());
        assert!(Table::new(TablePoints { at: vec![0.0, 0.0], length: vec![0.0, 1.0] }).is_err());
        assert!(Table::new(TablePoints { at: vec![0.0], length: vec![0.0] }).is_err());
        assert!(Polynomial { coefficients: vec![] }.check().is_err());
        assert!(Polynomial { coefficients: vec![0.0] }.check().is_err());
    }
}
