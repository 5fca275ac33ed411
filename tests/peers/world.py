"""The twin's worlds of many bodies against MuJoCo and closed forms: stacks, a held box, a falling lid, an arm that gives way, the tasks
that ship, noisy demonstrations of them replayed open loop, speed. Times are those of the processor, not of the clock on the wall.

    python tests/peers/world.py --program target/release/twin
"""
import argparse
import math
import os
import resource
import statistics
import sys
import tempfile
import time
import tomllib

from program import Failed, answer, built, ending_by_signals, note

try:
    import mujoco
    import numpy as np
    from mujoco import rollout

    from mujoco_scene.arm import Carrying, resting
    from mujoco_scene.replay import Replay
    from mujoco_scene.run import Scene
except ModuleNotFoundError as missing:
    sys.exit(f"{missing.name} is not installed; `pip install -r tests/peers/requirements.txt` in a virtual environment")

TASKS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "twin", "tasks")
TABLE = """[[body]]
name = "table"
hold = "fixed"
friction = 0.8
piece = [{ shape = "box", size = [2.0, 2.0, 0.1], position = [0.0, 0.0, -0.05] }]
"""
NEVER = """[[success]]
body = "box"
low = [90.0, 90.0, 90.0]
high = [91.0, 91.0, 91.0]
"""


def twin(program, text, *more):
    """The twin's answer to a task given as text."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "task.toml")
        with open(path, "w") as stream:
            stream.write(text)
        return answer([program, "task", path, "--json", *more])


def both(program, text, duration, step=1e-3):
    """The same task for the same time in the twin (bodies by name) and in MuJoCo (a scene at the end)."""
    bodies = twin(program, text, "--duration", str(duration))["episodes"][0]["bodies"]
    scene = Scene(tomllib.loads(text), bodies, step)
    for i in range(round(duration / step)):
        scene.advance(i)
    return {body["name"]: body["end"] for body in bodies}, scene


def box(name, place, offset=(0, 0, 0), size=(0.06, 0.06, 0.06), friction=0.8):
    return (f'[[body]]\nname = "{name}"\nmass = 0.2\nfriction = {friction}\nposition = {[float(x) for x in place]}\n'
            f'centre_of_mass = {[float(x) for x in offset]}\npiece = [{{ shape = "box", size = {list(size)} }}]\n')


def stacks(program):
    right = {"twin": 0, "mujoco": 0}
    count = 0
    for i in range(60):
        shift, reach, angle = (0.005, 0.010, 0.015)[i % 3], 0.002 + 0.0286 * (i * 17 % 40) / 39, 0.7 * i
        aside, across = np.array([math.cos(angle), math.sin(angle), 0]), np.array([-math.sin(angle), math.cos(angle), 0])
        offset, heavy = aside * reach, (across * shift, aside * shift)
        upper = offset + heavy[1]
        pair = 0.5 * (upper + heavy[0])
        margin = min(0.03 - max(abs(upper[k]), abs(pair[k])) for k in range(2))
        if abs(margin) < 2e-4 or count == 40:
            continue
        count += 1
        text = "horizon = 2.0\n" + TABLE + box("lower", (0, 0, 0.03), heavy[0]) + box("box", offset + (0, 0, 0.09), heavy[1]) + NEVER
        ours, scene = both(program, text, 2.0)
        for engine, height in (("twin", ours["box"]["position"][2]), ("mujoco", scene.place("box")[0][2])):
            right[engine] += (abs(height - 0.09) < 1e-3) == (margin > 0)
    print(f"stacks of two boxes, centres of mass 5, 10, 15 mm off: as statics says, of {count}: twin {right['twin']}, MuJoCo {right['mujoco']}")


def gripper(force, friction=0.6):
    finger = """[[body]]
