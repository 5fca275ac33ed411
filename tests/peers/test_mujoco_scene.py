"""The arm, the gripper and the task files of policies in MuJoCo: `python -m unittest discover tests/peers`."""
import os
import tomllib
import unittest

import numpy as np
import tomli_w

from mujoco_policies import ratios
from mujoco_scene.acting import Gripper
from mujoco_scene.franka import READY, Arm, rotation, wxyz
from mujoco_scene.hidden import Hidden
from verdicts import wilson

TASKS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "twin", "tasks")


def task(name):
    with open(os.path.join(TASKS, f"{name}.toml"), "rb") as stream:
        return tomllib.load(stream)


class MujocoScene(unittest.TestCase):
    def test_joints_bring_the_body_where_it_is_wanted(self):
        arm, generator = Arm(task("pick_carrot")["arm"]), np.random.default_rng(0)
        for _ in range(20):
            place, turn = arm.carried(READY + generator.uniform(-0.2, 0.2, 7))
            found, turned = arm.carried(arm.reach(place, turn))
            self.assertLess(np.abs(found - place).max() + np.abs(turned - turn).max(), 1e-8)

    def test_quaternions_of_all_kinds_of_turns_come_back(self):
        for turn in [*np.eye(4), *np.random.default_rng(0).standard_normal((50, 4))]:
            matrix = rotation(turn)
            self.assertLess(np.abs(rotation(wxyz(matrix)) - matrix).max(), 1e-12)

    def test_the_opening_is_that_between_the_faces_of_the_fingers(self):
        gripper = Gripper(task("pick_carrot"))
        self.assertAlmostEqual(gripper.width(0.0), 0.09)
        self.assertAlmostEqual(gripper.width(0.044), 0.002)
        self.assertAlmostEqual(gripper.position(0.05), 0.02)

    def test_a_task_file_is_read_as_it_was_written_and_reality_is_another(self):
        for name in ("pick_carrot", "close_laptop"):
            given = task(name)
            self.assertEqual(tomllib.loads(tomli_w.dumps(given)), given)
            hidden = Hidden(given, 20)
            self.assertEqual(hidden.task, Hidden(given, 20).task)
            away = lambda other: np.abs(np.array(other["camera"][0]["position"]) - hidden.task["camera"][0]["position"]).max()
            self.assertLess(away(hidden.identified(20)), 0.005)
            self.assertGreater(away(given), 0.005)

    def test_intervals_of_shares_are_wilsons(self):
        # Newcombe 1998, table I: 81 of 263.
        self.assertTrue(np.allclose(wilson(81, 263), [0.2553, 0.3662], atol=5e-5))

    def test_the_interval_of_a_ratio_holds_what_trainings_scatter_by(self):
        chance = lambda odds: 1 / (1 + np.exp(-odds))
        # Log odds of two sorts of policies; those of a training and of a start, the same for both sorts, scatter about them.
        generator, odds, training = np.random.default_rng(0), [0.24, 1.39], 0.6
        far = generator.normal(0, 1, (200000, 2)) @ [training, 1.0]
        truth, studies = chance(odds[0] + far).mean() / chance(odds[1] + far).mean(), 200
        inside = np.zeros(2)
        for _ in range(studies):
            start = generator.normal(0, 1, 60)
            sides = [generator.random((3, 60)) < chance(middle + training * generator.normal(0, 1, (3, 1)) + start) for middle in odds]
            for kind, tables in enumerate((sides, [side.mean(axis=0, keepdims=True) for side in sides])):
                low, high = np.quantile(ratios(*tables, draws=500), [0.025, 0.975])
                inside[kind] += low <= truth <= high
        self.assertGreater(inside[0] / studies, 0.9)
        # With starts alone drawn again it is far from what it says.
        self.assertLess(inside[1] / studies, 0.75)


if __name__ == "__main__":
    unittest.main()
