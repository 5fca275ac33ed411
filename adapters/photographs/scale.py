"""How long one unit of a model is, by a ChArUco board that lies in the pictures.

Its corners are found in each picture (Garrido-Jurado et al. 2014, by OpenCV), placed in the model by the pictures' poses, and the board is laid
onto them by the similarity of least squares (Umeyama 1991). COLMAP's pixels count from the picture's corner, OpenCV's from the middle of the first.
"""
import cv2
import numpy as np

from pictures import Refused

FEWEST = 3  # pictures that show the board
CORNERS = 4  # of it in a picture, and of those that are placed
APART = np.radians(3.0)  # directions from which a corner is seen
OFF = 3.0  # a corner further from where the others see it is another one [pixel]
BENT = 0.02  # corners off by so much of the board's diagonal are not those of this board
EXPECTED = "give COLUMNSxROWS,SQUARE,MARKER,DICTIONARY, for example 5x7,0.034,0.028,DICT_5X5_100"


class Board:
    """As `calibration hand-eye --board` writes it: `COLUMNSxROWS,SQUARE,MARKER,DICTIONARY`, lengths in metres."""

    def __init__(self, text):
        parts = [part.strip() for part in text.split(",")]
        try:
            squares, square, marker, dictionary = parts
            columns, rows = map(int, squares.split("x"))
            square, marker = float(square), float(marker)
        except ValueError:
            raise Refused(f"--board {text}: {EXPECTED}") from None
        if not (3 <= columns <= 50 and 3 <= rows <= 50):
            raise Refused(f"--board {text}: a board has 3 to 50 squares each way")
        if not (1e-3 <= marker < square <= 1.0):
            raise Refused(f"--board {text}: a marker is smaller than its square; both in metres, a millimetre to a metre")
        known = {name[5:].lower(): name for name in dir(cv2.aruco) if name.startswith("DICT_")}
        name = known.get(dictionary.lower().removeprefix("dict_"))
        if name is None:
            raise Refused(f"--board {text}: no dictionary is called {dictionary}; OpenCV's names hold, like DICT_4X4_50")
        markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        if len(markers.bytesList) < columns * rows // 2:
            raise Refused(f"--board {text}: the board has {columns * rows // 2} markers, {name} only {len(markers.bytesList)}")
        self.text, self.boards = text, []
        # Boards of an even number of rows were drawn otherwise before OpenCV 4.6.
        for old in (False, True) if rows % 2 == 0 else (False,):
            board = cv2.aruco.CharucoBoard((columns, rows), square, marker, markers)
            board.setLegacyPattern(old)
            self.boards.append(board)
        self.corners = np.asarray(self.boards[0].getChessboardCorners(), float)
        self.diagonal = float(np.hypot(columns, rows) * square)

    def seen(self, paths, note):
        """For each picture that shows the board: {number of the corner: pixel as COLMAP counts}."""
        best = {}
        for board in self.boards:
            parameters = cv2.aruco.DetectorParameters()
            parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE  # markers; the board's own corners are refined anyway
            detector, found = cv2.aruco.CharucoDetector(board, cv2.aruco.CharucoParameters(), parameters), {}
            for count, (name, path) in enumerate(paths.items()):
                if count and count % 25 == 0:
                    note(f"looks for the board: {count} of {len(paths)}")
                grey = cv2.imdecode(np.fromfile(path, np.uint8), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
                corners, numbers, _, _ = detector.detectBoard(grey)
                if numbers is not None and len(numbers) >= CORNERS:
                    found[name] = {int(number): place + 0.5 for number, place in zip(np.ravel(numbers), np.reshape(corners, (-1, 2)).astype(float))}
            if sum(map(len, found.values())) > sum(map(len, best.values())):
                best = found
        self.enough(best, len(paths), "pictures")
        return best

    def enough(self, seen, count, what):
        if len(seen) < FEWEST:
            raise Refused(f"the board {self.text} is seen in {len(seen)} of {count} {what}, {FEWEST} are the least: check --board against the print, "
                          "lay it flat and whole into the picture, or leave --board out and find --scale as the answer then says")


def placed(rays, starts):
    """The point nearest to rays from `starts` [n, 3] along `rays` [n, 3] of length 1."""
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    return np.linalg.solve(across.sum(axis=0), (across @ starts[:, :, None]).sum(axis=0)[:, 0])


def similarity(source, goal):
    """Scale, rotation and translation that take points onto others with the least squares (Umeyama 1991)."""
    middle, onto = source.mean(axis=0), goal.mean(axis=0)
    left, sizes, right = np.linalg.svd((goal - onto).T @ (source - middle))
    proper = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    turn = left * proper @ right
    scale = float((sizes * proper).sum() / ((source - middle) ** 2).sum())
    return scale, turn, onto - scale * turn @ middle


class View:
    """The pose and the camera of one picture of a model."""

    def __init__(self, image):
        pose = image.cam_from_world()
        self.turn, self.shift, self.camera = pose.rotation.matrix(), np.asarray(pose.translation), image.camera
        self.place = -self.turn.T @ self.shift

    def rays(self, pixels):
        plane = np.asarray(self.camera.cam_from_img(np.asarray(pixels, float)))
        rays = np.column_stack([plane, np.ones(len(plane))]) @ self.turn
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def off(self, point, pixel):
        """How far from a pixel the point appears [pixel]."""
        inside = self.turn @ point + self.shift
        if inside[2] <= 0:
            return np.inf
        return float(np.linalg.norm(np.asarray(self.camera.img_from_cam(inside)).ravel() - pixel))


def corners_placed(views, seen):
    """Corners of the board in the model's frame: {number: place}, of those that two pictures and more agree on."""
    out = {}
    for number in sorted({number for corners in seen.values() for number in corners}):
        there = [(views[name], corners[number]) for name, corners in seen.items() if number in corners]
        while len(there) >= 2:
            rays = np.array([view.rays([pixel])[0] for view, pixel in there])
            if np.arccos(np.clip((rays @ rays.T).min(), -1, 1)) < APART:
                break
            point = placed(rays, np.array([view.place for view, _ in there]))
            offs = [view.off(point, pixel) for view, pixel in there]
            if max(offs) <= OFF:
                out[number] = point
                break
            there.pop(int(np.argmax(offs)))
    return out


def fitted(points, goal):
    """The similarity onto the board's corners, and how far they are off it [unit of goal], without the few that do not fit."""
    kept = np.ones(len(points), bool)
    for _ in range(10):
        scale, turn, shift = similarity(points[kept], goal[kept])
        off = np.linalg.norm(scale * points @ turn.T + shift - goal, axis=1)
        inside = off <= 4 * np.median(off) + 1e-12
        if (inside == kept).all() or inside.sum() < CORNERS:
            break
        kept = inside
    return scale, turn, shift, float(np.sqrt((off[kept] ** 2).mean())), int(kept.sum())


def of_board(board, reconstruction, seen):
    """Metres for one unit of the model, how sure that is, and the board's plane in metres of the model's axes, towards the cameras."""
    images = {reconstruction.image(number).name: reconstruction.image(number) for number in reconstruction.reg_image_ids()}
    seen = {name: corners for name, corners in seen.items() if name in images}
    board.enough(seen, len(images), "pictures that have a pose")
    views = {name: View(images[name]) for name in seen}
    points = corners_placed(views, seen)
    if len(points) < CORNERS:
        raise Refused(f"the board is seen in {len(seen)} pictures, but only {len(points)} of its corners lie at one place in all of them: "
                      "keep it where it is while the pictures are taken, and take some from other sides")
    numbers = sorted(points)
    scale, turn, shift, off, count = fitted(np.array([points[n] for n in numbers]), board.corners[numbers])
    if off > BENT * board.diagonal:
        raise Refused(f"the board's corners are {1e3 * off:.1f} mm off those of {board.text}: check its columns, rows and dictionary, glue it to "
                      "something flat, and keep it where it is while the pictures are taken")
    # The board's z points into it; the plane as --table takes it has its normal towards the cameras.
    normal = turn.T @ [0.0, 0.0, -1.0]
    level = float(normal @ np.mean([scale * points[n] for n in numbers], axis=0))
    if np.mean([normal @ (scale * view.place) - level for view in views.values()]) < 0:
        normal, level = -normal, -level
    # Each corner is off by `off`; across the board's half diagonal that is this share of the scale.
    share = off / np.sqrt(count) / (0.25 * board.diagonal)
    return {"metres": scale, "spread": float(share), "pictures": len(seen), "corners": count, "off_mm": 1e3 * off,
            "table": [*map(float, normal), level]}
