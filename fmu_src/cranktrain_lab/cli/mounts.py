"""The verb ``mounts``: an engine as a rigid body on its mounts."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from cranktrain.cli.console import say, show_rows
from cranktrain.cli.functions import verb
from cranktrain.cli.new import KIND
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.core.units import RPM
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.results.columns import NOTHING
from cranktrain.results.views.found import VerbResult
from cranktrain.store.whole_file import check_place, whole_file
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option

DESCRIPTION = """\
The rigid engine on its mounts: six named modes, mount forces by order over speed, start and stop.

Block, crank and moving parts are one rigid body. Free forces and moments of the masses and the reaction to the torque
of gas and masses excite it; the mounts are those of [mounts] and [[mount_dynamics]]. Amplitudes are zero to peak.

modes     frequency, damping ratio and fractions of the kinetic energy by direction; coupled: other directions that
          hold a tenth or more of it
static    forces of each mount on the frame from the weight, and from the largest full-load torque of these speeds
orders    excitation and motion of the engine's centre, and sum of all mounts on the frame, by order and speed
mounts    forces of each mount on the frame, by order and speed
start, stop     largest motion and mount forces in time, and those of periodic cycles at the same speeds
"""
SPEEDS = 41
"""Speeds where no distance is given."""
Ramp = Annotated[float, between(1.0, 20000.0, "rev/min per s")]


@dataclass(frozen=True, kw_only=True)
class Mounts(words.Load):
    """Question of :func:`mounts`."""

    from_rpm: words.FirstSpeed | None = None
    to_rpm: words.LastSpeed | None = None
    step_rpm: Annotated[
        float | None,
        between(0.01, 10000.0, "rev/min"),
        Option("RPM", f"distance between speeds, rev/min (default: {SPEEDS} speeds)", "--step"),
    ] = None
    orders: Annotated[
        words.OrdersOf,
        Option("LIST", "orders to be listed, up to 12, e.g. 2,4 (default: the strongest)", convert=words.order_list),
    ] = ()
    start_rpm_per_s: Annotated[
        Ramp | None,
        Option("RPM_PER_S", "start from rest to the engine's lowest speed at this rate of the speed", "--start"),
    ] = None
    stop_rpm_per_s: Annotated[
        Ramp | None,
        Option("RPM_PER_S", "motored stop from the engine's lowest speed at this rate of the speed", "--stop"),
    ] = None
    plots: Annotated[words.File | None, Option("DIR", "folder for pictures of forces, motion, start and stop")] = None
    output: Annotated[
        words.File | None,
        Option(
            "FILE.toml",
            "engine file to write, whose mounts over frequency are bodies and connections, for --block flexible",
        ),
    ] = None


@verb(Mounts, DESCRIPTION)
def mounts(named: str | Path | Engine, ask: Mounts) -> VerbResult:
    """Compute modes and response of an engine on its mounts, and its start and stop if they are asked for."""
    from cranktrain.results.figures import check_folder
    from cranktrain_lab.mounts.pictures import PICTURES, save_pictures
    from cranktrain_lab.mounts.running import running_engine
    from cranktrain_lab.mounts.study import passage, report, study

    engine = load_engine(named)
    low = engine.speeds[0] / RPM if ask.from_rpm is None else ask.from_rpm
    high = engine.speeds[1] / RPM if ask.to_rpm is None else ask.to_rpm
    if low >= high:
        raise InputError(f"--from {low:g} --to {high:g} rev/min: the first speed must be below the last one")
    if ask.plots is not None:
        check_folder(Path(ask.plots), "--plots", PICTURES)
    if ask.output is not None:
        check_place(ask.output, KIND)
        if not engine.mount_dynamics:
            raise InputError(f"--output {ask.output}: '{engine.name}' has no [[mount_dynamics]], so it runs as it is")
    count = SPEEDS if ask.step_rpm is None else 1 + max(1, round((high - low) / ask.step_rpm))
    made = study(engine, RPM * np.linspace(low, high, count), ask.load, words.orders_of(ask.orders))
    rates = (ask.start_rpm_per_s, -ask.stop_rpm_per_s if ask.stop_rpm_per_s else None)
    passages = [passage(made, RPM * rate, ask.load) for rate in rates if rate is not None]
    drawn = [] if ask.plots is None else save_pictures(Path(ask.plots), made, passages)
    found = report(made, passages) | {"plots": list(map(str, drawn))}
    if ask.output is not None:
        written, found["fit_error"] = running_engine(engine)
        with whole_file(ask.output, KIND) as temporary:
            temporary.write_text(written.to_toml(), encoding="utf-8")
    return VerbResult.of(found, "mounts", written=[*found["plots"], *([str(ask.output)] if ask.output else [])])


def show(found: VerbResult) -> None:
    """Print modes, the largest forces of each order, and peaks of start and stop."""
    header: Sequence[str]
    rows: list[list[str]] = []
    for one in found["modes"]:
        shares = [f"{round(value, 2) + 0.0:.2f}" for key, value in one.items() if key.startswith("share_")]
        coupled = ", ".join(one["coupled"]) or NOTHING
        rows.append([one["name"], f"{one['hz']:.3f}", f"{one['damping_ratio']:.3f}", *shares, coupled])
    header = ("mode", "Hz", "damping", "lateral", "bounce", "fore-and-aft", "pitch", "yaw", "roll", "coupled with")
    show_rows(f"{found['engine']} on its mounts, {found['mass_kg']:.4g} kg: fractions of kinetic energy", header, rows)
    rows = []
    for order in dict.fromkeys(one["order"] for one in found["orders"]):
        worst = max((one for one in found["orders"] if one["order"] == order), key=lambda one: one["frame_n"])
        mount = max((one for one in found["mounts"] if one["order"] == order), key=lambda one: one["force_n"])
        sums = [f"{worst['frame_n']:.4g}", f"{worst['speed_rpm']:.0f}"]
        rows.append([f"{order:g}", *sums, f"{mount['force_n']:.4g}", f"{mount['mount']}", f"{mount['speed_rpm']:.0f}"])
    header = ("order", "sum on frame / N", "at rev/min", "one mount / N", "mount", "at rev/min")
    show_rows("Largest forces by order", header, rows)
    for name in [one for one in ("start", "stop") if one in found]:
        rows = []
        for one in found[name]["peaks"]:
            pairs = [(one["peak"], one["speed_rpm"]), (one["periodic"], one["periodic_rpm"])]
            rows.append([one["quantity"], one["unit"], *(text for a, b in pairs for text in (f"{a:.4g}", f"{b:.0f}"))])
        header = ("", "unit", "largest", "at rev/min", "of periodic cycles", "at rev/min")
        show_rows(f"{name.capitalize()} at {abs(found[name]['rate_rpm_per_s']):.4g} rev/min per s", header, rows)
    for line in found["said"]:
        print(line)
    for name in found.beside["written"]:
        say(f"{name} written")
