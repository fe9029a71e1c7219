"""Observations, scenes and results for people: as text, and as HTML in a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from palmares.messages import Event, Observation, Result, Scene, SceneBody

Rows: TypeAlias = list[tuple[str, str]]
"""Label and value of each line"""
MOST = 12
"""Of more objects or events than this the rest is counted"""


def text(title: str, rows: Rows) -> str:
    """Return a title and aligned lines."""
    width = max((len(label) for label, _ in rows), default=0)
    return "\n".join([f"<{title}>", *(f"  {label:<{width}}  {value}" for label, value in rows)])


def html(title: str, rows: Rows) -> str:
    """Return a table."""
    lines = "".join(
        f'<tr><th style="text-align:left">{escape(label)}</th>'
        f'<td style="text-align:left">{escape(value)}</td></tr>'
        for label, value in rows
    )
    return f"<table><caption>{escape(title)}</caption>{lines}</table>"


def observation(obs: Observation) -> tuple[str, Rows]:
    """Return title and lines of an observation."""
    over = f", over: {obs.reason}" if obs.done else ""
    title = f"Observation of tick {obs.tick} ({obs.sim_time_s:.2f} s), score {obs.score:g}{over}"
    hand = obs.hand
    rows = [("base", f"{_vector(hand.base.position)} m, quaternion {_vector(hand.base.quat_xyzw)}")]
    for motor in hand.actuators:
        state = f"σ {motor.position:.3f} of {motor.command:.3f} commanded, tension {motor.tension:.3g}"
        rows.append((motor.name, state))
    rows.append(("wrist", f"{_vector(hand.wrist.force)} N, {_vector(hand.wrist.torque)} N·m"))
    if hand.joints.size:
        rows.append(("encoders", _vector(hand.joints.tolist()) + " rad"))
    if hand.touch.size:
        felt = hand.touch[:, 2]
        rows.append(("touch", f"{int((felt > 0.0).sum())} of {felt.size} taxels, {felt.sum():.3g} N in all"))
    for name, image in obs.cameras.items():
        rows.append((f"camera {name}", f"{image.width} × {image.height}"))
    if obs.truth is not None:
        truth = obs.truth
        for k, (name, at) in enumerate(zip(truth.names, truth.positions.tolist(), strict=True)):
            if k == MOST:
                rows.append(("", f"and {len(truth.names) - MOST} more objects"))
                break
            rows.append((name, f"{_vector(at)} m"))
        rows.append(("contacts", str(truth.contact_count)))
    rows += _events(obs.events)
    return title, rows


def scene(scene: Scene) -> tuple[str, Rows]:
    """Return title and lines of a scene."""
    free = scene.free
    title = f"Scene of {len(free)} objects, {len(scene.furniture)} fixed bodies, {len(scene.regions)} regions"
    rows = [(body.name, _body(body)) for body in free[:MOST]]
    if len(free) > MOST:
        rows.append(("", f"and {len(free) - MOST} more objects"))
    rows += [(body.name, "fixed" + (", endless" if body.endless else "")) for body in scene.furniture]
    for region in scene.regions:
        role = f"{region.role}: " if region.role else ""
        rows.append((f"region {region.name}", f"{role}{_vector(region.min)} to {_vector(region.max)} m"))
    return title, rows


def result(result: Result) -> tuple[str, Rows]:
    """Return title and lines of a result."""
    title = f"Result of {result.task} with {result.hand}: score {result.score:g}, {result.status}"
    rows = [
        ("run", result.run_id),
        ("ended", f"{result.reason} after {result.ticks} ticks, {result.sim_time_s:.2f} s"),
        ("objects", f"{result.in_goal} in the goal, {result.outside} outside"),
    ]
    if result.note is not None:
        rows.append(("note", result.note))
    if result.mode == "realtime":
        rows.append(("real time", f"{result.missed_ticks} ticks missed, {result.late_ticks} late"))
    rows += _events(result.events)
    rows.append(("state hash", result.state_hash))
    if result.replay is not None:
        rows.append(("replay", f"{result.replay.bytes} bytes, SHA-256 {result.replay.sha256[:16]}…"))
    return title, rows


def _body(body: SceneBody) -> str:
    kind = body.parts[0].shape.type if len(body.parts) == 1 else f"{len(body.parts)} parts"
    size = " × ".join(f"{2000.0 * half:.0f}" for half in body.half_extents)
    at = "hidden" if body.position is None else f"at {_vector(body.position)} m"
    return f"{kind}, {size} mm, {1000.0 * body.mass:.0f} g, friction {body.friction:.2g}, {at}"


def _events(events: Sequence[Event]) -> Rows:
    told = [(f"tick {event.tick}", event.kind + _which(event.object)) for event in events[:MOST]]
    return [*told, ("", f"and {len(events) - MOST} more events")] if len(events) > MOST else told


def _which(k: int | None) -> str:
    return "" if k is None else f", object {k}"


def _vector(numbers: Sequence[float]) -> str:
    return "(" + ", ".join(f"{x:.3f}" for x in numbers) + ")"
