"""A cell in MuJoCo that records sessions of a known cause. Shares no code with the twin, and only numbers of the arm."""
