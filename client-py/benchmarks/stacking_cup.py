"""Close on a stacking cup in 1.2 s, lift it by 0.1 m in 1.5 s, and draw curves of motor, joints and wrist.

    pip install matplotlib
    python stacking_cup.py --output ../../docs/pictures/stacking_cup.svg

The protocol is that of an experiment of Rocchi and Hauser (2016). The curves are those of the simulation,
without errors of sensors.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from pathlib import Path

import figures
import numpy as np

import palmares
from palmares.arrays import Array
from palmares.outputs import output_file
from palmares.rotation import quat_of
from palmares.skills.grasps import TopGrasp
from palmares.skills.motion import UP, Mover
from palmares.skills.objects import object_bounds

# name, pitch, roll, above, aside, along, σ open, σ closed, sink
GRASP = TopGrasp("flat", 1.6182, 0.3491, 0.0068, 0.0264, 0.1876, 0.0212, 0.9, 0.12)
CUP = "065-e_cups"
CLOSE_S, LIFT_S, LIFT_M, HOLD_S = 1.2, 1.5, 0.1, 0.5
ABOVE_M = 0.02
"""A grasp with the palm above the object, so that it does not press on it"""
FINGERS = ("thumb", "index", "middle", "ring", "little", "palm")


def seed_with_cup(client: palmares.Client) -> int:
    """Return the first seed whose object is the cup, and leave its run open."""
    for seed in range(1, 500):
        client.reset("grasp", "softhand", seed=seed)
        if CUP in client.scene.free[0].name:
            return seed
        client.stop()
    sys.exit(f"no seed up to 500 has {CUP}")


class Recorder(Mover):
    """Moves the hand and records every tick."""

    rows: dict[str, list[float]]

    def _step(self) -> None:
        super()._step()
        self.write()

    def close(self, duration_s: float) -> None:
        """Wind up the tendon at constant speed."""
        ticks, start = round(duration_s / self.client.run.tick_s), self.sigma
        for tick in range(1, ticks + 1):
            self.sigma = start + (1.0 - start) * tick / ticks
            self._step()

    def write(self) -> None:
        """Append a row."""
        obs, truth = self.obs, self.obs.truth
        assert truth is not None
        hand, joints = obs.hand, np.asarray(truth.joints.position)
        cup = truth.objects[0]
        fingers: dict[str, float] = defaultdict(float)
        for contact in truth.contacts:
            for name in (contact.a, contact.b):
                part = name.rsplit("/", 1)[-1].split("_")[0]
                if part in FINGERS:
                    fingers[part] += float(np.linalg.norm(contact.force))
        row = {
            "t": obs.sim_time_s,
            "command": hand.actuators[0].command,
            "sigma": hand.actuators[0].position,
            "tension": hand.actuators[0].tension,
            "joints": float(np.degrees(np.mean(joints))),
            "predicted": float(np.degrees(np.mean(truth.predicted_equilibrium))),
            "weight": float(hand.wrist.force[2]),
            "base": float(hand.base.position[2]),
            "cup": float(cup.position[2]),
        } | {part: fingers[part] for part in FINGERS}
        for name, value in row.items():
            self.rows[name].append(value)


def main() -> None:
    """Play and draw."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--output", type=output_file, default="stacking_cup.svg")
    args = parser.parse_args()
    with palmares.Client("local", team="stacking-cup") as client:
        seed = seed_with_cup(client)
        client.stop()
        hand = Recorder(client, client.reset("grasp", "softhand", seed=seed))
        hand.rows = defaultdict(list)
        (cup,) = object_bounds(client.scene, hand.obs)
        rotation = GRASP.rotation(0.0)
        at = GRASP.base_position(cup, rotation) + ABOVE_M * UP
        hand.to(1.0, at + GRASP.sink_m * UP, quat_of(rotation), sigma=GRASP.sigma_open)
        hand.to(0.5, at)
        hand.wait(0.3)
        begin_s = hand.obs.sim_time_s
        hand.close(CLOSE_S)
        hand.to(LIFT_S, at + LIFT_M * UP)
        hand.wait(HOLD_S)
        client.stop()
    rows = {name: np.asarray(values) for name, values in hand.rows.items()}
    rows["t"] -= begin_s
    draw(rows, args.output)
    lifted_m = rows["cup"][-1] - rows["cup"][rows["t"] < 0.0][-1]
    print(f"seed {seed}: the cup is {lifted_m:.3f} m higher, the wrist bears {rows['weight'][-1]:.2f} N")


def draw(rows: dict[str, Array], out: Path) -> None:
    """Draw the curves from just before the hand closes."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    shown = rows["t"] > -0.2
    t = rows["t"][shown]
    figure, axes = plt.subplots(4, 1, sharex=True, figsize=(7, 8.5), constrained_layout=True)
    panels: list[tuple[str, dict[str, Array]]] = [
        ("motor σ", {"commanded": rows["command"], "reached": rows["sigma"]}),
        ("mean joint angle, °", {"simulated": rows["joints"], "free hand's equilibrium": rows["predicted"]}),
        ("contact forces, N", {name: rows[name] for name in FINGERS}),
        ("wrist, vertical force, N", {"hand and cup": rows["weight"]}),
    ]
    for axis, (label, curves) in zip(axes, panels, strict=True):
        for name, values in curves.items():
            axis.plot(t, values[shown], label=name, linewidth=1.2)
        axis.set_ylabel(label)
        axis.legend(fontsize="small", ncols=3)
        axis.grid(alpha=0.3)
        for edge in (0.0, CLOSE_S, CLOSE_S + LIFT_S):
            axis.axvline(edge, color="0.6", linewidth=0.8)
    axes[-1].set_xlabel("s from the beginning of the closing; lines: closed, lifted")
    figures.save(figure, out)


if __name__ == "__main__":
    main()
