//! Spatial vectors and 6x6 symmetric matrices in Plücker form.

use palmares_models::{Mat3, Vec3};
use std::ops::{Add, AddAssign, Mul, Sub};

/// A spatial velocity: angular part, and linear velocity of the point at the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpatialVelocity {
    /// rad/s
    pub angular: Vec3,
    /// m/s
    pub linear: Vec3,
}

/// A spatial force: moment about the origin, and force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Force {
    /// N·m
    pub moment: Vec3,
    /// N
    pub force: Vec3,
}

impl SpatialVelocity {
    /// No motion.
    pub const ZERO: SpatialVelocity = SpatialVelocity { angular: Vec3::ZERO, linear: Vec3::ZERO };

    /// Power of a force along this motion.
    #[inline]
    pub fn dot(self, f: Force) -> f64 {
        self.angular.dot(f.moment) + self.linear.dot(f.force)
    }

    /// The cross product of motions, `self × other`.
    #[inline]
    pub fn cross(self, other: SpatialVelocity) -> SpatialVelocity {
        SpatialVelocity {
            angular: self.angular.cross(other.angular),
            linear: self.angular.cross(other.linear) + self.linear.cross(other.angular),
        }
    }

    /// The cross product with a force, `self ×* f`.
    #[inline]
    pub fn cross_force(self, f: Force) -> Force {
        Force {
            moment: self.angular.cross(f.moment) + self.linear.cross(f.force),
            force: self.angular.cross(f.force),
        }
    }

    /// Velocity of the point at `r` from the origin.
    #[inline]
    pub fn at(self, r: Vec3) -> Vec3 {
        self.linear + self.angular.cross(r)
    }

    /// The same motion about an origin moved by `d`.
    #[inline]
    pub fn moved(self, d: Vec3) -> SpatialVelocity {
        SpatialVelocity { angular: self.angular, linear: self.at(d) }
    }
}

impl Force {
    /// No force.
    pub const ZERO: Force = Force { moment: Vec3::ZERO, force: Vec3::ZERO };

    /// Force, then moment: the order of a body's velocities in the solver.
    #[inline]
    pub fn components(self) -> [f64; 6] {
        let (f, m) = (self.force, self.moment);
        [f.x, f.y, f.z, m.x, m.y, m.z]
    }

    /// The same force about an origin moved by `d`.
    #[inline]
    pub fn moved(self, d: Vec3) -> Force {
        Force { moment: self.moment - d.cross(self.force), force: self.force }
    }
}

/// The arithmetic of a spatial vector is that of its two parts.
macro_rules! arithmetic {
    ($vector:ident { $moment:ident, $line:ident }) => {
        impl Add for $vector {
            type Output = $vector;
            #[inline]
            fn add(self, o: $vector) -> $vector {
                $vector { $moment: self.$moment + o.$moment, $line: self.$line + o.$line }
            }
        }

        impl AddAssign for $vector {
            #[inline]
            fn add_assign(&mut self, o: $vector) {
                *self = *self + o;
            }
        }

        impl Sub for $vector {
            type Output = $vector;
            #[inline]
            fn sub(self, o: $vector) -> $vector {
                $vector { $moment: self.$moment - o.$moment, $line: self.$line - o.$line }
            }
        }

        impl Mul<f64> for $vector {
            type Output = $vector;
            #[inline]
            fn mul(self, k: f64) -> $vector {
                $vector { $moment: self.$moment * k, $line: self.$line * k }
            }
        }
    };
}

arithmetic!(SpatialVelocity { angular, linear });
arithmetic!(Force { moment, force });

/// The matrix of `x ↦ a × x`.
#[inline]
pub fn cross_matrix(a: Vec3) -> Mat3 {
    Mat3::from_cols(Vec3::new(0.0, a.z, -a.y), Vec3::new(-a.z, 0.0, a.x), Vec3::new(a.y, -a.x, 0.0))
}

/// `[a]× m`: the cross product of `a` with every column.
#[inline]
pub fn cross_columns(a: Vec3, m: &Mat3) -> Mat3 {
    Mat3::from_cols(a.cross(m.x_axis), a.cross(m.y_axis), a.cross(m.z_axis))
}

/// `m [a]×ᵀ`: [`cross_columns`] for rows.
#[inline]
pub fn cross_rows(a: Vec3, m: &Mat3) -> Mat3 {
    Mat3::from_cols(
        m.z_axis * a.y - m.y_axis * a.z,
        m.x_axis * a.z - m.z_axis * a.x,
        m.y_axis * a.x - m.x_axis * a.y,
    )
}

