"""cell.toml: what the laboratory knows, and nothing of what is true besides."""
from . import fr3
from .world import CENTRE, DECLARED_SCATTER, FRICTION, MASS, TIP_FRICTION

NOISE = {"q": 4e-6, "dq": 1.5e-3, "tau": 0.04, "position": 0.0007, "rotation": 0.005}  # one sigma; SI

MEASURED = "/franka_robot_state_broadcaster/measured_joint_states"
DESIRED = "/franka_robot_state_broadcaster/desired_joint_states"
OBJECT = "/object/pose"


def cell_toml(world, clips):
    """The file's text for a session with these clips."""
    arm = f"""[robot]
model = "fr3"
base_frame = "{fr3.BASE_FRAME}"

[controller]
kind = "joint_impedance"
stiffness = {plain(fr3.STIFFNESS)}
damping = {plain(fr3.DAMPING)}
rotor_inertia = {plain(fr3.ROTOR)}
torque_limit = {plain(fr3.TORQUE)}

[tool]
mass = {world.tool.mass}
length = {world.tool.length}
radius = {world.tool.radius}

[table]
height = 0.0

[topics]
measured = "{MEASURED}"
desired = "{DESIRED}"
"""
    if world.box is not None:
        arm += f"""object_pose = "{OBJECT}"

[object]
shape = "box"
size = {plain(world.box.size)}
support = "corners"
mass_range = {plain(MASS)}
friction_range = {plain(FRICTION)}
centre_of_mass_range = {[[-CENTRE, CENTRE]] * 3}
tip_friction_range = {plain(TIP_FRICTION)}
friction_scatter = {DECLARED_SCATTER}
pose_noise = {{ position = {NOISE["position"]}, rotation = {NOISE["rotation"]} }}
"""
    kind = "excitation" if world.box is None else "control_hit_slide"
    return arm + "".join(f'\n[[clip]]\nfile = "{clip}"\nkind = "{kind}"\n' for clip in clips)


def plain(values):
    return [float(v) for v in values]
