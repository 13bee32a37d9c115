"""The verb ``identify`` with only a file of targets: calibration of engine values to published frequencies."""

from pathlib import Path

from cranktrain.cli.console import labelled_bar, say, show_rows
from cranktrain.engine.model import Engine
from cranktrain.results.views.found import VerbResult


def calibrated(
    named: str | Path | Engine, targets: str | Path, output: str | Path | None, seed: int, evaluations: int
) -> VerbResult:
    """Search the values, and write the engine file. Return the report of the calibration."""
    from cranktrain_lab.calibration import calibrate as study

    with labelled_bar("identify") as (tell, follow):
        last = 0.0

        def progress(share: float, cost: float) -> None:
            nonlocal last
            follow(share)
            if share >= last + 0.05 or share < last:
                last = share
                tell(f"sum of squared deviations over tolerances {cost:.3g}")

        report = study.calibrate(named, targets, output, seed=seed, evaluations=evaluations, say=tell, follow=progress)
    return VerbResult.of(report, "identify")


def show(report: VerbResult) -> None:
    """Print targets, calibrated values and sensitivities."""
    keys = [p["key"] for p in report["parameters"]]
    rows = [
        (
            t["name"], t["shape"], f"{t['target_hz']:g}", f"{t['hz']:.1f}", f"{t['deviation_percent']:+.2f} %",
            f"{t['tolerance_percent']:g} %", "yes" if t["met"] else "no",
            ", ".join(f"{key} {t['sensitivities'][key]:+.2f}" for key in t["rests_on"][:4]),
        )
        for t in report["targets"]
    ]  # fmt: skip
    header = ("target", "shape", "Hz", "ours / Hz", "deviation", "tolerance", "met", "rests on (sensitivity)")
    show_rows(f"{report['engine']}: targets", header, rows)
    if report["extra_modes_hz"]:
        found = ", ".join(f"{hz:.1f}" for hz in report["extra_modes_hz"])
        print(f"Computed modes below the last target that match no target: {found} Hz")
    show_rows(
        "Free values",
        ("value", "found", "low", "high", "unit", ""),
        [
            (p["key"], f"{p['value']:.4g}", f"{p['low']:g}", f"{p['high']:g}", p["unit"], "at a bound" * p["at_bound"])
            for p in report["parameters"]
        ],
    )
    show_rows("Derived values (SI)", ("value", "found"), [(d["key"], f"{d['value']:.4g}") for d in report["derived"]])
    show_rows(
        "Sensitivities d ln f / d ln p",
        ("value", *(t["name"] for t in report["targets"])),
        [(key, *(f"{t['sensitivities'][key]:+.2f}" for t in report["targets"])) for key in keys],
    )
    if report["confirmed"]:
        print("The engine's own values meet all targets, so no search was made. For a search give narrower tolerances.")
    if report["file"]:
        say(f"{report['file']} written")
