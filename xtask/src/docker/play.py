"""Plays one tick on a server; the team `left-open` then waits for the server to end."""

import sys
import time

import palmares

url, team = sys.argv[1:]
with palmares.Client(url, team=team, reconnect_s=0.0) as client:
    client.reset("balls", "softhand", seed=1)
    obs = client.step(hand=[0.5])
    assert obs.tick == 1, obs.tick
    if team == "left-open":
        print("open", flush=True)
        time.sleep(600)
    result = client.stop()
    assert result.status == "practice", result
    print("done", flush=True)
