//! glTF 2.0 in one binary file (`.glb`): the triangles of the scene, in metres.

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};
use palmares_models::Vec3;
use serde_json::Value;

use super::text::Corners;
use super::transform::{MAX_DEPTH, MAX_NODES, place};

/// Names of the chunks.
const JSON: &[u8; 4] = b"JSON";
const BINARY: &[u8; 4] = b"BIN\0";
/// Numbers that are read: a scene can name an accessor many times.
const MAX_NUMBERS: usize = 100_000_000;

/// The triangles of the scene.
pub(super) fn glb(bytes: &[u8]) -> Result<Corners, String> {
    let word = |at: usize| -> Option<usize> {
        let bytes = bytes.get(at..at + 4)?;
        usize::try_from(u32::from_le_bytes(bytes.try_into().ok()?)).ok()
    };
    if !bytes.starts_with(b"glTF") || word(4) != Some(2) {
        return Err("is no binary glTF 2.0 file".to_owned());
    }
    let (mut json, mut binary) = (None, &[][..]);
    let mut at = 12;
    while let (Some(length), Some(kind)) = (word(at), bytes.get(at + 4..at + 8)) {
        let end = (at + 8).checked_add(length).filter(|end| *end <= bytes.len());
        let chunk = &bytes[at + 8..end.ok_or("ends too early")?];
        match kind {
            kind if kind == JSON => json = json.or(Some(chunk)),
            kind if kind == BINARY && binary.is_empty() => binary = chunk,
            _ => {}
        }
        at += 8 + length;
    }
    let json: Value = serde_json::from_slice(json.ok_or("has no JSON")?)
        .map_err(|error| format!("has JSON that cannot be read: {error}"))?;
    // Others are about the look.
    let compressed = ["KHR_draco_mesh_compression", "EXT_meshopt_compression"];
    for extension in list(&json["extensionsRequired"]).iter().filter_map(Value::as_str) {
        if compressed.contains(&extension) {
            return Err(format!("needs {extension}, which is not read; save it without compression"));
        }
    }
    let mut file = File { json: &json, binary, corners: Vec::new(), visited: 0, numbers: 0 };
    let scene = &json["scenes"][size(&json["scene"], 0)?];
    let roots: Vec<usize> = match scene["nodes"].as_array() {
        Some(nodes) => nodes.iter().map(|node| size(node, usize::MAX)).collect::<Result<_, _>>()?,
        // Without a scene: the nodes that no node has as a child.
        None => {
            let nodes = list(&json["nodes"]);
            let below: Vec<&Value> = nodes.iter().flat_map(|node| list(&node["children"])).collect();
            (0..nodes.len())
                .filter(|k| !below.iter().any(|child| child.as_u64() == Some(*k as u64)))
                .collect()
        }
    };
    for root in roots {
        file.node(root, &Matrix4::identity(), 0)?;
    }
    Ok(file.corners)
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// A count, an index or a number of bytes.
fn size(value: &Value, or: usize) -> Result<usize, String> {
    match value {
        Value::Null => Ok(or),
        value => value
            .as_u64()
            .and_then(|n| usize::try_from(n).ok())
            .ok_or_else(|| format!("has {value} where a count is expected")),
    }
}

/// `N` numbers, if the value is there.
fn numbers<const N: usize>(value: &Value) -> Result<Option<[f64; N]>, String> {
    if value.is_null() {
        return Ok(None);
    }
    let numbers: Option<Vec<f64>> = list(value).iter().map(Value::as_f64).collect();
    let numbers = numbers.and_then(|list| <[f64; N]>::try_from(list).ok());
    numbers.map(Some).ok_or_else(|| format!("has a transform that is not {N} numbers"))
}

struct File<'a> {
    json: &'a Value,
    binary: &'a [u8],
    corners: Corners,
    /// Nodes that were placed.
    visited: usize,
    /// Numbers that were read.
    numbers: usize,
}

