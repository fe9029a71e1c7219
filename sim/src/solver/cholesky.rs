//! Block-sparse Cholesky factorisation, min-degree ordered over bodies.
//!
//! The matrix couples bodies that touch; almost all blocks are zero. An optional last block may be negative
//! definite, which is how tendons enter: `[H Rᵀ; R −K⁻¹]` is quasi-definite and has the same solution as
//! `H + Rᵀ K R` without filling it (Vanderbei, *Symmetric Quasidefinite Matrices*, 1995).

const NONE: u32 = u32::MAX;

/// Symbolic and numeric factorisation; re-used while the pattern stays.
#[derive(Clone, Debug, Default)]
pub struct BlockCholesky {
    sizes: Vec<usize>,
    pattern: Vec<(u32, u32)>,
    negative_last: bool,
    /// Block eliminated k-th.
    order: Vec<usize>,
    /// Inverse of `order`.
    rank: Vec<usize>,
    /// First row of the k-th eliminated block, in elimination order.
    start: Vec<usize>,
    /// Size of the k-th eliminated block.
    size: Vec<usize>,
    /// Rows below the k-th diagonal block: ranks, ascending.
    below: Vec<Vec<usize>>,
    /// Offset of block (row rank, column rank) in `data`.
    offset: Vec<u32>,
    data: Vec<f64>,
    transposed: Vec<f64>,
    adjacency: Vec<bool>,
}

/// Where a block's element (i, j) stands: `offset + i · row + j · column`.
#[derive(Clone, Copy, Debug)]
pub struct BlockAt {
    /// Of element (0, 0).
    pub offset: usize,
    /// Step to the next row.
    pub row: usize,
    /// Step to the next column.
    pub column: usize,
}

impl BlockCholesky {
    /// Orders the blocks. `pattern` lists coupled blocks, ascending and without repeats; with
    /// `negative_last` the last block is eliminated last and taken as negative definite.
    pub fn analyse(&mut self, sizes: &[usize], pattern: &[(u32, u32)], negative_last: bool) {
        if self.sizes == sizes && self.pattern == pattern && self.negative_last == negative_last {
            return;
        }
        self.sizes.clear();
        self.sizes.extend_from_slice(sizes);
        self.pattern.clear();
        self.pattern.extend_from_slice(pattern);
        self.negative_last = negative_last;
        let n = sizes.len();
        self.adjacency.clear();
        self.adjacency.resize(n * n, false);
        for &(a, b) in pattern {
            self.adjacency[a as usize * n + b as usize] = true;
            self.adjacency[b as usize * n + a as usize] = true;
        }
        self.order.clear();
        self.rank.clear();
        self.rank.resize(n, usize::MAX);
        self.below.resize(n, Vec::new());
        for k in 0..n {
            let next = self.min_degree(k);
            self.rank[next] = k;
            self.order.push(next);
            self.below[k].clear();
            for i in 0..n {
                if self.rank[i] == usize::MAX && self.adjacency[next * n + i] {
                    self.below[k].push(i);
                }
            }
            let (below, adjacency) = (&self.below[k], &mut self.adjacency);
            for &i in below {
                for &j in below {
                    adjacency[i * n + j] = i != j;
                }
            }
        }
        self.place_blocks(n);
    }

    /// The block left whose elimination touches the fewest rows; ties go to the first.
    fn min_degree(&self, eliminated: usize) -> usize {
        let n = self.sizes.len();
        let last = usize::from(self.negative_last && eliminated + 1 < n);
        let mut best = (usize::MAX, 0);
        for i in 0..n - last {
            if self.rank[i] != usize::MAX {
                continue;
            }
            let mut degree = 0;
            for j in 0..n {
                if self.rank[j] == usize::MAX && self.adjacency[i * n + j] {
                    degree += self.sizes[j];
                }
            }
            if degree < best.0 {
                best = (degree, i);
            }
        }
        best.1
    }

    fn place_blocks(&mut self, n: usize) {
        self.offset.clear();
        self.offset.resize(n * n, NONE);
        self.start.clear();
        self.size.clear();
        let (mut row, mut offset) = (0, 0);
        for k in 0..n {
            let s = self.sizes[self.order[k]];
            self.start.push(row);
            self.size.push(s);
            row += s;
            for i in &mut self.below[k] {
                *i = self.rank[*i];
            }
            self.below[k].sort_unstable();
            self.offset[k * n + k] = offset as u32;
            offset += s * s;
            for &i in &self.below[k] {
                self.offset[i * n + k] = offset as u32;
                offset += self.sizes[self.order[i]] * s;
            }
        }
        self.data.clear();
        self.data.resize(offset, 0.0);
    }

