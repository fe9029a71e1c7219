//! Several files in one input, as text: a line `=== NAME` begins each. Bytes change more easily than in an archive, whose
//! compression and checksums hide the content.

use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Named inputs.
pub(crate) type Seeds = Vec<(String, Vec<u8>)>;

const MARK: &[u8] = b"=== ";

/// Joins files to an input.
pub(crate) fn joined(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut out = Vec::new();
    for (name, content) in files {
        out.extend_from_slice(MARK);
        out.extend_from_slice(name.as_bytes());
        out.push(b'\n');
        out.extend_from_slice(content);
        out.push(b'\n');
    }
    out
}

/// Splits an input into its files. Bytes before the first mark belong to none.
pub(crate) fn split(data: &[u8]) -> Vec<(String, &[u8])> {
    let begins: Vec<usize> = (0..data.len())
        .filter(|&at| data[at..].starts_with(MARK) && (at == 0 || data[at - 1] == b'\n'))
        .collect();
    let ends = begins.iter().skip(1).map(|&next| next - 1).chain([data.len()]);
    let file = |(&begin, end): (&usize, usize)| {
        let part = &data[begin + MARK.len()..end.max(begin + MARK.len())];
        let line = part.iter().position(|&byte| byte == b'\n').unwrap_or(part.len());
        let name = String::from_utf8_lossy(&part[..line]).into_owned();
        (name, part.get(line + 1..).unwrap_or_default())
    };
    begins.iter().zip(ends).map(file).collect()
}

/// An archive: the input itself if it begins as one, otherwise one of its files. `None` if these make no archive.
pub(crate) fn archive(data: &[u8]) -> Option<Vec<u8>> {
    if data.starts_with(b"PK") {
        return Some(data.to_vec());
    }
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for (name, content) in split(data) {
        zip.start_file(name, options).ok()?;
        zip.write_all(content).ok()?;
    }
    Some(zip.finish().ok()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_joined_and_split() {
        let files: [(&str, &[u8]); 3] = [("a", b"x\ny"), ("b", b""), ("c/d", b"\xff\0")];
        let text = joined(&files);
        let text = &text[..text.len() - 1];
        assert_eq!(split(text), files.map(|(name, content)| (name.to_owned(), content)));
        for bytes in [&b""[..], b"=== ", b"=== \n", b"=== a", b"x\n=== a\n=== b"] {
            split(bytes);
        }
        assert!(archive(text).is_some_and(|zip| zip.starts_with(b"PK")));
    }
}
