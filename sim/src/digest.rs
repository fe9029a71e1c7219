//! A 64-bit digest of a state: equal bits give equal digests on every machine.

use palmares_models::{Pose, Rotation, Vec3};

/// FNV-1a over 64-bit words with a final mix: small, and the same on every machine and in every version.
pub(crate) struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Digest(0xcbf2_9ce4_8422_2325)
    }
}

impl Digest {
    pub(crate) fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        self.0 ^= self.0 >> 29;
    }

    pub(crate) fn float(&mut self, x: f64) {
        self.word(x.to_bits());
    }

    pub(crate) fn floats(&mut self, xs: &[f64]) {
        for &x in xs {
            self.float(x);
        }
    }

    pub(crate) fn vector(&mut self, v: Vec3) {
        self.floats(&v.to_array());
    }

    pub(crate) fn pose(&mut self, pose: &Pose) {
        self.vector(pose.translation);
        let Rotation { x, y, z, w } = pose.rotation;
        self.floats(&[x, y, z, w]);
    }

    pub(crate) fn finish(self) -> u64 {
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }
}
