"""A policy behind openpi's websocket protocol, asked for actions."""
import msgpack
import numpy as np
from websockets.sync.client import connect


def packed(value):
    if isinstance(value, np.ndarray):
        return {b"__ndarray__": True, b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
    raise TypeError(f"{type(value).__name__} cannot be sent")


def unpacked(value):
    return np.frombuffer(value[b"data"], np.dtype(value[b"dtype"])).reshape(value[b"shape"]) if b"__ndarray__" in value else value


class Policy:
    def __init__(self, address):
        self.address = address
        try:
            self.socket = connect(address, compression=None, max_size=None)
        except OSError as error:
            raise ValueError(f"no policy answers at {address} ({error}); start its server") from None
        self.metadata = self.received()

    def received(self):
        answer = self.socket.recv()
        if isinstance(answer, str):
            raise ValueError(f"the policy at {self.address} failed: {answer.strip().splitlines()[-1]}")
        return msgpack.unpackb(answer, object_hook=unpacked)

    def actions(self, observation):
        """[actions, numbers]"""
        self.socket.send(msgpack.packb(observation, default=packed))
        return np.asarray(self.received()["actions"], float)
