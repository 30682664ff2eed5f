"""A report of three small computations that tell how often they ran; as a program, it is killed."""

import os
import signal
import sys
from pathlib import Path

from markupsafe import Markup, escape

from design.reproduction import DataTable, Drawing, Piece, Section, reproduce
from design.reproduction.drawing import panel

EVIL = '<script>alert("x")</script>'


def square(number, log):
    """Square a number and note it in a file; stop at the third if another file says how."""
    stop = Path(log).with_name("stop")
    if number == 3 and stop.exists():
        how = stop.read_text()
        stop.unlink()
        if how == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        raise KeyboardInterrupt
    with open(log, "a") as stream:
        stream.write(f"{number}\n")
    return {"square": number * number}


class Squares(Section):
    key = "squares"
    title = f"Squares {EVIL}"

    def __init__(self, log, stop=""):
        self.log = str(log)
        if stop:
            Path(log).with_name("stop").write_text(stop)

    def pieces(self):
        return tuple(Piece(f"square-{n}", square, {"number": n, "log": self.log}) for n in (1, 2, 3))

    def text(self, data):
        return Markup("<p>{}</p>").format(escape(sum(found["square"] for found in data.values())))

    def draw(self, data):
        figure, ax = panel("squares")
        ax.plot([found["square"] for found in data.values()])
        return (Drawing("squares", figure, f"caption {EVIL}", f"group {EVIL}"),)

    def tables(self, data):
        return (DataTable("squares", ("number", "square"), [(n, n * n) for n in (1, 2, 3)]),)


if __name__ == "__main__":
    directory = Path(sys.argv[1])
    reproduce([Squares(directory / "log", "kill")], directory / "report")
