//! The seed of a run.

use hmac::{Hmac, KeyInit, Mac};
use sha2::{Digest, Sha256};

/// 32 bytes that determine a run's scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seed(pub [u8; 32]);

impl Seed {
    /// The seed that a practice client requests: SHA-256("palmares practice seed" ‖ little-endian number).
    pub fn from_u64(number: u64) -> Self {
        let mut hash = Sha256::new();
        hash.update(b"palmares practice seed");
        hash.update(number.to_le_bytes());
        Seed(hash.finalize().into())
    }

    /// Seed of run `k` of a task: HMAC-SHA256(secret, task ‖ 0x00 ‖ little-endian k). The same for every
    /// team, new in every run.
    pub fn for_run(secret: &[u8], task: &str, k: u64) -> Self {
        let mut mac = Hmac::<Sha256>::new_from_slice(secret).expect("HMAC takes keys of any length");
        mac.update(task.as_bytes());
        mac.update(&[0]);
        mac.update(&k.to_le_bytes());
        Seed(mac.finalize().into_bytes().into())
    }

    /// Lower-case hexadecimal, 64 digits.
    pub fn to_hex(&self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}
