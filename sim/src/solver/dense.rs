//! Kernels of the factorisation on small dense blocks, stored row by row.
//!
//! Bodies have six velocities, fingers four or three, a tendon is one row: kernels of these sizes are
//! unrolled. Every element is the same sum in the same order in every kernel.

/// Calls a kernel with a constant size for common sizes: `sized!(s, fixed::<S>(..), general)`.
macro_rules! sized {
    ($size:expr, $kernel:ident($($argument:expr),*), $general:expr) => {
        match $size {
            6 => $kernel::<6>($($argument),*),
            4 => $kernel::<4>($($argument),*),
            3 => $kernel::<3>($($argument),*),
            1 => $kernel::<1>($($argument),*),
            _ => $general,
        }
    };
}

/// `y −= L x` for a block below the diagonal.
#[inline]
pub(super) fn subtract_block(l: &[f64], x: &[f64], y: &mut [f64]) {
    #[inline(always)]
    fn rows<const S: usize>(l: &[f64], x: &[f64], y: &mut [f64]) {
        let (Some(x), rows) = (x.first_chunk::<S>(), l.as_chunks::<S>().0) else { return };
        for (y, row) in y.iter_mut().zip(rows) {
            let mut sum = 0.0;
            for k in 0..S {
                sum += row[k] * x[k];
            }
            *y -= sum;
        }
    }
    sized!(x.len(), rows(l, x, y), {
        for (y, row) in y.iter_mut().zip(l.chunks_exact(x.len())) {
            let mut sum = 0.0;
            for (a, b) in row.iter().zip(x) {
                sum += a * b;
            }
            *y -= sum;
        }
    })
}

/// `x −= Lᵀ y` for a block below the diagonal.
#[inline]
pub(super) fn subtract_transposed(l: &[f64], y: &[f64], x: &mut [f64]) {
    #[inline(always)]
    fn rows<const S: usize>(l: &[f64], y: &[f64], x: &mut [f64]) {
        let (Some(x), rows) = (x.first_chunk_mut::<S>(), l.as_chunks::<S>().0) else { return };
        let mut sum = *x;
        for (y, row) in y.iter().zip(rows) {
            for k in 0..S {
                sum[k] -= row[k] * y;
            }
        }
        *x = sum;
    }
    sized!(x.len(), rows(l, y, x), {
        for (y, row) in y.iter().zip(l.chunks_exact(x.len())) {
            for (x, l) in x.iter_mut().zip(row) {
                *x -= l * y;
            }
        }
    })
}

/// Cholesky of the lower half; the diagonal of the result holds reciprocals. False when a pivot is not positive.
#[inline]
pub(super) fn factor_diagonal(a: &mut [f64], s: usize) -> bool {
    #[inline(always)]
    fn rows<const S: usize>(a: &mut [f64]) -> bool {
        let Some(a) = a.as_chunks_mut::<S>().0.first_chunk_mut::<S>() else { return false };
        let mut c = [[0.0; S]; S];
        for j in 0..S {
            for i in j..S {
                c[j][i] = a[i][j];
            }
        }
        let done = if is_diagonal(&c) {
            (0..S).all(|k| scale_pivot(&mut c[k][k]))
        } else {
            pivot::<S, 0>(&mut c)
                && pivot::<S, 1>(&mut c)
                && pivot::<S, 2>(&mut c)
                && pivot::<S, 3>(&mut c)
                && pivot::<S, 4>(&mut c)
                && pivot::<S, 5>(&mut c)
        };
        for j in 0..S {
            for i in j..S {
                a[i][j] = c[j][i];
            }
        }
        done
    }
    sized!(s, rows(a), {
        for i in 0..s {
            let (above, row) = a.split_at_mut(i * s);
            for (j, upper) in above.chunks_exact(s).enumerate() {
                let mut x = row[j];
                for k in 0..j {
                    x -= row[k] * upper[k];
                }
                row[j] = x * upper[j];
            }
            let mut d = row[i];
            for &x in &row[..i] {
                d -= x * x;
            }
            if d.is_nan() || d <= 0.0 {
                return false;
            }
            row[i] = 1.0 / d.sqrt();
        }
        true
    })
}

/// Whether a matrix given by columns is diagonal, as for a ball without load: then no pivot depends on
/// another.
#[inline(always)]
fn is_diagonal<const S: usize>(c: &[[f64; S]; S]) -> bool {
    // A negative zero would not be preserved.
    (0..S).all(|j| c[j][j + 1..].iter().all(|x| x.to_bits() == 0))
}

