"""Drawn pictures of a table with a print, a board and a box, from known places, for the tests."""
import cv2
import numpy as np

import scale

BOARD = "5x7,0.03,0.022,DICT_5X5_100"
SIZE, FOCAL = (480, 360), 430.0


def grain(generator, rows, columns):
    """A print with details of all sizes."""
    out = np.zeros((rows, columns, 3))
    for step in (4, 8, 16, 48):
        small = generator.normal(0, 1, (-(-rows // step), -(-columns // step), 3))
        out += cv2.resize(small, (columns, rows), interpolation=cv2.INTER_LINEAR) * step ** 0.3
    return np.clip(128 + 50 * out, 0, 255).astype(np.uint8)


class Scene:
    """A table of 0.9 m with a board of 5 x 7 squares on it, and a box; z up."""

    def __init__(self):
        generator = np.random.default_rng(0)
        table = grain(generator, 900, 900)  # a pixel is a millimetre
        board = scale.Board(BOARD).boards[0].generateImage((500, 700), marginSize=0)
        board = cv2.cvtColor(cv2.resize(board, (150, 210), interpolation=cv2.INTER_AREA), cv2.COLOR_GRAY2BGR)
        table[480:690, 520:670] = board
        self.faces = [(table, [-0.45, 0.45, 0.0], [0.9, 0, 0], [0, -0.9, 0])]
        low, high, up = np.array([-0.1, -0.08, 0.0]), np.array([0.06, 0.06, 0.12]), 0.12
        wide, deep = high[0] - low[0], high[1] - low[1]
        print_of = lambda across, down: grain(generator, round(1500 * down), round(1500 * across))
        self.sides = [(print_of(wide, up), [low[0], low[1], up], [wide, 0, 0], [0, 0, -up]),
                      (print_of(deep, up), [high[0], low[1], up], [0, deep, 0], [0, 0, -up]),
                      (print_of(wide, up), [high[0], high[1], up], [-wide, 0, 0], [0, 0, -up]),
                      (print_of(deep, up), [low[0], high[1], up], [0, -deep, 0], [0, 0, -up]),
                      (print_of(wide, deep), [low[0], high[1], up], [wide, 0, 0], [0, -deep, 0])]

    def drawn(self, turn, place):
        """The picture of a camera with axes `turn` (rows: right, down, forwards) at `place`."""
        size = (2 * SIZE[0], 2 * SIZE[1])
        out = np.full((size[1], size[0], 3), 90, np.uint8)
        inside = np.array([[2 * FOCAL, 0, SIZE[0] - 0.5], [0, 2 * FOCAL, SIZE[1] - 0.5], [0, 0, 1]])
        for picture, corner, across, down in self.faces + self.sides:
            corner, across, down = map(np.array, (corner, across, down))
            if np.cross(across, down) @ (corner - place) <= 0:
                continue  # seen from behind
            rows, columns = picture.shape[:2]
            # From a pixel of the print, whose corner is -0.5, -0.5, to the camera.
            to = np.column_stack([across / columns, down / rows, corner + 0.5 * across / columns + 0.5 * down / rows - place])
            onto = inside @ turn @ to
            warped = cv2.warpPerspective(picture, onto, size, flags=cv2.INTER_LINEAR)
            covers = cv2.warpPerspective(np.full((rows, columns), 255, np.uint8), onto, size, flags=cv2.INTER_NEAREST) > 0
            out[covers] = warped[covers]
        return cv2.resize(out, SIZE, interpolation=cv2.INTER_AREA)


def looking(place, at):
    forwards = (at - place) / np.linalg.norm(at - place)
    right = np.cross(forwards, [0, 0, 1])
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(forwards, right), forwards])


def cameras(count):
    for k in range(count):
        angle, height, far = 2 * np.pi * k / count, (0.3, 0.45)[k % 2], 0.62
        place = np.array([far * np.cos(angle), far * np.sin(angle), height])
        yield looking(place, np.array([0.03, -0.02, 0.02])), place
