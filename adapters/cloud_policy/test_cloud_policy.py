"""A policy learns from a made-up data set where a box is, goes on after a Ctrl-C as if there had been none, and is served.

    python -m unittest discover adapters/cloud_policy
"""
import asyncio
import io
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import msgpack
import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import torch
from PIL import Image
from websockets.asyncio.client import connect

import seeing
import serve
from checkpoint import Trained, read
from data_set import Frames, moving
from network import Policy

HERE = os.path.dirname(os.path.abspath(__file__))
TASK = """horizon = 1.0
[arm]
body = "tool"
base = [0.1, 0.0, 0.0]
[[camera]]
name = "above"
position = [0.6, 0.0, 1.0]
look_at = [0.6, 0.0, 0.0]
width = 64
height = 48
"""


def depth(camera, x, y):
    """A table, and on it a box of 0.1 m whose middle is at x, y from the arm's base [m]."""
    rays, at = camera.rays.astype(float), camera.place
    hit = lambda z: (rays * ((z - at[2]) / rays[:, 2:]) + at)
    top = hit(0.1)
    inside = (abs(top[:, 0] - x) < 0.05) & (abs(top[:, 1] - y) < 0.05)
    return np.where(inside, 900, 1000).astype(np.uint16).reshape(camera.rows, camera.columns)


def colour(camera, x, y):
    """The same in black and white, as a PNG."""
    stream = io.BytesIO()
    Image.fromarray(((depth(camera, x, y) == 900)[..., None] * [255, 255, 255]).astype(np.uint8)).save(stream, "PNG")
    return stream.getvalue()


def write(folder, camera, episodes=40, frames=3):
    generator, rows = np.random.default_rng(0), []
    for episode in range(episodes):
        x, y = generator.uniform([0.4, -0.15], [0.6, 0.15])
        stream = io.BytesIO()
        Image.fromarray(depth(camera, x, y)).save(stream, "PNG")
        for _ in range(frames):
            rows.append({"observation.state": generator.uniform(-1, 1, 2).tolist(), "action": [x, y], "episode_index": episode,
                         "observation.images.above_depth": {"bytes": stream.getvalue(), "path": None},
                         "observation.images.above": {"bytes": colour(camera, x, y), "path": None}})
    os.makedirs(f"{folder}/meta")
    os.makedirs(f"{folder}/data/chunk-000")
    features = {"action": {"names": ["tool.x", "tool.y"]}, "observation.images.above_depth": {}, "observation.images.above": {}}
    with open(f"{folder}/meta/info.json", "w") as stream:
        json.dump({"fps": 20, "features": features}, stream)
    numbers = pa.list_(pa.float32())
    image = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    schema = pa.schema([("observation.state", numbers), ("action", numbers), ("episode_index", pa.int64()),
                        ("observation.images.above_depth", image), ("observation.images.above", image)])
    parquet.write_table(pa.Table.from_pylist(rows, schema), f"{folder}/data/chunk-000/file-000.parquet")