name = "{name}"
mass = 0.1
friction = {friction}
pad_radius = 0.01
piece = [{{ shape = "box", size = [0.01, 0.018, 0.018], position = [{place}, 0.0, 0.0] }}]
joint = {joint}
"""
    drive = f"drive = {{ target = 0.04, speed = 0.1, force = {force} }}"
    common = 'kind = "prismatic", parent = "palm", axis = [1.0, 0.0, 0.0]'
    return ("horizon = 40.0\n"
            '[[body]]\nname = "palm"\nhold = "fixed"\nfriction = 0.5\npiece = [{ shape = "box", size = [0.1, 0.1, 0.04], position = [0.0, 0.0, 0.2] }]\n'
            + finger.format(name="left", friction=friction, place=-0.035, joint=f"{{ {common}, limits = [-0.05, 0.05], {drive} }}")
            + finger.format(name="right", friction=friction, place=0.035, joint=f'{{ {common}, follows = {{ body = "left", ratio = -1.0 }} }}')
            + box("box", (0, 0, -0.02), size=(0.06, 0.06, 0.1), friction=friction) + NEVER)


def held(program):
    text = gripper(40.0)
    early, late = (both(program, text, t) for t in (1.0, 31.0))
    ours = math.dist(early[0]["box"]["position"], late[0]["box"]["position"])
    theirs = float(np.linalg.norm(early[1].place("box")[0] - late[1].place("box")[0]))
    print(f"held box of 0.2 kg, 20 N a pad, mu 0.6: drift in 30 s: twin {ours * 1e3:.6f} mm, MuJoCo {theirs * 1e3:.4f} mm")
    limit, fell = 0.2 * 9.81 / 0.6, {}
    for share in (0.95, 0.98, 0.99, 1.01, 1.02, 1.05):
        ours, scene = both(program, gripper(limit * share), 1.0)
        fell[share] = (-0.02 - ours["box"]["position"][2]) * 1e3, (-0.02 - scene.place("box")[0][2]) * 1e3
    words = ", ".join(f"{share:.2f}: {a:.2f} / {b:.2f}" for share, (a, b) in fell.items())
    print(f"the same at a share of the force that just holds it: fallen in 1 s [mm], twin / MuJoCo: {words}")


def lid(program):
    text = ('horizon = 2.0\n[[body]]\nname = "box"\nmass = 0.4\nfriction = 0.3\npiece = [{ shape = "box", size = [0.3, 0.2, 0.01], position = [0.15, 0.0, 0.0] }]\n'
            'joint = { kind = "revolute", axis = [0.0, -1.0, 0.0], limits = [-0.2, 3.0], start = 1.2, friction = 0.05, damping = 0.03 }\n'
            '[[success]]\njoint = "box"\nbetween = [2.9, 3.0]\n')
    inertia = 0.4 * (0.3 ** 2 + 0.01 ** 2) / 12 + 0.4 * 0.15 ** 2
    for duration in (0.1, 0.2, 0.3):
        angle, speed, dt = 1.2, -1e-12, 1e-5
        for _ in range(round(duration / dt)):
            half = speed + 0.5 * dt * torque(angle, speed) / inertia
            speed += dt * torque(angle + 0.5 * dt * speed, half) / inertia
            angle += dt * half
        ours, scene = both(program, text, duration)
        found = [1.2 - ours["box"]["joint"], 1.2 - scene.joint("box")]
        print(f"lid after {duration} s: fallen {1.2 - angle:.6f} rad; off: twin {100 * (found[0] / (1.2 - angle) - 1):+.3f} %, MuJoCo {100 * (found[1] / (1.2 - angle) - 1):+.3f} %")


def torque(angle, speed):
    return -0.4 * 9.81 * 0.15 * math.cos(angle) - 0.05 * math.copysign(1, speed) - 0.03 * speed


GAINS = [600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0], [50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0]


def arm(program):
    """A box falls 20 mm onto a plate that an arm under joint impedance control holds; the plate weighs nothing."""
    stiffness, damping = GAINS
    for mass in (0.5, 3.0):
        at = [0.47, 0.01, 0.405]
        text = ("horizon = 5.0\n" + '[[body]]\nname = "plate"\nhold = "moved"\nfriction = 0.8\nposition = [0.45, 0.0, 0.35]\n'
                'piece = [{ shape = "box", size = [0.12, 0.12, 0.01] }]\n' + box("box", at).replace("mass = 0.2", f"mass = {mass}")
                + f'[arm]\nbody = "plate"\nposition = [0.0, 0.0, 0.05]\nrotation = [3.141592654, 0.0, 0.0]\nstiffness = {stiffness}\n'
                f'damping = {damping}\n' + NEVER)
        words = []
        for duration in (0.08, 0.1, 0.15, 0.3, 3.0):
            found = twin(program, text, "--duration", str(duration))["episodes"][0]["arm"]
            start, ours = np.array(found["start_q"]), np.array(found["end_q"])
            theirs = Carrying(start, GAINS, ([0.12, 0.12, 0.01], [0, 0, 0.05]), (0.06, mass, at))
            theirs.go_on(duration)
            given = [np.abs(q - start).max() for q in (ours, theirs.q())]
            words.append(f"{duration} s: {1e3 * given[0]:.3f} / {1e3 * given[1]:.3f} (apart {1e3 * np.abs(ours - theirs.q()).max():.3f})")
        print(f"{mass} kg onto a plate held by an arm, its joints give way by at most [mrad], twin / MuJoCo: " + ", ".join(words))


def noisy(program, count, only):
    """Scripted demonstrations with noise, their commands alone given to MuJoCo; each may take half a second longer there."""
    for name in only or sorted(os.listdir(TASKS)):
        path = os.path.join(TASKS, name)
        with open(path, "rb") as stream:
            task = tomllib.load(stream)
        with tempfile.TemporaryDirectory() as folder:
            found = answer([program, "task", path, "--json", "--episodes", str(count), "--noise", "0.003", "--record", folder])
            wins = 0
            for episode in found["episodes"]:
                scene = Replay(task, episode["bodies"], os.path.join(folder, f"episode_{episode['seed']:06}.mcap"))
                length = round((episode["duration_s"] + 0.5) / scene.step)
                held = most = 0
                for i in range(length):
                    scene.advance(i)
                    held = held + 1 if scene.succeeds() else 0
                    most = max(most, held)
                wins += most >= task.get("hold", 0.5) / scene.step * 0.9
        print(f"{name:20s} with 3 mm of noise, success of {count}: twin {found['successes']}, MuJoCo replaying the commands {wins}")
        sys.stdout.flush()


def tasks(program, count, only):
    for name in only or sorted(os.listdir(TASKS)):
        path = os.path.join(TASKS, name)
        with open(path, "rb") as stream:
            task = tomllib.load(stream)
        begun = of_children()
        found = answer([program, "task", path, "--json", "--episodes", str(count)])
        used, simulated = of_children() - begun, sum(e["duration_s"] for e in found["episodes"])
        free = [body["name"] for body in task["body"] if "joint" not in body and body.get("hold", "free") == "free"]
        hinged = [body["name"] for body in task["body"] if body.get("joint", {}).get("kind") == "revolute"]
        apart, turned, swung, wins, seconds, steps = [], [], [], 0, 0.0, 0
        for episode in found["episodes"]:
            ends = {body["name"]: body["end"] for body in episode["bodies"]}
            scene = Scene(task, episode["bodies"])
            length = round(episode["duration_s"] / scene.step)
            held = 0
            for i in range(length):
                scene.advance(i)
                held = held + 1 if scene.succeeds() else 0
            wins += held >= min(task.get("hold", 0.5) / scene.step * 0.9, length)
            seconds, steps = seconds + scene.seconds, steps + length
            for body in free:
                place, turn = scene.place(body)
                apart.append(1e3 * math.dist(place, ends[body]["position"]))
                cosine = abs(float(np.dot(turn, ends[body]["orientation_wxyz"])))
                turned.append(math.degrees(2 * math.acos(min(1.0, cosine))))
            swung += [math.degrees(abs(scene.joint(body) - ends[body]["joint"])) for body in hinged]
        hinge = f", hinge {statistics.median(swung):.2f} deg" if swung else ""
        print(f"{name:20s} success of {count}: twin {found['successes']}, MuJoCo {wins}; apart at the end, median (90 %): "
              f"{statistics.median(apart):.2f} ({np.quantile(apart, 0.9):.2f}) mm, {statistics.median(turned):.2f} ({np.quantile(turned, 0.9):.2f}) deg{hinge}; "
              f"a step: twin {1e6 * used / (simulated / 1e-3):.1f} us, MuJoCo {1e6 * seconds / steps:.1f} us")
        sys.stdout.flush()


def speed(program, only):
    """Everything where it starts and nothing moved: both engines without a word of Python in a step."""
    for name in only or sorted(os.listdir(TASKS)):
        text = still(name)
        ours, found = rested(program, text)
        scene = Scene(tomllib.loads(text), found["bodies"])
        theirs = rolled(scene.model, scene.data)
        print(f"{name:20s} at rest, a step: twin {1e6 * ours:.2f} us ({1e-3 / ours:.0f} times real time), MuJoCo {1e6 * theirs:.2f} us, ratio {theirs / ours:.2f}")
    if only:
        return
    stiffness, damping = GAINS
    text = still("stack_boxes.toml").replace("[arm]\n", f"[arm]\nstiffness = {stiffness}\ndamping = {damping}\n", 1)
    text = text.replace("# A gripper that is moved", box("third", (0.6, 0.0, 0.025), size=(0.05, 0.05, 0.05)) + "\n# A gripper that is moved", 1)
    ours, found = rested(program, text)
    task = tomllib.loads(text)
    for body, at in zip(task["body"], found["bodies"]):
        if body.get("hold", "free") == "free" and "joint" not in body:
            body["position"], body["rotation"] = at["start"]["position"], [0.0, 0.0, 0.0]
    theirs = rolled(*resting(task, found["arm"]["start_q"]))
    print(f"arm under control, hand, three boxes at rest, a step: twin {1e6 * ours:.2f} us ({1e-3 / ours:.0f} times real time), "
          f"MuJoCo {1e6 * theirs:.2f} us, ratio {theirs / ours:.2f}")


def still(name):
    """A task without its motion."""
    with open(os.path.join(TASKS, name)) as stream:
        return stream.read().split("\n[[motion]]")[0] + "\n"


def rested(program, text):
    """The twin's time for a step [s of a processor], and the episode."""
    times = []
    for duration in ("5", "65"):
        begun = of_children()
        found = twin(program, text, "--duration", duration)
        times.append(of_children() - begun)
    return (times[1] - times[0]) / 60000, found["episodes"][0]