impl File<'_> {
    fn node(&mut self, index: usize, above: &Matrix4<f64>, depth: usize) -> Result<(), String> {
        self.visited += 1;
        if depth > MAX_DEPTH || self.visited > MAX_NODES {
            return Err(format!("has more than {MAX_DEPTH} nodes inside each other, or {MAX_NODES} in all"));
        }
        let Some(node) = list(&self.json["nodes"]).get(index) else {
            return Err(format!("names node {index}, which is not there"));
        };
        let to = above * local(node)?;
        if !node["mesh"].is_null() {
            let mesh = size(&node["mesh"], 0)?;
            let json = self.json;
            for primitive in list(&json["meshes"][mesh]["primitives"]) {
                let triangles = self.primitive(primitive)?;
                place(&triangles, &to, &mut self.corners)?;
            }
        }
        for child in list(&node["children"]) {
            self.node(size(child, usize::MAX)?, &to, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Value) -> Result<Corners, String> {
        const TRIANGLES: usize = 4;
        const STRIP: usize = 5;
        const FAN: usize = 6;
        let mode = size(&primitive["mode"], TRIANGLES)?;
        if ![TRIANGLES, STRIP, FAN].contains(&mode) || primitive["attributes"]["POSITION"].is_null() {
            return Ok(Vec::new());
        }
        let values = self.accessor(&primitive["attributes"]["POSITION"], 3)?;
        let points: Vec<Vec3> = values.chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
        let order: Vec<usize> = if primitive["indices"].is_null() {
            (0..points.len()).collect()
        } else {
            self.accessor(&primitive["indices"], 1)?.into_iter().map(|index| index as usize).collect()
        };
        let mut corners = Vec::new();
        let mut add = |a: usize, b: usize, c: usize| -> Result<(), String> {
            let point = |i: usize| points.get(i).copied().ok_or("names vertices that are not there");
            corners.push([point(a)?, point(b)?, point(c)?]);
            Ok(())
        };
        match mode {
            TRIANGLES => order.chunks_exact(3).try_for_each(|f| add(f[0], f[1], f[2]))?,
            STRIP => {
                for (k, f) in order.windows(3).enumerate() {
                    let (a, b) = if k % 2 == 0 { (f[0], f[1]) } else { (f[1], f[0]) };
                    add(a, b, f[2])?;
                }
            }
            _ => order.windows(2).skip(1).try_for_each(|pair| add(order[0], pair[0], pair[1]))?,
        }
        Ok(corners)
    }

    /// The numbers of an accessor, `each` for an element.
    fn accessor(&mut self, index: &Value, each: usize) -> Result<Vec<f64>, String> {
        let accessor = &self.json["accessors"][size(index, usize::MAX)?];
        let view = &self.json["bufferViews"][size(&accessor["bufferView"], usize::MAX)?];
        if view.is_null() || !accessor["sparse"].is_null() {
            return Err("has an accessor without its own bytes, which is not read".to_owned());
        }
        let buffer = size(&view["buffer"], 0)?;
        if buffer != 0 || !self.json["buffers"][0]["uri"].is_null() {
            return Err("has its vertices in another file; save it as one .glb".to_owned());
        }
        let normalized = accessor["normalized"].as_bool() == Some(true);
        let kind = size(&accessor["componentType"], 0)?;
        let (bytes, most): (usize, f64) = match kind {
            5120 => (1, 127.0),
            5121 => (1, 255.0),
            5122 => (2, 32767.0),
            5123 => (2, 65535.0),
            5125 | 5126 => (4, 1.0),
            other => return Err(format!("has numbers of type {other}, which glTF does not have")),
        };
        let too_early = || "ends too early".to_owned();
        let start = size(&view["byteOffset"], 0)?;
        let end = start.checked_add(size(&view["byteLength"], 0)?).ok_or_else(too_early)?;
        let view_bytes = self.binary.get(start..end).ok_or_else(too_early)?;
        let stride = size(&view["byteStride"], each * bytes)?.max(each * bytes);
        let data = view_bytes.get(size(&accessor["byteOffset"], 0)?..).ok_or_else(too_early)?;
        let count = size(&accessor["count"], 0)?;
        self.numbers = self.numbers.saturating_add(count.saturating_mul(each));
        if self.numbers > MAX_NUMBERS {
            return Err(format!("has more than {MAX_NUMBERS} numbers"));
        }
        let mut numbers = Vec::new();
        for element in 0..count {
            let at = element.checked_mul(stride).ok_or_else(too_early)?;
            for k in 0..each {
                let b = at
                    .checked_add(k * bytes)
                    .and_then(|at| data.get(at..at + bytes))
                    .ok_or_else(too_early)?;
                let number = match kind {
                    5120 => f64::from(i8::from_le_bytes([b[0]])),
                    5121 => f64::from(b[0]),
                    5122 => f64::from(i16::from_le_bytes([b[0], b[1]])),
                    5123 => f64::from(u16::from_le_bytes([b[0], b[1]])),
                    5125 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
                    _ => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
                };
                numbers.push(if normalized { (number / most).max(-1.0) } else { number });
            }
        }
        Ok(numbers)
    }
}

/// The transform of a node: a matrix by columns, or translation, rotation and scale.
fn local(node: &Value) -> Result<Matrix4<f64>, String> {
    if let Some(matrix) = numbers::<16>(&node["matrix"])? {
        return Ok(Matrix4::from_column_slice(&matrix));
    }
    let [x, y, z] = numbers(&node["translation"])?.unwrap_or_default();
    let [i, j, k, w] = numbers(&node["rotation"])?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let [a, b, c] = numbers(&node["scale"])?.unwrap_or([1.0; 3]);
    let turn = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-12);
    Ok(Matrix4::new_translation(&Vector3::new(x, y, z))
        * turn.unwrap_or_default().to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&Vector3::new(a, b, c)))
}
