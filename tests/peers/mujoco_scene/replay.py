"""The commands of a recorded episode in MuJoCo, open loop: where moved bodies were told to be, row by row."""
import mujoco
import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from .run import Scene


class Replay(Scene):
    """An episode begun where the twin began, with the targets of its clip."""

    def __init__(self, task, bodies, clip, step=1e-3):
        super().__init__(task, bodies, step)
        self.targets = {}
        with open(clip, "rb") as stream:
            for _, channel, _, said in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
                if channel.topic.startswith("/object/") and channel.topic.endswith("/target"):
                    place, turn = said.pose.position, said.pose.orientation
                    row = (said.twinalign.stamp_ns * 1e-9, np.array([place.x, place.y, place.z]), np.array([turn.w, turn.x, turn.y, turn.z]))
                    self.targets.setdefault(channel.topic.split("/")[2], []).append(row)

    def pose_at(self, name, now):
        rows = self.targets[name]
        times = [row[0] for row in rows]
        after = int(np.searchsorted(times, now, side="right"))
        if after == 0 or after == len(rows):
            return rows[max(after - 1, 0)][1:]
        (since, place, turn), (then, to, turned) = rows[after - 1], rows[after]
        share, way, result = (now - since) / (then - since), np.zeros(3), turn.copy()
        mujoco.mju_subQuat(way, turned, turn)
        mujoco.mju_quatIntegrate(result, way, share)
        return place + share * (to - place), result
