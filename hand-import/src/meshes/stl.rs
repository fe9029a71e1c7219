//! STL, binary and as text.

use palmares_models::Vec3;

use super::text::Corners;
use crate::source::limits;

/// Bytes of the header of a binary file with its number of triangles, and of a triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// The triangles. CAD programs begin binary files with `solid` too, and write text in capital letters or with accents.
pub(super) fn stl(bytes: &[u8]) -> Result<Corners, String> {
    let stated = bytes.get(80..HEADER).and_then(|b| <[u8; 4]>::try_from(b).ok()).map(u32::from_le_bytes);
    let body = bytes.len().saturating_sub(HEADER);
    let size = stated.and_then(|count| usize::try_from(count).ok()?.checked_mul(TRIANGLE));
    let start = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes).trim_ascii_start();
    let solid = start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // Up to two bytes after the last triangle are padding.
    let binary = size.is_some_and(|size| size <= body && (!solid || body - size <= 2));
    if solid && !binary {
        return text(&String::from_utf8_lossy(start));
    }
    let (Some(count), Some(size)) = (stated, size) else {
        return Err(format!("is no STL file: it has {} bytes", bytes.len()));
    };
    if size > body {
        return Err(format!(
            "is cut off: it states {count} triangles of {TRIANGLE} bytes, but {body} bytes follow"
        ));
    }
    let most = limits().mesh_vertices;
    if size / TRIANGLE * 3 > most {
        return Err(format!("has {count} triangles; the limit is {}", most / 3));
    }
    let corner = |bytes: &[u8]| {
        let x =
            |k: usize| f64::from(f32::from_le_bytes([bytes[k], bytes[k + 1], bytes[k + 2], bytes[k + 3]]));
        Vec3::new(x(0), x(4), x(8))
    };
    // After the normal.
    let triangle = |t: &[u8]| [corner(&t[12..24]), corner(&t[24..36]), corner(&t[36..48])];
    Ok(bytes[HEADER..HEADER + size].chunks_exact(TRIANGLE).map(triangle).collect())
}

/// The corners of each `outer loop`.
fn text(text: &str) -> Result<Corners, String> {
    let mut corners = Vec::new();
    let mut face: Vec<Vec3> = Vec::new();
    for (k, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let Some(first) = words.next() else { continue };
        if first.eq_ignore_ascii_case("vertex") {
            let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
            let [x, y, z] = *numbers.as_slice() else {
                return Err(format!("has a vertex in line {} that is not three numbers", k + 1));
            };
            face.push(Vec3::new(x, y, z));
        } else if first.eq_ignore_ascii_case("endloop") {
            let [a, b, c] = *face.as_slice() else {
                return Err(format!("has a face of {} corners in line {}", face.len(), k + 1));
            };
            corners.push([a, b, c]);
            face.clear();
        }
    }
    if !face.is_empty() {
        return Err("is cut off in a face".to_owned());
    }
    Ok(corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACE: &str = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1e0 0 0\n  vertex 0 1 0\n endloop\nendfacet\n";

    fn binary(header: &str) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        bytes.resize(80, b' ');
        bytes.extend(1_u32.to_le_bytes());
        for x in [0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            bytes.extend(x.to_le_bytes());
        }
        bytes.extend([0, 0]);
        bytes
    }

    #[test]
    fn text_and_binary_files_give_the_same_triangles() {
        let wanted = [[Vec3::ZERO, Vec3::X, Vec3::Y]];
        let solid = format!("solid part\n{FACE}endsolid part\n");
        let latin: Vec<u8> =
            solid.replace("part", "sch#ssel").bytes().map(|b| if b == b'#' { 0xfc } else { b }).collect();
        let padded = [binary("solid by CAD"), vec![0; 2]].concat();
        for bytes in [
            solid.clone().into_bytes(),
            solid.to_uppercase().into_bytes(),
            solid.replace('\n', "\r\n").into_bytes(),
            format!("\u{feff}\n {solid}").into_bytes(),
            latin,
            binary("made by a program"),
            binary("solid by CAD"),
            padded,
            [binary("with a trailer"), vec![0; 200]].concat(),
        ] {
            assert_eq!(stl(&bytes).expect("STL"), wanted, "{}", String::from_utf8_lossy(&bytes));
        }
        assert_eq!(stl(format!("{solid}{solid}").as_bytes()).expect("two solids").len(), 2);
    }

    #[test]
    fn faults_are_named() {
        let cut = binary("x");
        assert!(stl(&cut[..100]).expect_err("short").contains("states 1 triangles"));
        assert!(stl(b"").expect_err("empty").contains("0 bytes"));
        let four = FACE.replace("vertex 0 1 0", "vertex 0 1 0\nvertex 1 1 0");
        assert!(stl(format!("solid\n{four}").as_bytes()).expect_err("four").contains("4 corners in line"));
        assert!(stl(b"solid\nvertex 0 x 0\n").expect_err("word").contains("line 2"));
        let many = [vec![b' '; 80], u32::MAX.to_le_bytes().to_vec(), vec![0; 100]].concat();
        assert!(stl(&many).expect_err("many").contains("cut off"));
    }
}