/// `a aᵀ`-like outer product `a bᵀ`.
#[inline]
pub fn outer(a: Vec3, b: Vec3) -> Mat3 {
    Mat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Rigid-body inertia about the origin: mass, first moment and rotational inertia.
#[derive(Clone, Copy, Debug, Default)]
pub struct RigidInertia {
    /// kg
    pub mass: f64,
    /// mass · centre of mass, kg·m
    pub first_moment: Vec3,
    /// kg·m²
    pub rotational: Mat3,
}

impl RigidInertia {
    /// From mass, centre of mass and inertia about it.
    #[inline]
    pub fn new(mass: f64, com: Vec3, about_com: Mat3) -> Self {
        let shift = (Mat3::from_diagonal(Vec3::splat(com.dot(com))) - outer(com, com)) * mass;
        RigidInertia { mass, first_moment: com * mass, rotational: about_com + shift }
    }

    /// Momentum at a velocity.
    #[inline]
    pub fn mul(&self, v: SpatialVelocity) -> Force {
        Force {
            moment: self.rotational * v.angular + self.first_moment.cross(v.linear),
            force: v.linear * self.mass - self.first_moment.cross(v.angular),
        }
    }
}

impl AddAssign for RigidInertia {
    #[inline]
    fn add_assign(&mut self, o: RigidInertia) {
        self.mass += o.mass;
        self.first_moment += o.first_moment;
        self.rotational += o.rotational;
    }
}

/// A general 6x6 matrix from motions to forces; rows and columns (angular, linear).
#[derive(Clone, Copy, Debug, Default)]
pub struct SpatialMatrix {
    /// angular rows, angular columns
    pub aa: Mat3,
    /// angular rows, linear columns
    pub al: Mat3,
    /// linear rows, angular columns
    pub la: Mat3,
    /// linear rows, linear columns
    pub ll: Mat3,
}

impl SpatialMatrix {
    /// All zero.
    pub const ZERO: SpatialMatrix =
        SpatialMatrix { aa: Mat3::ZERO, al: Mat3::ZERO, la: Mat3::ZERO, ll: Mat3::ZERO };

    /// Product with a motion.
    #[inline]
    pub fn mul(&self, v: SpatialVelocity) -> Force {
        Force {
            moment: self.aa * v.angular + self.al * v.linear,
            force: self.la * v.angular + self.ll * v.linear,
        }
    }

    /// Rows about an origin at `−d` from the present one.
    #[inline]
    pub fn rows_moved(&self, d: Vec3) -> SpatialMatrix {
        SpatialMatrix {
            aa: self.aa + cross_columns(d, &self.la),
            al: self.al + cross_columns(d, &self.ll),
            la: self.la,
            ll: self.ll,
        }
    }

    /// Columns about an origin at `−d` from the present one.
    #[inline]
    pub fn columns_moved(&self, d: Vec3) -> SpatialMatrix {
        SpatialMatrix {
            aa: self.aa + cross_rows(d, &self.al),
            al: self.al,
            la: self.la + cross_rows(d, &self.ll),
            ll: self.ll,
        }
    }

    /// Transpose.
    #[inline]
    pub fn transpose(&self) -> SpatialMatrix {
        SpatialMatrix {
            aa: self.aa.transpose(),
            al: self.la.transpose(),
            la: self.al.transpose(),
            ll: self.ll.transpose(),
        }
    }
}

impl AddAssign<&SpatialMatrix> for SpatialMatrix {
    #[inline]
    fn add_assign(&mut self, o: &SpatialMatrix) {
        self.aa += o.aa;
        self.al += o.al;
        self.la += o.la;
        self.ll += o.ll;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Vec3, b: Vec3) -> bool {
        (a - b).length() < 1e-12
    }

    #[test]
    fn moving_the_origin_keeps_power_and_point_velocity() {
        let v = SpatialVelocity { angular: Vec3::new(1.0, -2.0, 0.5), linear: Vec3::new(0.3, 0.1, -0.7) };
        let f = Force { moment: Vec3::new(0.2, 0.4, -0.1), force: Vec3::new(-1.0, 2.0, 3.0) };
        let d = Vec3::new(0.1, -0.4, 0.9);
        assert!((v.dot(f) - v.moved(d).dot(f.moved(d))).abs() < 1e-12);
        let p = Vec3::new(-0.6, 0.2, 0.3);
        assert!(close(v.at(p), v.moved(d).at(p - d)));
    }

    #[test]
    fn a_matrix_moved_on_both_sides_gives_the_same_power() {
        let k = SpatialMatrix {
            aa: Mat3::from_cols(Vec3::new(2.0, 0.1, 0.3), Vec3::new(0.1, 1.0, 0.2), Vec3::new(0.3, 0.2, 3.0)),
            al: Mat3::from_cols(
                Vec3::new(0.5, 0.7, -0.1),
                Vec3::new(0.2, -0.3, 0.9),
                Vec3::new(0.4, 0.6, 0.8),
            ),
            la: Mat3::from_cols(
                Vec3::new(0.5, 0.2, 0.4),
                Vec3::new(0.7, -0.3, 0.6),
                Vec3::new(-0.1, 0.9, 0.8),
            ),
            ll: Mat3::from_diagonal(Vec3::new(4.0, 5.0, 6.0)),
        };
        let d = Vec3::new(0.3, -0.2, 0.5);
        // `moved(d)` puts the origin at +d, `rows_moved(d)` at −d: they cancel.
        let v = SpatialVelocity { angular: Vec3::new(0.4, 1.0, -0.6), linear: Vec3::new(1.0, 2.0, -0.5) };
        let about_here = v.dot(k.mul(v));
        let w = v.moved(-d);
        let about_there = w.dot(k.rows_moved(d).columns_moved(d).mul(w));
        assert!((about_here - about_there).abs() < 1e-12);
    }
}
