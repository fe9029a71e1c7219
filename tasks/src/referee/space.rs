//! Boxes along the axes of a frame.

/// Lowest and highest corner of a box, m.
pub(crate) type Corners = ([f64; 3], [f64; 3]);

/// Whether a point is in a box with these corners, its surface included.
pub(crate) fn contains((low, high): Corners, p: [f64; 3]) -> bool {
    (0..3).all(|k| p[k] >= low[k] && p[k] <= high[k])
}

/// Distance of a point from a box, m; 0 inside.
pub(crate) fn away((low, high): Corners, p: [f64; 3]) -> f64 {
    let beyond = |k: usize| (low[k] - p[k]).max(p[k] - high[k]).max(0.0);
    (0..3).map(|k| beyond(k) * beyond(k)).sum::<f64>().sqrt()
}
