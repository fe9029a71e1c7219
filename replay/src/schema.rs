//! JSON Schemas of the channels. That of Foxglove follows the published field definitions of `foxglove.SceneUpdate`
//! (<https://github.com/foxglove/foxglove-sdk/tree/main/schemas/jsonschema>); fields we never fill are left out.

use serde_json::{Value, json};

fn object(title: &str, description: &str, properties: Value) -> Value {
    json!({"title": title, "description": description, "type": "object", "properties": properties})
}

fn list(items: Value) -> Value {
    json!({"type": "array", "items": items})
}

fn number(description: &str) -> Value {
    json!({"type": "number", "description": description})
}

fn text(description: &str) -> Value {
    json!({"type": "string", "description": description})
}

fn whole(description: &str) -> Value {
    json!({"type": "integer", "minimum": 0, "description": description})
}

fn seconds(title: &str) -> Value {
    let nsec = json!({"type": "integer", "minimum": 0, "maximum": 999_999_999});
    json!({"type": "object", "title": title, "properties": {"sec": {"type": "integer"}, "nsec": nsec}})
}

fn vector(description: &str) -> Value {
    let axes = json!({"x": number("x"), "y": number("y"), "z": number("z")});
    object("foxglove.Vector3", description, axes)
}

fn quaternion() -> Value {
    let parts = json!({"x": number("x"), "y": number("y"), "z": number("z"), "w": number("w")});
    object("foxglove.Quaternion", "Orientation", parts)
}

fn pose() -> Value {
    let parts = json!({"position": vector("Position, m"), "orientation": quaternion()});
    object("foxglove.Pose", "Pose in the entity's frame", parts)
}

fn color() -> Value {
    let parts = json!({"r": number("red"), "g": number("green"), "b": number("blue"), "a": number("alpha")});
    object("foxglove.Color", "Colour, 0 to 1", parts)
}

/// `foxglove.SceneUpdate`
pub(crate) fn scene_update() -> Value {
    let deletion = json!({
        "timestamp": seconds("time"), "type": {"type": "integer"}, "id": text("Entity to delete"),
    });
    let size = |title: &str, description: &str| {
        object(title, description, json!({"pose": pose(), "size": vector("Size, m"), "color": color()}))
    };
    let cylinder = json!({
        "pose": pose(), "size": vector("Size, m"), "color": color(),
        "bottom_scale": number("Ratio of the lower end's diameter, 0 to 1"),
        "top_scale": number("Ratio of the upper end's diameter, 0 to 1"),
    });
    let triangles = json!({
        "pose": pose(), "points": list(vector("Corner, m")), "color": color(), "colors": list(color()),
        "indices": list(json!({"type": "integer", "minimum": 0})),
    });
    let pair = json!({"key": text("Key"), "value": text("Value")});
    let entity = json!({
        "timestamp": seconds("time"),
        "frame_id": text("Frame of reference"),
        "id": text("Identifier; replaces an earlier entity of the same name"),
        "lifetime": seconds("duration"),
        "frame_locked": {"type": "boolean", "description": "Whether the entity follows its frame"},
        "metadata": list(object("foxglove.KeyValuePair", "A note", pair)),
        "cubes": list(size("foxglove.CubePrimitive", "A box")),
        "spheres": list(size("foxglove.SpherePrimitive", "A sphere; the size is its diameters")),
        "cylinders": list(object("foxglove.CylinderPrimitive", "A cylinder along z", cylinder)),
        "triangles": list(object("foxglove.TriangleListPrimitive", "Triangles", triangles)),
    });
    let parts = json!({
        "deletions": list(object("foxglove.SceneEntityDeletion", "What goes away", deletion)),
        "entities": list(object("foxglove.SceneEntity", "A body", entity)),
    });
    object("foxglove.SceneUpdate", "What stands in the scene", parts)
}

/// `palmares.Action`
pub(crate) fn action() -> Value {
    let numbers = list(json!({"type": "number"}));
    let base = json!({
        "position": numbers, "quat_xyzw": numbers, "linear": numbers, "angular": numbers,
    });
    let action = json!({
        "base": object("palmares.BaseTarget", "A pose (m) or a velocity (m/s, rad/s)", base),
        "hand": list(number("σ of a motor, 0 to 1")),
    });
    let wrench = object("palmares.Wrench", "World frame", json!({"force": numbers, "torque": numbers}));
    let push = json!({"link": text("Name of the link"), "wrench": wrench, "duration_s": number("s")});
    let parts = json!({
        "tick": whole("The tick the world was at"),
        "action": object("palmares.ActionTargets", "As applied", action),
        "state": text("Digest of every bit of the state it led to, 16 hexadecimal digits"),
        "pushes": list(object("palmares.Push", "A wrench from outside that began here", push)),
    });
    object("palmares.Action", "What led from one tick to the next; its numbers bring back every bit", parts)
}

/// `palmares.Event`
pub(crate) fn event() -> Value {
    let parts = json!({
        "tick": whole("When"), "kind": text("What"), "object": whole("Which object"),
    });
    object("palmares.Event", "Something the referee noted", parts)
}

/// `palmares.Hash`
pub(crate) fn hash() -> Value {
    let parts = json!({
        "tick": whole("When"),
        "state": text("Digest of every bit of the state, 16 hexadecimal digits"),
        "chain": text("Hash chain before this message, 64 hexadecimal digits"),
    });
    object("palmares.Hash", "The state at a tick", parts)
}