def rolled(model, data):
    """MuJoCo's time for a step [s of a processor]."""
    state = np.zeros((1, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    mujoco.mj_getState(model, data, state[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
    begun = time.process_time()
    rollout.rollout(model, data, state, nstep=20000)
    return (time.process_time() - begun) / 20000


def of_children():
    """Processor time of the programs that were started and have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, type=built, metavar="TWIN", help="the built `twin`")
    parser.add_argument("--only", default="", metavar="A,B", help="stacks, held, lid, arm, tasks, noisy, speed [default: all]")
    parser.add_argument("--tasks", default="", metavar="FILE,..", help="names of files in twin/tasks/ [default: all]")
    parser.add_argument("--episodes", type=int, default=20, metavar="N", help="of each task [default: 20]")
    given = parser.parse_args()
    ending_by_signals()
    files = given.tasks.split(",") if given.tasks else []
    parts = {"stacks": stacks, "held": held, "lid": lid, "arm": arm,
             "tasks": lambda program: tasks(program, given.episodes, files), "noisy": lambda program: noisy(program, given.episodes, files),
             "speed": lambda program: speed(program, files)}
    for name in given.only.split(",") if given.only else parts:
        if name not in parts:
            sys.exit(f"nothing is called {name}; there are {', '.join(parts)}")
        try:
            parts[name](given.program)
        except Failed as error:
            note(f"{name}: {error}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
