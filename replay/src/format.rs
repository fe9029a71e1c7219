//! Names of topics and records in a file.

/// Topic of [`crate::messages::ActionMessage`].
pub(crate) const ACTION: &str = "/action";
/// Topic of the referee's events.
pub(crate) const EVENT: &str = "/event";
/// Topic of [`crate::messages::HashMessage`].
pub(crate) const HASH: &str = "/hash";
/// Topic of the bodies' shapes.
pub(crate) const SCENE: &str = "/scene";
/// Topic of the bodies' poses.
pub(crate) const POSES: &str = "/tf";

/// Topic of the telemetry of the hand.
pub(crate) const TELEMETRY: &str = "/telemetry";

/// Name of the metadata record with the header.
pub(crate) const RUN_RECORD: &str = "palmares.run";
/// Name of the metadata record with the outcome.
pub(crate) const RESULT_RECORD: &str = "palmares.result";
/// Name of the metadata record with the signature.
pub(crate) const SIGNATURE_RECORD: &str = "palmares.signature";
/// Name of the metadata record with the hand's description.
pub(crate) const HAND_RECORD: &str = "palmares.hand";
/// Name of the metadata record with the scene's regions and the bodies' names.
pub(crate) const SCENE_RECORD: &str = "palmares.scene";
/// Hexadecimal digits of a signature.
pub(crate) const SIGNATURE_DIGITS: usize = 128;
/// Name of the attachment with a hand's files.
pub(crate) const HAND_FILES: &str = "hand.zip";

/// Ticks between two hashes of the state.
pub(crate) const HASH_EVERY: u64 = 100;