/// Replaces a pivot by its reciprocal root; false if it is not positive.
#[inline(always)]
fn scale_pivot(d: &mut f64) -> bool {
    let positive = *d > 0.0;
    *d = 1.0 / d.sqrt();
    positive
}

/// The K-th pivot of a matrix given by columns: scales its column, and subtracts the column's square from the
/// rest. The following operations depend only on the next pivot.
#[inline(always)]
fn pivot<const S: usize, const K: usize>(c: &mut [[f64; S]; S]) -> bool {
    if K >= S {
        return true;
    }
    if !scale_pivot(&mut c[K][K]) {
        return false;
    }
    let scale = c[K][K];
    for i in K + 1..S {
        c[K][i] *= scale;
    }
    for j in K + 1..S {
        for i in j..S {
            c[j][i] -= c[K][i] * c[K][j];
        }
    }
    true
}

/// `x := L⁻¹ x`
#[inline]
pub(super) fn forward(l: &[f64], x: &mut [f64]) {
    #[inline(always)]
    fn rows<const S: usize>(l: &[f64], x: &mut [f64]) {
        let (Some(x), Some(l)) = (x.first_chunk_mut::<S>(), l.as_chunks::<S>().0.first_chunk::<S>()) else {
            return;
        };
        for i in 0..S {
            let mut y = x[i];
            for k in 0..i {
                y -= l[i][k] * x[k];
            }
            x[i] = y * l[i][i];
        }
    }
    sized!(x.len(), rows(l, x), {
        for (i, row) in l.chunks_exact(x.len()).enumerate() {
            let mut y = x[i];
            for k in 0..i {
                y -= row[k] * x[k];
            }
            x[i] = y * row[i];
        }
    })
}

/// `x := L⁻ᵀ x`
#[inline]
pub(super) fn backward(l: &[f64], x: &mut [f64]) {
    #[inline(always)]
    fn rows<const S: usize>(l: &[f64], x: &mut [f64]) {
        let (Some(x), Some(l)) = (x.first_chunk_mut::<S>(), l.as_chunks::<S>().0.first_chunk::<S>()) else {
            return;
        };
        for i in (0..S).rev() {
            let y = x[i] * l[i][i];
            x[i] = y;
            for k in 0..i {
                x[k] -= l[i][k] * y;
            }
        }
    }
    sized!(x.len(), rows(l, x), {
        for (i, row) in l.chunks_exact(x.len()).enumerate().rev() {
            let y = x[i] * row[i];
            x[i] = y;
            for k in 0..i {
                x[k] -= row[k] * y;
            }
        }
    })
}

/// `B := B L⁻ᵀ` for a block of m rows below the diagonal one, whose size is s.
#[inline]
pub(super) fn forward_block(l: &[f64], s: usize, block: &mut [f64], m: usize) {
    #[inline(always)]
    fn rows<const S: usize>(l: &[f64], block: &mut [f64], m: usize) {
        match m {
            6 => forward_columns::<6, S>(l, block),
            4 => forward_columns::<4, S>(l, block),
            3 => forward_columns::<3, S>(l, block),
            _ => {
                for row in block.as_chunks_mut::<S>().0 {
                    forward(l, row);
                }
            }
        }
    }
    sized!(s, rows(l, block, m), {
        for row in block.chunks_exact_mut(s) {
            forward(l, row);
        }
    })
}

/// Like [`forward_block`], with all M rows in parallel.
#[inline]
fn forward_columns<const M: usize, const S: usize>(l: &[f64], block: &mut [f64]) {
    let Some(l) = l.as_chunks::<S>().0.first_chunk::<S>() else { return };
    let Some(block) = block.as_chunks_mut::<S>().0.first_chunk_mut::<M>() else { return };
    let mut columns = [[0.0; M]; S];
    for c in 0..S {
        for r in 0..M {
            columns[c][r] = block[r][c];
        }
    }
    for c in 0..S {
        let mut x = columns[c];
        for k in 0..c {
            for r in 0..M {
                x[r] -= l[c][k] * columns[k][r];
            }
        }
        for r in 0..M {
            x[r] *= l[c][c];
        }
        columns[c] = x;
    }
    for r in 0..M {
        for c in 0..S {
            block[r][c] = columns[c][r];
        }
    }
}

