//! Hands that come with the program.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use crate::hand::Hand;
use crate::read::{self, LoadOptions};

/// Embedded, so that the program runs from anywhere: name, URDF, settings.
const FILES: [(&str, &str, &str); 3] = [
    ("softhand", include_str!("../hands/softhand/hand.urdf"), include_str!("../hands/softhand/hand.toml")),
    ("reflex", include_str!("../hands/reflex/hand.urdf"), include_str!("../hands/reflex/hand.toml")),
    ("pinch", include_str!("../hands/pinch/hand.urdf"), include_str!("../hands/pinch/hand.toml")),
];

/// All hands that come with the program, loaded once.
///
/// # Panics
/// Never in a build whose tests pass: the files are part of the program, and a test loads them all.
pub fn builtin_hands() -> &'static [Arc<Hand>] {
    static HANDS: OnceLock<Vec<Arc<Hand>>> = OnceLock::new();
    HANDS.get_or_init(|| {
        FILES
            .iter()
            .map(|(name, urdf, settings)| {
                let urdf_file = format!("hands/{name}/hand.urdf");
                let settings_file = format!("hands/{name}/hand.toml");
                let loaded = read::from_text(
                    (Path::new(&urdf_file), urdf),
                    Some((Path::new(&settings_file), settings)),
                    None,
                    &LoadOptions::default(),
                );
                match loaded {
                    Ok(loaded) => Arc::new(loaded.hand),
                    Err(error) => panic!("embedded hand: {error}"),
                }
            })
            .collect()
    })
}

impl Hand {
    /// The hand of that name that comes with the program.
    pub fn builtin(name: &str) -> Option<Arc<Hand>> {
        builtin_hands().iter().find(|hand| hand.name == name).cloned()
    }
}
