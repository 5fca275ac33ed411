"""Demonstrations in the layout of `calibration export-episodes --to lerobot`: the numbers and pictures of LeRobot's version 3.0 without its
statistics and its lists of episodes and tasks."""
import io
import json
import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
from PIL import Image

PICTURE = pa.struct([("bytes", pa.binary()), ("path", pa.string())])


def png(picture):
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "PNG", compress_level=1)
    return {"bytes": stream.getvalue(), "path": None}


class Written:
    def __init__(self, out, rate, stage):
        self.out, self.rate, self.episodes, self.index = out, rate, 0, 0
        state, around = stage.names()
        camera, shape = stage.camera["name"], [stage.rows, stage.columns]
        numbers = lambda names: {"dtype": "float32", "names": names, "shape": [len(names)]}
        image = lambda channels: {"dtype": "image", "names": ["height", "width", "channels"], "shape": [*shape, channels]}
        self.features = {"observation.state": numbers(state), "observation.environment_state": numbers(around), "action": numbers(state)}
        self.features[f"observation.images.{camera}_depth"] = {**image(1), "info": {"depth_unit": "mm", "is_depth_map": True}}
        if stage.pictures:
            self.features[f"observation.images.{camera}"] = image(3)
        whole = ["frame_index", "episode_index", "index", "task_index"]
        self.features |= {name: {"dtype": "int64", "names": None, "shape": [1]} for name in whole}
        self.features["timestamp"] = {"dtype": "float32", "names": None, "shape": [1]}
        kinds = {"float32": pa.float32(), "int64": pa.int64()}
        kind = lambda feature: PICTURE if feature["dtype"] == "image" else kinds["float32"] if feature["shape"] == [1] and feature["names"] is None else pa.list_(pa.float32())
        self.schema = pa.schema([(name, pa.int64() if name in whole else kind(feature)) for name, feature in self.features.items()])
        os.makedirs(os.path.join(out, "data", "chunk-000"))
        self.table = parquet.ParquetWriter(os.path.join(out, "data", "chunk-000", "file-000.parquet"), self.schema)

    def episode(self, frames):
        """`frames`: (state, surroundings, depth, picture or None, action) of each."""
        state, around, depth, picture, action = zip(*frames)
        images = [name for name in self.features if name.startswith("observation.images.")]
        columns = {"observation.state": list(state), "observation.environment_state": list(around), "action": list(action),
                   images[0]: [png(one) for one in depth]}
        if len(images) > 1:
            columns[images[1]] = [png(one) for one in picture]
        count = np.arange(len(frames))
        columns |= {"frame_index": count, "episode_index": 0 * count + self.episodes, "index": count + self.index, "task_index": 0 * count,
                    "timestamp": (count / self.rate).astype(np.float32)}
        self.table.write_table(pa.table([pa.array(columns[name], field.type) for name, field in zip(self.schema.names, self.schema)], schema=self.schema))
        self.episodes, self.index = self.episodes + 1, self.index + len(frames)

    def close(self):
        self.table.close()
        os.makedirs(os.path.join(self.out, "meta"))
        said = {"codebase_version": "v3.0", "robot_type": "mujoco", "fps": self.rate, "total_episodes": self.episodes, "total_frames": self.index,
                "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet", "features": self.features}
        with open(os.path.join(self.out, "meta", "info.json"), "w") as stream:
            json.dump(said, stream, indent=2)
