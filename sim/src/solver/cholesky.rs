//! Block-sparse Cholesky factorisation, min-degree ordered over bodies.
//!
//! The matrix couples bodies that touch; almost all blocks are zero. An optional last block may be negative
//! definite, which is how tendons enter: `[H Rᵀ; R −K⁻¹]` is quasi-definite and has the same solution as
//! `H + Rᵀ K R` without filling it (Vanderbei, *Symmetric Quasidefinite Matrices*, 1995).

use std::ops::Range;

use super::dense::{
    backward, columns, factor_diagonal, forward, forward_block, subtract_block, subtract_product,
    subtract_square, subtract_transposed,
};
use super::ordering::Ordering;

const NONE: u32 = u32::MAX;

/// Flag in a block's entry: the stored block is its transpose.
const TRANSPOSED: u32 = 1 << 31;

/// Symbolic and numeric factorisation; reused while the pattern stays.
#[derive(Clone, Debug, Default)]
pub struct BlockCholesky {
    sizes: Vec<usize>,
    pattern: Vec<(u32, u32)>,
    negative_last: bool,
    ordering: Ordering,
    /// First row of each block of the right-hand side in elimination order.
    row: Vec<u32>,
    /// The block columns in elimination order.
    columns: Vec<Column>,
    /// The blocks below the diagonal, column by column, by ascending rank.
    below: Vec<Below>,
    /// For every coupled pair of blocks: their offset, and whether the transpose is stored. Other entries are
    /// left over from earlier patterns: clearing them would take longer than ordering a heap.
    place: Vec<u32>,
    data: Vec<f64>,
    transposed: Vec<f64>,
    /// Ranks of the blocks below the diagonal of the present column.
    ranks: Vec<usize>,
    /// Multiply-adds of a factorisation and of the ordering before it.
    work: u64,
}

/// A block column.
#[derive(Clone, Debug)]
struct Column {
    size: usize,
    /// First row in elimination order.
    start: usize,
    /// Offset of the diagonal block in `data`.
    diagonal: usize,
    /// Indices in the list of blocks below the diagonal.
    below: Range<usize>,
}

/// A block below the diagonal.
#[derive(Clone, Copy, Debug)]
struct Below {
    /// Rank of its rows.
    rank: usize,
    /// Number of its rows.
    size: usize,
    /// First row in elimination order.
    start: usize,
    /// Offset in `data`.
    offset: usize,
}

/// Address of a block's element (i, j): `offset + i · row + j · column`.
#[derive(Clone, Copy, Debug)]
pub struct BlockAt {
    /// Offset of element (0, 0).
    pub offset: usize,
    /// Step to the next row.
    pub row: usize,
    /// Step to the next column.
    pub column: usize,
}

impl BlockCholesky {
    /// Orders the blocks. `pattern` lists coupled blocks, ascending and without repeats; with `negative_last`
    /// the last block is eliminated last and is negative definite.
    pub fn analyse(&mut self, sizes: &[usize], pattern: &[(u32, u32)], negative_last: bool) {
        if self.sizes == sizes && self.pattern == pattern && self.negative_last == negative_last {
            return;
        }
        self.sizes.clear();
        self.sizes.extend_from_slice(sizes);
        self.pattern.clear();
        self.pattern.extend_from_slice(pattern);
        self.negative_last = negative_last;
        self.ordering.find(sizes, pattern, negative_last);
        self.place_blocks(sizes.len());
    }

    fn place_blocks(&mut self, n: usize) {
        self.columns.clear();
        self.below.clear();
        let mut row = 0;
        for &block in &self.ordering.order {
            let size = self.sizes[block];
            self.columns.push(Column { size, start: row, diagonal: 0, below: 0..0 });
            row += size;
        }
        self.place.resize(self.place.len().max(n * n), NONE);
        let mut offset = 0;
        self.work = (n * n) as u64;
        for k in 0..n {
            let block = self.ordering.order[k];
            self.ranks.clear();
            self.ordering.below(block).for_each(|other| self.ranks.push(self.ordering.rank[other]));
            self.ranks.sort_unstable();
            let (size, first) = (self.columns[k].size, self.below.len());
            self.columns[k].diagonal = offset;
            self.place[block * n + block] = offset as u32;
            offset += size * size;
            for &rank in &self.ranks {
                let (column, other) = (&self.columns[rank], self.ordering.order[rank]);
                let (rows, start) = (column.size, column.start);
                self.below.push(Below { rank, size: rows, start, offset });
                self.place[other * n + block] = offset as u32;
                self.place[block * n + other] = offset as u32 | TRANSPOSED;
                offset += rows * size;
            }
            self.columns[k].below = first..self.below.len();
            let rows: usize = self.below[first..].iter().map(|below| below.size).sum();
            self.work += (size * size * size / 3 + size * size * rows + size * rows * rows / 2) as u64;
        }
        self.row.clear();
        for block in 0..n {
            let start = self.columns[self.ordering.rank[block]].start;
            self.row.extend((start..start + self.sizes[block]).map(|row| row as u32));
        }
        self.data.resize(offset, 0.0);
    }

    /// Multiply-adds of a factorisation.
    pub fn work(&self) -> u64 {
        self.work
    }

    /// Sets every stored element to zero.
    pub fn clear(&mut self) {
        self.data.fill(0.0);
    }

    /// Address of block (a, b); it must be on the diagonal or in the pattern.
    #[inline]
    pub fn at(&self, a: usize, b: usize) -> BlockAt {
        let place = self.place[a * self.sizes.len() + b];
        let offset = (place & !TRANSPOSED) as usize;
        if place & TRANSPOSED == 0 {
            BlockAt { offset, row: self.sizes[b], column: 1 }
        } else {
            BlockAt { offset, row: 1, column: self.sizes[a] }
        }
    }

