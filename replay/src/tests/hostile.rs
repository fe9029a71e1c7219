//! Damaged files, and files made to do damage.

use super::*;
use mcap::records::op;
use std::collections::BTreeSet;

fn recorded() -> Vec<u8> {
    let files = hand_archive("pinch_of_ours", "");
    let mut scenario = Scenario::with(hand_of(&files), 101);
    scenario.hand_files = Some(Arc::new(files));
    scenario.record().bytes
}

/// Numbers that look random and are the same every time.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }
}

#[test]
fn every_flipped_bit_is_refused() {
    let mut bytes = recorded();
    assert!(read(&bytes).is_ok());
    // Opcode, length, first and last bytes of every record of the file, and places in between.
    let mut places = BTreeSet::new();
    let mut kinds = BTreeSet::new();
    for frame in records::frames(&bytes).expect("frames") {
        kinds.insert(frame.opcode);
        let end = frame.start + frame.body.len();
        places.extend(frame.start - 9..(frame.start + 24).min(end));
        places.extend(end.saturating_sub(8)..end);
    }
    for kind in [
        op::HEADER,
        op::METADATA,
        op::ATTACHMENT,
        op::CHUNK,
        op::MESSAGE_INDEX,
        op::DATA_END,
        op::FOOTER,
        op::STATISTICS,
    ] {
        assert!(kinds.contains(&kind), "a record of kind {kind:#x}");
    }
    places.extend(0..8);
    places.extend(bytes.len() - 150..bytes.len());
    let signature = reader::find_signature(&bytes).expect("signed");
    places.extend(signature.start - 300..signature.end + 40);
    places.extend((0..bytes.len()).step_by(97));
    for (k, place) in places.into_iter().enumerate() {
        let bit = 1 << (k % 8);
        bytes[place] ^= bit;
        assert!(read(&bytes).is_err(), "bit {bit:#x} of byte {place} of {}", bytes.len());
        bytes[place] ^= bit;
    }
    assert!(read(&bytes).is_ok());
}

#[test]
fn every_cut_is_refused() {
    let bytes = recorded();
    let mut ends: BTreeSet<usize> = (0..200).chain(bytes.len() - 600..bytes.len()).collect();
    ends.extend((0..bytes.len()).step_by(131));
    ends.extend(
        records::frames(&bytes).expect("frames").iter().flat_map(|f| [f.start - 9, f.start + f.body.len()]),
    );
    ends.remove(&bytes.len());
    for end in ends {
        let refused = read(&bytes[..end]).expect_err("cut");
        let name = if end < mcap::MAGIC.len() { "not_a_replay" } else { "truncated" };
        assert_eq!(refused.name(), name, "cut at {end}: {refused}");
    }
    let longer = [bytes.as_slice(), b"x"].concat();
    assert_eq!(read(&longer).expect_err("more").name(), "chain_broken");
    let twice = [bytes.as_slice(), bytes.as_slice()].concat();
    assert_eq!(read(&twice).expect_err("more").name(), "chain_broken");
}

#[test]
fn other_files_are_not_replays() {
    for bytes in [&b""[..], b"hello", b"PK\x03\x04 an archive"] {
        assert_eq!(read(bytes).expect_err("no replay").name(), "not_a_replay");
    }
    let mut other = Vec::new();
    mcap::Writer::new(std::io::Cursor::new(&mut other)).expect("writer").finish().expect("finished");
    assert_eq!(read(&other).expect_err("no replay").name(), "not_a_replay");
}

#[test]
fn random_damage_never_brings_the_reader_down() {
    let bytes = recorded();
    let mut numbers = Numbers(1);
    let starts: Vec<usize> = records::frames(&bytes).expect("frames").iter().map(|f| f.start).collect();
    for _ in 0..1500 {
        let mut bytes = bytes.clone();
        for _ in 0..=numbers.below(4) {
            // Near the beginning of a record are the lengths; elsewhere anything may be.
            let near = starts[numbers.below(starts.len())] + numbers.below(40);
            let place =
                if numbers.below(3) == 0 { numbers.below(bytes.len()) } else { near.saturating_sub(9) };
            let place = place.min(bytes.len() - 1);
            bytes[place] = [0, 1, 0x7f, 0x80, 0xff, numbers.below(256) as u8][numbers.below(6)];
        }
        if numbers.below(4) == 0 {
            let (from, to) = (numbers.below(bytes.len()), numbers.below(bytes.len()));
            bytes.drain(from.min(to)..to.max(from));
        }
        // Refused, or by chance the same file. `read` would make a refusal of a panic.
        let _ = reader::read_all(&bytes);
    }
}

