//! Splits an MCAP file into records, within bounds: the file may come from anybody.

use crate::verify_error::VerifyError;
use mcap::MAGIC;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// Largest size of a file, bytes.
pub const FILE_BYTES: usize = 512 << 20;
/// Largest size of a chunk, compressed or not, bytes; those of the recorder have 256 KiB.
const CHUNK_BYTES: usize = 8 << 20;
/// Largest compression ratio of a chunk above [`RATIO_COUNTS_FROM`]; those of the recorder have about 10.
const CHUNK_RATIO: u64 = 200;
/// Smaller chunks may have any compression ratio, bytes.
const RATIO_COUNTS_FROM: u64 = 1 << 20;
/// Largest size of all uncompressed chunks together, bytes; ten minutes in which every body moves have 10⁸.
pub(crate) const UNPACKED_BYTES: u64 = 2 << 30;
/// Size of a record's opcode and length, bytes.
const PREFIX: usize = 9;

/// A record of the file, outside of chunks.
#[derive(Debug)]
pub(crate) struct Frame<'a> {
    /// CompetitionMode of the record.
    pub(crate) opcode: u8,
    /// Offset of the body.
    pub(crate) start: usize,
    /// The record without opcode and length.
    pub(crate) body: &'a [u8],
}

fn damaged(at: usize, what: impl ToString) -> VerifyError {
    VerifyError::ChainBroken(format!("the record at byte {at} is damaged: {}", what.to_string()))
}

/// All records from the first to the footer, which must be the end of the file.
pub(crate) fn frames(bytes: &[u8]) -> Result<Vec<Frame<'_>>, VerifyError> {
    if bytes.len() > FILE_BYTES {
        return Err(VerifyError::NotAReplay(format!("it has {} bytes, more than {FILE_BYTES}", bytes.len())));
    }
    if !bytes.starts_with(MAGIC) {
        return Err(VerifyError::NotAReplay("it is not an MCAP file: its first bytes differ".into()));
    }
    let cut =
        || VerifyError::Truncated(format!("the file ends at byte {} in the middle of a record", bytes.len()));
    let mut frames = Vec::new();
    let mut at = MAGIC.len();
    loop {
        let prefix = bytes.get(at..at + PREFIX).ok_or_else(cut)?;
        let opcode = prefix[0];
        let length = u64::from_le_bytes(prefix[1..].try_into().map_err(|_| cut())?);
        let length = usize::try_from(length).map_err(|_| cut())?;
        let start = at + PREFIX;
        let end = start.checked_add(length).ok_or_else(cut)?;
        let body = bytes.get(start..end).ok_or_else(cut)?;
        frames.push(Frame { opcode, start, body });
        at = end;
        if opcode == op::FOOTER {
            break;
        }
    }
    match &bytes[at..] {
        rest if rest == MAGIC => Ok(frames),
        rest if MAGIC.starts_with(rest) => Err(cut()),
        _ => Err(VerifyError::ChainBroken("there are bytes after the end of the file".into())),
    }
}

/// Uncompresses a chunk and calls `see` with its records. Returns its size.
pub(crate) fn each_of_chunk(
    frame: &Frame<'_>,
    see: &mut dyn FnMut(Record<'_>) -> Result<(), VerifyError>,
) -> Result<u64, VerifyError> {
    let failed = |error: mcap::McapError| damaged(frame.start, error);
    let Record::Chunk { header, data } = mcap::parse_record(frame.opcode, frame.body).map_err(failed)? else {
        return Err(damaged(frame.start, "not a chunk"));
    };
    let allowed =
        (data.len() as u64).saturating_mul(CHUNK_RATIO).max(RATIO_COUNTS_FROM).min(CHUNK_BYTES as u64);
    if header.uncompressed_size > allowed || data.len() > CHUNK_BYTES {
        let (size, packed) = (header.uncompressed_size, data.len());
        return Err(damaged(
            frame.start,
            format!("a chunk of {size} bytes in {packed}; allowed are {allowed}"),
        ));
    }
    // The chunk is uncompressed and its checksum compared before `see` gets the first record.
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(CHUNK_BYTES);
    let size = header.uncompressed_size;
    let mut reader = LinearReader::new_with_options(options);
    let mut prefix = [op::CHUNK; PREFIX];
    prefix[1..].copy_from_slice(&(frame.body.len() as u64).to_le_bytes());
    let input = [&prefix[..], frame.body].concat();
    let mut fed = 0;
    while let Some(event) = reader.next_event() {
        match event.map_err(failed)? {
            LinearReadEvent::ReadRequest(wanted) => {
                let give = wanted.min(input.len() - fed);
                reader.insert(give).copy_from_slice(&input[fed..fed + give]);
                reader.notify_read(give);
                fed += give;
            }
            LinearReadEvent::Record { data, opcode } => {
                // The recorder writes only schemas, channels and messages into chunks.
                if matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
                    see(mcap::parse_record(opcode, data).map_err(failed)?)?;
                }
            }
        }
    }
    Ok(size)
}

/// Name and content of an attachment. The parser of the library trusts the lengths in the file.
pub(crate) fn attachment<'a>(frame: &Frame<'a>) -> Result<(&'a str, &'a [u8]), VerifyError> {
    parse_attachment(frame.body)
        .ok_or_else(|| damaged(frame.start, "an attachment that does not fit its record"))
}

fn parse_attachment(body: &[u8]) -> Option<(&str, &[u8])> {
    // Two times, name, media type, data, checksum.
    let (name, rest) = text(body.get(16..)?)?;
    let (_, rest) = text(rest)?;
    let (length, rest) = rest.split_first_chunk::<8>()?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let (data, checksum) = rest.split_at_checked(length)?;
    (checksum.len() == 4).then_some((name, data))
}

fn text(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (text, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    Some((std::str::from_utf8(text).ok()?, rest))
}
