"""How many commands of a 1 kHz torque loop reach a robot in time: one that is served, beside others, in turns.

    pip install pylibfranka
    rt_bridge serve --cell config/fr3_cell.toml --bind 127.0.0.2
    python rt_bridge/examples/success_rate.py 60 127.0.0.2 [another robot's address ...]

Asks for no torque, so the arm stands still, and answers every state. One line a robot: the success rate that the robot itself
reports (share of the last 100 commands that were there in time), as mean and worst over the whole time, and the share of
the robot's milliseconds whose state was seen.
"""

import sys
from pylibfranka import Robot, RealtimeConfig, Torques

SLICE = 10.0  # s; the robots take turns, so that they share whatever else the machine does


def loop(address, seconds):
    """Success rates as reported [1], states seen, and milliseconds that passed."""
    robot = Robot(address, RealtimeConfig.kIgnore)
    control = robot.start_torque_control()
    rates, first, last = [], None, None
    while first is None or last - first < seconds:
        state, _ = control.readOnce()
        last = state.time.to_sec()
        first = last if first is None else first
        if last - first > 0.2:  # the first hundred commands fill the rate
            rates.append(state.control_command_success_rate)
        command = Torques([0.0] * 7)
        command.motion_finished = last - first >= seconds
        control.writeOnce(command)
    return rates, len(rates), round(1e3 * (last - first - 0.2))


def main():
    seconds, addresses = float(sys.argv[1]), sys.argv[2:]
    found = {address: [[], 0, 0] for address in addresses}
    left = seconds
    while left > 0:
        for address in addresses:
            for kept, new in enumerate(loop(address, min(SLICE, left))):
                found[address][kept] += new
        left -= SLICE
    for address, (rates, seen, passed) in found.items():
        print(f"{address}: success rate {sum(rates) / len(rates):.4f}, worst {min(rates):.2f}; {seen / passed:.4f} of {passed} states seen")


if __name__ == "__main__":
    main()
