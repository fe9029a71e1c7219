//! Content of a closure's figure: panels of curves with their predictions.

use crate::view::View;

/// A figure: panels over one horizontal axis, as a rule of time.
#[derive(Clone, Debug, Default)]
pub(crate) struct Figure {
    pub(crate) title: String,
    /// Smaller lines below the title.
    pub(crate) notes: Vec<String>,
    /// Samples, s, or of what the horizontal axis has.
    pub(crate) time: Vec<f64>,
    /// Label of the horizontal axis, with its unit.
    pub(crate) across: &'static str,
    /// Vertical lines: time and label.
    pub(crate) marks: Vec<(f64, String)>,
    pub(crate) panels: Vec<Panel>,
    /// The hand itself, drawn before the panels, all at one scale.
    pub(crate) views: Vec<View>,
}

/// Curves on one pair of axes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Panel {
    pub(crate) title: String,
    /// Label of the vertical axis, with its unit. Panels with the same label share their range.
    pub(crate) axis: String,
    pub(crate) curves: Vec<Curve>,
}

/// A curve and its predicted end values.
#[derive(Clone, Debug, Default)]
pub(crate) struct Curve {
    pub(crate) name: String,
    /// One per time.
    pub(crate) values: Vec<f64>,
    /// Begin and end of a prediction, s, and its value.
    pub(crate) predicted: Vec<(f64, f64, f64)>,
}

/// The range of all panels with this axis, with a margin.
pub(crate) fn range(figure: &Figure, axis: &str) -> (f64, f64) {
    let mut low = f64::INFINITY;
    let mut high = f64::NEG_INFINITY;
    for panel in figure.panels.iter().filter(|p| p.axis == axis) {
        for curve in &panel.curves {
            let predicted = curve.predicted.iter().map(|p| p.2);
            for y in curve.values.iter().copied().chain(predicted).filter(|y| y.is_finite()) {
                low = low.min(y);
                high = high.max(y);
            }
        }
    }
    if low > high {
        return (0.0, 1.0);
    }
    let margin = 0.06 * (high - low).max(1e-6 * high.abs()).max(1e-9);
    (low - margin, high + margin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_shared_and_never_empty() {
        let curve = |y: f64| Curve { values: vec![0.0, y], ..Curve::default() };
        let panel =
            |axis: &str, y: f64| Panel { axis: axis.into(), curves: vec![curve(y)], ..Panel::default() };
        let figure =
            Figure { panels: vec![panel("a", 1.0), panel("a", -2.0), panel("b", 0.0)], ..Figure::default() };
        let (low, high) = range(&figure, "a");
        assert!(low < -2.0 && high > 1.0 && high < 1.5);
        let (low, high) = range(&figure, "b");
        assert!(low < high);
        assert_eq!(range(&figure, "c"), (0.0, 1.0));
    }
}