    /// The stored elements, addressed through [`BlockCholesky::at`]. Only the lower half of diagonal blocks
    /// is used.
    #[inline]
    pub fn data(&mut self) -> &mut [f64] {
        &mut self.data
    }

    /// A block of six rows on the diagonal; `None` for another size.
    #[inline]
    pub fn square(&mut self, block: usize) -> Option<&mut [[f64; 6]; 6]> {
        let at = self.at(block, block);
        if at.row != 6 {
            return None;
        }
        self.data[at.offset..].as_chunks_mut().0.first_chunk_mut()
    }

    /// Factorises in place. False when a pivot is not positive.
    pub fn factor(&mut self) -> bool {
        let n = self.columns.len();
        for k in 0..n {
            let Column { size: s, diagonal: d, below: Range { start, end }, .. } = self.columns[k].clone();
            if self.negative_last && k + 1 == n {
                for x in &mut self.data[d..d + s * s] {
                    *x = -*x;
                }
            }
            if !factor_diagonal(&mut self.data[d..d + s * s], s) {
                return false;
            }
            for b in &self.below[start..end] {
                let (diagonal, block) = split(&mut self.data, d, s * s, b.offset, b.size * s);
                forward_block(diagonal, s, block, b.size);
            }
            for first in start..end {
                match (self.below[first].size, s) {
                    (6, 6) => self.eliminate::<6, 6>(first, end),
                    (6, 4) => self.eliminate::<6, 4>(first, end),
                    (6, 3) => self.eliminate::<6, 3>(first, end),
                    (4, 6) => self.eliminate::<4, 6>(first, end),
                    (4, 4) => self.eliminate::<4, 4>(first, end),
                    (4, 3) => self.eliminate::<4, 3>(first, end),
                    (3, 6) => self.eliminate::<3, 6>(first, end),
                    (3, 4) => self.eliminate::<3, 4>(first, end),
                    (1, 6) => self.eliminate::<1, 6>(first, end),
                    (1, 4) => self.eliminate::<1, 4>(first, end),
                    (1, 3) => self.eliminate::<1, 3>(first, end),
                    (_, s) => self.eliminate_any(s, first, end),
                }
            }
        }
        true
    }

    /// Offset of the block in this row and column, by their ranks, on or below the diagonal.
    #[inline]
    fn offset(&self, row: usize, column: usize) -> usize {
        let order = &self.ordering.order;
        self.place[order[row] * order.len() + order[column]] as usize
    }

    /// Subtracts the product of a column's block at index `first` with itself and the blocks after it, up to
    /// `end`, from the rest of the matrix; the block is N x K.
    #[inline]
    fn eliminate<const N: usize, const K: usize>(&mut self, first: usize, end: usize) {
        let Some((b, rest)) = self.below[first..end].split_first() else { return };
        let by_columns = columns::<N, K>(&self.data[b.offset..b.offset + N * K]);
        let square = self.columns[b.rank].diagonal;
        subtract_square(&mut self.data[square..square + N * N], &by_columns);
        for a in rest {
            let to = self.offset(a.rank, b.rank);
            let (a, c) = split(&mut self.data, a.offset, a.size * K, to, a.size * N);
            subtract_product(c, a, &by_columns);
        }
    }

    /// Like [`Self::eliminate`], for a column of any size.
    fn eliminate_any(&mut self, s: usize, first: usize, end: usize) {
        let Some((b, _)) = self.below[first..end].split_first() else { return };
        self.transposed.clear();
        for column in 0..s {
            self.transposed.extend((0..b.size).map(|row| self.data[b.offset + row * s + column]));
        }
        for a in &self.below[first..end] {
            let to = self.offset(a.rank, b.rank);
            let (a, c) = split(&mut self.data, a.offset, a.size * s, to, a.size * b.size);
            for (c, a) in c.chunks_exact_mut(b.size).zip(a.chunks_exact(s)) {
                for (a, b) in a.iter().zip(self.transposed.chunks_exact(b.size)) {
                    for (c, b) in c.iter_mut().zip(b) {
                        *c -= a * b;
                    }
                }
            }
        }
    }

    /// Solves in place for a right-hand side given block after block in the order of `sizes`.
    pub fn solve(&self, x: &mut [f64], scratch: &mut Vec<f64>) {
        scratch.resize(x.len(), 0.0);
        for (&row, x) in self.row.iter().zip(x.iter()) {
            scratch[row as usize] = *x;
        }
        for column in &self.columns {
            let (s, at, d) = (column.size, column.start, column.diagonal);
            let (head, rest) = scratch.split_at_mut(at + s);
            let y = &mut head[at..];
            forward(&self.data[d..d + s * s], y);
            for b in &self.below[column.below.clone()] {
                let to = b.start - at - s;
                subtract_block(&self.data[b.offset..b.offset + b.size * s], y, &mut rest[to..to + b.size]);
            }
        }
        if let (true, Some(last)) = (self.negative_last, self.columns.last()) {
            for y in &mut scratch[last.start..] {
                *y = -*y;
            }
        }
        for column in self.columns.iter().rev() {
            let (s, at, d) = (column.size, column.start, column.diagonal);
            let (head, rest) = scratch.split_at_mut(at + s);
            let y = &mut head[at..];
            for b in &self.below[column.below.clone()] {
                let from = b.start - at - s;
                let block = &self.data[b.offset..b.offset + b.size * s];
                subtract_transposed(block, &rest[from..from + b.size], y);
            }
            backward(&self.data[d..d + s * s], y);
        }
        for (&row, x) in self.row.iter().zip(x.iter_mut()) {
            *x = scratch[row as usize];
        }
    }
}

/// Two disjoint ranges of one vector, the second mutable.
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
