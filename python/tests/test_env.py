"""Tasks as environments: `python -m unittest discover python/tests`, with gymnasium installed."""
import pathlib
import unittest

import gymnasium
import numpy as np
import twinalign.env
from gymnasium.utils.env_checker import check_env

ROOT = pathlib.Path(__file__).parents[2]
CARROT, CELL = ROOT / "twin" / "tasks" / "pick_carrot.toml", ROOT / "config" / "fr3_cell.toml"


def make(**arguments):
    return gymnasium.make("twinalign/Task-v0", task=CARROT, **arguments)


class EnvTest(unittest.TestCase):
    def test_it_is_an_environment_as_gymnasium_has_them(self):
        check_env(make(rate=10).unwrapped, skip_render_check=True)

    def test_the_seed_draws_the_start_and_the_same_actions_lead_to_the_same_end(self):
        env = make(pictures=False)
        first, _ = env.reset(seed=5)
        ends = []
        for _ in range(2):
            observation, _ = env.reset(seed=5)
            np.testing.assert_array_equal(observation["environment_state"], first["environment_state"])
            for _ in range(10):
                action = observation["agent_pos"].copy()
                action[8:] += 0.01
                observation, reward, terminated, truncated, info = env.step(action)
                self.assertFalse(terminated or truncated, info)
            ends.append(observation["agent_pos"])
        np.testing.assert_array_equal(*ends)
        self.assertGreater(np.abs(ends[0] - first["agent_pos"]).max(), 0.01)
        other, _ = env.reset(seed=6)
        self.assertTrue((other["environment_state"] != first["environment_state"]).any())

    def test_pictures_have_the_cameras_size_and_a_cloud_lies_where_the_scene_is(self):
        env = make(depth=True, render_mode="rgb_array")
        observation, _ = env.reset(seed=0)
        self.assertEqual(observation["pixels"]["front"].shape, (240, 320, 3))
        depth = observation["depth"]["front"]
        self.assertEqual((depth.shape, depth.dtype), ((240, 320, 1), np.uint16))
        points = twinalign.env.cloud(depth, env.unwrapped.cameras["front"], points=512)
        self.assertEqual(points.shape, (512, 3))
        self.assertTrue(0.3 < np.median(points[:, 2]) < 2.0)
        self.assertEqual(twinalign.env.cloud(np.zeros((4, 4)), 10.0).shape, (1024, 3))
        self.assertEqual(env.render().shape, (240, 320, 3))

    def test_what_would_stop_a_robot_ends_the_episode(self):
        env = make(pictures=False)
        observation, _ = env.reset(seed=0)
        action = observation["agent_pos"].copy()
        action[-7:] = 9.0
        _, _, terminated, truncated, info = env.step(action)
        self.assertTrue(terminated and not truncated and "beyond its end" in info["fault"], info)

    def test_the_horizon_truncates_and_a_cell_s_arm_comes_later(self):
        env = make(pictures=False, cell=CELL, parameters={"effect": [{"name": "command_delay", "delay": 0.1}]}, rate=2)
        exact = make(pictures=False, rate=2)
        places = []
        for one in (env, exact):
            observation, _ = one.reset(seed=1)
            action = observation["agent_pos"].copy()
            action[-7] += 0.3
            observation, *_ = one.step(action)
            places.append(observation["agent_pos"][-7] - action[-7])
        self.assertLess(places[0], places[1] - 0.005)
        truncated = False
        for _ in range(25):
            _, _, terminated, truncated, _ = exact.step(action)
            self.assertFalse(terminated)
            if truncated:
                break
        self.assertTrue(truncated)

    def test_wrong_arguments_are_said_with_what_would_do(self):
        for arguments, words in (({"rate": 3}, "1, 2, 4, 5, 10"), ({"parameters": {}}, "give cell"), ({"render_mode": "human"}, "rgb_array")):
            with self.assertRaisesRegex((ValueError, gymnasium.error.Error), words):
                twinalign.env.TaskEnv(CARROT, **arguments)
        env = twinalign.env.TaskEnv(CARROT, pictures=False)
        with self.assertRaisesRegex(RuntimeError, "reset"):
            env.step(np.zeros(15, np.float32))
        env.reset(seed=0)
        with self.assertRaisesRegex(ValueError, "15 numbers"):
            env.step(np.zeros(3, np.float32))


if __name__ == "__main__":
    unittest.main()
