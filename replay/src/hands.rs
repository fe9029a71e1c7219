//! The hand of a replay: a built-in one, or the attached one.

use crate::format::HAND_FILES;
use crate::header::Header;
use crate::verify_error::VerifyError;
use palmares_models::hand::Hand;
use palmares_models::read::{self, Files, LoadOptions};
use std::path::Path;
use std::sync::Arc;

/// The hand of the run.
pub(crate) fn hand(header: &Header, files: Option<&[u8]>) -> Result<Arc<Hand>, VerifyError> {
    let hand = match (header.hand_attached, files) {
        (true, Some(files)) => Arc::new(unpacked(files)?),
        (true, None) => return Err(VerifyError::OtherHand("the hand's files are not attached".into())),
        (false, _) => Hand::builtin(&header.hand).ok_or_else(|| {
            VerifyError::OtherHand(format!(
                "this program has no hand `{}`, and it is not attached",
                header.hand
            ))
        })?,
    };
    let found = hand.content_hash();
    if found != header.hand_hash {
        return Err(VerifyError::OtherHand(format!(
            "the hand `{}` is another one here: its hash is {found}, recorded was {}",
            header.hand, header.hand_hash
        )));
    }
    Ok(hand)
}

/// The hand in an archive.
pub(crate) fn unpacked(files: &[u8]) -> Result<Hand, VerifyError> {
    let failed =
        |error: &dyn ToString| VerifyError::OtherHand(format!("the attached hand: {}", error.to_string()));
    let options = LoadOptions::default();
    let files = Files::archive(Path::new(HAND_FILES), files, &options.limits).map_err(|e| failed(&e))?;
    let loaded = read::from_files(files, None, &options).map_err(|e| failed(&e))?;
    Ok(loaded.hand)
}
