"""Plays one run through the proxy; between its two halves waits for a line, while a host may end."""

import json
import sys

import palmares

url, token = sys.argv[1:]
with palmares.Client(url, token=token, timeout_s=20.0, reconnect_s=60.0) as client:
    client.reset("balls", "softhand")
    for _ in range(100):
        client.step(hand=[0.2])
    print("half", flush=True)
    sys.stdin.readline()
    for _ in range(100):
        obs = client.step(hand=[0.6])
    result = client.stop()
    print(json.dumps({"tick": obs.tick, "status": result.status, "run_id": result.run_id}), flush=True)