/// The K columns of a block of N rows.
#[inline]
pub(super) fn columns<const N: usize, const K: usize>(block: &[f64]) -> [[f64; N]; K] {
    let mut columns = [[0.0; N]; K];
    for (i, row) in block.as_chunks::<K>().0.iter().enumerate().take(N) {
        for k in 0..K {
            columns[k][i] = row[k];
        }
    }
    columns
}

/// `C −= A Bᵀ`, with A by rows and B by columns.
#[inline]
pub(super) fn subtract_product<const N: usize, const K: usize>(c: &mut [f64], a: &[f64], b: &[[f64; N]; K]) {
    for (c, a) in c.as_chunks_mut::<N>().0.iter_mut().zip(a.as_chunks::<K>().0) {
        let mut row = *c;
        for p in 0..K {
            for j in 0..N {
                row[j] -= a[p] * b[p][j];
            }
        }
        *c = row;
    }
}

/// The lower half of `C −= B Bᵀ`, with B by columns; above the diagonal the result is undefined.
#[inline]
pub(super) fn subtract_square<const N: usize, const K: usize>(c: &mut [f64], b: &[[f64; N]; K]) {
    /// The first W elements of row i.
    #[inline(always)]
    fn part<const W: usize, const N: usize, const K: usize>(row: &mut [f64; N], b: &[[f64; N]; K], i: usize) {
        let Some(head) = row.first_chunk_mut::<W>() else { return };
        let mut sum = *head;
        for b in b {
            let x = b[i];
            for (sum, b) in sum.iter_mut().zip(b) {
                *sum -= x * b;
            }
        }
        *head = sum;
    }
    // Two at a time, as the processor does.
    for (i, row) in c.as_chunks_mut::<N>().0.iter_mut().enumerate().take(N) {
        match i / 2 {
            0 if N > 2 => part::<2, N, K>(row, b, i),
            1 if N > 4 => part::<4, N, K>(row, b, i),
            _ => part::<N, N, K>(row, b, i),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `A = B Bᵀ + s I` with numbers of a simple generator.
    fn positive(s: usize) -> Vec<f64> {
        let b = |i: usize, k: usize| ((7 * i + 3 * k + 1) % 11) as f64 / 11.0;
        let entry = |i: usize, j: usize| (0..s).map(|k| b(i, k) * b(j, k)).sum::<f64>();
        (0..s * s).map(|n| entry(n / s, n % s) + if n / s == n % s { s as f64 } else { 0.0 }).collect()
    }

    #[test]
    fn factor_forward_and_backward_solve_every_size() {
        for s in 1..=9 {
            let a = positive(s);
            let x: Vec<f64> = (0..s).map(|i| i as f64 - 1.5).collect();
            let mut y: Vec<f64> = (0..s).map(|i| (0..s).map(|j| a[i * s + j] * x[j]).sum()).collect();
            let mut l = a.clone();
            assert!(factor_diagonal(&mut l, s), "size {s}");
            forward(&l, &mut y);
            backward(&l, &mut y);
            for (y, x) in y.iter().zip(&x) {
                assert!((y - x).abs() < 1e-12, "size {s}: {y} for {x}");
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_reported() {
        for s in 1..=7 {
            let mut a = positive(s);
            a[s * s - 1] = -1.0;
            assert!(!factor_diagonal(&mut a, s), "size {s}");
        }
    }

    #[test]
    fn unrolled_kernels_compute_what_the_general_one_does() {
        for (rows, columns) in [(1, 6), (3, 4), (6, 6), (5, 2), (4, 3)] {
            let l: Vec<f64> = (0..rows * columns).map(|k| (k % 5) as f64 - 2.0).collect();
            let x: Vec<f64> = (0..columns).map(|k| 0.5 + k as f64).collect();
            let mut y = vec![1.0; rows];
            subtract_block(&l, &x, &mut y);
            for (i, y) in y.iter().enumerate() {
                let product: f64 = (0..columns).map(|k| l[i * columns + k] * x[k]).sum();
                assert!((y - (1.0 - product)).abs() < 1e-14);
            }
            let (up, mut down) = (vec![2.0; rows], x.clone());
            subtract_transposed(&l, &up, &mut down);
            for (k, down) in down.iter().enumerate() {
                let product: f64 = (0..rows).map(|i| 2.0 * l[i * columns + k]).sum();
                assert!((down - (x[k] - product)).abs() < 1e-14);
            }
        }
    }
}
