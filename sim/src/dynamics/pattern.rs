//! Products with matrices of the hand's pattern: the base couples with everything, a finger with the base and itself.
//!
//! Products with zero are skipped: the sums have the same bits as those over whole rows.

use crate::model::Cluster;
use std::ops::Range;

/// Columns, besides the base's six, in which the rows of a cluster may differ from zero.
#[inline]
pub fn columns(clusters: &[Cluster], block: usize, n: usize) -> Range<usize> {
    if block == 0 { 6..n } else { clusters[block].dofs.clone() }
}

/// `Σ_j row_j x_j`, in order.
#[inline]
pub fn row_sum(row: &[f64], x: &[f64], columns: &Range<usize>) -> f64 {
    let mut sum = 0.0;
    for (a, b) in row[..6].iter().zip(&x[..6]) {
        sum += a * b;
    }
    for (a, b) in row[columns.clone()].iter().zip(&x[columns.clone()]) {
        sum += a * b;
    }
    sum
}

/// `Σ_j row_j x_j` as four partial sums: a fixed order that lets the processor overlap them.
#[inline]
pub fn row_sum_abreast(row: &[f64], x: &[f64], columns: &Range<usize>) -> f64 {
    let mut s = [0.0; 4];
    let (chunks, tail) = row.as_chunks::<4>();
    let (xs, x_tail) = x.as_chunks::<4>();
    let mut add = |part: Range<usize>| {
        for (a, b) in chunks[part.clone()].iter().zip(&xs[part]) {
            for k in 0..4 {
                s[k] += a[k] * b[k];
            }
        }
    };
    let base = chunks.len().min(2);
    let end = columns.end.div_ceil(4).min(chunks.len());
    add(0..base);
    add((columns.start / 4).clamp(base, end.max(base))..end.max(base));
    if columns.end > 4 * chunks.len() || chunks.len() < 2 {
        for (a, b) in tail.iter().zip(x_tail) {
            s[0] += a * b;
        }
    }
    (s[0] + s[1]) + (s[2] + s[3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaving_out_zeros_changes_no_bit() {
        for n in 6..30 {
            for start in 6..=n {
                for end in start..=n {
                    let value = |j: usize| libm::sin((j * j + 3 * n) as f64);
                    let held = |j: usize| j < 6 || (start..end).contains(&j);
                    let row: Vec<f64> = (0..n).map(|j| if held(j) { value(j) } else { 0.0 }).collect();
                    let x: Vec<f64> = (0..n).map(|j| value(j + 7)).collect();
                    let plain = row.iter().zip(&x).fold(0.0, |sum, (a, b)| sum + a * b);
                    assert_eq!(row_sum(&row, &x, &(start..end)), plain);
                    let whole = row_sum_abreast(&row, &x, &(6..n));
                    assert_eq!(row_sum_abreast(&row, &x, &(start..end)), whole);
                    assert!((whole - plain).abs() < 1e-13);
                }
            }
        }
    }
}
