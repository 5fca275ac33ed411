"""The installed package: `python -m unittest discover python/tests`. `TWINALIGN_SESSION`: a session of an arm alone, for more."""
import os
import pathlib
import re
import subprocess
import tempfile
import time
import unittest

import numpy as np
import twinalign

CELL = pathlib.Path(__file__).parents[2] / "config" / "fr3_cell.toml"
SESSION = os.environ.get("TWINALIGN_SESSION")


class TwinTest(unittest.TestCase):
    def setUp(self):
        self.twin = twinalign.Twin(CELL)

    def test_steps_and_roll_outs_are_the_same_and_a_reset_is_the_beginning(self):
        twin, start = self.twin, self.twin.q
        t = np.arange(300)[:, None] * 1e-3
        q_d = start + 0.05 * (1 - np.cos(6 * t)) * np.ones(7)
        dq_d = 0.3 * np.sin(6 * t) * np.ones(7)
        q, dq, place, turn = twin.roll_out(q_d, dq_d)
        self.assertEqual((q.shape, dq.shape, place.shape, turn.shape), ((300, 7), (300, 7), (300, 3), (300, 4)))
        self.assertGreater(np.abs(q[-1] - start).max(), 1e-3)
        self.assertAlmostEqual(twin.time, 0.3)
        twin.reset()
        np.testing.assert_array_equal(twin.q, start)
        for row in range(300):
            twin.step(q_d[row], dq_d[row])
        np.testing.assert_array_equal(twin.q, q[-1])
        np.testing.assert_array_equal(twin.object_position, place[-1])

    def test_parameters_of_a_dict_act(self):
        late = {"effect": [{"name": "command_delay", "delay": 0.02}]}
        q_d = self.twin.q + 0.01
        other = twinalign.Twin(CELL, late)
        for twin in (self.twin, other):
            twin.step(q_d, periods=10)
        self.assertGreater(np.abs(self.twin.q - other.q).max(), 1e-5)

    def test_wrong_shapes_and_words_are_told(self):
        with self.assertRaisesRegex(ValueError, "6 numbers for 7 joints"):
            self.twin.step(np.zeros(6))
        with self.assertRaisesRegex(RuntimeError, "unknown|no effect|known"):
            twinalign.Twin(CELL, {"effect": [{"name": "bad_mood", "size": 1.0}]})
        with self.assertRaises(RuntimeError):
            twinalign.Session("/nowhere")

    def test_effects_are_listed(self):
        names = {effect["name"]: effect for effect in twinalign.effects()}
        self.assertGreater(len(names), 30)
        self.assertEqual(names["command_delay"]["parameters"][0]["unit"], "s")


OBJECTS = """
[[object]]
name = "milk"
shape = "box"
size = [0.08, 0.06, 0.10]
mass = 0.3
start = [0.55, 0.0]

[[object]]
name = "cup"
shape = "box"
size = [0.06, 0.06, 0.08]
mass = 0.2
start = [0.5, 0.3]
"""
LAPTOP = """
[[object]]
name = "lap"
urdf = "lap.urdf"
hold = "fixed"
joints = { hinge = 0.4 }
start = [0.45, -0.35]
"""
URDF = """<robot name="lap">
<link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.01"/><geometry><box size="0.2 0.2 0.02"/></geometry></collision></link>
<link name="lid"><inertial><mass value="0.2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="-0.1 0 0.005"/><geometry><box size="0.2 0.2 0.01"/></geometry></collision></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="lid"/><origin xyz="0.1 0 0.02"/><axis xyz="0 1 0"/>
<limit lower="0" upper="2.0" effort="1" velocity="1"/></joint></robot>"""