    /// Sets every stored element to zero.
    pub fn clear(&mut self) {
        self.data.fill(0.0);
    }

    /// Where block (a, b) stands; it must be on the diagonal or in the pattern.
    #[inline]
    pub fn at(&self, a: usize, b: usize) -> BlockAt {
        let n = self.sizes.len();
        let (ra, rb) = (self.rank[a], self.rank[b]);
        if ra >= rb {
            BlockAt { offset: self.offset[ra * n + rb] as usize, row: self.sizes[b], column: 1 }
        } else {
            BlockAt { offset: self.offset[rb * n + ra] as usize, row: 1, column: self.sizes[a] }
        }
    }

    /// The stored elements, addressed through [`BlockCholesky::at`]. Of diagonal blocks the lower half counts.
    #[inline]
    pub fn data(&mut self) -> &mut [f64] {
        &mut self.data
    }

    /// Factorises in place. False when a pivot is not positive.
    pub fn factor(&mut self) -> bool {
        let n = self.sizes.len();
        for k in 0..n {
            let s = self.size[k];
            let d = self.offset[k * n + k] as usize;
            if self.negative_last && k + 1 == n {
                for x in &mut self.data[d..d + s * s] {
                    *x = -*x;
                }
            }
            if !factor_diagonal(&mut self.data[d..d + s * s], s) {
                return false;
            }
            for &i in &self.below[k] {
                let o = self.offset[i * n + k] as usize;
                let m = self.size[i];
                let (diagonal, block) = split(&mut self.data, d, s * s, o, m * s);
                forward_block(diagonal, s, block, m);
            }
            for (position, &j) in self.below[k].iter().enumerate() {
                let (oj, nj) = (self.offset[j * n + k] as usize, self.size[j]);
                transpose(&self.data[oj..oj + nj * s], nj, s, &mut self.transposed);
                for &i in &self.below[k][position..] {
                    let (oi, mi) = (self.offset[i * n + k] as usize, self.size[i]);
                    let oc = self.offset[i * n + j] as usize;
                    let (a, c) = split(&mut self.data, oi, mi * s, oc, mi * nj);
                    subtract_product(c, a, &self.transposed, mi, nj, s);
                }
            }
        }
        true
    }

    /// Solves in place for a right-hand side given block after block in the order of `sizes`.
    pub fn solve(&self, x: &mut [f64], scratch: &mut Vec<f64>) {
        let n = self.sizes.len();
        scratch.resize(x.len(), 0.0);
        let mut from = 0;
        for b in 0..n {
            let (to, s) = (self.start[self.rank[b]], self.sizes[b]);
            scratch[to..to + s].copy_from_slice(&x[from..from + s]);
            from += s;
        }
        for k in 0..n {
            let (s, at) = (self.size[k], self.start[k]);
            let d = self.offset[k * n + k] as usize;
            forward(&self.data[d..d + s * s], s, &mut scratch[at..at + s]);
            let (done, rest) = scratch.split_at_mut(at + s);
            let y = &done[at..];
            for &i in &self.below[k] {
                let o = self.offset[i * n + k] as usize;
                let (m, to) = (self.size[i], self.start[i] - at - s);
                subtract_block(&self.data[o..o + m * s], y, &mut rest[to..to + m]);
            }
        }
        if self.negative_last {
            let (s, at) = (self.size[n - 1], self.start[n - 1]);
            for y in &mut scratch[at..at + s] {
                *y = -*y;
            }
        }
        for k in (0..n).rev() {
            let (s, at) = (self.size[k], self.start[k]);
            let (head, rest) = scratch.split_at_mut(at + s);
            let y = &mut head[at..];
            for &i in &self.below[k] {
                let o = self.offset[i * n + k] as usize;
                let (m, from) = (self.size[i], self.start[i] - at - s);
                subtract_transposed(&self.data[o..o + m * s], &rest[from..from + m], y);
            }
            let d = self.offset[k * n + k] as usize;
            backward(&self.data[d..d + s * s], s, y);
        }
        let mut to = 0;
        for b in 0..n {
            let (from, s) = (self.start[self.rank[b]], self.sizes[b]);
            x[to..to + s].copy_from_slice(&scratch[from..from + s]);
            to += s;
        }
    }
}

