"""Serves a policy that train.py has trained, by openpi's websocket protocol:

    python adapters/cloud_policy/serve.py laptop_policy --port 8000
    calibration policy run --task twin/tasks/close_laptop.toml --policy ws://localhost:8000 --chunk 16
    calibration evaluate --policies cloud=ws://localhost:8000 --tasks twin/tasks/close_laptop.toml --chunk 16 --out cloud

It needs `observation/state` and `observation/depth/CAMERA` (or `observation/image/CAMERA`) and answers with `actions`, a chunk of them.
"""
import argparse
import asyncio
import signal
import sys
import traceback

try:
    import msgpack
    import numpy as np
    import torch
    import websockets
    from websockets.asyncio.server import serve

    import seeing
    from checkpoint import Trained
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; `pip install -r adapters/cloud_policy/requirements.txt` in a virtual environment")


def packed(value):
    """For msgpack: an array is a map of its bytes, element and shape."""
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return {b"__ndarray__": True, b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
    raise TypeError(f"{type(value).__name__} cannot be sent")


def unpacked(value):
    if b"__ndarray__" in value:
        element = np.dtype(value[b"dtype"])
        if element.kind not in "biuf":
            raise ValueError(f"an array of {element} is not taken")
        return np.frombuffer(value[b"data"], element).reshape(value[b"shape"])
    return value


class Acting:
    """Answers to one client; its draws begin anew with each."""

    def __init__(self, trained, seed):
        self.trained = trained
        self.points, self.noise = np.random.default_rng(seed), torch.Generator().manual_seed(seed)

    def answer(self, observation):
        trained, see = self.trained, self.trained.settings["see"]
        kind = "depth" if see == "cloud" else "image"
        state = self.taken(observation, "observation/state")
        picture = self.taken(observation, f"observation/{kind}/{trained.camera_name}")
        if state.shape != (len(trained.names),):
            raise ValueError(f"observation/state has {state.shape} numbers, the policy was trained on {len(trained.names)}")
        if see == "cloud":
            depth = picture.reshape(picture.shape[:2])
            seen = seeing.drawn(trained.camera.cloud(depth, self.points), trained.settings["points"], self.points)
        else:
            seen = (seeing.small(picture).astype(np.float32) / 255).transpose(2, 0, 1)
        seen, state = (torch.from_numpy(np.ascontiguousarray(part[None])) for part in (seen, trained.scale.to(state.astype(np.float32))))
        actions = trained.policy.act(seen, state, self.noise)[0].numpy()
        return {"actions": trained.scale.back(actions).astype(np.float32)}

    @staticmethod
    def taken(observation, key):
        if key not in observation:
            raise ValueError(f"the observation has no `{key}`; it has {', '.join(map(str, observation))}")
        return observation[key]


def handler(trained, seed):
    metadata = {"policy": "twinalign cloud_policy", "see": trained.settings["see"], "camera": trained.camera_name, "steps": trained.step,
                "horizon": trained.settings["horizon"], "rate": trained.rate, "actions": trained.names}

    async def handle(socket):
        acting = Acting(trained, seed)
        try:
            await socket.send(msgpack.packb(metadata, default=packed))
            async for message in socket:
                try:
                    answer = acting.answer(msgpack.unpackb(message, object_hook=unpacked))
                except Exception:
                    await socket.send(traceback.format_exc())
                    await socket.close(1011)
                    return
                await socket.send(msgpack.packb(answer, default=packed))
        except websockets.ConnectionClosed:
            pass
    return handle


async def run(trained, given):
    ended = asyncio.get_running_loop().create_future()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, lambda: ended.done() or ended.set_result(None))
    async with serve(handler(trained, given.seed), given.host, given.port, compression=None, max_size=64 << 20, close_timeout=0.2) as server:
        port = server.sockets[0].getsockname()[1]
        print(f"policy of {trained.step} steps at ws://{given.host}:{port}", flush=True)
        await ended


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkpoint", metavar="CHECKPOINT", help="of train.py: the file or its folder")
    parser.add_argument("--port", type=int, default=8000, metavar="P", help="0: any that is free [default: 8000]")
    parser.add_argument("--host", default="localhost", metavar="HOST", help="who may ask: localhost alone, or 0.0.0.0 [default: localhost]")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of noise and points")
    parser.add_argument("--threads", type=int, default=1, metavar="N", help="of torch [default: 1]")
    given = parser.parse_args()
    torch.set_num_threads(given.threads)
    try:
        asyncio.run(run(Trained(given.checkpoint), given))
    except (ValueError, OSError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
