"""Whether verdicts are scored rightly: `python -m unittest discover tests/peers`."""
import unittest

from verdicts import calibration_error, outcome, table, wilson


def truth(*effects, known=True):
    return {"effects": list(effects), "known": known}


def scored(hidden, kind, *effects):
    return outcome(hidden, {"kind": kind, "effects": list(effects)})


class Scores(unittest.TestCase):
    def test_nothing_hidden(self):
        self.assertEqual(scored(truth(), "none"), "exact")
        self.assertEqual(scored(truth(), "unexplained"), "unexplained")
        self.assertEqual(scored(truth(), "named", "payload"), "wrong")
        self.assertEqual(scored(truth(), "class", "payload", "base_tilt"), "beside")

    def test_one_effect(self):
        hidden = truth("payload")
        self.assertEqual(scored(hidden, "named", "payload"), "exact")
        self.assertEqual(scored(hidden, "named", "payload", "base_tilt"), "wrong")
        self.assertEqual(scored(hidden, "class", "payload", "base_tilt"), "class")
        self.assertEqual(scored(hidden, "class", "base_tilt"), "beside")
        self.assertEqual(scored(hidden, "none"), "none")
        self.assertEqual(scored(hidden, "not_testable"), "other")

    def test_two_effects(self):
        hidden = truth("table_tilt", "camera_latency")
        self.assertEqual(scored(hidden, "named", "camera_latency", "table_tilt"), "exact")
        self.assertEqual(scored(hidden, "named", "camera_latency"), "part")
        self.assertEqual(scored(hidden, "named", "camera_latency", "payload"), "wrong")
        self.assertEqual(scored(hidden, "class", "camera_latency", "payload"), "part")

    def test_outside_of_the_library(self):
        hidden = truth("wind", known=False)
        self.assertEqual(scored(hidden, "unexplained"), "exact")
        self.assertEqual(scored(hidden, "none"), "none")
        self.assertEqual(scored(hidden, "named", "table_tilt"), "wrong")
        vessel = truth("sloshing load", known=False) | {"near": ["payload"]}
        self.assertEqual(scored(vessel, "named", "payload"), "part")
        self.assertEqual(scored(vessel, "named", "payload", "table_tilt"), "wrong")

    def test_wilson_interval_of_eight_in_ten(self):
        low, high = wilson(8, 10)
        self.assertAlmostEqual(low, 0.4902, places=3)
        self.assertAlmostEqual(high, 0.9433, places=3)

    def test_a_confidence_of_nine_tenths_that_is_right_half_the_time_is_off_by_four_tenths(self):
        results = [{"confidence": 0.9, "outcome": o} for o in ("exact", "wrong")] + [{"confidence": None, "outcome": "none"}]
        self.assertAlmostEqual(calibration_error(results), 0.4)

    def test_the_table_counts_every_session(self):
        result = {"session": "0000_arm", "kind": "arm", "truth": ["payload"], "outcome": "exact", "said": "named payload",
                  "confidence": 0.9, "shrink": 0.8, "seconds": 12.0}
        self.assertIn("100%", table([result]).splitlines()[1])
        self.assertIn("no session", table([]))


if __name__ == "__main__":
    unittest.main()
