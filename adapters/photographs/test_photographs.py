"""Pictures of a drawn table with a box and a board become a scan whose poses and scale are the true ones; what is wrong is said in a sentence.

    OMP_NUM_THREADS=1 python -m unittest discover adapters/photographs
"""
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import cv2
import numpy as np
import pycolmap
from PIL import ExifTags, Image

import folder
import model
import pictures
import scale
import video
from drawn import BOARD, SIZE, Scene, cameras, grain
from pictures import Refused

HERE = os.path.dirname(os.path.abspath(__file__))


def command(source, out, *more):
    return [sys.executable, f"{HERE}/poses.py", source, "--out", out, "--threads", "1", *more]


def run(*words):
    return subprocess.run(command(*words), capture_output=True, text=True)


class Photographs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cv2.setNumThreads(1)
        cls.held = tempfile.TemporaryDirectory()
        cls.folder = cls.held.name
        cls.source = f"{cls.folder}/täble pictures"
        os.makedirs(f"{cls.source}/masks")
        os.makedirs(f"{cls.source}/inner")
        scene, cls.truth = Scene(), {}
        for k, (turn, place) in enumerate(cameras(16)):
            picture = scene.drawn(turn, place)
            name, options = f"IMG {k} ü.jpg", {}
            if k == 3:  # taken with the phone on its side, in another order of pixels
                picture = np.ascontiguousarray(np.rot90(picture, 1))
                options["exif"] = Image.Exif()
                options["exif"][ExifTags.Base.Orientation] = 6
            Image.fromarray(picture[..., ::-1]).save(f"{cls.source}/{name}", quality=95, **options)
            cls.truth[name.replace(" ", "_")] = (turn, place)
            Image.fromarray(np.full(SIZE[::-1], 255, np.uint8)).save(f"{cls.source}/masks/IMG {k} ü.png")
        content = cls.content(f"{cls.source}/IMG 5 ü.jpg")
        for name, what in (("half.jpg", content[:len(content) // 2]), ("nothing.jpg", b""), ("copy.jpg", content), ("notes.txt", b"x")):
            with open(f"{cls.source}/{name}", "wb") as stream:
                stream.write(what)

    @classmethod
    def tearDownClass(cls):
        cls.held.cleanup()

    def out(self, name):
        return f"{self.folder}/{name}"

    @staticmethod
    def content(path):
        with open(path, "rb") as stream:
            return stream.read()

    def said(self, line, *words):
        """A refusal: one line without a traceback that holds these words."""
        done = run(*words)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertNotIn("Traceback", done.stderr)
        self.assertIn(line, done.stderr.splitlines()[-1])
        self.assertFalse(os.path.exists(self.out("refused")) or os.path.exists(self.out("refused.unfinished")))

    def test_poses_and_scale_are_the_true_ones(self):
        out = self.out("scan")
        done = run(self.source, out, "--board", BOARD, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        answer = json.loads(done.stdout)
        self.assertGreaterEqual(answer["with_pose"], 15)
        for word in ("half.jpg cannot be read", "nothing.jpg is empty", "copy.jpg", "inner", "notes.txt"):
            self.assertIn(word, done.stderr)
        self.assertEqual(sorted(os.listdir(out)), ["images", "masks", "photographs.json", "sparse"])
        self.assertEqual(len(os.listdir(f"{out}/images")), answer["with_pose"])
        self.assertEqual(len(os.listdir(f"{out}/masks")), answer["with_pose"])
        read = pycolmap.Reconstruction(f"{out}/sparse/0")
        images = [read.image(number) for number in read.reg_image_ids()]
        for image in images:
            with Image.open(f"{out}/images/{image.name}") as picture:
                self.assertEqual((picture.size, picture.getexif().get(ExifTags.Base.Orientation, 1)), (SIZE, 1))
        metres, turn, shift = scale.similarity(np.array([image.projection_center() for image in images]),
                                               np.array([self.truth[image.name][1] for image in images]))
        self.assertAlmostEqual(metres, 1.0, delta=0.01)
        off = [np.linalg.norm(metres * turn @ image.projection_center() + shift - self.truth[image.name][1]) for image in images]
        turned = [np.degrees(np.linalg.norm(cv2.Rodrigues(image.cam_from_world().rotation.matrix() @ turn.T @ self.truth[image.name][0].T)[0]))
                  for image in images]
        self.assertLess(np.median(off), 0.003)
        self.assertLess(np.median(turned), 0.3)
        # The table is level: its plane in the true frame is z = 0.
        normal, level = turn @ answer["scale"]["table"][:3], answer["scale"]["table"][3]
        self.assertGreater(normal[2], 0.999)
        self.assertLess(abs(metres * level + normal @ shift), 0.003)
        # The same pictures give the same scan; an earlier one is replaced where that is asked for, unless masks would be lost.
        self.said(f"{out} exists", self.source, out)
        first = self.content(f"{out}/sparse/0/images.bin")
        again = run(self.source, out, "--board", BOARD, "--force")
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertIn("Next: twin reconstruct object", again.stdout)
        self.assertEqual(self.content(f"{out}/sparse/0/images.bin"), first)
        shutil.copy(f"{out}/masks/IMG_0_ü.png", f"{out}/masks/drawn.png")
        self.said("holds masks that would be lost (drawn.png)", self.source, out, "--force")

    def test_ctrl_c_leaves_nothing(self):
        for stage in ("looks", "pairs of pictures", "poses"):
            child = subprocess.Popen(command(self.source, self.out("ended"), "--board", BOARD), stderr=subprocess.PIPE, stdout=subprocess.PIPE)
            said = b"-"
            while said and not said.startswith(stage.encode()) and not (stage == "looks" and said.startswith(b"folders")):
                said = child.stderr.readline()
            asked = time.monotonic()
            child.send_signal(signal.SIGINT)
            output, errors = child.communicate()
            self.assertLess(time.monotonic() - asked, 5.0)
            self.assertEqual((child.returncode, output), (130, b""))
            self.assertIn("nothing of it was kept", errors.decode().splitlines()[-1])
            self.assertFalse([name for name in os.listdir(self.folder) if name.startswith("ended")])

    def test_two_runs_do_not_write_one_scan(self):
        with folder.Unfinished(self.out("twice"), False):
            with self.assertRaisesRegex(Refused, "another run is writing"):
                folder.Unfinished(self.out("twice"), False).__enter__()
        self.assertFalse(os.path.exists(self.out("twice.unfinished")))
        # What a run that was killed has left is taken over.
        os.makedirs(self.out("twice.unfinished/work"))
        with folder.Unfinished(self.out("twice"), False) as unfinished:
            self.assertEqual(os.listdir(unfinished.path), [])
            unfinished.done()
        self.assertTrue(os.path.isdir(self.out("twice")))
        with self.assertRaisesRegex(Refused, "not a folder that this program alone"):
            folder.Unfinished(self.out("twice"), True)

    def test_what_is_wrong_is_said_in_a_sentence(self):
        out, few, blurry = self.out("refused"), self.out("few"), self.out("blurry")
        for place in (few, blurry, self.out("empty"), f"{self.out('outer')}/in"):
            os.makedirs(place)
        for k in range(12):
            name = f"IMG {k} ü.jpg"
            if k < 5:
                shutil.copy(f"{self.source}/{name}", few)
            picture = cv2.imdecode(np.fromfile(f"{self.source}/{name}", np.uint8), cv2.IMREAD_COLOR)
            Image.fromarray(cv2.GaussianBlur(picture, (0, 0), 9.0)).save(f"{blurry}/{k}.png")
        self.said("no such folder or video", self.out("nowhere"), out)
        self.said("no PNG or JPEG picture", self.out("empty"), out)
        self.said("give the one that holds the pictures", self.out("outer"), out)
        self.said("5 pictures can be used, 8 are the least", few, out)
        self.said("12 of 12 pictures are blurred", blurry, out)
        self.said("is one picture", f"{few}/IMG 0 ü.jpg", out)
        self.said("give COLUMNSxROWS", self.source, out, "--board", "5x7")
        self.said("is smaller than its square", self.source, out, "--board", "5x7,0.02,0.03,DICT_5X5_100")
        self.said("no dictionary is called", self.source, out, "--board", "5x7,0.03,0.02,DICT_5X5_77")
        self.said("is seen in 0 of 16 pictures", self.source, out, "--board", "5x7,0.03,0.02,DICT_6X6_100")
        with open(f"{few}/a.HEIC", "wb") as stream:
            stream.write(b"x")
        self.said("heif-convert", few, out)
        self.said("give an --out that can be written", self.source, f"{few}/a.HEIC/refused")

    def test_a_blurred_picture_is_found_beside_sharp_ones(self):
        generator = np.random.default_rng(1)
        greys = [grain(generator, 240, 320)[..., 0].astype(np.float32) for _ in range(9)]
        along = np.zeros((15, 15), np.float32)
        along[7] = 1 / 15
        noise = generator.normal(0, 2, greys[4].shape).astype(np.float32)
        greys[4] = cv2.filter2D(greys[4], -1, along) + noise
        sharp = [pictures.sharpness(grey) for grey in greys]
        self.assertEqual([at for at, bad in enumerate(pictures.blurred(sharp)) if bad], [4])
        self.assertNotIn(4, pictures.spread(sharp, 3))
        self.assertEqual(len(pictures.spread(sharp, 3)), 3)

    def test_names_are_in_the_order_of_their_numbers(self):
        self.assertEqual(sorted(["IMG_10.jpg", "IMG_9.jpg", "a.jpg", "2.png"], key=pictures.natural), ["2.png", "a.jpg", "IMG_9.jpg", "IMG_10.jpg"])

    def test_the_focal_length_begins_with_what_exif_says(self):
        exif, base = Image.Exif(), ExifTags.Base
        self.assertEqual(pictures.focal_share(exif, (4000, 3000))[0], None)
        exif.get_ifd(ExifTags.IFD.Exif).update({base.FocalLengthIn35mmFilm: 26, base.FocalLength: 5.7})
        share, zoom = pictures.focal_share(exif, (3000, 4000))
        self.assertAlmostEqual(share, 0.751, delta=0.001)
        self.assertEqual(zoom, (26, 5.7, 0.0))

    def test_many_pictures_are_matched_with_their_neighbours_and_around(self):
        self.assertIsNone(model.pairs(model.EVERY_PAIR))
        chosen = model.pairs(400)
        self.assertTrue({(0, 1), (0, 12), (398, 399), (0, 399)} <= set(chosen))
        self.assertTrue(all(0 <= i < j < 400 for i, j in chosen))
        self.assertLess(len(chosen), 400 * 399 // 10)

    def test_a_mask_lies_upright_over_its_picture(self):
        place = self.out("upright")
        os.makedirs(f"{place}/masks")
        raw = np.zeros((80, 120, 3), np.uint8)
        raw[:30, :30] = 255
        exif = Image.Exif()
        exif[ExifTags.Base.Orientation] = 6
        Image.fromarray(raw).save(f"{place}/a.jpg", exif=exif, quality=95)
        Image.fromarray(raw[..., 0]).save(f"{place}/masks/a.png")
        picture = pictures.Picture(f"{place}/a.jpg")
        size = picture.written(self.folder, 60)
        picture.written_mask(f"{place}/mask.png", size)
        seen, mask = (np.asarray(Image.open(path).convert("L")) > 128 for path in (f"{self.folder}/a.jpg", f"{place}/mask.png"))
        self.assertEqual((size, seen.shape), ((40, 60), (60, 40)))
        self.assertTrue(seen[5, 35] and not seen[5, 5])  # the upper left corner is now the upper right one
        self.assertGreater((seen == mask).mean(), 0.98)

    def test_frames_of_a_video_are_the_sharp_ones(self):
        program = shutil.which("ffmpeg")
        if program is None:
            with self.assertRaisesRegex(Refused, "apt install ffmpeg"):
                video.frames("walk.mp4", self.out("frames"), None, lambda _: None)
            return
        place = self.out("walk")
        os.makedirs(place)
        generator = np.random.default_rng(2)
        large = grain(generator, 300, 700)
        for k in range(60):
            frame = large[20:260, 4 * k:4 * k + 320]
            Image.fromarray(frame if k % 4 == 2 else cv2.blur(frame, (21, 21))).save(f"{place}/{k:03d}.png")
        words = f"-v error -framerate 15 -i {place}/%03d.png -c:v mpeg4 -q:v 2 {place}/walk.mp4"
        subprocess.run([program, *words.split()], check=True)
        found, looked_at = video.frames(f"{place}/walk.mp4", self.out("frames"), 4, lambda _: None)
        self.assertEqual((len(found), looked_at), (15, 60))
        for number, path in enumerate(found):
            got = np.asarray(Image.open(path), float)
            true = large[20:260, 4 * (4 * number + 2):4 * (4 * number + 2) + 320].astype(float)
            self.assertLess(np.abs(got - true).mean(), 12.0)
        with open(f"{place}/broken.mp4", "wb") as stream:
            stream.write(b"no video")
        with self.assertRaisesRegex(Refused, "ffmpeg cannot read"):
            video.frames(f"{place}/broken.mp4", self.out("other"), None, lambda _: None)


if __name__ == "__main__":
    unittest.main()
