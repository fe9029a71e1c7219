//! Changes of inputs for tests: the same ones in every run.

/// A source of numbers that look random (xorshift).
pub struct Source(u64);

impl Source {
    /// A source; equal seeds give equal numbers.
    pub fn new(seed: u64) -> Self {
        Source(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A number below `end`, which is above 0.
    pub fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }
}

/// Texts that readers take wrongly most often.
const TEXTS: [&str; 14] = [
    "nan",
    "inf",
    "-1",
    "0",
    "1e308",
    "-1e-308",
    "18446744073709551616",
    "null",
    "{}",
    "[]",
    "\"\"",
    "\0",
    "\u{202e}",
    "\n",
];

/// Returns `input` with one to four changes; some take a part of `other`.
pub fn changed(input: &[u8], other: &[u8], source: &mut Source) -> Vec<u8> {
    let mut out = input.to_vec();
    for _ in 0..=source.below(4) {
        let at = source.below(out.len() + 1);
        let end = (at + source.below(16)).min(out.len());
        match source.below(7) {
            0 if at < out.len() => out[at] ^= 1 << source.below(8),
            1 if at < out.len() => out[at] = source.next() as u8,
            2 => drop(out.drain(at..end)),
            3 => drop(out.splice(at..at, out[at..end].to_vec())),
            4 => {
                let from = source.below(other.len() + 1);
                let to = (from + source.below(64)).min(other.len());
                drop(out.splice(at..end, other[from..to].to_vec()));
            }
            5 => {
                let text = TEXTS[source.below(TEXTS.len())];
                match number_at(&out, at) {
                    Some((from, to)) => drop(out.splice(from..to, text.bytes())),
                    None => drop(out.splice(at..at, text.bytes())),
                }
            }
            _ => out.truncate(at.max(out.len() / 2)),
        }
    }
    out
}

/// The first number at or after a place, as a range.
fn number_at(bytes: &[u8], at: usize) -> Option<(usize, usize)> {
    let from = (at..bytes.len()).find(|&k| bytes[k].is_ascii_digit())?;
    let part = |byte: u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'e');
    let to = (from..bytes.len()).find(|&k| !part(bytes[k])).unwrap_or(bytes.len());
    Some((from, to))
}
