"""The engine protocol of twinalign (docs/engine.md), version 2, for any simulator that Python reaches. Needs numpy alone.

    serve(greet, roll_out)

answers on standard input and output until the input ends. Whatever is printed meanwhile, by libraries too, goes to standard error.
"""
import json
import os
import struct
import sys
import traceback

import numpy as np

VERSION = 2


class Impossible(Exception):
    """There is no answer for these parameters; others may do."""


def _exactly(stream, count):
    data = stream.read(count)
    if len(data) < count:
        raise EOFError
    return data


def _receive(stream):
    text, numbers = struct.unpack("<II", _exactly(stream, 8))
    head = json.loads(_exactly(stream, text))
    return head, np.frombuffer(_exactly(stream, 8 * numbers), "<f8")


def _send(stream, head, numbers=()):
    text = json.dumps(head).encode()
    numbers = np.ascontiguousarray(numbers, "<f8")
    stream.write(struct.pack("<II", len(text), numbers.size) + text)
    stream.write(numbers.tobytes())
    stream.flush()


class RollOut:
    """What is asked for. SI units, joints in the order of the greeting.

    `q`, `dq`: what the encoders read at time 0 [dof]; `commands`: the command in force in each control period, `before` rows
    of them from before time 0 [before + ticks, 2 dof: q_d, then dq_d]; `times`: when states are wanted, ascending [rows];
    `parameters`: stiffness and damping [dof]; `effects`: parameters by name of the effect and of the parameter; `readings`: what a
    row of the answer is made of. `object`: the object's numbers and where it stands, a dict as in docs/engine.md, None for an
    arm alone; `pose_times`: when its pose is wanted, ascending [poses].
    """

    def __init__(self, head, numbers):
        dof, self.before, self.ticks = head["dof"], head["before"], head["ticks"]
        self.dof, self.readings = dof, head["readings"]
        parts = np.split(numbers, np.cumsum([dof, dof, (self.before + self.ticks) * 2 * dof, head["rows"]]))
        self.q, self.dq, self.times, self.pose_times = parts[0], parts[1], parts[3], parts[4]
        self.object = head.get("object")
        self.commands = parts[2].reshape(-1, 2 * dof)
        self.parameters = {name: np.array(values) for name, values in head["parameters"].items()}
        bounded = lambda value: np.array([np.inf if v is None else v for v in value]) if isinstance(value, list) else value
        self.effects = {effect["name"]: {name: bounded(value) for name, value in effect.items() if name != "name"}
                        for effect in head["effects"]}


def serve(greet, roll_out):
    """`greet(cell)` takes the greeting and gives what the engine can do: name, parameters, effects, readings, object.
    `roll_out(RollOut)` gives the states [rows, readings, dof]; with an object, those and its poses [poses, 7]."""
    source, sink = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while True:
        try:
            head, numbers = _receive(source)
        except (EOFError, KeyboardInterrupt):
            return
        try:
            if head["message"] == "hello":
                _send(sink, {"message": "hello", "protocol": VERSION, **greet(head)})
            else:
                answer = roll_out(RollOut(head, numbers))
                parts = answer if isinstance(answer, tuple) else (answer,)
                _send(sink, {"message": "states"}, np.concatenate([np.ravel(part) for part in parts]))
        except Impossible as why:
            _send(sink, {"message": "impossible", "why": str(why)})
        except BrokenPipeError:
            return
        except Exception as error:  # the other side says it in its one line; the rest stands on standard error
            traceback.print_exc()
            _send(sink, {"message": "error", "why": f"{type(error).__name__}: {error}".splitlines()[0]})
