//! Lists of numbers.

/// Numbers that are separated by spaces; `None` if one is no finite number.
pub(crate) fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace().map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect()
}
