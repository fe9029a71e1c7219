//! The hash chain over all messages that decide a score.

use sha2::{Digest, Sha256};

/// `c₀ = SHA-256("palmares replay 1" ‖ header)`, `c = SHA-256(c ‖ topic ‖ 0 ‖ message)` for every action, event,
/// hash and the outcome, in the order of the file. A `palmares.Hash` message carries the chain before itself, so
/// that a change is found within a hundred ticks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Chain([u8; 32]);

impl Chain {
    /// The start of the chain of a file with this header.
    pub(crate) fn start<'a>(header: impl Iterator<Item = (&'a String, &'a String)>) -> Self {
        let mut hash = Sha256::new();
        hash.update(b"palmares replay 1");
        for (key, value) in header {
            for text in [key, value] {
                hash.update((text.len() as u64).to_le_bytes());
                hash.update(text);
            }
        }
        Chain(hash.finalize().into())
    }

    /// Adds a message.
    pub(crate) fn extend(&mut self, topic: &str, message: &[u8]) {
        let mut hash = Sha256::new();
        hash.update(self.0);
        hash.update(topic);
        hash.update([0]);
        hash.update(message);
        self.0 = hash.finalize().into();
    }

    /// 64 hexadecimal digits.
    pub(crate) fn to_hex(&self) -> String {
        hex::encode(self.0)
    }
}
