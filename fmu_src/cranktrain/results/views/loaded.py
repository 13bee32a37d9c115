"""Reader of result files."""

from pathlib import Path

from cranktrain.core.errors import InputError, StoreError
from cranktrain.core.user_file import user_path
from cranktrain.results.files import StoredRun
from cranktrain.results.run_up.run_up import RunUp
from cranktrain.results.views.over_speed import OrdersOverSpeed
from cranktrain.results.views.time_series import TimeSeries
from cranktrain.store.hdf5 import is_run_up, read_result
from cranktrain.store.sound_files import rising


class LoadedRun(TimeSeries, StoredRun):
    """A run read from its result file, with the methods of a finished run."""

    __repr__ = TimeSeries.__repr__


class LoadedCoupling(LoadedRun):
    """A run of coupled units read from its file; outputs ``unit/output`` at the communication points."""

    @property
    def title(self) -> str:
        """Title with engine, speed and coupling scheme."""
        own = self.attributes
        speed = f", {own['speed_rpm']:.5g} rev/min" if "speed_rpm" in own else ""
        return f"{own.get('engine', 'units')}{speed}, coupled by {own.get('scheme')}"


def load_run(path: str | Path) -> LoadedRun | OrdersOverSpeed:
    """Read a result file of ``simulate``, ``runup`` or ``couple``.

    Raises ``InputError``: no path; ``StoreError`` if the file is missing, incomplete, damaged, or of another kind.
    """
    if not isinstance(path, str | Path):
        raise InputError(f"load_run: {path!r} is no path; give that of a result file, such as 'diesel_i6_2000rpm.h5'")
    target = user_path(path)
    if is_run_up(target):
        return OrdersOverSpeed.of(RunUp.load(target))
    data, attributes = read_result(target)
    if "angle" not in data and "scheme" in attributes:
        outputs = {name: values for name, (values, _) in data.items()}
        angle = next((values for name, values in outputs.items() if name.endswith("/crank.angle")), None)
        time = outputs.get("time")
        if angle is None or angle.size < 2 or time is None or time.shape != angle.shape:
            raise StoreError(f"{target}: no unit has recorded its crank.angle, over which outputs are evaluated")
        if not all(one.ndim == 1 and one.dtype.kind in "iuf" for one in (time, angle)) or not rising(time):
            raise StoreError(f"{target}: its time is damaged; run 'cranktrain couple' again")
        return LoadedCoupling(outputs.pop("time"), angle, outputs, attributes)
    return LoadedRun.load(target)
