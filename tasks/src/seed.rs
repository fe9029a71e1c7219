//! The seed of a run.

use hmac::{Hmac, KeyInit, Mac};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Whose scene run `k` of a task has, in a competition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Scenes {
    /// All teams have the same.
    #[default]
    Shared,
    /// Every team has its own, from the same distribution.
    PerTeam,
}

impl Scenes {
    /// The word in `competition.toml` and in messages.
    pub fn word(self) -> &'static str {
        match self {
            Scenes::Shared => "shared",
            Scenes::PerTeam => "per_team",
        }
    }
}

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

    /// Seed of a team's run `k` of a task: HMAC-SHA256(secret, task ‖ 0x00 ‖ little-endian k), and if every team has its own scenes,
    /// HMAC-SHA256(secret, task ‖ 0x00 ‖ little-endian k ‖ team). New in every run.
    pub fn for_run(secret: &[u8], scenes: Scenes, task: &str, k: u64, team: &str) -> Self {
        let mut mac = Hmac::<Sha256>::new_from_slice(secret).expect("HMAC takes keys of any length");
        mac.update(task.as_bytes());
        mac.update(&[0]);
        mac.update(&k.to_le_bytes());
        if scenes == Scenes::PerTeam {
            mac.update(team.as_bytes());
        }
        Seed(mac.finalize().into_bytes().into())
    }

    /// Lower-case hexadecimal, 64 digits.
    pub fn to_hex(&self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers are those of Python's `hmac.digest(bytes(range(32)), b"balls\0" + k.to_bytes(8, "little") + team, "sha256")`.
    #[test]
    fn the_seed_of_a_run_is_a_hash_of_secret_task_number_and_team() {
        let secret: Vec<u8> = (0..32).collect();
        let seed = |scenes, k, team| Seed::for_run(&secret, scenes, "balls", k, team).to_hex();
        for (scenes, team, expected) in [
            (Scenes::Shared, "crabs", "118d7e771edf436a3bc85a145a11d10711a4daad76ca9933e0026b2a97bdb0fd"),
            (Scenes::Shared, "Ørreds", "118d7e771edf436a3bc85a145a11d10711a4daad76ca9933e0026b2a97bdb0fd"),
            (Scenes::PerTeam, "crabs", "3be29f9d856d7b60d1a48022dc4e3b6276a4d5224d04d013c86109d6fe008e9e"),
            (Scenes::PerTeam, "Ørreds", "eea5fac9e6c80e888bf4cef75a5062009ab6746d3b40f093cf656a843f80969a"),
        ] {
            assert_eq!(seed(scenes, 3, team), expected, "{scenes:?} {team}");
            assert_ne!(seed(scenes, 4, team), expected, "{scenes:?} {team}");
        }
    }
}
