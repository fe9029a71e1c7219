//! Writes replays again with changes, as a forger does. For tests.

use crate::chain::Chain;
use crate::format::{ACTION, EVENT, HASH, POSES, RESULT_RECORD, RUN_RECORD, SIGNATURE_RECORD, TELEMETRY};
use crate::signature::Signer;
use crate::{reader, records};
use mcap::records::{MessageHeader, Metadata, Record, op};
use std::collections::BTreeMap;
use std::io::Cursor;

/// Returns what replaces a message, a value of the header or the `outcome`, given its topic or the record's name and its text.
pub type Change = dyn Fn(&str, &str) -> String;

/// Writes a replay again with changed messages and signs it; `honest` also computes the chain again.
pub fn rewritten(bytes: &[u8], change: &Change, honest: bool, signer: &Signer) -> Vec<u8> {
    written(bytes, change, honest, true, signer)
}

/// Writes a replay in the form of programs that had no telemetry.
pub fn earlier(bytes: &[u8], signer: &Signer) -> Vec<u8> {
    written(bytes, &|_: &str, text: &str| text.to_owned(), true, false, signer)
}

fn written(bytes: &[u8], change: &Change, honest: bool, telemetry: bool, signer: &Signer) -> Vec<u8> {
    let options = mcap::WriteOptions::new().calculate_data_section_crc(false).compression_threads(0);
    let mut out = options.create(Cursor::new(Vec::new())).expect("writer");
    let (mut topics, mut schemas) = (BTreeMap::new(), BTreeMap::new());
    let mut chain = None;
    for frame in records::frames(bytes).expect("frames") {
        match frame.opcode {
            op::METADATA => {
                let Ok(Record::Metadata(mut metadata)) = mcap::parse_record(frame.opcode, frame.body) else {
                    panic!("metadata")
                };
                match metadata.name.as_str() {
                    RUN_RECORD => {
                        for value in metadata.metadata.values_mut() {
                            *value = change(RUN_RECORD, value);
                        }
                        chain = Some(Chain::start(metadata.metadata.iter()));
                    }
                    RESULT_RECORD => {
                        let outcome = change(RESULT_RECORD, &metadata.metadata["outcome"]);
                        chain.as_mut().expect("header").extend(RESULT_RECORD, outcome.as_bytes());
                        metadata.metadata.insert("outcome".into(), outcome);
                    }
                    SIGNATURE_RECORD => {
                        let mut put = |key: &str, value| metadata.metadata.insert(key.into(), value);
                        put("signature", "0".repeat(128));
                        put("public_key", signer.public().to_string());
                        if honest {
                            put("chain", chain.as_ref().expect("header").to_hex());
                        }
                    }
                    _ if !telemetry => continue,
                    _ => {}
                }
                let Metadata { name, metadata } = metadata;
                out.write_metadata(&Metadata { name, metadata }).expect("metadata");
            }
            op::CHUNK => drop(
                records::each_of_chunk(&frame, &mut |record| {
                    match record {
                        Record::Schema { header, data } => {
                            let id = out.add_schema(&header.name, &header.encoding, &data).expect("schema");
                            schemas.insert(header.id, id);
                        }
                        Record::Channel(channel) if channel.topic == TELEMETRY && !telemetry => {}
                        Record::Channel(channel) => {
                            let schema = schemas[&channel.schema_id];
                            let id = out.add_channel(
                                schema,
                                &channel.topic,
                                &channel.message_encoding,
                                &BTreeMap::new(),
                            );
                            topics.insert(channel.id, (channel.topic.clone(), id.expect("channel")));
                        }
                        Record::Message { header, data } => {
                            let Some((topic, id)) = topics.get(&header.channel_id) else { return Ok(()) };
                            let header = MessageHeader { channel_id: *id, ..header };
                            if [POSES, TELEMETRY].contains(&topic.as_str()) {
                                out.write_to_known_channel(&header, &data).expect("message");
                                return Ok(());
                            }
                            let mut text = change(topic, std::str::from_utf8(&data).expect("JSON"));
                            let chain = chain.as_mut().expect("header");
                            if topic == HASH && honest {
                                let mut hash: serde_json::Value = serde_json::from_str(&text).expect("JSON");
                                hash["chain"] = chain.to_hex().into();
                                text = hash.to_string();
                            }
                            if [ACTION, EVENT, HASH].contains(&topic.as_str()) {
                                chain.extend(topic, text.as_bytes());
                            }
                            out.write_to_known_channel(&header, text.as_bytes()).expect("message");
                        }
                        _ => {}
                    }
                    Ok(())
                })
                .expect("chunk"),
            ),
            _ => {}
        }
    }
    out.finish().expect("finished");
    signed(out.into_inner().into_inner(), signer)
}

/// Replaces the signature.
fn signed(mut bytes: Vec<u8>, signer: &Signer) -> Vec<u8> {
    let place = reader::find_signature(&bytes).expect("a place");
    bytes[place.clone()].fill(b'0');
    let signature = signer.sign(&<sha2::Sha256 as sha2::Digest>::digest(&bytes).into());
    bytes[place].copy_from_slice(signature.as_bytes());
    bytes
}
