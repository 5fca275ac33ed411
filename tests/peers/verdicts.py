"""Scores verdicts against what was hidden, and prints the table."""
import math
import statistics

RIGHT = ("exact", "class")
COLUMNS = ("exact", "class", "part", "wrong", "beside", "none", "unexplained", "other")
KEY = """exact: the very name, or names where two are hidden; where nothing is hidden `none`, and outside of the library `unexplained`
class: a class that holds all that is hidden    part: names or a class that hold one of two, or a known effect that is in an unknown one
wrong: another name, said as named    beside: a class without what is hidden    none, unexplained: said where that is not so
other: not testable, or no answer    right: exact and class, with its 95 % interval (Wilson)
x noise: mean squared residual on held-out clips over what noise alone leaves, before any effect: near 1 there is nothing to find"""


def outcome(truth, verdict):
    """Column of a verdict. `truth` as in truth.json, `verdict` as in the diagnosis."""
    kind, said = verdict["kind"], set(verdict.get("effects", []))
    hidden = set(truth["effects"]) if truth["known"] else set()
    if kind in ("none", "unexplained"):
        right = "none" if not truth["effects"] else "unexplained" if not truth["known"] else None
        return "exact" if kind == right else kind
    if kind not in ("named", "class"):
        return "other"
    if kind == "named" and hidden and said == hidden:
        return "exact"
    if kind == "class" and hidden and hidden <= said:
        return "class"
    if kind == "named" and said and said <= set(truth.get("near", [])):
        return "part"
    if len(hidden) > 1 and (said < hidden if kind == "named" else said & hidden):
        return "part"
    return "wrong" if kind == "named" else "beside"


def wilson(right, all_, z=1.96):
    """95 % interval of a share."""
    if all_ == 0:
        return 0.0, 1.0
    share = right / all_
    middle = share + z * z / (2 * all_)
    half = z * math.sqrt(share * (1 - share) / all_ + z * z / (4 * all_ * all_))
    return (middle - half) / (1 + z * z / all_), (middle + half) / (1 + z * z / all_)


def calibration_error(results, bins=5):
    """Expected calibration error of the confidences given, or None."""
    given = [(r["confidence"], r["outcome"] in RIGHT) for r in results if r["confidence"] is not None]
    if not given:
        return None
    error = 0.0
    for i in range(bins):
        part = [(c, right) for c, right in given if min(int(c * bins), bins - 1) == i]
        if part:
            error += abs(sum(c for c, _ in part) - sum(right for _, right in part)) / len(given)
    return error


def row(name, results):
    counts = {column: sum(r["outcome"] == column for r in results) for column in COLUMNS}
    right = sum(r["outcome"] in RIGHT for r in results)
    low, high = wilson(right, len(results))
    shrinks = [r["shrink"] for r in results if r["shrink"] is not None]
    seconds = [r["seconds"] for r in results]
    cells = [f"{name:28s}", f"{len(results):4d}"] + [f"{counts[column]:6d}" for column in COLUMNS]
    cells.append(f"{right / len(results):5.0%} [{low:4.0%}, {high:4.0%}]")
    cells.append(f"{statistics.median(shrinks):6.2f}" if shrinks else "     -")
    cells.append(f"{statistics.median(seconds):6.0f} {max(seconds):6.0f}")
    return "  ".join(cells)


def table(results):
    """The whole table as text: per kind, per effect, in all."""
    if not results:
        return "no session was diagnosed yet\n"
    head = "  ".join([f"{'':28s}", "  n "] + [f"{column[:6]:>6s}" for column in COLUMNS] + [f"{'right':18s}", "shrink", "median  worst s"])
    lines = [head]
    for kind in dict.fromkeys(r["kind"] for r in results):
        lines.append(row(kind, [r for r in results if r["kind"] == kind]))
    lines.append(row("all", results))
    lines.append("")
    for hidden in sorted({"+".join(r["truth"]) or "nothing" for r in results}):
        lines.append(row(hidden[:28], [r for r in results if ("+".join(r["truth"]) or "nothing") == hidden]))
    errors = [calibration_error(part) for part in (results, [r for r in results if not r["said"].startswith("none")])]
    errors = ["-" if error is None else f"{error:.3f}" for error in errors]
    lines += ["", f"expected calibration error of the confidence: {errors[0]}; of verdicts other than `none`: {errors[1]}", "", KEY, ""]
    for r in results:
        times = f"{r['gap']:9.1f} x noise" if r.get("gap") is not None else f"{'-':>9s}        "
        lines.append(f"{r['session']:24s} {'+'.join(r['truth']) or 'nothing':44s} {times}  {r['outcome']:12s} said {r['said']}")
    return "\n".join(lines) + "\n"
