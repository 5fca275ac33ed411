"""A recording by librealsense of a camera that does not exist: its software device, its recorder.

    python recording.py OUT.bag          # needs pyrealsense2 and numpy

Two seconds of depth (millimetres) and colour at 640x480 and 30 Hz, stamped by a hardware clock: a box 0.1 m before a wall at 1 m
slides to the right. One frame is missing on purpose.
"""

import sys
import time

import numpy
import pyrealsense2 as rs

WIDTH, HEIGHT, RATE, FRAMES, MISSING, FOCAL = 640, 480, 30, 60, 20, 380.0
WALL, BOX = 1000, 900  # mm


def lens():
    found = rs.intrinsics()
    found.width, found.height = WIDTH, HEIGHT
    found.fx = found.fy = FOCAL
    found.ppx, found.ppy = WIDTH / 2, HEIGHT / 2
    found.model, found.coeffs = rs.distortion.none, [0.0] * 5
    return found


def add_stream(sensor, number, kind, pixel, size):
    stream = rs.video_stream()
    stream.uid, stream.index, stream.type, stream.fmt, stream.bpp = number, 0, kind, pixel, size
    stream.width, stream.height, stream.fps, stream.intrinsics = WIDTH, HEIGHT, RATE, lens()
    return sensor.add_video_stream(stream)


def picture(number):
    """Depth and colour of one moment."""
    depth, color = numpy.full((HEIGHT, WIDTH), WALL, numpy.uint16), numpy.full((HEIGHT, WIDTH, 3), 120, numpy.uint8)
    left = 80 + 4 * number
    depth[200:260, left : left + 80] = BOX
    color[200:260, left : left + 80] = (200, 60, 40)
    return depth, color


def main(path):
    device = rs.software_device()
    sensors = [device.add_sensor("Stereo Module"), device.add_sensor("RGB Camera")]
    sizes = [2, 3]
    streams = [
        add_stream(sensors[0], 1, rs.stream.depth, rs.format.z16, sizes[0]),
        add_stream(sensors[1], 2, rs.stream.color, rs.format.rgb8, sizes[1]),
    ]
    sensors[0].add_read_only_option(rs.option.depth_units, 0.001)
    recorder = rs.recorder(path, device)
    queue = rs.frame_queue(500)
    recorded = recorder.query_sensors()
    for sensor, stream in zip(recorded, streams):
        sensor.open(stream)
        sensor.start(queue)
    for number in range(FRAMES):
        if number == MISSING:
            continue
        for sensor, stream, size, pixels in zip(sensors, streams, sizes, picture(number)):
            frame = rs.software_video_frame()
            frame.pixels, frame.stride, frame.bpp = pixels, WIDTH * size, size
            frame.timestamp, frame.domain = 1000.0 * number / RATE, rs.timestamp_domain.hardware_clock
            frame.frame_number, frame.profile = number, stream.as_video_stream_profile()
            sensor.on_video_frame(frame)
        time.sleep(0.01)  # the recorder writes in a thread of its own
    time.sleep(0.5)
    for sensor in recorded:
        sensor.stop()
        sensor.close()


if __name__ == "__main__":
    main(sys.argv[1])
