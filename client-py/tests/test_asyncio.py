"""A program with asyncio plays runs as docs/teams.md shows, and its event loop goes on meanwhile."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path
from typing import Any

from tests.real_server import RealServer, needs_server

GUIDE = Path(__file__).parents[2] / "docs/teams.md"
BEATS = 20


@needs_server
def test_the_guides_program_plays_two_runs_beside_an_event_loop(tmp_path: Path) -> None:
    (code,) = re.findall(r"## Threads and asyncio.*?```python\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    names: dict[str, Any] = {}
    with RealServer(tmp_path) as server:
        code = code.replace("http://127.0.0.1:8080", server.url).replace("asyncio.run(main())\n", "")
        exec(compile(code, "guide", "exec"), names)

        async def beside() -> tuple[list[float], int]:
            runs = [asyncio.to_thread(names["play"], seed) for seed in (1, 2)]
            playing = asyncio.gather(*runs)
            beats = 0
            while not playing.done():
                await asyncio.sleep(0.01)
                beats += 1
            return await playing, beats

        scores, beats = asyncio.run(beside())
    assert all(score > 0.0 for score in scores)
    # A loop that waited for the calls would come back only in the end.
    assert beats > BEATS
