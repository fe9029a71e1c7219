//! Text formats of meshes: OBJ, OFF, Klamp't's `.tri`.
//!
//! The OBJ parser of mesh-loader refuses published files whose parts share their vertices.

use palmares_models::Vec3;

/// Triangles by their corners.
pub(super) type Corners = Vec<[Vec3; 3]>;

/// Wavefront OBJ: the lines `v` and `f`; everything else is look. A negative index counts from the last vertex back.
pub(super) fn obj(text: &str) -> Result<Corners, String> {
    let (mut points, mut corners) = (Vec::new(), Vec::new());
    let mut lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    while let Some(line) = lines.next() {
        // A line goes on after a backslash.
        let mut joined = line.to_owned();
        while let Some(first) = joined.trim_end().strip_suffix('\\') {
            joined.truncate(first.len());
            joined.push(' ');
            joined.push_str(lines.next().unwrap_or_default());
        }
        let mut words = joined.split_whitespace();
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
pub(super) fn fan(face: &[usize], points: &[Vec3], corners: &mut Corners) -> Result<(), String> {
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
        assert_eq!(off, tri);
        let broken = "v 0 0 0\nv 1 0 0 # corner \\\nv 1 1 0 1.0\nv 0 1 0\nf 1 2 \\\n 3 4 # face\n";
        assert_eq!(super::obj(broken).expect("continued"), tri);
        assert!(super::obj("v 0 0 0\nf 0 1 1\n").expect_err("0").contains("index '0'"));
        let obj = obj("o a\nv 0 0 0\nv 1 0 0\nvn 0 0 1\no b\nv 1 1 0\nv 0 1 0\nf 1//1 2//1 -2//1 -1//1\n");
        assert_eq!(obj.expect("OBJ"), tri);
    }

    #[test]
    fn wrong_counts_are_errors() {
        assert!(off("OFF 9 9 9 0").expect_err("short").contains("too early"));
        assert!(tri("1 0 0 0 1 0 5 6").expect_err("outside").contains("not there"));
    }
}
