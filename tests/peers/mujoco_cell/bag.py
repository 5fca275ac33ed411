"""A clip as `ros2 bag record` writes it: MCAP with CDR messages."""
import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

from . import fr3, laboratory

TYPES = get_typestore(Stores.ROS2_HUMBLE)
START_NS = 1_760_000_000_000_000_000
TICK_NS = 1_000_000

Header, Time = TYPES.types["std_msgs/msg/Header"], TYPES.types["builtin_interfaces/msg/Time"]
JointState, PoseStamped = TYPES.types["sensor_msgs/msg/JointState"], TYPES.types["geometry_msgs/msg/PoseStamped"]
Pose, Point, Quaternion = (TYPES.types[f"geometry_msgs/msg/{name}"] for name in ("Pose", "Point", "Quaternion"))


def header(ns):
    return Header(stamp=Time(sec=ns // 10**9, nanosec=ns % 10**9), frame_id=fr3.BASE_FRAME)


def joints(ns, q, dq, tau):
    return JointState(header=header(ns), name=fr3.NAMES, position=np.array(q), velocity=np.array(dq), effort=np.array(tau))


def pose(ns, place, turn):
    w, x, y, z = (float(v) for v in turn)
    point = Point(*(float(v) for v in place))
    return PoseStamped(header=header(ns), pose=Pose(position=point, orientation=Quaternion(x=x, y=y, z=z, w=w)))


class Bag:
    """An open clip."""

    def __init__(self, stream):
        self.writer, self.channels = Writer(stream, compression=CompressionType.ZSTD), {}
        self.writer.start(profile="ros2", library="twinalign peers")

    def write(self, topic, ns, message):
        kind = message.__msgtype__
        if topic not in self.channels:
            text, _ = TYPES.generate_msgdef(kind, ros_version=2)
            schema = self.writer.register_schema(kind, "ros2msg", text.encode())
            self.channels[topic] = self.writer.register_channel(topic, "cdr", schema)
        self.writer.add_message(self.channels[topic], ns, bytes(TYPES.serialize_cdr(message, kind)), ns)

    def close(self):
        self.writer.finish()


def write(stream, desired, measured, poses, log, rng):
    """`desired` and `measured`: arrays q, dq, tau (None where not logged); `poses`: (ns, place, turn) in order; `log`: which rows are kept."""
    bag = Bag(stream)
    row = lambda series, i: [[] if array is None else array[i] for array in series]
    events = []
    for kind, every in ((0, log.measured_every), (1, log.every)):
        kept, stamps = log.stamps(len(desired[0]), every, TICK_NS, rng)
        events += [(START_NS + int(ns), kind, int(i)) for i, ns in zip(kept, stamps)]
    events += [(ns, 2, i) for i, (ns, _, _) in enumerate(poses)]
    for ns, kind, i in sorted(events):
        if kind == 2:
            bag.write(laboratory.OBJECT, ns, pose(*poses[i]))
        else:
            topic, series = ((laboratory.MEASURED, measured), (laboratory.DESIRED, desired))[kind]
            bag.write(topic, ns, joints(ns, *row(series, i)))
    bag.close()
