"""The verb ``noise``: structure-borne noise of an engine's flexible block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from cranktrain.cli.console import show_rows, stages
from cranktrain.cli.functions import Subject, verb, verb_of
from cranktrain.cli.result_names import result_name
from cranktrain.cli.run_options import engine_of, gas_of, option_of, request_of
from cranktrain.core.errors import InputError
from cranktrain.core.typed_file import between
from cranktrain.core.user_file import ending
from cranktrain.engine.file import load_engine
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult
from cranktrain.studies.requests import words
from cranktrain.studies.requests.fields import Option, Question, fields_of, several

if TYPE_CHECKING:
    from cranktrain_lab.noise.result import NoiseResult

DESCRIPTION = """\
Velocity of the block's outer surfaces, third-octave levels by panel, and the sound power that they radiate.

The engine runs in its flexible block at each speed until its cycles repeat, and the block's modal velocities are
recorded over a period. The mean square normal velocity of each panel follows from the shapes of the block's modes; the
first call repeats the block's reduction to compute them. ENGINE may also be a result of this verb (.h5), whose levels,
pictures and sound are made without a run.

sound_power_db, sound_power_dba     level re 1 pW of all panels, and A-weighted
bands      third-octave bands: hz, sound_power_db, step_error_db (with --check-step), note on the error of the step
panels     panel, area_m2, critical_hz, velocity_mm_s (RMS normal velocity), levels, bands_db