/// A file of these records.
fn file_of(records: &[(u8, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = mcap::MAGIC.to_vec();
    for (opcode, body) in records.iter().chain([&(op::FOOTER, vec![0; 20])]) {
        bytes.push(*opcode);
        bytes.extend((body.len() as u64).to_le_bytes());
        bytes.extend(body);
    }
    bytes.extend(mcap::MAGIC);
    bytes
}

fn chunk(uncompressed: u64, compression: &str, packed: u64, data: &[u8]) -> Vec<u8> {
    let mut body = vec![0; 16];
    body.extend(uncompressed.to_le_bytes());
    body.extend(0u32.to_le_bytes());
    body.extend((compression.len() as u32).to_le_bytes());
    body.extend(compression.as_bytes());
    body.extend(packed.to_le_bytes());
    body.extend(data);
    body
}

#[test]
fn claims_of_size_are_not_believed() {
    let message = |length: u64| [&[op::MESSAGE][..], &length.to_le_bytes(), &[0; 40]].concat();
    let inner = |length: u64| {
        let data = message(length);
        chunk(data.len() as u64, "", data.len() as u64, &data)
    };
    let cases = [
        (op::CHUNK, chunk(u64::MAX, "zstd", 4, b"bomb")),
        (op::CHUNK, chunk(1 << 40, "zstd", 4, b"bomb")),
        (op::CHUNK, chunk(100, "zstd", u64::MAX, b"bomb")),
        (op::CHUNK, chunk(100, "zstd", 4, b"bomb")),
        (op::CHUNK, chunk(100, "lz4", 4, b"bomb")),
        (op::CHUNK, chunk(100, "", 4, b"bomb")),
        (op::CHUNK, inner(u64::MAX)),
        (op::CHUNK, inner(1 << 62)),
        (op::CHUNK, inner(1 << 30)),
        (op::CHUNK, vec![0; 5]),
        (op::METADATA, u32::MAX.to_le_bytes().to_vec()),
        (op::METADATA, [&0u32.to_le_bytes()[..], &u32::MAX.to_le_bytes(), &[0; 9]].concat()),
        (op::ATTACHMENT, vec![]),
        (op::ATTACHMENT, vec![0xff; 30]),
        (op::ATTACHMENT, [&[0; 24][..], &u64::MAX.to_le_bytes()].concat()),
    ];
    for (k, (opcode, body)) in cases.into_iter().enumerate() {
        let refused = read(&file_of(&[(opcode, body)])).expect_err("hostile");
        assert_eq!(refused.name(), "chain_broken", "case {k}: {refused}");
    }
}

#[test]
fn a_bomb_is_not_unpacked() {
    // Fifty megabytes of zeros in a few kilobytes.
    let mut bomb = Vec::new();
    let options = mcap::WriteOptions::new().chunk_size(None).compression_threads(0);
    let mut out = options.create(std::io::Cursor::new(&mut bomb)).expect("writer");
    let id = out.add_channel(0, "/action", "json", &Default::default()).expect("channel");
    let header = mcap::records::MessageHeader { channel_id: id, sequence: 0, log_time: 0, publish_time: 0 };
    out.write_to_known_channel(&header, &vec![b'0'; 50 << 20]).expect("message");
    out.finish().expect("finished");
    drop(out);
    assert!(bomb.len() < 1 << 20);
    let refused = read(&bomb).expect_err("a bomb");
    assert_eq!(refused.name(), "chain_broken");
    assert!(refused.to_string().contains("allowed are"), "{refused}");
}
