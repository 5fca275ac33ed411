"""`calibration policy run` against openpi's own codec: a websocket server as openpi's, over openpi-client's msgpack, that plays a
recorded demonstration back, and how often that is a success.

    python3 -m venv venv && venv/bin/pip install numpy msgpack "websockets>=13" openpi-client==0.1.2 pyarrow
    venv/bin/python tests/peers/openpi.py --programs target/release
"""
import argparse
import asyncio
import os
import sys
import tempfile
import threading

from program import Failed, answer, built, ending_by_signals

try:
    import numpy as np
    import websockets.asyncio.server
    from openpi_client import msgpack_numpy
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; the head of this file says how")

TASKS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "twin", "tasks")


class Server:
    """openpi's WebsocketPolicyServer in short: metadata to each client, an answer to each observation, a traceback as text."""

    def __init__(self, infer):
        self.infer, self.seen, self.port = infer, [], None
        self.ready = threading.Event()
        threading.Thread(target=lambda: asyncio.run(self.run()), daemon=True).start()
        self.ready.wait()

    async def run(self):
        async with websockets.asyncio.server.serve(self.handle, "127.0.0.1", 0, compression=None, max_size=None) as server:
            self.port = server.sockets[0].getsockname()[1]
            self.ready.set()
            await server.serve_forever()

    async def handle(self, socket):
        packer = msgpack_numpy.Packer()
        await socket.send(packer.pack({"name": "peer", "shape": np.array([4, 15])}))
        async for message in socket:
            observation = msgpack_numpy.unpackb(message)
            self.seen.append({key: getattr(value, "shape", value) for key, value in observation.items()})
            try:
                await socket.send(packer.pack(self.infer(observation)))
            except Exception as error:
                await socket.send(f"Traceback\n{error!r}")
                await socket.close()


def demonstration(programs, task, seed, folder):
    """Actions of a scripted run, twenty a second, as exported for LeRobot."""
    clips, out = os.path.join(folder, f"clips{seed}"), os.path.join(folder, f"set{seed}")
    answer([os.path.join(programs, "twin"), "task", task, "--seed", str(seed), "--record", clips, "--json"])
    answer([os.path.join(programs, "calibration"), "export-episodes", task, clips, "--to", "lerobot", "--out", out, "--json"])
    import pyarrow.parquet as parquet
    table = parquet.read_table(os.path.join(out, "data", "chunk-000", "file-000.parquet"), columns=["action", "observation.state"])
    return [np.array(table[name].to_pylist(), dtype=np.float32) for name in ("action", "observation.state")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", required=True, metavar="FOLDER", help="with the built `twin` and `calibration`")
    parser.add_argument("--task", default="pick_carrot", metavar="NAME", help="in twin/tasks/ [default: pick_carrot]")
    parser.add_argument("--episodes", type=int, default=5, metavar="N")
    given = parser.parse_args()
    ending_by_signals()
    for name in ("twin", "calibration"):
        built(os.path.join(given.programs, name))
    task = os.path.join(TASKS, given.task + ".toml")
    successes = 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(given.episodes):
            actions, states = demonstration(given.programs, task, seed, folder)
            place = {"at": 0, "first": None}

            def infer(observation):
                at = place["at"]
                if place["first"] is None:
                    place["first"] = np.abs(observation["observation/state"] - states[0]).max()
                place["at"] += 4
                rows = np.arange(at, at + 8).clip(0, len(actions) - 1)
                # Both kinds of arrays that policies answer with.
                return {"actions": actions[rows].astype(np.float64) if at % 8 else actions[rows]}

            server = Server(infer)
            found = answer([os.path.join(given.programs, "calibration"), "policy", "run", "--task", task, "--policy",
                            f"ws://127.0.0.1:{server.port}", "--seed", str(seed), "--chunk", "4", "--json"])
            successes += found["successes"]
            print(f"start {seed}: {found['episodes'][0]}; first state off by {place['first']:.1e}; seen {server.seen[0]}")
    print(f"{successes} of {given.episodes} played back through openpi's codec are a success")

    def broken(observation):
        raise KeyError("observation/exterior_image_1_left")
    server = Server(broken)
    try:
        answer([os.path.join(given.programs, "calibration"), "policy", "run", "--task", task, "--policy", f"ws://127.0.0.1:{server.port}"])
        print("a server's error was not noticed")
    except Failed as error:
        print(f"a server's error is said so: {error}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
