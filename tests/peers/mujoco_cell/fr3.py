"""The Franka FR3: numbers only.

Kinematics after Craig and inertials from the vendor's `franka_description` (Apache-2.0), model `fr3`.
"""
import numpy as np

DOF = 7
NAMES = [f"fr3_joint{i + 1}" for i in range(DOF)]
BASE_FRAME = "fr3_link0"

# a [m], d [m], alpha [rad] between one joint and the next.
GEOMETRY = [
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -np.pi / 2),
    (0.0, 0.316, np.pi / 2),
    (0.0825, 0.0, np.pi / 2),
    (-0.0825, 0.384, -np.pi / 2),
    (0.0, 0.0, np.pi / 2),
    (0.088, 0.0, np.pi / 2),
]
FLANGE = 0.107  # along the last joint's axis [m]

# Mass [kg], centre of mass in the link frame [m], inertia about it: xx, yy, zz, xy, xz, yz [kg m^2].
BODIES = [
    (2.9274653454, (4.128e-07, -0.0181251324, -0.038603597),
     (0.0239273, 0.0224821, 0.0063501, 1.33e-05, -0.000114, -0.001995)),
    (2.9355370338, (0.0031828864, -0.0743221644, 0.0088146084),
     (0.0419389, 0.0251451, 0.0617021, 0.0002026, 0.0040778, -0.0042252)),
    (2.2449013699, (0.0407015686, -0.0048200565, -0.0289730823),
     (0.0241014, 0.0197405, 0.0190445, 0.0024047, -0.0028563, -0.0021042)),
    (2.6155955791, (-0.0459100965, 0.063049296, -0.0085187868),
     (0.03453, 0.0288816, 0.0412547, 0.0132255, 0.0101514, -0.0009763)),
    (2.3271207594, (-0.0016039605, 0.0292536262, -0.097296599),
     (0.0516103, 0.0478773, 0.0164236, -0.0057152, -0.0035673, 0.010674)),
    (1.8170376524, (0.0597131221, -0.0410294666, -0.0101692726),
     (0.0054123, 0.0140583, 0.0160808, 0.0061935, 0.0014219, -0.0013141)),
    (0.6271432862, (0.0045225817, 0.0086261921, -0.0161633251),
     (0.00021092389, 0.00017718568, 5.99319e-05, -2.433299e-05, 4.56448e-05, 8.74407e-05)),
]

Q_MIN = np.array([-2.9007, -1.8361, -2.9007, -3.0770, -2.8763, 0.4398, -3.0508])
Q_MAX = np.array([2.9007, 1.8361, 2.9007, -0.1169, 2.8763, 4.6216, 3.0508])
SPEED = np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26])
TORQUE = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0])
ROTOR = np.array([0.195, 0.195, 0.195, 0.195, 0.074, 0.074, 0.074])

# Where excitations begin, and where inverse kinematics would like to be [rad].
REST = np.array([0.0, -0.3, 0.0, -2.2, 0.0, 1.9, 0.7854])

# What the laboratory has set, at the joint [N m/rad], [N m s/rad].
STIFFNESS = np.array([600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0])
DAMPING = np.array([50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0])


def by_size(largest):
    """`largest` for the strong joints and less for the wrist, as the gears are [same unit]."""
    return largest * np.sqrt(STIFFNESS / STIFFNESS.max())
