"""The bodies of a run as shapes for Foxglove, as in a replay: a link's frame is `hand/LINK`."""

from __future__ import annotations

from typing import Any

import numpy as np
from foxglove.messages import (
    Color,
    CubePrimitive,
    CylinderPrimitive,
    Point3,
    Pose,
    Quaternion,
    SceneEntity,
    SpherePrimitive,
    Timestamp,
    TriangleListPrimitive,
    Vector3,
)
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from palmares.arrays import Array
from palmares.rotation import matrix_of, quat_of

WORLD = "world"


def frame_of(body: dict[str, Any]) -> str:
    """Return the frame of a body of `scene.bodies`; furniture stands in the world."""
    if body["kind"] == "furniture":
        return WORLD
    return f"hand/{body['name']}" if body["kind"] == "hand" else str(body["name"])


def entity_of(body: dict[str, Any], time: Timestamp) -> SceneEntity:
    """Return a body of `scene.bodies` as an entity that follows its frame."""
    red, green, blue = body["color"]
    color = Color(r=red, g=green, b=blue, a=1.0)
    fixed = body["kind"] == "furniture"
    cubes: list[CubePrimitive] = []
    spheres: list[SpherePrimitive] = []
    cylinders: list[CylinderPrimitive] = []
    triangles: list[TriangleListPrimitive] = []
    for part in body["parts"]:
        shape, position, quat = part["shape"], np.array(part["position"]), part["quat_xyzw"]
        if fixed:
            turned = matrix_of(body["quat_xyzw"])
            position = np.array(body["position"]) + turned @ position
            quat = quat_of(turned @ matrix_of(quat))
        pose = pose_of(position, quat)
        match shape["type"]:
            case "sphere":
                spheres.append(SpherePrimitive(pose=pose, size=cube(2 * shape["radius"]), color=color))
            case "box":
                size = Vector3(**dict(zip("xyz", (2 * x for x in shape["half_extents"]), strict=True)))
                cubes.append(CubePrimitive(pose=pose, size=size, color=color))
            case "cylinder" | "capsule":
                width, length = 2 * shape["radius"], 2 * shape["half_length"]
                size = Vector3(x=width, y=width, z=length)
                cylinders.append(
                    CylinderPrimitive(pose=pose, size=size, bottom_scale=1.0, top_scale=1.0, color=color)
                )
                if shape["type"] == "capsule":
                    for z in (-length / 2, length / 2):
                        end = position + matrix_of(quat) @ [0.0, 0.0, z]
                        spheres.append(
                            SpherePrimitive(pose=pose_of(end, quat), size=cube(width), color=color)
                        )
            case "hull":
                triangles.append(hull(shape["points"], pose, color))
    return SceneEntity(
        timestamp=time,
        frame_id=frame_of(body),
        id=frame_of(body) if body["kind"] == "hand" else body["name"],
        frame_locked=True,
        cubes=cubes,
        spheres=spheres,
        cylinders=cylinders,
        triangles=triangles,
    )


def pose_of(position: Any, quat_xyzw: Any) -> Pose:
    """Return a pose of Foxglove."""
    return Pose(position=vector(position), orientation=quaternion(quat_xyzw))


def vector(xyz: Any) -> Vector3:
    """Return a vector of Foxglove."""
    x, y, z = (float(value) for value in xyz)
    return Vector3(x=x, y=y, z=z)


def quaternion(xyzw: Any) -> Quaternion:
    """Return a rotation of Foxglove."""
    x, y, z, w = (float(value) for value in xyzw)
    return Quaternion(x=x, y=y, z=z, w=w)


def cube(size: float) -> Vector3:
    """Return equal sizes along all axes."""
    return Vector3(x=size, y=size, z=size)


def hull(points: list[list[float]], pose: Pose, color: Color) -> TriangleListPrimitive:
    """Return the convex hull of points (m)."""
    return TriangleListPrimitive(
        pose=pose,
        points=[Point3(x=float(x), y=float(y), z=float(z)) for x, y, z in points],
        color=color,
        indices=[int(index) for index in faces_of(np.array(points, float)).ravel()],
    )


def faces_of(corners: Array) -> NDArray[np.int32]:
    """Return the triangles of a convex hull: three indices of corners each, counterclockwise from outside."""
    made = ConvexHull(corners)
    faces = np.array(made.simplices)
    a, b, c = (corners[faces[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), made.equations[:, :3]) < 0
    faces[inwards] = faces[inwards][:, [0, 2, 1]]
    return faces
