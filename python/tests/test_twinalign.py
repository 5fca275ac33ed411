"""The installed package: `python -m unittest discover python/tests`. `TWINALIGN_SESSION`: a session of an arm alone, for more."""
import os
import pathlib
import subprocess
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
