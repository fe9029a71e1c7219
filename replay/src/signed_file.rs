//! A file that is hashed while it is written, so that it need not be read again for the signature.

use crate::format::SIGNATURE_DIGITS;
use crate::signature::Signer;
use mcap::records::op;
use sha2::{Digest, Sha256};
use std::cell::RefCell;
use std::fs::File;
use std::io::{BufWriter, Error, Result, Seek, SeekFrom, Write};
use std::rc::Rc;

/// Size of a record's opcode and length, bytes.
const RECORD_HEAD: usize = 9;

/// A finished file.
pub(crate) struct Written {
    /// 64 hexadecimal digits.
    pub(crate) sha256: String,
    /// Size of the file.
    pub(crate) bytes: u64,
}

#[derive(Debug)]
struct Inner {
    file: BufWriter<File>,
    /// Hash of all bytes before the tail.
    hash: Sha256,
    hashed: u64,
    /// Bytes since [`SignedFile::signature_follows`].
    tail: Option<Vec<u8>>,
}

/// The file: a handle for the MCAP writer, and one for the signature.
#[derive(Clone, Debug)]
pub(crate) struct SignedFile(Rc<RefCell<Inner>>);

impl SignedFile {
    pub(crate) fn new(file: File) -> Self {
        let (file, hash) = (BufWriter::new(file), Sha256::new());
        SignedFile(Rc::new(RefCell::new(Inner { file, hash, hashed: 0, tail: None })))
    }

    /// Announces that the next record is the one with the signature.
    pub(crate) fn signature_follows(&self) {
        self.0.borrow_mut().tail = Some(Vec::new());
    }

    /// Writes the signature, which covers every byte of the file, with zeros in its own place.
    pub(crate) fn sign(self, signer: &Signer) -> Result<Written> {
        let mut inner = self.0.borrow_mut();
        let Inner { file, hash, hashed, tail } = &mut *inner;
        let mut tail = tail.take().ok_or_else(|| Error::other("no record for the signature"))?;
        // The signature is the last value of the record, whose keys are sorted.
        let mut length = [0; 8];
        if tail.len() < RECORD_HEAD || tail[0] != op::METADATA {
            return Err(Error::other("the record of the signature is not where it should be"));
        }
        length.copy_from_slice(&tail[1..RECORD_HEAD]);
        let end =
            usize::try_from(u64::from_le_bytes(length)).map_err(Error::other)?.saturating_add(RECORD_HEAD);
        let place = end.saturating_sub(SIGNATURE_DIGITS)..end;
        if tail.get(place.clone()).is_none_or(|digits| digits.iter().any(|&digit| digit != b'0')) {
            return Err(Error::other("the place of the signature is not filled with zeros"));
        }
        let digest = |tail: &[u8]| hash.clone().chain_update(tail).finalize();
        let signature = signer.sign(&digest(&tail).into());
        tail[place.clone()].copy_from_slice(signature.as_bytes());
        file.flush()?;
        let file = file.get_mut();
        file.seek(SeekFrom::Start(*hashed + place.start as u64))?;
        file.write_all(signature.as_bytes())?;
        file.sync_all()?;
        Ok(Written { sha256: hex::encode(digest(&tail)), bytes: *hashed + tail.len() as u64 })
    }
}

impl Write for SignedFile {
    fn write(&mut self, buffer: &[u8]) -> Result<usize> {
        let Inner { file, hash, hashed, tail } = &mut *self.0.borrow_mut();
        let written = file.write(buffer)?;
        let new = &buffer[..written];
        match tail {
            Some(tail) => tail.extend_from_slice(new),
            None => {
                hash.update(new);
                *hashed += written as u64;
            }
        }
        Ok(written)
    }

    fn flush(&mut self) -> Result<()> {
        self.0.borrow_mut().file.flush()
    }
}
