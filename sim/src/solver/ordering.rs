//! The order in which the blocks of a symmetric sparse matrix are eliminated: minimum degree over the exact elimination
//! graph, kept as rows of bits. A heap's couplings change at every step, so that finding the order must be cheap.

const WORD: usize = u64::BITS as usize;

/// Order of elimination, and the blocks that each eliminated block couples.
#[derive(Clone, Debug, Default)]
pub(super) struct Ordering {
    /// Block eliminated k-th.
    pub(super) order: Vec<usize>,
    /// Inverse of `order`.
    pub(super) rank: Vec<usize>,
    /// Words in a row of `graph`.
    words: usize,
    /// Per block: its neighbours. For an eliminated block: the remaining blocks that its elimination coupled.
    graph: Vec<u64>,
    /// Per remaining block: rows that its elimination would touch.
    degree: Vec<u32>,
    /// The remaining blocks, ascending.
    left: Vec<usize>,
    row: Vec<u64>,
}

impl Ordering {
    /// Always eliminates the block that touches the fewest rows; ties go to the first. With `keep_last` the
    /// last block comes last.
    pub(super) fn find(&mut self, sizes: &[usize], pattern: &[(u32, u32)], keep_last: bool) {
        let n = sizes.len();
        self.words = n.div_ceil(WORD);
        self.graph.clear();
        self.graph.resize(n * self.words, 0);
        self.degree.clear();
        self.degree.resize(n, 0);
        for &(a, b) in pattern {
            for (a, b) in [(a as usize, b as usize), (b as usize, a as usize)] {
                self.graph[a * self.words + b / WORD] |= 1 << (b % WORD);
                self.degree[a] += sizes[b] as u32;
            }
        }
        self.order.clear();
        self.rank.clear();
        self.rank.resize(n, usize::MAX);
        self.left.clear();
        // Uncoupled blocks go first: most of a heap that flies apart.
        for block in 0..n {
            if self.degree[block] == 0 && !(keep_last && block + 1 == n) {
                self.append(block);
            } else {
                self.left.push(block);
            }
        }
        // No remaining block touches fewer rows than this.
        let mut bound = 0;
        while let Some(all_but_last) = self.left.len().checked_sub(1) {
            let among = if keep_last && all_but_last > 0 { all_but_last } else { all_but_last + 1 };
            let (mut least, mut place) = (u32::MAX, 0);
            for (k, &block) in self.left[..among].iter().enumerate() {
                if self.degree[block] < least {
                    (least, place) = (self.degree[block], k);
                    if least == bound {
                        break;
                    }
                }
            }
            let next = self.left.remove(place);
            self.append(next);
            bound = self.eliminate(next, sizes).min(least);
        }
    }

    /// Makes a block the next in the order.
    fn append(&mut self, block: usize) {
        self.rank[block] = self.order.len();
        self.order.push(block);
    }

    /// Couples the neighbours of a block with each other, and removes it from the graph. Returns the smallest
    /// degree of a neighbour.
    fn eliminate(&mut self, block: usize, sizes: &[usize]) -> u32 {
        let words = self.words;
        self.row.clear();
        self.row.extend_from_slice(&self.graph[block * words..][..words]);
        let mut least = u32::MAX;
        ones(&self.row).for_each(|i| {
            let own = &mut self.graph[i * words..][..words];
            own[block / WORD] &= !(1 << (block % WORD));
            let mut degree = self.degree[i] - sizes[block] as u32;
            for (w, (own, row)) in own.iter_mut().zip(&self.row).enumerate() {
                let mut fill = row & !*own;
                if i / WORD == w {
                    fill &= !(1 << (i % WORD));
                }
                *own |= fill;
                while fill != 0 {
                    degree += sizes[w * WORD + fill.trailing_zeros() as usize] as u32;
                    fill &= fill - 1;
                }
            }
            self.degree[i] = degree;
            least = least.min(degree);
        });
        least
    }

    /// The blocks below the diagonal in the column of a block, ascending by index.
    pub(super) fn below(&self, block: usize) -> impl Iterator<Item = usize> {
        ones(&self.graph[block * self.words..][..self.words])
    }
}

/// Indices of the set bits.
fn ones(row: &[u64]) -> impl Iterator<Item = usize> {
    row.iter().enumerate().flat_map(|(w, &word)| {
        let mut left = word;
        std::iter::from_fn(move || {
            let bit = left.trailing_zeros() as usize;
            (left != 0).then(|| {
                left &= left - 1;
                w * WORD + bit
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Textbook elimination, on sets.
    fn by_the_book(
        sizes: &[usize],
        pattern: &[(u32, u32)],
        keep_last: bool,
    ) -> (Vec<usize>, Vec<Vec<usize>>) {
        let n = sizes.len();
        let mut graph = vec![BTreeSet::new(); n];
        for &(a, b) in pattern {
            graph[a as usize].insert(b as usize);
            graph[b as usize].insert(a as usize);
        }
        let (mut order, mut below) = (Vec::new(), Vec::new());
        for k in 0..n {
            let left = (0..n).filter(|i| !order.contains(i) && (!keep_last || k + 1 == n || i + 1 < n));
            let touches = |i: &usize| graph[*i].iter().map(|j| sizes[*j]).sum::<usize>();
            let next = left.min_by_key(touches).expect("one is left");
            order.push(next);
            let neighbours = std::mem::take(&mut graph[next]);
            for &i in &neighbours {
                graph[i].extend(neighbours.iter().filter(|j| **j != i));
                graph[i].remove(&next);
            }
            below.push(neighbours.into_iter().collect());
        }
        (order, below)
    }

    #[test]
    fn blocks_are_eliminated_by_the_least_degree() {
        let mut seed = 3u64;
        let mut random = |below: usize| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as usize % below
        };
        let mut ordering = Ordering::default();
        // Less than one word of bits, one, and more, in one workspace.
        for n in [1, 7, 64, 65, 150, 30] {
            let sizes: Vec<usize> = (0..n).map(|_| [6, 6, 4, 3][random(4)]).collect();
            let mut pattern: Vec<(u32, u32)> =
                (0..2 * n).map(|_| (random(n) as u32, random(n) as u32)).filter(|(a, b)| a < b).collect();
            pattern.sort_unstable();
            pattern.dedup();
            for keep_last in [false, true] {
                ordering.find(&sizes, &pattern, keep_last);
                let (order, below) = by_the_book(&sizes, &pattern, keep_last);
                assert_eq!(ordering.order, order);
                for (k, (&block, below)) in order.iter().zip(&below).enumerate() {
                    assert_eq!(ordering.rank[block], k);
                    assert_eq!(&ordering.below(block).collect::<Vec<_>>(), below);
                }
            }
        }
    }
}