class CloudPolicy(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.held = tempfile.TemporaryDirectory()
        cls.folder = cls.held.name
        cls.task = f"{cls.folder}/task.toml"
        with open(cls.task, "w") as stream:
            stream.write(TASK)
        _, cls.camera = seeing.Camera.of_task(cls.task, None)
        write(f"{cls.folder}/data_set", cls.camera)

    @classmethod
    def tearDownClass(cls):
        cls.held.cleanup()

    def command(self, out, steps, *more):
        return [sys.executable, f"{HERE}/train.py", f"{self.folder}/data_set", "--task", self.task, "--out", f"{self.folder}/{out}",
                "--steps", str(steps), "--points", "128", "--horizon", "4", "--still", "0", *more]

    def test_a_cloud_lies_where_the_box_is(self):
        cloud = self.camera.cloud(depth(self.camera, 0.5, -0.1), np.random.default_rng(0))
        self.assertLess(np.abs(cloud.mean(axis=0) - [0.5, -0.1, 0.1]).max(), 0.01)
        # The table is left out.
        self.assertGreater(cloud[:, 2].min(), 0.09)

    def test_chunks_end_with_their_episode(self):
        frames = Frames.__new__(Frames)
        frames.episode = np.array([0, 0, 0, 1, 1])
        self.assertEqual(frames.chunks(3).tolist(), [[0, 1, 2], [1, 2, 2], [2, 2, 2], [3, 4, 4], [4, 4, 4]])

    def test_frames_in_which_nothing_is_commanded_are_left_out(self):
        action = np.array([[0.0, 0], [0.004, 0], [0.004, 0.006], [0.008, 0.006], [0.012, 0.006], [0.012, 0.006], [1.0, 0.0], [1.0, 0.0]])
        episode = np.array([0, 0, 0, 0, 0, 0, 1, 1])
        # Slow motion goes on; the first and the last frame of an episode stay.
        self.assertEqual(moving(action, episode, 0.005).tolist(), [0, 2, 4, 5, 6, 7])
        self.assertEqual(moving(action, episode, 0.0).tolist(), list(range(8)))

    def test_chunks_are_made_of_what_demonstrations_are(self):
        generator = np.random.default_rng(0)
        state, way = (torch.from_numpy(generator.uniform(-0.3, 0.3, (100, 2)).astype(np.float32)) for _ in range(2))
        lines = state[:, None] + way[:, None] * torch.linspace(0.1, 1.0, 10)[:, None]
        policy = Policy("cloud", 2, 10, 2)
        policy.find_directions(state, lines)
        again = policy.chunk(state, policy.along(state, lines))
        self.assertLess((again - lines).abs().max(), 1e-5)
        # Whatever it says is a line from the state on.
        parts = torch.from_numpy(generator.standard_normal((5, 2)).astype(np.float32))
        self.assertLess(policy.chunk(state[:5], parts).diff(n=2, dim=1).abs().max(), 1e-5)

    def test_it_learns_where_the_box_is_and_says_so_when_asked(self):
        subprocess.run(self.command("learned", 600), check=True, capture_output=True)
        trained = Trained(f"{self.folder}/learned")

        async def ask(places):
            async with serve.serve(serve.handler(trained, 0), "127.0.0.1", 0, compression=None) as server:
                port = server.sockets[0].getsockname()[1]
                async with connect(f"ws://127.0.0.1:{port}", compression=None) as socket:
                    metadata, errors = msgpack.unpackb(await socket.recv()), []
                    for place in places:
                        seen = {"observation/state": np.zeros(2, np.float32), "observation/depth/above": depth(self.camera, *place)}
                        await socket.send(msgpack.packb(seen, default=serve.packed))
                        actions = msgpack.unpackb(await socket.recv(), object_hook=serve.unpacked)["actions"]
                        errors.append(np.abs(actions - place).mean())
                    await socket.send(msgpack.packb({"prompt": ""}))
                    return metadata, errors, await socket.recv()
        places = np.random.default_rng(1).uniform([0.42, -0.13], [0.58, 0.13], (20, 2))
        metadata, errors, said = asyncio.run(ask(places))
        self.assertEqual((metadata["horizon"], metadata["see"], metadata["actions"]), (4, "cloud", ["tool.x", "tool.y"]))
        # Whoever knows nothing is 0.05 m off.
        self.assertLess(np.mean(errors), 0.015)
        self.assertIn("has no `observation/state`", said)

    def test_pictures_are_seen_in_place_of_points(self):
        subprocess.run(self.command("pictures", 5, "--see", "pictures"), check=True, capture_output=True)
        acting = serve.Acting(Trained(f"{self.folder}/pictures"), 0)
        picture = np.array(Image.open(io.BytesIO(colour(self.camera, 0.5, 0.0))))
        answer = acting.answer({"observation/state": np.zeros(2, np.float32), "observation/image/above": picture})
        self.assertEqual(answer["actions"].shape, (4, 2))

    def test_after_ctrl_c_it_goes_on_as_if_there_had_been_none(self):
        subprocess.run(self.command("whole", 60), check=True, capture_output=True)
        child = subprocess.Popen(self.command("parts", 60), stderr=subprocess.PIPE)
        beside = f"{self.folder}/parts/checkpoint.pt"
        while b"goes on at step" not in child.stderr.readline():
            pass
        time.sleep(0.5)
        asked = time.monotonic()
        child.send_signal(signal.SIGINT)
        child.communicate()
        code = child.returncode
        self.assertLess(time.monotonic() - asked, 20.0)
        if code:
            self.assertEqual(code, 130)
            self.assertLess(read(beside)["step"], 60)
            subprocess.run(self.command("parts", 60), check=True, capture_output=True)
        one, other = read(f"{self.folder}/whole/checkpoint.pt"), read(beside)
        self.assertEqual(one["step"], other["step"])
        self.assertTrue(all(torch.equal(one["mean"][key], other["mean"][key]) for key in one["mean"]))
        refused = subprocess.run(self.command("parts", 60, "--seed", "1"), capture_output=True, text=True)
        self.assertIn("is of another training", refused.stderr)


if __name__ == "__main__":
    unittest.main()
