"""Is the time left true? Runs a command, notes what it promises while it works, and says how far each promise was off.

    python tests/peers/time_left.py -- target/release/twin reconstruct object scan --out mug

Without a terminal a program writes a line every ten seconds. Each row: when it was written [s], the share said to be done, the end that it
promised [s after the start], how many times later or earlier the end came, counted from then on, and what was at work. Ends with 1 where one from a fifth of
the whole time on was off by more than 1.5 times. What the command answers is thrown away."""
import re
import subprocess
import sys
import time

FACTOR = 1.5
FROM = 0.2  # of the whole time
ROUNDED = 5.0  # s: what the end may be off by, as promises are said to ten seconds
UNITS = {"h": 3600.0, "min": 60.0, "s": 1.0}
LINE = re.compile(r": +(\d+) %, ((?:\d+ (?:h|min|s) ?)+)left(?:, (.*))?")


def promises(command):
    """(seconds after the start, share done, seconds promised, what is at work) of every line; and how long it took."""
    begun, found = time.monotonic(), []
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        for line in process.stderr:
            said = LINE.search(line)
            if said:
                parts = re.findall(r"(\d+) (h|min|s)", said[2])
                found.append((time.monotonic() - begun, int(said[1]), sum(int(n) * UNITS[unit] for n, unit in parts), said[3] or ""))
            else:
                sys.stderr.write(line)
    if process.returncode not in (0, 3):  # 3: an answer that says more is to be done
        sys.exit(f"{command[0]} ended with {process.returncode}; give a command that succeeds")
    return found, time.monotonic() - begun


def off(at, left, took):
    """How many times the work that was left exceeded what was promised, or the other way round."""
    real, said = max(took - at, ROUNDED), max(left, ROUNDED)
    return max(real / said, said / real)


def main():
    if "--" not in sys.argv or sys.argv[-1] == "--":
        sys.exit(__doc__)
    found, took = promises(sys.argv[sys.argv.index("--") + 1:])
    if not found:
        sys.exit(f"it took {took:.0f} s and promised nothing; give a command that works for longer than ten seconds")
    print("  after   done  promised end  off by")
    for at, share, left, work in found:
        early = "" if at >= FROM * took else " (first fifth)"
        print(f"{at:5.0f} s  {share:3d} %  {at + left:10.0f} s  {off(at, left, took):5.2f}  {work}{early}")
    counted = [off(at, left, took) for at, _, left, _ in found if at >= FROM * took]
    print(f"ended after {took:.0f} s; worst from a fifth on: {max(counted, default=1.0):.2f}")
    sys.exit(int(any(factor > FACTOR for factor in counted)))


if __name__ == "__main__":
    main()