--radiation one is the equivalent radiated power (efficiency 1), an upper estimate below a panel's critical frequency;
plate takes each panel as a baffled, simply supported plate.
"""
SOURCE = Subject(
    "engine", "ENGINE", "name of a shipped engine (diesel_i6), path of a .toml file, or of a result of noise (.h5)",
    ("Engine",),
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Shown(Question):
    """Options that also apply to a result."""

    heading = "levels, pictures, sound"
    radiation: Annotated[
        Literal["one", "plate"], Option("ASSUMPTION", "radiation efficiency: one (default) or plate, by plate theory")
    ] = "one"
    panel: Annotated[
        str | None, Option("NAME", "panel of the picture over speed and frequency (default: all panels)")
    ] = None
    plots: Annotated[
        words.File | None,
        Option("FOLDER", "folder for pictures: third-octave levels; for three speeds or more levels over speed too"),
    ] = None
    map: Annotated[
        words.File | None,
        Option("FILE", "picture of the surface (.png, at the loudest speed; .gif, .mp4 or .html for all speeds)"),
    ] = None
    at_hz: Annotated[
        float | None, between(0.1, 1e5, "Hz"), Option("HZ", "third-octave band of --map (default: the loudest, dB(A))")
    ] = None
    at_order: Annotated[
        float | None, between(0.1, words.HIGHEST_ORDER, "per revolution"), Option("ORDER", "order of --map, one line")
    ] = None
    wav: Annotated[words.File | None, Option("FILE.wav", "sound of a surface point's normal velocity")] = None
    point_mm: Annotated[
        Sequence[float] | None,
        between(-1e5, 1e5, "mm"),
        Option(("X", "Y", "Z"), "place of the point of --wav, mm (default: of the largest velocity)", count=3),
    ] = None
    apart = (("at_hz", "at_order"),)


@dataclass(frozen=True, kw_only=True)
class Noise(
    Shown, words.Settled, words.CrankLevel, words.Levels, words.PistonLevel, words.Load, words.Pressures, words.Encoder,
    words.Meshes,
):  # fmt: skip
    """Question of :func:`noise`."""

    heading = ""
    speeds_rpm: Annotated[
        float | Sequence[float] | None,
        between(20.0, 20000.0, "rev/min"),
        Option("RPM", "one or several speeds, rev/min", "--speed"),
    ] = None
    block: Annotated[Literal["flexible"], Option("LEVEL", "flexible (default); on ground no surface moves")] = (
        "flexible"
    )
    cutoff_hz: Annotated[
        float, between(100.0, 20000.0, "Hz"), Option("HZ", "the block keeps its modes up to this frequency ({default})")
    ] = 3000.0
    step_deg: Annotated[
        float | None,
        between(0.001, 2.5, "deg of crank angle"),
        Option("DEG", "step (default 1, or less for 4 steps per period of the highest frequency)"),
    ] = None
    panels: Annotated[
        words.File | None,
        Option("FILE.toml", "thicknesses of panels; areas of an own reduced block's interfaces (--block-body)"),
    ] = None
    check_step: Annotated[
        bool, Option(help="also run with half the step, and mark bands that differ by more than 3 dB")
    ] = False
    output: Annotated[
        words.File | None,
        Option("FILE.h5", "result file (default: ENGINE_SPEEDrpm_noise.h5, with other speeds and options in its name)"),
    ] = None

    @property
    def speed_rpm(self) -> float:
        """Lowest speed, rev/min, which begins the name of a result file."""
        return min(several(self.speeds_rpm))


@verb(Noise, DESCRIPTION, SOURCE)
def noise(named: str | Path | Engine, ask: Noise) -> VerbResult:
    """Run and evaluate, or evaluate a result."""
    from cranktrain.results.figures import check_folder
    from cranktrain.results.pictures.files import check_picture
    from cranktrain.store.whole_file import check_place
    from cranktrain_lab.noise.pictures import BANDS_PICTURE, WATERFALL_PICTURE
    from cranktrain_lab.noise.result import NOISE, NoiseResult
    from cranktrain_lab.noise.sound import check_sound

    for option in ("at_hz", "at_order"):
        if getattr(ask, option) is not None and ask.map is None:
            raise InputError(f"{option_of(option)} is the place of a picture; give --map FILE too")
    if ask.point_mm is not None and ask.wav is None:
        raise InputError("--point-mm is the place of a sound; give --wav FILE too")
    if ask.plots is not None:
        check_folder(Path(ask.plots), pictures=(BANDS_PICTURE, WATERFALL_PICTURE))
    if ask.map is not None:
        check_picture(Path(ask.map))
    if ask.wav is not None:
        check_sound(Path(ask.wav))
    if ask.output is not None:
        if ending(ask.output) != ".h5":
            raise InputError(f"{ask.output}: a result is HDF5; name it {Path(ask.output).with_suffix('.h5').name}")
        check_place(Path(ask.output), NOISE)
    written = None
    if not isinstance(named, Engine) and ending(named) == ".h5":
        _refuse_run_options(ask, named)
        result = NoiseResult.load(named)
    else:
        result = _run(named, ask)
        written = None if ask.output is None else str(result.save(Path(ask.output)))
    result.panels.chosen(ask.panel)
    with stages(str(result.attributes["engine"])) as tell:
        return _evaluated(result, ask, written, tell)


def answer(engine: str, ask: Noise) -> VerbResult:
    """Run :func:`noise` with a result file, which is named after the options if no name is given."""
    speeds = sorted(set(several(ask.speeds_rpm)))
    if ending(engine) != ".h5" and ask.output is None and speeds:
        plain = replace(ask, **{one.name: one.default for one in fields_of(Shown)})
        kind = "_".join(("noise", *(f"{rpm:g}" for rpm in speeds[1:])))
        ask = replace(ask, output=result_name(load_engine(engine).name, plain, kind))
    found: VerbResult = verb_of(noise).function(engine, ask)
    return found


def _refuse_run_options(ask: Noise, named: str | Path) -> None:
    """Raise ``InputError`` for options of a run beside a result."""
    shown = {one.name for one in fields_of(Shown)}
    for one in fields_of(Noise):
        if one.name not in shown and getattr(ask, one.name) != one.default:
            raise InputError(f"{one.names[0]} belongs to a run, and {named} is a result; leave it out")


def _run(named: str | Path | Engine, ask: Noise) -> NoiseResult:
    """Run the engine at all speeds."""
    from cranktrain.structure.block.shape import block_plan
    from cranktrain_lab.noise.own_panels import read_panels
    from cranktrain_lab.noise.study import noise_assembly, noise_result

    speeds = sorted(set(several(ask.speeds_rpm)))
    if not speeds:
        raise InputError("--speed is missing; give one or several speeds, rev/min")
    engine = engine_of(named, ask)
    block_plan(engine)  # refuses an engine without a block
    own = {} if ask.panels is None else read_panels(ask.panels)
    request = request_of(ask, speeds[0])
    request.settings(engine, option_of)
    gas = gas_of(request, engine, speeds)
    with stages(engine.name) as tell:
        made, panels = noise_assembly(engine, request, ask.cutoff_hz, own, tell)
        return noise_result(made, panels, request, gas, speeds, ask.cutoff_hz, ask.check_step, tell)


def _evaluated(result: NoiseResult, ask: Noise, written: str | None, tell: Any) -> VerbResult:
    """Levels, pictures and sound of a result."""
    from cranktrain.results.pictures.files import save_picture
    from cranktrain_lab.noise.pictures import ASSUMED, loudest_band, save_pictures, surface_map
    from cranktrain_lab.noise.result import levels
    from cranktrain_lab.noise.sound import save_sound

    found: dict[str, Any] = {
        "engine": result.attributes["engine"],
        "assumption": ASSUMED[ask.radiation],
        "speeds": [levels(result, k, ask.radiation) for k in range(len(result.runs))],
        "result": written,
    }
    if ask.plots is not None:
        tell("pictures")
        found["plots"] = [str(one) for one in save_pictures(Path(ask.plots), result, ask.radiation, ask.panel)]
    if ask.map is not None:
        tell("surface")
        hz = ask.at_hz
        if hz is None and ask.at_order is None:
            hz = loudest_band(result, ask.radiation)
        loudest = max(range(len(result.runs)), key=lambda k: found["speeds"][k]["sound_power_dba"] or 0.0)
        found["map"] = str(save_picture(Path(ask.map), surface_map(result, hz, ask.at_order), 1.0, loudest))
    if ask.wav is not None:
        tell("sound")
        place = None if ask.point_mm is None else 1e-3 * np.array(ask.point_mm)
        sound = save_sound(Path(ask.wav), result, place)
        place_mm = [round(1e3 * x, 1) for x in sound.place.tolist()]
        found["wav"] = {
            "file": str(ask.wav), "point_mm": place_mm, "full_scale_m_s": sound.full_scale, "seconds": sound.seconds,
        }  # fmt: skip
    return VerbResult.of(found, "noise", noise=result)


def show(found: VerbResult) -> None:
    """Print a table of panels and one of bands for one speed, or a table of speeds."""
    speeds = found["speeds"]
    for one in speeds if len(speeds) == 1 else ():
        rows = [
            (
                row["panel"], f"{row['area_m2']:.3f}", f"{row['velocity_mm_s']:.3g}", _db(row["sound_power_db"]),
                _db(row["sound_power_dba"]), f"{row['critical_hz']:.0f}",
            )
            for row in one["panels"]
        ]  # fmt: skip
        header = ("panel", "area / m2", "RMS velocity / mm/s", "L_W / dB", "L_W / dB(A)", "critical / Hz")
        show_rows(f"{found['engine']}, {one['speed_rpm']:g} rev/min: outer surfaces of the block", header, rows)
        bands = [
            (f"{row['hz']:g}", _db(row["sound_power_db"]), row["note"])
            for row in one["bands"]
            if row["sound_power_db"] is not None
        ]
        show_rows("Third-octave bands, all panels", ("Hz", "L_W / dB", "step"), bands)
    if len(speeds) > 1:
        of_speeds = [
            (
                f"{one['speed_rpm']:g}", _db(one["sound_power_db"]), _db(one["sound_power_dba"]),
                str(one["panels"][0]["panel"]), ", ".join(f"{row['hz']:g} Hz" for row in one["bands"] if row["note"]),
            )
            for one in speeds
        ]  # fmt: skip
        heads = ("rev/min", "L_W / dB", "L_W / dB(A)", "loudest panel", "bands with a note on the step")
        show_rows(f"{found['engine']}: sound power of the block's outer surfaces", heads, of_speeds)
    for one in speeds:
        total = f"{_db(one['sound_power_db'])} dB, {_db(one['sound_power_dba'])} dB(A) re 1 pW"
        if len(speeds) == 1:
            print(f"Sound power level {total}; {found['assumption']}")
        if not one["steady"]:
            print(f"{one['speed_rpm']:g} rev/min: no cycle repeats, so levels are those of the last cycles")
    if len(speeds) > 1:
        print(f"Levels re 1 pW; {found['assumption']}")
    if found["result"]:
        print(f"Result: {found['result']}")
    if "plots" in found:
        print("Pictures: " + ", ".join(found["plots"]))
    if "map" in found:
        print(f"Surface: {found['map']}")
    if "wav" in found:
        wav = found["wav"]
        place = ", ".join(f"{x:g}" for x in wav["point_mm"])
        print(f"Sound: {wav['file']}, point {place} mm, full scale {wav['full_scale_m_s']:g} m/s")


def _db(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"
