"""Small FMUs in plain Python, made at once: a mass on a spring, a spring that it may be coupled to, and others."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path

from pythonfmu.builder import FmuBuilder

SLAVE = '''
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class {name}(Fmi2Slave):
    """{text}"""

    def __init__(self, **arguments):
        super().__init__(**arguments)
{body}

    def do_step(self, time, size):
{step}
        return True

import ctypes
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))
'''
MASS = (
    "Mass", "A mass that is pushed by a force, on a spring and a damper",
    {"force": ("input", 0.0), "place": ("output", 1.0), "speed": ("output", 0.0), "mass": ("parameter", 1.0)},
    ["for _ in range(20):",
     "    h = size / 20",
     "    self.speed += h * (self.force - self.place - 0.1 * self.speed) / self.mass",
     "    self.place += h * self.speed"],
)  # fmt: skip
SPRING = (
    "Spring", "A spring between a place and one that is given",
    {"place": ("input", 0.0), "anchor": ("input", 0.0), "force": ("output", 0.0), "stiffness": ("parameter", 2.0)},
    ["self.force = -self.stiffness * (self.place - self.anchor)"],
)  # fmt: skip
LOUD = (
    "Loud", "An output that is as large as a number may be",
    {"place": ("input", 0.0), "force": ("output", 0.0), "size": ("parameter", 1.7e308)},
    ["self.force = self.size if time > 0.5 else -self.size"],
)  # fmt: skip


def small_fmu(folder: Path, name: str, text: str, variables: dict, step: list[str]) -> Path:
    """Build an FMU of real variables and the lines of its step."""
    body = []
    for variable, (causality, start) in variables.items():
        fixed = ", variability=Fmi2Variability.fixed" if causality == "parameter" else ""
        place = f"self.__dict__[{variable!r}]"
        body.append(f"{place} = {start}")
        body.append(
            f"self.register_variable(Real({variable!r}, causality=Fmi2Causality.{causality}{fixed}, "
            f"getter=lambda: {place}, setter=lambda v: self.__dict__.__setitem__({variable!r}, v)))"
        )
    script = folder / f"{name.lower()}.py"
    lines = {"body": body, "step": step}
    indented = {key: "\n".join(f"        {line}" for line in found) for key, found in lines.items()}
    script.write_text(SLAVE.format(name=name, text=text, **indented))
    return Path(FmuBuilder.build_FMU(script, dest=folder, needsExecutionTool="false"))


def edited(fmu: Path, target: Path, changes: Sequence[tuple[str, str]] = (), leave_out: str = "") -> Path:
    """A copy of an FMU with other words in its description, and without the files whose names begin so."""
    with zipfile.ZipFile(fmu) as before, zipfile.ZipFile(target, "w") as after:
        for entry in before.namelist():
            if leave_out and entry.startswith(leave_out):
                continue
            content = before.read(entry)
            if entry == "modelDescription.xml":
                text = content.decode()
                for old, new in changes:
                    assert old in text, old
                    text = text.replace(old, new)
                content = text.encode()
            after.writestr(entry, content)
    return target


def small_combustion(folder: Path, name: str, cylinders: int, step: list[str], without: str = "") -> Path:
    """An FMU with the variables that a combustion has for the cranktrain, pressures of 1 bar, and odd steps."""
    variables = dict.fromkeys(("crank.angle", "crank.speed"), ("input", 0.0))
    variables |= {key: ("output", 0.0) for key in ("pressure.angle", "indicated.torque") if key != without}
    variables |= {f"cylinder[{c + 1}].pressure": ("output", 1e5) for c in range(cylinders)}
    return small_fmu(folder, name, "Combustion with odd steps", variables, step)
