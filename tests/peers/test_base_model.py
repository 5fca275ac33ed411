"""Models of a laboratory that `calibration export-model --base` brings up to date, loaded by MuJoCo: `python -m unittest discover tests/peers`
after `cargo build --release`; without the built program they are passed over."""
import os
import subprocess
import tempfile
import unittest

import mujoco
import numpy as np

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
PROGRAM = os.path.join(os.environ.get("TWINALIGN_PROGRAMS", os.path.join(ROOT, "target", "release")), "calibration")
THETA = """
[arm]
stiffness = [610.0, 590.0, 600.0, 620.0, 240.0, 150.0, 50.0]
damping = [50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0]
[[effect]]
name = "payload"
mass = 0.4
centre = [0.0, 0.0, 0.05]
[[effect]]
name = "joint_coulomb_friction"
coulomb = [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
"""
PLACES = ["0 0 0.333", "0 0 0", "0 0 0.316", "0.0825 0 0", "-0.0825 0 0.384", "0 0 0", "0.088 0 0"]
AXES = ["0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 -1 0", "0 0 -1"]
HOME = [0, -0.785, 0, -2.356, 0, 1.571, 0.785]


def arm(prefix, base):
    """An FR3 whose links have frames of their own, with a hand of two fingers on a tendon."""
    hand = "".join(
        f'<body name="{prefix}{f}" pos="0 {y} 0.16"><inertial mass="0.015" pos="0 0 0" diaginertia="1e-5 1e-5 1e-5"/><joint name="{prefix}finger_{f}" '
        f'type="slide" axis="0 {1 if y > 0 else -1} 0" range="0 0.04"/><geom type="box" size="0.008 0.004 0.02"/></body>'
        for f, y in (("a", 0.01), ("b", -0.01)))
    inner = hand
    for k in reversed(range(7)):
        inner = (f'<body name="{prefix}link{k + 1}" pos="{PLACES[k]}"><inertial mass="2" pos="0 0 0" diaginertia="0.02 0.02 0.01"/><joint '
                 f'name="{prefix}fr3_joint{k + 1}" axis="{AXES[k]}" class="arm"/><geom type="sphere" size="0.04"/>{inner}</body>')
    return f'<body name="{prefix}stand" {base}><frame euler="0 0 0">{inner}</frame></body>'


def actuators(prefix, kind):
    drives = "".join(f'<{kind} name="{prefix}motor{k}" joint="{prefix}fr3_joint{k}" class="drive"/>' for k in range(1, 8))
    return drives + f'<position name="{prefix}grip" tendon="{prefix}both" kp="100" ctrlrange="0 0.04"/>'


def rest(prefix):
    return (f'<tendon><fixed name="{prefix}both"><joint joint="{prefix}finger_a" coef="0.5"/><joint joint="{prefix}finger_b" coef="0.5"/></fixed>'
            f'</tendon><equality><joint joint1="{prefix}finger_a" joint2="{prefix}finger_b"/></equality>')


def lab(base="", prefixes=("",), kind="general", more=""):
    bases = [base, 'pos="0 1.2 0"'][:len(prefixes)]
    return ('<mujoco model="lab"><compiler angle="degree"/><option timestep="0.002"/><default><geom solref="0.004 1" friction="0.6"/><default '
            'class="arm"><joint damping="0.5" frictionloss="0.2" range="-170 170"/></default><default class="drive"><general gainprm="2000" '
            'biastype="affine" biasprm="0 -2000 -200" forcerange="-87 87" ctrlrange="-2.9 2.9"/></default></default><worldbody><geom name="table" '
            'type="box" size="2 2 0.02" pos="0 0 -0.02"/>' + "".join(map(arm, prefixes, bases)) + "</worldbody>"
            + "".join(map(rest, prefixes)) + "<actuator>" + "".join(actuators(p, kind) for p in prefixes) + f"</actuator>{more}</mujoco>")


