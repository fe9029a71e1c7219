//! Text formats of meshes: OBJ, OFF, Klamp't's `.tri`, and plain faces of Open Inventor.
//!
//! The OBJ parser of mesh-loader refuses published files whose parts share their vertices.

use palmares_models::Vec3;

/// Triangles by their corners.
pub(super) type Corners = Vec<[Vec3; 3]>;

/// Wavefront OBJ: the lines `v` and `f`; everything else is look. A negative index counts from the last vertex back.
pub(super) fn obj(text: &str) -> Result<Corners, String> {
    let (mut points, mut corners) = (Vec::new(), Vec::new());
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        // A line goes on after a backslash.
        let mut joined = line.to_owned();
        while let Some(first) = joined.trim_end().strip_suffix('\\') {
            let Some(more) = lines.next() else { break };
            joined = format!("{first} {more}");
        }
        let mut words = joined.split('#').next().unwrap_or_default().split_whitespace();
        match words.next() {
            Some("v") => points.extend(self::points(&mut words, 1)?),
            Some("f") => {
                let index = |word: &str| -> Result<usize, String> {
                    let number: Option<i64> = word.split('/').next().and_then(|first| first.parse().ok());
                    let from = number.map(|n| if n < 0 { points.len() as i64 + n } else { n - 1 });
                    let from = from.and_then(|from| usize::try_from(from).ok());
                    from.ok_or_else(|| {
                        format!("has a face with the index '{word}'; valid: 1 and more, or -1 and less")
                    })
                };
                let face: Vec<usize> = words.map(index).collect::<Result<_, _>>()?;
                fan(&face, &points, &mut corners)?;
            }
            _ => {}
        }
    }
    Ok(corners)
}

/// Object File Format: counts, vertices, faces.
pub(super) fn off(text: &str) -> Result<Corners, String> {
    let mut words = words(text);
    let first = words.next().ok_or("is empty")?;
    if !first.ends_with("OFF") {
        return Err("does not begin with OFF".to_owned());
    }
    let (vertices, faces) = (count(&mut words)?, count(&mut words)?);
    let _edges = count(&mut words)?;
    let points = points(&mut words, vertices)?;
    let mut corners = Vec::new();
    for _ in 0..faces {
        let n = count(&mut words)?;
        let face: Vec<usize> = (0..n).map(|_| count(&mut words)).collect::<Result<_, _>>()?;
        fan(&face, &points, &mut corners)?;
    }
    Ok(corners)
}

/// Number of vertices, vertices, number of triangles, triangles.
pub(super) fn tri(text: &str) -> Result<Corners, String> {
    let mut words = words(text);
    let vertices = count(&mut words)?;
    let points = points(&mut words, vertices)?;
    let mut corners = Vec::new();
    for _ in 0..count(&mut words)? {
        let face = [count(&mut words)?, count(&mut words)?, count(&mut words)?];
        fan(&face, &points, &mut corners)?;
    }
    Ok(corners)
}

/// Open Inventor and VRML as text: `IndexedFaceSet` over the last `Coordinate3`. A file that moves or scales its parts, or
/// has other shapes, is not read.
pub(super) fn inventor(text: &str) -> Result<Corners, String> {
    const MOVES: [&str; 9] = [
        "Transform",
        "Translation",
        "Rotation",
        "RotationXYZ",
        "Scale",
        "MatrixTransform",
        "ScaleFactor",
        "Units",
        "USE",
    ];
    const SHAPES: [&str; 6] = ["Cube", "Sphere", "Cylinder", "Cone", "IndexedTriangleStripSet", "QuadMesh"];
    if !text.starts_with("#Inventor") && !text.starts_with("#VRML V1") {
        return Err("is no Open Inventor file as text".to_owned());
    }
    if text.lines().next().is_some_and(|line| line.contains("binary")) {
        return Err("is a binary Open Inventor file, which is not read; save it as STL or OBJ".to_owned());
    }
    let plain: String = text.lines().map(|line| line.split('#').next().unwrap_or_default()).fold(
        String::with_capacity(text.len()),
        |mut all, line| {
            all.push_str(line);
            all.push('\n');
            all
        },
    );
    let separators = |c: char| c.is_whitespace() || c == ',';
    let spaced = plain.replace('[', " [ ").replace(']', " ] ").replace('{', " { ").replace('}', " } ");
    let mut words = spaced.split(separators).filter(|word| !word.is_empty());
    let (mut vertices, mut corners) = (Vec::new(), Vec::new());
    while let Some(word) = words.next() {
        if MOVES.contains(&word) || SHAPES.contains(&word) {
            return Err(format!("has a {word}, which is not read; save it as STL or OBJ"));
        }
        match word {
            "point" => {
                let list = list(&mut words)?;
                vertices = list
                    .chunks_exact(3)
                    .map(|p| Some(Vec3::new(p[0].parse().ok()?, p[1].parse().ok()?, p[2].parse().ok()?)))
                    .collect::<Option<Vec<Vec3>>>()
                    .ok_or("has a point that is no number")?;
            }
            // A `FaceSet` has its vertices in order: the number of each face.
            "numVertices" => {
                let mut first = 0;
                for word in list(&mut words)? {
                    let left = vertices.len().saturating_sub(first);
                    let count = word.parse().unwrap_or(if word == "-1" { left } else { 0 });
                    let face: Vec<usize> = (first..first + count.min(left)).collect();
                    fan(&face, &vertices, &mut corners)?;
                    first = first.saturating_add(count);
                }
            }
            "coordIndex" => {
                let list = list(&mut words)?;
                for face in list.split(|word| word.starts_with('-')) {
                    let face: Option<Vec<usize>> = face.iter().map(|word| word.parse().ok()).collect();
                    fan(&face.ok_or("has an index that is no number")?, &vertices, &mut corners)?;
                }
            }
            _ => {}
        }
    }
    Ok(corners)
}