/// `y −= L x` for a block below the diagonal; the common widths are unrolled.
#[inline]
fn subtract_block(l: &[f64], x: &[f64], y: &mut [f64]) {
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
    match x.len() {
        6 => rows::<6>(l, x, y),
        4 => rows::<4>(l, x, y),
        3 => rows::<3>(l, x, y),
        s => {
            for (y, row) in y.iter_mut().zip(l.chunks_exact(s)) {
                let mut sum = 0.0;
                for (a, b) in row.iter().zip(x) {
                    sum += a * b;
                }
                *y -= sum;
            }
        }
    }
}

/// `x −= Lᵀ y` for a block below the diagonal.
#[inline]
fn subtract_transposed(l: &[f64], y: &[f64], x: &mut [f64]) {
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
    match x.len() {
        6 => rows::<6>(l, y, x),
        4 => rows::<4>(l, y, x),
        3 => rows::<3>(l, y, x),
        s => {
            for (y, row) in y.iter().zip(l.chunks_exact(s)) {
                for (x, l) in x.iter_mut().zip(row) {
                    *x -= l * y;
                }
            }
        }
    }
}

/// Two disjoint ranges of one vector, mutable the second.
#[inline]
fn split(data: &mut [f64], a: usize, la: usize, b: usize, lb: usize) -> (&[f64], &mut [f64]) {
    if a < b {
        let (head, tail) = data.split_at_mut(b);
        (&head[a..a + la], &mut tail[..lb])
    } else {
        let (head, tail) = data.split_at_mut(a);
        (&tail[..la], &mut head[b..b + lb])
    }
}

/// Dense Cholesky of the lower half; the diagonal of the result holds reciprocals.
#[inline]
fn factor_diagonal(a: &mut [f64], s: usize) -> bool {
    match s {
        6 => factor_rows::<6>(a.as_chunks_mut().0),
        4 => factor_rows::<4>(a.as_chunks_mut().0),
        3 => factor_rows::<3>(a.as_chunks_mut().0),
        _ => {
            for i in 0..s {
                let (above, row) = a.split_at_mut(i * s);
                if !factor_row(above.chunks_exact(s), row, i) {
                    return false;
                }
            }
            true
        }
    }
}

/// As [`factor_diagonal`], of a size known to the compiler.
#[inline]
fn factor_rows<const S: usize>(a: &mut [[f64; S]]) -> bool {
    for i in 0..S {
        let (above, row) = a.split_at_mut(i);
        if !factor_row(above.iter().map(|r| r.as_slice()), &mut row[0], i) {
            return false;
        }
    }
    true
}

