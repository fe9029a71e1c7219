//! The length of a tendon along a path, with its derivatives.

/// A length as a function of one coordinate, with its first two derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length {
    /// s, in the tendon's unit; 0 at coordinate 0, except for a table.
    pub value: f64,
    /// ds/dq: the moment arm.
    pub slope: f64,
    /// d²s/dq²
    pub curvature: f64,
}