class ObjectsTest(unittest.TestCase):
    """A cell with several objects by name."""

    def cell(self, blocks):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        text = re.sub(r"(?s)\n\[object\].*?(?=\n\[camera\])", blocks, CELL.read_text(), count=1)
        (pathlib.Path(folder.name) / "lap.urdf").write_text(URDF)
        path = pathlib.Path(folder.name) / "cell.toml"
        path.write_text(text)
        return path

    def still(self, twin, rows):
        return np.repeat(twin.q[None], rows, axis=0), np.zeros((rows, twin.dof))

    def test_each_is_where_its_block_says_and_the_first_where_one_object_is(self):
        twin = twinalign.Twin(self.cell(OBJECTS))
        self.assertEqual(twin.object_names, ["milk", "cup"])
        objects = twin.objects
        np.testing.assert_allclose(objects["cup"][0], [0.5, 0.3, 0.04], atol=1e-9)
        np.testing.assert_allclose(objects["cup"][1], [1, 0, 0, 0], atol=1e-12)
        np.testing.assert_array_equal(objects["milk"][0], twin.object_position)
        one = twinalign.Twin(CELL)
        self.assertEqual(one.object_names, ["object"])
        np.testing.assert_array_equal(one.objects["object"][0], one.object_position)

    def test_one_falls_beside_the_other_and_a_reset_puts_both_back(self):
        twin = twinalign.Twin(self.cell(OBJECTS))
        begun = twin.objects
        tilted = ([0.55, 0.075, 0.19], [np.cos(0.3), np.sin(0.3), 0, 0])
        twin.reset(objects={"cup": tilted})
        np.testing.assert_allclose(twin.objects["cup"][0], tilted[0], atol=1e-9)
        q_d, dq_d = self.still(twin, 800)
        q, dq, ways = twin.roll_out_named(q_d, dq_d)
        self.assertEqual({name: (place.shape, turn.shape) for name, (place, turn) in ways.items()},
                         {"milk": ((800, 3), (800, 4)), "cup": ((800, 3), (800, 4))})
        self.assertGreater(np.linalg.norm(ways["cup"][0][-1] - tilted[0]), 0.02)  # it fell beside the milk, or onto it
        np.testing.assert_array_equal(ways["cup"][0][-1], twin.objects["cup"][0])
        twin.reset()
        for name, (place, turn) in begun.items():
            np.testing.assert_array_equal(twin.objects[name][0], place)
            np.testing.assert_array_equal(twin.objects[name][1], turn)
        twin.reset(objects={"cup": tilted})
        again = twin.roll_out_named(q_d, dq_d)[2]
        for name in ways:
            np.testing.assert_array_equal(again[name][0], ways[name][0])

    def test_a_link_goes_where_its_joint_lets_it_and_what_is_fixed_stays(self):
        twin = twinalign.Twin(self.cell(OBJECTS + LAPTOP))
        self.assertEqual(twin.object_names, ["milk", "cup", "lap", "lap_lid"])
        place, _ = twin.objects["lap_lid"]
        angle = 1.1
        twin.reset(objects={"lap_lid": (place, [np.cos(angle / 2), 0, np.sin(angle / 2), 0])})
        np.testing.assert_allclose(twin.objects["lap_lid"][1], [np.cos(angle / 2), 0, np.sin(angle / 2), 0], atol=1e-9)
        with self.assertRaisesRegex(ValueError, "`lap` cannot be put elsewhere"):
            twin.reset(objects={"lap": ([0.4, 0.4, 0.0], [1, 0, 0, 0])})

    def test_what_cannot_be_is_told_and_leaves_the_beginning(self):
        twin = twinalign.Twin(self.cell(OBJECTS))
        begun = twin.objects["cup"][0]
        for objects, told in [
            ({"bowl": ([0.5, 0.3, 0.05], [1, 0, 0, 0])}, "no object `bowl`; it has milk, cup"),
            ({"cup": ([0.55, 0.02, 0.04], [1, 0, 0, 0])}, "`milk` and `cup` overlap"),
            ({"cup": ([0.5, 0.3, np.nan], [1, 0, 0, 0])}, "finite"),
            ({"cup": ([0.5, 0.3, 0.05], [0, 0, 0, 0])}, "quaternion"),
        ]:
            with self.assertRaisesRegex(ValueError, told):
                twin.reset(objects=objects)
            np.testing.assert_array_equal(twin.objects["cup"][0], begun)

    def test_pictures_show_all_of_them_and_are_the_same_after_a_reset(self):
        twin = twinalign.Twin(self.cell(OBJECTS))
        colour, depth = twin.render()
        self.assertEqual((colour.dtype, depth.dtype, colour.shape), (np.uint8, np.uint16, (*depth.shape, 3)))
        twin.reset()
        np.testing.assert_array_equal(twin.render()[1], depth)
        for name, (x, y) in {"milk": (0.55, -0.2), "cup": (0.62, 0.2)}.items():
            place, turn = twin.objects[name]
            twin.reset(objects={name: ([x, y, place[2]], turn)})
            changed = np.any(twin.render()[0] != colour, axis=-1).sum()
            self.assertGreater(changed, 200, name)


@unittest.skipUnless(SESSION, "TWINALIGN_SESSION is not set")
class SessionTest(unittest.TestCase):
    def test_clips_are_arrays_without_copies(self):
        session = twinalign.Session(SESSION)
        clip = session[0]
        self.assertEqual(clip.q.shape, (len(clip.stamps_ns), len(clip.joint_names)))
        self.assertIs(clip.q, clip.q)
        self.assertFalse(clip.q.flags.owndata)  # it is the reader's memory
        self.assertTrue(clip.q.flags.c_contiguous)
        with self.assertRaises(IndexError):
            session[len(session)]

    def test_the_answer_is_that_of_the_command(self):
        found = twinalign.identify_arm(SESSION)
        self.assertEqual(len(found["parameters"]["stiffness"]["value"]), 7)
        program = os.environ.get("TWINALIGN_CALIBRATION")
        if program:
            import json
            command = [program, "identify", "arm", SESSION, "--json"]
            answer = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
            self.assertEqual(answer["parameters"], found["parameters"])
            self.assertEqual(set(answer), set(found))

    def test_a_budget_gives_the_best_answer_so_far(self):
        began = time.monotonic()
        found = twinalign.diagnose(SESSION, budget=3.0)
        self.assertIn(found["verdict"]["kind"], {"none", "named", "class", "unexplained", "not_testable"})
        self.assertLess(time.monotonic() - began, 120.0)


if __name__ == "__main__":
    unittest.main()