@unittest.skipUnless(os.access(PROGRAM, os.X_OK), "the programs are not built")
class BaseModel(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        with open(self.path("theta.toml"), "w") as stream:
            stream.write(THETA)
        self.cell = mujoco.MjModel.from_xml_path(self.exported([], "cell.xml"))

    def path(self, name):
        return os.path.join(self.folder, name)

    def exported(self, words, name):
        cell = os.path.join(ROOT, "config", "fr3_cell.toml")
        command = [PROGRAM, "export-model", self.path("theta.toml"), "--cell", cell, "--to", "mjcf", *words, "--out", self.path(name), "--force"]
        done = subprocess.run(command, capture_output=True, text=True)
        self.said = done.stdout + done.stderr
        self.assertEqual(done.returncode, 0, self.said)
        return self.path(name)

    def merged(self, text, *words):
        mujoco.MjModel.from_xml_string(text)  # what is given loads by itself
        with open(self.path("lab.xml"), "w") as stream:
            stream.write(text)
        model = mujoco.MjModel.from_xml_path(self.exported(["--base", self.path("lab.xml"), *words], "found.xml"))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        return model, data

    def in_base(self, model, data, base, body):
        stand, thing = data.body(base), data.body(body)
        turn = stand.xmat.reshape(3, 3).T
        return turn @ (thing.xpos - stand.xpos), turn @ thing.xmat.reshape(3, 3)

    def test_the_object_and_loads_are_where_the_cell_has_them_wherever_the_base_stands(self):
        data = mujoco.MjData(self.cell)
        mujoco.mj_forward(self.cell, data)
        wanted = {body: (data.body(body).xpos, data.body(body).xmat.reshape(3, 3)) for body in ("object", "payload")}
        for base in ('pos="0 0 0"', 'pos="0.2 0.1 0.75" euler="0 0 90"', 'pos="0 0 1" euler="0 90 0"', 'pos="1 2 3" quat="0.5 0.5 0.5 0.5"'):
            model, data = self.merged(lab(base))
            for body, (place, turn) in wanted.items():
                found, turned = self.in_base(model, data, "stand", body)
                self.assertLess(np.abs(found - place).max() + np.abs(turned - turn).max(), 1e-6, (base, body))
            # The sensor of the object measures in the base frame, as in the cell; it reports late, as the camera does, and here at once.
            self.assertEqual(model.sensor_delay[model.sensor("object_position").id], self.cell.sensor_delay[self.cell.sensor("object_position").id])
            model.sensor_delay[:] = 0
            mujoco.mj_forward(model, data)
            number = model.sensor("object_position").adr[0]
            self.assertLess(np.abs(data.sensordata[number:number + 3] - wanted["object"][0]).max(), 1e-6, base)

    def test_controls_keep_their_order_and_pull_as_in_the_cell(self):
        qpos, ctrl = " ".join(map(str, [*HOME, 0.04, 0.04])), " ".join(map(str, [*HOME, 0.04]))
        more = (f'<sensor><actuatorfrc name="torque2" actuator="motor2"/></sensor><keyframe><key name="home" qpos="{qpos}" ctrl="{ctrl}"/></keyframe>')
        model, data = self.merged(lab(more=more))
        names = [model.actuator(i).name for i in range(model.nu)]
        self.assertEqual(names[:8], [f"motor{k}" for k in range(1, 8)] + ["grip"])
        np.testing.assert_allclose(model.key_ctrl[0][:8], [*HOME, 0.04])
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
        there = mujoco.MjData(self.cell)
        there.qpos[:7] = HOME
        velocity = [i for i in range(model.nu) if names[i].endswith("_velocity")]
        data.ctrl[:7] = np.array(HOME) + 0.01
        data.ctrl[velocity], data.qvel[:7] = 0.2, 0.1
        self.assertEqual(self.cell.nu, 14)
        there.ctrl[:7], there.ctrl[7:], there.qvel[:7] = np.array(HOME) + 0.01, 0.2, 0.1
        for one, other in ((model, data), (self.cell, there)):
            one.dof_frictionloss[:] = 0
            mujoco.mj_forward(one, other)
        torque = lambda d: d.actuator_force[:7] + d.actuator_force[-7:]
        np.testing.assert_allclose(torque(data), torque(there), atol=1e-9)
        self.assertEqual(model.sensor("torque2").objid[0], 1)

    def test_joints_have_what_was_found(self):
        model, _ = self.merged(lab())
        for k in range(1, 8):
            own, cell = model.joint(f"fr3_joint{k}"), self.cell.joint(f"fr3_joint{k}")
            for key in ("dof_frictionloss", "dof_armature"):
                self.assertEqual(getattr(model, key)[own.dofadr[0]], getattr(self.cell, key)[cell.dofadr[0]])
            np.testing.assert_allclose(model.jnt_actfrcrange[own.id], self.cell.jnt_actfrcrange[cell.id])

    def test_motors_become_positions_and_their_keyframes_hold_the_pose(self):
        qpos = " ".join(map(str, [*HOME, 0.04, 0.04]))
        more = f'<keyframe><key name="home" qpos="{qpos}" ctrl="1 2 3 4 5 6 7 0.04"/></keyframe>'
        text = lab(kind="motor", more=more).replace('<general gainprm="2000" biastype="affine" biasprm="0 -2000 -200" forcerange="-87 87" '
                                                    'ctrlrange="-2.9 2.9"/>', '<motor ctrlrange="-87 87" gear="50"/>')
        model, _ = self.merged(text)
        np.testing.assert_allclose(model.key_ctrl[0][:8], [*HOME, 0.04])
        self.assertFalse(model.actuator_ctrllimited[:7].any())
        np.testing.assert_allclose(model.actuator_gear[:7, 0], 1)

    def test_one_of_two_arms_is_asked_for(self):
        text = lab(prefixes=("left_", "right_"))
        with self.assertRaises(AssertionError):
            self.merged(text)
        self.assertIn("--base-joints right_fr3_joint1", self.said)
        names = ",".join(f"right_fr3_joint{k}" for k in range(1, 8))
        model, data = self.merged(text, "--base-joints", names)
        place, _ = self.in_base(model, data, "right_stand", "object")
        np.testing.assert_allclose(place, [0.5, 0, 0.05], atol=1e-6)
        self.assertEqual(model.dof_frictionloss[model.joint("left_fr3_joint1").dofadr[0]], 0.2)
        self.assertEqual([model.actuator(i).name for i in (0, 7, 8)], ["left_motor1", "left_grip", "right_motor1"])

    def test_a_keyframe_keeps_a_free_body_of_a_second_world(self):
        cube = '<worldbody><body name="cube" pos="0.4 0.3 0.1"><freejoint/><geom name="cube" type="box" size="0.02 0.02 0.02"/></body></worldbody>'
        qpos = " ".join(map(str, [*HOME, 0.04, 0.04, 0.4, 0.3, 0.02, 1, 0, 0, 0]))
        text = lab(more=f'{cube}<keyframe><key name="home" qpos="{qpos}"/></keyframe>')
        before = mujoco.MjModel.from_xml_string(text)
        after, data = self.merged(text.replace("<worldbody>", '<worldbody><light pos="0 0 3"/></worldbody><worldbody>', 1))
        mujoco.mj_resetDataKeyframe(after, data, 0)
        mujoco.mj_forward(after, data)
        there = mujoco.MjData(before)
        mujoco.mj_resetDataKeyframe(before, there, 0)
        mujoco.mj_forward(before, there)
        for body in ("cube", "link7", "a"):
            np.testing.assert_allclose(data.body(body).xpos, there.body(body).xpos, atol=1e-9)

    def test_controls_in_degrees_with_an_offset_ask_for_the_same_positions(self):
        qpos = " ".join(map(str, [*HOME, 0.04, 0.04]))
        ctrl = " ".join(str(np.degrees(q) - 20) for q in HOME) + " 0.04"
        law = f'gainprm="{2000 * np.pi / 180:.9f}" biastype="affine" biasprm="{2000 * np.radians(20):.9f} -2000 -200"'
        text = lab(more=f'<keyframe><key name="home" qpos="{qpos}" ctrl="{ctrl}"/></keyframe>').replace(
            'gainprm="2000" biastype="affine" biasprm="0 -2000 -200"', law).replace('ctrlrange="-2.9 2.9"', 'ctrlrange="-190 150"')
        model, _ = self.merged(text)
        np.testing.assert_allclose(model.key_ctrl[0][:7], HOME, atol=1e-6)
        np.testing.assert_allclose(model.actuator_ctrlrange[:7], np.radians([[-170, 170]] * 7), atol=1e-6)

    def test_names_of_the_model_that_the_cell_has_too(self):
        more = ('<worldbody><geom name="object" size="0.1" pos="2 2 2"/><body name="payload" pos="1 0 1"><geom size="0.1" mass="1"/></body></worldbody>')
        model, _ = self.merged(lab(more=more))
        self.assertEqual((model.body("payload").mass[0], model.body("cell_payload").mass[0]), (1, 0.4))
        rich = ('<worldbody><body name="object" pos="0.6 0.1 0.9"><freejoint name="free"/><geom name="og" type="box" size="0.05 0.05 0.05"/><site '
                'name="grasp"/></body></worldbody><contact><pair geom1="og" geom2="table"/></contact><sensor><framepos name="gp" objtype="site" '
                'objname="grasp"/></sensor>')
        model, _ = self.merged(lab(more=rich))
        np.testing.assert_allclose(model.body("object").pos, [0.6, 0.1, 0.9])
        self.assertAlmostEqual(model.body("object").mass[0], self.cell.body("object").mass[0])

    def test_what_is_merged_once_more_stays_as_it_is(self):
        model, _ = self.merged(lab())
        with open(self.path("found.xml")) as stream:
            again, _ = self.merged(stream.read())
        self.assertEqual((again.nu, again.nbody, again.nq), (model.nu, model.nbody, model.nq))
        np.testing.assert_allclose(again.actuator_gainprm, model.actuator_gainprm)


if __name__ == "__main__":
    unittest.main()
