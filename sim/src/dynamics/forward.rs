//! Accelerations: `M v̇ = τ − c`, solved from the fingertips to the base.

/// Solves `M x = b` for the coordinates from `first` on; those before it are fixed. `b` becomes x, the lower
/// triangle of M its factor `Lᵀ D L` (Featherstone 2008, table 6.3). From the last row to the first there is
/// no fill-in: entries that no path to the base couples stay zero and are skipped. False if M is not positive
/// definite.
pub fn accelerations(m: &mut [f64], first: usize, b: &mut [f64]) -> bool {
    let n = b.len();
    for k in (first..n).rev() {
        let (above, row) = m.split_at_mut(k * n);
        let row = &mut row[..=k];
        let (d, x) = (row[k], b[k]);
        // Rejects zero, negative and NaN.
        if !(d > 0.0 && d.is_finite()) {
            return false;
        }
        let inverse = 1.0 / d;
        for i in (first..k).rev() {
            if row[i] != 0.0 {
                let factor = row[i] * inverse;
                for (to, x) in above[i * n + first..=i * n + i].iter_mut().zip(&row[first..=i]) {
                    *to -= factor * x;
                }
                row[i] = factor;
                b[i] -= factor * x;
            }
        }
        b[k] = x * inverse;
    }
    for k in first + 1..n {
        let mut x = b[k];
        for (l, known) in m[k * n + first..k * n + k].iter().zip(&b[first..k]) {
            x -= l * known;
        }
        b[k] = x;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive definite matrix, two branches on a base of two, and a product with it.
    fn example(x: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = x.len();
        let other_branches = |i: usize, j: usize| i >= 2 && j >= 2 && (i < 4) != (j < 4);
        let value = |i: usize, j: usize| match (i == j, other_branches(i, j)) {
            (true, _) => 3.0 + i as f64,
            (_, true) => 0.0,
            _ => libm::cos((i + j) as f64),
        };
        let m: Vec<f64> = (0..n * n).map(|k| value(k / n, k % n)).collect();
        let b = m.chunks(n).map(|row| row.iter().zip(x).map(|(m, x)| m * x).sum()).collect();
        (m, b)
    }

    #[test]
    fn accelerations_solve_the_equations_of_motion() {
        let x = [1.0, -2.0, 0.5, 3.0, -1.5, 0.25];
        let (mut m, mut b) = example(&x);
        assert!(accelerations(&mut m, 0, &mut b));
        assert!(b.iter().zip(x).all(|(b, x)| (b - x).abs() < 1e-14), "{b:?}");
    }

    #[test]
    fn what_is_held_takes_no_part() {
        let x = [0.0, 0.0, 0.5, 3.0, -1.5, 0.25];
        let (mut m, mut b) = example(&x);
        assert!(accelerations(&mut m, 2, &mut b));
        assert!(b[2..].iter().zip(&x[2..]).all(|(b, x)| (b - x).abs() < 1e-14), "{b:?}");
    }

    #[test]
    fn a_massless_coordinate_is_refused() {
        let (mut m, mut b) = example(&[1.0; 6]);
        m[14] = 0.0;
        assert!(!accelerations(&mut m, 0, &mut b));
    }
}
