"""How many commands of a 1 kHz torque loop reach a robot in time.

    pip install pylibfranka
    rt_bridge serve --cell config/fr3_cell.toml
    python rt_bridge/examples/success_rate.py 60 127.0.0.1

Asks for no torque, so the arm stands still, and answers every state. Says the success rate that the robot itself reports (share
of the last 100 commands that were there in time), as mean and worst, and the share of the robot's milliseconds whose state was
seen. success_rate.sh has another server take turns with it.
"""

import sys
from pylibfranka import Robot, RealtimeConfig, Torques

FILLING = 0.2  # s; until the first hundred commands fill the rate


def main(seconds, address):
    control = Robot(address, RealtimeConfig.kIgnore).start_torque_control()
    rates, begin, passed = [], None, 0.0
    while passed < seconds:
        state, _ = control.readOnce()
        now = state.time.to_sec()
        begin = now if begin is None else begin
        passed = now - begin
        if passed > FILLING:
            rates.append(state.control_command_success_rate)
        command = Torques([0.0] * 7)
        command.motion_finished = passed >= seconds
        control.writeOnce(command)
    seen = len(rates) / round(1e3 * (passed - FILLING))
    print(f"success rate {sum(rates) / len(rates):.4f}, worst {min(rates):.2f}; {seen:.4f} of the states seen", flush=True)


if __name__ == "__main__":
    main(float(sys.argv[1]), sys.argv[2])