/// The words between `[` and `]`, or one word without them.
fn list<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<Vec<&'a str>, String> {
    if words.next() != Some("[") {
        return Err("has a list without [".to_owned());
    }
    Ok(words.by_ref().take_while(|word| *word != "]").collect())
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(|line| line.split('#').next().unwrap_or_default()).flat_map(str::split_whitespace)
}

fn count<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<usize, String> {
    let word = words.next().ok_or("ends too early")?;
    word.parse().map_err(|_| format!("has '{word}' where a count is expected"))
}

fn points<'a>(words: &mut impl Iterator<Item = &'a str>, n: usize) -> Result<Vec<Vec3>, String> {
    let mut next = || -> Result<f64, String> {
        let word = words.next().ok_or("ends too early")?;
        word.parse().map_err(|_| format!("has '{word}' where a number is expected"))
    };
    // The count is only a claim: nothing is reserved for it.
    let mut points = Vec::new();
    for _ in 0..n {
        points.push(Vec3::new(next()?, next()?, next()?));
    }
    Ok(points)
}

/// Splits a face into triangles around its first corner.
fn fan(face: &[usize], points: &[Vec3], corners: &mut Corners) -> Result<(), String> {
    let point = |i: usize| points.get(i).copied().ok_or("names vertices that are not there");
    for pair in face.windows(2).skip(1) {
        corners.push([point(face[0])?, point(pair[0])?, point(pair[1])?]);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_formats_give_the_same_triangles() {
        let square = "0 0 0  1 0 0  1 1 0  0 1 0";
        let off = off(&format!("OFF # a square\n4 1 0\n{square}\n4 0 1 2 3\n")).expect("OFF");
        let tri = tri(&format!("4\n{square}\n2\n0 1 2\n0 2 3\n")).expect("tri");
        let iv = "#Inventor V2.0 ascii\nSeparator { Coordinate3 { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] }\n\
                  IndexedFaceSet { coordIndex [ 0, 1, 2, 3, -1 ] } }";
        assert_eq!(off, tri);
        assert_eq!(inventor(iv).expect("Inventor"), tri);
        let set =
            iv.replace("IndexedFaceSet { coordIndex [ 0, 1, 2, 3, -1 ] }", "FaceSet { numVertices [ 4 ] }");
        assert_eq!(inventor(&set).expect("FaceSet"), tri);
        let broken = "v 0 0 0\nv 1 0 0 # corner\nv 1 1 0 1.0\nv 0 1 0\nf 1 2 \\\n 3 4 # face\n";
        assert_eq!(super::obj(broken).expect("continued"), tri);
        assert!(super::obj("v 0 0 0\nf 0 1 1\n").expect_err("0").contains("index '0'"));
        let obj = obj("o a\nv 0 0 0\nv 1 0 0\nvn 0 0 1\no b\nv 1 1 0\nv 0 1 0\nf 1//1 2//1 -2//1 -1//1\n");
        assert_eq!(obj.expect("OBJ"), tri);
    }

    #[test]
    fn what_is_not_read_is_named() {
        let moved = "#Inventor V2.0 ascii\nSeparator { Translation { translation 0 0 1 } Cube { } }";
        assert!(inventor(moved).expect_err("moves").contains("Translation"));
        assert!(off("OFF 9 9 9 0").expect_err("short").contains("too early"));
        assert!(tri("1 0 0 0 1 0 5 6").expect_err("outside").contains("not there"));
    }
}