/// Turns row i of the matrix into row i of the factor, given the rows above it.
#[inline(always)]
fn factor_row<'a>(above: impl Iterator<Item = &'a [f64]>, row: &mut [f64], i: usize) -> bool {
    for (j, upper) in above.enumerate() {
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
    true
}

/// `x := L⁻¹ x`
#[inline]
fn forward(l: &[f64], s: usize, x: &mut [f64]) {
    match s {
        6 => forward_rows::<6>(l.as_chunks().0, x),
        4 => forward_rows::<4>(l.as_chunks().0, x),
        3 => forward_rows::<3>(l.as_chunks().0, x),
        _ => {
            for (i, row) in l.chunks_exact(s).enumerate() {
                forward_row(row, x, i);
            }
        }
    }
}

/// `B := B L⁻ᵀ` for a block of m rows below the diagonal one.
#[inline]
fn forward_block(l: &[f64], s: usize, block: &mut [f64], m: usize) {
    match (m, s) {
        (6, 6) => forward_columns::<6, 6>(l, block),
        (6, 4) => forward_columns::<6, 4>(l, block),
        (4, 6) => forward_columns::<4, 6>(l, block),
        _ => {
            for row in block.chunks_exact_mut(s) {
                forward(l, s, row);
            }
        }
    }
}

/// As [`forward_block`], all M rows abreast.
#[inline]
fn forward_columns<const M: usize, const S: usize>(l: &[f64], block: &mut [f64]) {
    let (l, _) = l.as_chunks::<S>();
    let (block, _) = block.as_chunks_mut::<S>();
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

#[inline]
fn forward_rows<const S: usize>(l: &[[f64; S]], x: &mut [f64]) {
    let (x, _) = x.split_at_mut(S);
    for (i, row) in l.iter().enumerate().take(S) {
        forward_row(row, x, i);
    }
}

#[inline(always)]
fn forward_row(row: &[f64], x: &mut [f64], i: usize) {
    let mut y = x[i];
    for k in 0..i {
        y -= row[k] * x[k];
    }
    x[i] = y * row[i];
}

/// `x := L⁻ᵀ x`
#[inline]
fn backward(l: &[f64], s: usize, x: &mut [f64]) {
    for i in (0..s).rev() {
        let y = x[i] * l[i * s + i];
        x[i] = y;
        for k in 0..i {
            x[k] -= l[i * s + k] * y;
        }
    }
}

#[inline]
fn transpose(a: &[f64], rows: usize, columns: usize, out: &mut Vec<f64>) {
    out.resize(rows * columns, 0.0);
    for i in 0..rows {
        for j in 0..columns {
            out[j * rows + i] = a[i * columns + j];
        }
    }
}

/// `c −= a · b` with a (m x k), b (k x n); the common sizes are unrolled.
#[inline]
fn subtract_product(c: &mut [f64], a: &[f64], b: &[f64], m: usize, n: usize, k: usize) {
    match (n, k) {
        (6, 6) => product::<6, 6>(c, a, b, m),
        (6, 4) => product::<6, 4>(c, a, b, m),
        (6, 3) => product::<6, 3>(c, a, b, m),
        (4, 6) => product::<4, 6>(c, a, b, m),
        (4, 4) => product::<4, 4>(c, a, b, m),
        (1, 6) => product::<1, 6>(c, a, b, m),
        (1, 4) => product::<1, 4>(c, a, b, m),
        _ => {
            for i in 0..m {
                for p in 0..k {
                    let x = a[i * k + p];
                    for j in 0..n {
                        c[i * n + j] -= x * b[p * n + j];
                    }
                }
            }
        }
    }
}

#[inline]
fn product<const N: usize, const K: usize>(c: &mut [f64], a: &[f64], b: &[f64], m: usize) {
    let (b, _) = b.as_chunks::<N>();
    let (a, _) = a.as_chunks::<K>();
    let (c, _) = c.as_chunks_mut::<N>();
    for i in 0..m {
        let mut row = c[i];
        for p in 0..K {
            let x = a[i][p];
            for j in 0..N {
                row[j] -= x * b[p][j];
            }
        }
        c[i] = row;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A random sparse block matrix with a negative last block, against dense Gaussian elimination.
    #[test]
    fn solves_like_a_dense_solver() {
        let sizes = [6, 3, 4, 4, 6, 6, 2];
        let pattern = [(0, 1), (0, 2), (0, 3), (0, 4), (1, 6), (2, 4), (2, 6), (3, 6), (4, 5)];
        let n: usize = sizes.iter().sum();
        let starts: Vec<usize> = sizes.iter().scan(0, |at, s| Some(std::mem::replace(at, *at + s))).collect();
        let mut seed = 7u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut dense = vec![0.0; n * n];
        let mut sparse = BlockCholesky::default();
        sparse.analyse(&sizes, &pattern, true);
        sparse.clear();
        let diagonal = (0..sizes.len()).map(|b| (b as u32, b as u32));
        for (a, b) in pattern.into_iter().chain(diagonal) {
            let (a, b) = (a as usize, b as usize);
            let at = sparse.at(a, b);
            for i in 0..sizes[a] {
                for j in 0..sizes[b] {
                    if a == b && j > i {
                        continue;
                    }
                    let sign = if a == 6 { -1.0 } else { 1.0 };
                    let x = random() + if a == b && i == j { 20.0 * sign } else { 0.0 };
                    dense[(starts[a] + i) * n + starts[b] + j] = x;
                    dense[(starts[b] + j) * n + starts[a] + i] = x;
                    sparse.data()[at.offset + i * at.row + j * at.column] = x;
                }
            }
        }
        let expected: Vec<f64> = (0..n).map(|_| random()).collect();
        let mut x: Vec<f64> = (0..n).map(|i| (0..n).map(|j| dense[i * n + j] * expected[j]).sum()).collect();
        assert!(sparse.factor());
        sparse.solve(&mut x, &mut Vec::new());
        for (a, b) in x.iter().zip(&expected) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn an_indefinite_block_is_refused() {
        let mut matrix = BlockCholesky::default();
        matrix.analyse(&[2], &[], false);
        matrix.clear();
        matrix.data().copy_from_slice(&[1.0, 0.0, 2.0, 1.0]);
        assert!(!matrix.factor());
    }
}
