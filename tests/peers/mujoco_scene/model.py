"""A task file as MJCF. Of what a task file says nothing about, MuJoCo's usual values count, but for a stiffer contact, elliptic cones,
an impratio of 20, which its authors advise for grasping, and one contact a pair of cylinders: with several, a cylinder that lies on
another is thrown away along its axis at 8 m/s in steps of 1 ms."""
import math

import mujoco
import numpy as np

HEAVY = 1e5  # [kg] of a body that is moved: nothing pushes it aside


def quaternion(rotation):
    """Roll, pitch, yaw as w, x, y, z."""
    r, p, y = (0.5 * angle for angle in rotation)
    cr, sr, cp, sp, cy, sy = math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(y), math.sin(y)
    return [cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy]


def numbers(values):
    return " ".join(f"{value:.12g}" for value in values)


def geom(piece, body):
    pad = body.get("pad_radius", 0.0)
    place = f'pos="{numbers(piece.get("position", [0, 0, 0]))}" quat="{numbers(quaternion(piece.get("rotation", [0, 0, 0])))}"'
    if piece.get("shape") == "box":
        shape = f'type="box" size="{numbers(0.5 * edge for edge in piece["size"])}"'
    elif piece.get("shape") == "cylinder":
        shape = f'type="cylinder" size="{piece["radius"]} {0.5 * piece["length"]}"'
    else:
        raise ValueError("meshes are not built here; give boxes and cylinders")
    turning = body["friction"] * 2 / 3 * pad
    # The twin's cylinder is a prism of 24 sides, which resists rolling by half the width of one.
    rolling = piece["radius"] * math.sin(math.pi / 24) if piece["shape"] == "cylinder" else 0.0
    dimensions = 6 if rolling else 4 if pad else 3
    return f'<geom {place} {shape} friction="{body["friction"]} {max(turning, 1e-4)} {max(rolling, 1e-6)}" condim="{dimensions}" mass="0"/>'


def inertial(body):
    """The inertia of evenly spread mass, moved to the centre of mass, as the task file means it."""
    volumes, centres, own = [], [], []
    for piece in body["piece"]:
        if piece["shape"] == "box":
            x, y, z = piece["size"]
            volume, moments = x * y * z, np.array([y * y + z * z, x * x + z * z, x * x + y * y]) / 12
        else:
            r, length = piece["radius"], piece["length"]
            side = (3 * r * r + length * length) / 12
            volume, moments = math.pi * r * r * length, np.array([side, side, r * r / 2])
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, np.array(quaternion(piece.get("rotation", [0, 0, 0]))))
        turn = turn.reshape(3, 3)
        volumes.append(volume)
        centres.append(np.array(piece.get("position", [0, 0, 0]), float))
        own.append(turn @ np.diag(moments) @ turn.T)
    shares = np.array(volumes) / sum(volumes)
    middle = sum(share * centre for share, centre in zip(shares, centres))
    inertia = np.zeros((3, 3))
    for share, centre, tensor in zip(shares, centres, own):
        away = centre - middle
        inertia += share * (tensor + away @ away * np.eye(3) - np.outer(away, away))
    inertia *= body["mass"]
    full = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    return f'<inertial pos="{numbers(body.get("centre_of_mass", middle))}" mass="{body["mass"]}" fullinertia="{numbers(full)}"/>'


def element(body, task):
    name, joint = body["name"], body.get("joint")
    inside = [geom(piece, body) for piece in body["piece"]]
    more = ""
    if joint:
        kind = {"revolute": "hinge", "prismatic": "slide"}[joint["kind"]]
        limits = joint.get("limits")
        limits = f'limited="true" range="{numbers(limits)}"' if limits else 'limited="false"'
        inside.insert(0, f'<joint name="{name}" type="{kind}" axis="{numbers(joint["axis"])}" {limits} '
                         f'frictionloss="{joint.get("friction", 0.0)}" damping="{joint.get("damping", 0.0)}"/>')
        inside.insert(1, inertial(body))
    elif body.get("hold", "free") == "free":
        inside[:0] = [f'<freejoint name="{name}"/>', inertial(body)]
    elif body["hold"] == "moved":
        inside[:0] = [f'<freejoint name="{name}"/>', f'<inertial pos="0 0 0" mass="{HEAVY}" diaginertia="{HEAVY} {HEAVY} {HEAVY}"/>']
        more = ' gravcomp="1"'
    inside += [element(other, task) for other in task["body"] if other.get("joint", {}).get("parent") == name]
    place = f'pos="{numbers(body.get("position", [0, 0, 0]))}" quat="{numbers(quaternion(body.get("rotation", [0, 0, 0])))}"'
    return f'<body name="{name}" {place}{more}>{"".join(inside)}</body>'


def mjcf(task, step, root=element, head="", more=""):
    """The model as text; `root`: what becomes of a body that hangs on no other one; `head`: what stands before the world; `more`: what is
    in it beside the bodies."""
    joints = {body["name"]: body["joint"] for body in task["body"] if "joint" in body}
    roots = [root(body, task) for body in task["body"] if not body.get("joint", {}).get("parent")]
    drives = [f'<motor name="{name}" joint="{name}"/>' for name, joint in joints.items() if "drive" in joint]
    gears = [f'<joint joint1="{name}" joint2="{joint["follows"]["body"]}" polycoef="0 {joint["follows"]["ratio"]} 0 0 0" solref="{4 * step} 1"/>'
             for name, joint in joints.items() if "follows" in joint]
    apart = [f'<exclude body1="{body["name"]}" body2="{body["joint"]["parent"]}"/>'
             for body in task["body"] if body.get("joint", {}).get("parent")]
    return f"""<mujoco><compiler angle="radian" autolimits="false" balanceinertia="true"/>
<option timestep="{step}" cone="elliptic" impratio="20" integrator="implicitfast"><flag multiccd="disable"/></option>
<default><geom solref="{4 * step} 1"/></default>
{head}<worldbody>{"".join(roots)}{more}</worldbody>
<actuator>{"".join(drives)}</actuator><equality>{"".join(gears)}</equality><contact>{"".join(apart)}</contact></mujoco>"""
