"""Datasets in LeRobot's format, version 3.0, for imitation. Needs ``pip install 'palmares[lerobot]'``.

>>> import palmares.lerobot                                                   # doctest: +SKIP
... palmares.lerobot.of_replays("demonstrations", ["run_1.mcap", "run_2.mcap"])
... palmares.lerobot.collect("mine", policy, "palmares/Grasp-SoftHand-v1", seeds=range(100))

``palmares dataset RUNS… --out FOLDER`` does the first from a shell. The format is the one that
``lerobot.datasets.LeRobotDataset("name", root=FOLDER)`` reads: rows of all episodes one after the other in
Parquet, and their places, statistics and the words of the task beside them.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    import pyarrow as pa
    import pyarrow.parquet as pq
except ImportError as missing:
    raise ImportError("palmares.lerobot needs pyarrow: pip install 'palmares[lerobot]'") from missing

from palmares import own_task
from palmares.arguments import whole
from palmares.arrays import Array
from palmares.png import png
from palmares.reproducible import mean
from palmares.sim import TASKS, Recording, describe_hand, welcome

VERSION = "v3.0"
"""Version of the format"""
STATE, ACTION, IMAGE = "observation.state", "action", "observation.images."
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
ROWS = 50_000
"""Most rows of a file, but for one longer episode"""
COUNTERS = {"frame_index": "int64", "episode_index": "int64", "index": "int64", "task_index": "int64"}
QUANTILES = (0.01, 0.1, 0.5, 0.9, 0.99)


@dataclass(frozen=True)
class Frames:
    """An episode: a row for each time at which an action begins."""

    task: str
    """What to do, in words"""
    columns: dict[str, NDArray[Any]]
    """Numbers (T, n), stored as float32; pictures (T, height, width, 3) of uint8, named `IMAGE` and a name"""
    names: dict[str, list[str]]
    """Names of the n numbers of each column"""


def write(
    folder: str | os.PathLike[str], episodes: Iterable[Frames], fps: int, robot_type: str | None = None
) -> int:
    """Write episodes as a dataset; return their number.

    Args:
        folder: A new or an empty folder.
        episodes: At least one, all with the same columns.
        fps: Rows per second.
        robot_type: Name of the hand.

    Raises:
        ValueError: The folder is not empty, there is no episode, or one has other columns.
        OSError: The folder cannot be written.

    """
    root = Path(folder)
    if root.exists() and any(root.iterdir()):
        raise ValueError(f"{root}: it is not empty; name a new folder")
    fps = whole("fps", fps, 1, 10_000)
    writer = _Writer(root, fps)
    for frames in episodes:
        writer.add(frames)
    writer.end(robot_type)
    return len(writer.rows)


def of_replays(
    folder: str | os.PathLike[str],
    replays: Sequence[str | os.PathLike[str]],
    *,
    every: int = 5,
    tasks: Iterable[str] = (),
) -> int:
    """Write recorded runs as a dataset; return their number.

    A row's state is the pose of the hand's base (m, x y z w), σ of every motor and the joints' positions; its
    action is the pose of the base one row later and the commanded σ. The runs are simulated again, and
    compared with the recording.

    Args:
        folder: A new or an empty folder.
        replays: Files, all of one hand.
        every: Ticks between two rows.
        tasks: Paths of your own tasks, if runs are of them.

    Raises:
        ValueError: A file is no replay, or of another hand than the first; or as `write`.
        OSError: A file cannot be read or written.

    """
    every = whole("every", every, 1, 10_000)
    own, first = list(tasks), Recording(replays[0]) if replays else None
    if first is None:
        raise ValueError("replays: found none; wanted at least one")
    words = {task.name: task.description for task in welcome(own_tasks=own).tasks}
    fps = round(1.0 / (every * first.tick_s))

    def episodes() -> Iterator[Frames]:
        for path in replays:
            recording = Recording(path, own)
            if (recording.hand, recording.tick_s) != (first.hand, first.tick_s):
                raise ValueError(f"{path}: found a run of {recording.hand}; wanted one of {first.hand}")
            yield frames_of(recording, every, words.get(recording.task, recording.task))

    return write(folder, episodes(), fps, first.hand)


def collect(
    folder: str | os.PathLike[str],
    policy: Callable[[dict[str, Array]], Array],
    env: str,
    seeds: Sequence[int],
    *,
    num_envs: int = 16,
    options: dict[str, Any] | None = None,
) -> int:
    """Play a policy in one episode for each seed; write them as a dataset, and return their number.

    A row's state has all fields of the observation but pictures, one after the other; fields ``rgb_NAME`` are
    its pictures. Its action is that of the policy.

    Args:
        folder: A new or an empty folder.
        policy: As for `palmares.minari.collect`.
        env: Id of the environment, such as ``palmares/Grasp-SoftHand-v1``.
        seeds: The scenes, 0 to 2**53 - 1.
        num_envs: Episodes at once.
        options: Arguments of ``gymnasium.make``, such as ``max_episode_steps`` and ``cameras``.

    Raises:
        ValueError: As `palmares.minari.collect` and `write`.
        OSError: The folder cannot be written.

    """
    import gymnasium

    from palmares.episodes import played

    options = dict(options or {})
    single = gymnasium.make(env, **options)
    fps = int(single.metadata["render_fps"])
    single.close()
    settings = {**gymnasium.spec(env).kwargs, **options}
    task, hand = str(settings["task"]), str(settings["hand"])
    own = [] if task in TASKS else [task]
    name = own_task.name_of(task, TASKS)
    words = next(it.description for it in welcome(own_tasks=own).tasks if it.name == name)

    def episodes() -> Iterator[Frames]:
        for episode in played(policy, env, seeds, num_envs, options):
            rows = episode.observations[:-1]
            pictures = [name for name in rows[0] if name.startswith("rgb_")]
            numbers = [name for name in rows[0] if not name.startswith(("rgb_", "depth_"))]
            state = np.stack([np.concatenate([np.ravel(row[name]) for name in numbers]) for row in rows])
            names = [f"{name}_{k}" for name in numbers for k in range(rows[0][name].size)]
            actions = np.stack(episode.actions)
            columns = {STATE: state, ACTION: actions}
            columns |= {IMAGE + name[4:]: np.stack([row[name] for row in rows]) for name in pictures}
            yield Frames(words, columns, {STATE: names, ACTION: [f"a{k}" for k in range(actions.shape[1])]})

    return write(folder, episodes(), fps, hand)


def frames_of(recording: Recording, every: int, task: str) -> Frames:
    """Return a recorded run as an episode, with a row for every `every` ticks."""
    found = recording.arrays()
    rows = np.arange(0, recording.ticks, every)
    later = np.minimum(rows + every, recording.ticks)
    sigma = found["motors"][:, :, 0]
    described = describe_hand(recording.hand)
    pose = [f"base_{it}" for it in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    motors = [motor["name"] for motor in described["motors"]]
    joints = [coordinate["name"] for coordinate in described["coordinates"]]
    return Frames(
        task,
        {
            STATE: np.hstack([found["base"][rows, :7], sigma[rows], found["q"][rows]]),
            ACTION: np.hstack([found["base"][later, :7], found["command"][later]]),
        },
        {STATE: [*pose, *motors, *joints], ACTION: [*pose, *motors]},
    )


class _Writer:
    """Writes the rows of episodes, and at the end what is known of them."""

    def __init__(self, root: Path, fps: int) -> None:
        self._root, self._fps = root, fps
        self._features: dict[str, Any] = {}
        self._waiting: list[Any] = []
        self._file, self._total, self._rows_waiting = 0, 0, 0
        self._tasks: list[str] = []
        self._stats: list[dict[str, dict[str, Any]]] = []
        self.rows: list[dict[str, Any]] = []

    def add(self, frames: Frames) -> None:
        features = {name: _feature(name, it, frames.names) for name, it in frames.columns.items()}
        if self.rows and features != self._features:
            raise ValueError(f"episode {len(self.rows)}: found columns {features}; wanted {self._features}")
        self._features = features
        count, number = len(next(iter(frames.columns.values()))), len(self.rows)
        if frames.task not in self._tasks:
            self._tasks.append(frames.task)
        stamps = (np.arange(count) / self._fps).astype(np.float32)
        counters = {
            "frame_index": np.arange(count),
            "episode_index": np.full(count, number),
            "index": self._total + np.arange(count),
            "task_index": np.full(count, self._tasks.index(frames.task)),
        }
        if self._waiting and self._rows_waiting + count > ROWS:
            self._flush()
        columns = {name: _column(it) for name, it in frames.columns.items()}
        columns |= {"timestamp": pa.array(stamps)}
        columns |= {name: pa.array(it, pa.int64()) for name, it in counters.items()}
        self._waiting.append(pa.table(columns))
        self._rows_waiting += count
        numbers = {**frames.columns, "timestamp": stamps[:, None]}
        numbers |= {name: it[:, None] for name, it in counters.items()}
        self._stats.append({name: _statistics(it) for name, it in numbers.items()})
        self.rows.append(
            {
                "episode_index": number,
                "tasks": [frames.task],
                "length": count,
                "data/chunk_index": 0,
                "data/file_index": self._file,
                "dataset_from_index": self._total,
                "dataset_to_index": self._total + count,
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
            }
        )
        self._total += count

    def end(self, robot_type: str | None) -> None:
        if not self.rows:
            raise ValueError("episodes: found none; wanted at least one")
        self._flush()
        for row, stats in zip(self.rows, self._stats, strict=True):
            for name, values in stats.items():
                row |= {f"stats/{name}/{key}": value for key, value in values.items()}
        self._parquet(EPISODES, pa.Table.from_pylist(self.rows))
        names = pa.table({"task_index": list(range(len(self._tasks))), "__index_level_0__": self._tasks})
        self._parquet("meta/tasks.parquet", names.replace_schema_metadata({b"pandas": _pandas_index()}))
        whole_stats = {name: _merged([it[name] for it in self._stats]) for name in self._stats[0]}
        self._json("meta/stats.json", whole_stats)
        plain = {"timestamp": {"dtype": "float32", "shape": [1], "names": None}}
        plain |= {name: {"dtype": kind, "shape": [1], "names": None} for name, kind in COUNTERS.items()}
        info = {
            "codebase_version": VERSION,
            "robot_type": robot_type,
            "total_episodes": len(self.rows),
            "total_frames": self._total,
            "total_tasks": len(self._tasks),
            "chunks_size": 1000,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": self._fps,
            "splits": {"train": f"0:{len(self.rows)}"},
            "data_path": DATA,
            "video_path": None,
            "features": self._features | plain,
        }
        self._json("meta/info.json", info)

    def _flush(self) -> None:
        self._parquet(DATA.format(chunk_index=0, file_index=self._file), pa.concat_tables(self._waiting))
        self._file, self._waiting, self._rows_waiting = self._file + 1, [], 0

    def _parquet(self, name: str, table: Any) -> None:
        path = self._root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(table, path)

    def _json(self, name: str, value: Any) -> None:
        path = self._root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(value, indent=4))


def _feature(name: str, values: NDArray[Any], names: dict[str, list[str]]) -> dict[str, Any]:
    if values.ndim == 4:
        return {"dtype": "image", "shape": list(values.shape[1:]), "names": ["height", "width", "channels"]}
    return {"dtype": "float32", "shape": [values.shape[1]], "names": names.get(name)}


def _column(values: NDArray[Any]) -> Any:
    if values.ndim == 4:
        rows = [{"bytes": png(picture), "path": None} for picture in values]
        return pa.array(rows, pa.struct([("bytes", pa.binary()), ("path", pa.string())]))
    flat = pa.array(np.ascontiguousarray(values, dtype=np.float32).ravel())
    return pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


def _statistics(values: NDArray[Any]) -> dict[str, Any]:
    """Return least, largest, mean, spread, count and quantiles; of pictures for each colour, 0 to 1."""
    rows = values.astype(np.float64)
    if values.ndim == 4:
        rows = rows.reshape(-1, 3) / 255.0
    middle = mean(rows)
    spread = np.sqrt(mean((rows - middle) * (rows - middle)))
    found = {"min": rows.min(axis=0), "max": rows.max(axis=0), "mean": middle, "std": spread}
    found |= {f"q{round(100 * q):02d}": np.percentile(rows, 100.0 * q, axis=0) for q in QUANTILES}
    shape = (3, 1, 1) if values.ndim == 4 else (-1,)
    return {name: it.reshape(shape).tolist() for name, it in found.items()} | {"count": [len(values)]}


def _merged(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the statistics of all episodes; quantiles are the means of the episodes', by length."""
    arrays = {name: np.array([part[name] for part in parts]) for name in parts[0]}
    counts = arrays["count"].reshape(-1, *[1] * (arrays["mean"].ndim - 1)).astype(np.float64)
    weight = counts / mean(counts) / len(parts)

    def weighted(values: Array) -> Array:
        return mean(values * weight) * len(parts)

    middle = weighted(arrays["mean"])
    apart = arrays["mean"] - middle
    variance = weighted(arrays["std"] * arrays["std"] + apart * apart)
    found = {"min": arrays["min"].min(axis=0), "max": arrays["max"].max(axis=0), "mean": middle}
    found |= {"std": np.sqrt(variance)} | {
        name: weighted(it) for name, it in arrays.items() if name.startswith("q")
    }
    total = int(arrays["count"].max()) if len(parts) == 1 else int(np.cumsum(arrays["count"])[-1])
    return {name: it.tolist() for name, it in found.items()} | {"count": [total]}


def _pandas_index() -> bytes:
    """Return what pandas needs to read the tasks as the index of a frame."""
    index = {
        "name": None,
        "field_name": "__index_level_0__",
        "pandas_type": "unicode",
        "numpy_type": "object",
    }
    column = {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64"}
    columns = [it | {"metadata": None} for it in (column, index)]
    described = {"index_columns": ["__index_level_0__"], "column_indexes": [], "columns": columns}
    return json.dumps(described).encode()
