"""Files of every format of measured signals, written by the formats' own libraries."""

import numpy as np

FORMATS = ("uff", "uffb", "mf4", "tdms", "wav", "h5", "mat", "parquet", "csv")
ENDINGS = {"uff": ".uff", "uffb": ".UFF"}


def write(folder, kind, time, columns, units=None, name="run"):
    """Write columns (name → (n,)) over times (n,) s; returns the path. Columns may be empty or texts where a format
    can.
    """
    path = folder / f"{name}{ENDINGS.get(kind, '.' + kind)}"
    units = units or {}
    globals()[f"_{kind}"](path, np.asarray(time, dtype=float), columns, units)
    return path


def _uff(path, time, columns, units, binary=0):
    import pyuff

    file = pyuff.UFF(str(path))
    even = bool(time.size > 1 and np.ptp(np.diff(time)) < 1e-6)
    for node, (name, values) in enumerate(columns.items(), start=1):
        n = min(time.size, len(values))
        about = dict.fromkeys(("rsp_node", "rsp_dir", "ref_dir", "ref_node", "ordinate_spec_data_type"), 0)
        about |= {"type": 58, "binary": binary, "func_type": 1, "rsp_ent_name": name, "id1": f"run {node}"}
        about |= {"data": np.asarray(values[:n], dtype=float), "x": time[:n], "num_pts": n, "ord_data_type": 4}
        about |= {"abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s", "orddenom_spec_data_type": 0}
        about |= {"ordinate_axis_units_lab": units.get(name, "NONE"), "abscissa_spacing": int(even)}
        about["abscissa_min"] = float(time[0]) if n else 0.0
        about["abscissa_inc"] = float(time[1] - time[0]) if even else 0.0
        file.write_sets(about, "add")


def _uffb(path, time, columns, units):
    _uff(path, time, columns, units, binary=1)


def _mf4(path, time, columns, units):
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        signals = []
        for name, values in columns.items():
            values = np.asarray(values)
            text = values.dtype.kind in "US"
            values = values.astype("S8") if text else values
            signal = Signal(values, time[: len(values)], name=name, unit=units.get(name, ""),
                            encoding="utf-8" if text else None)  # fmt: skip
            if len(values) == len(time):
                signals.append(signal)
            else:
                file.append([signal])
        if signals:
            file.append(signals)
        file.save(path, overwrite=True)


def _tdms(path, time, columns, units):
    from nptdms import ChannelObject, TdmsWriter

    even = bool(time.size > 1 and np.ptp(np.diff(time)) < 1e-6)
    with TdmsWriter(str(path)) as file:
        objects = [] if even else [ChannelObject("run", "time", time)]
        for name, values in columns.items():
            held = {"unit_string": units.get(name, "")}
            if even:
                held |= {"wf_increment": float(time[1] - time[0]), "wf_start_offset": float(time[0])}
            values = np.asarray(values)
            objects.append(
                ChannelObject("run", name, list(values) if values.dtype.kind in "US" else values, properties=held)
            )
        file.write_segment(objects)


def _wav(path, time, columns, units):
    from scipy.io import wavfile

    data = np.column_stack([np.asarray(values, dtype=np.float32) for values in columns.values()])
    wavfile.write(path, round(1.0 / (time[1] - time[0])), data)


def _h5(path, time, columns, units):
    import h5py

    with h5py.File(path, "w") as file:
        file["time"] = time
        for name, values in columns.items():
            values = np.asarray(values)
            file[name] = values.astype("S8") if values.dtype.kind in "US" else values
            file[name].attrs["units"] = units.get(name, "")


def _mat(path, time, columns, units):
    from scipy.io import savemat

    savemat(path, {"time": time} | {
        name: {"data": np.asarray(values), "unit": units[name]} if name in units else np.asarray(values)
        for name, values in columns.items()
    })  # fmt: skip


def _parquet(path, time, columns, units):
    import pyarrow as pa
    import pyarrow.parquet as pq

    n = max(len(time), *(len(values) for values in columns.values()))
    padded = {"time": [*time, *[None] * (n - len(time))]}
    for name, values in columns.items():
        padded[name] = [*np.asarray(values).tolist(), *[None] * (n - len(values))]
    table = pa.table(padded)
    fields = [field.with_metadata({"unit": units.get(field.name, "s")}) for field in table.schema]
    pq.write_table(table.cast(pa.schema(fields)), path, row_group_size=400)


def _csv(path, time, columns, units):
    lines = [";".join(["time [s]", *(f"{name} [{units[name]}]" if name in units else name for name in columns)])]
    for k, t in enumerate(time):
        cells = [values[k] if k < len(values) else "" for values in columns.values()]
        lines.append(
            ";".join([f"{t:.9g}", *(f"{c:.17g}" if isinstance(c, float | np.floating) else str(c) for c in cells)])
        )
    path.write_text("\n".join(lines) + "\n", "utf-8")
