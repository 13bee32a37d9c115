"""Layouts of cylinders: throws, banks and firing order of standard practice, one row per layout.

A row states the crank angle at which each cylinder fires. Throws follow from it: a throw at angle α points along the
bank at β when the crank has turned by θ = β − α, so α = β − φ for a cylinder that fires at φ. Cylinders are numbered
along the crank: in line 1 to n; in a V the first bank, then the second, cylinders k and k + n/2 on pin k; in a boxer
engine alternately to the left and to the right, each on its own pin. On split pins the cylinders of a pair lie beside
each other between two mains.

In-line engines with an even number of cylinders from six on have a crank that is its own mirror image, and fire
alternately in its front and rear half, so that their free moments vanish. Firing orders are the usual ones, as listed
by Köhler and Flierl, *Verbrennungsmotoren*, and Heisler, *Advanced Engine Technology* (1995); from nine cylinders in
line on they go on in the same scheme.
"""

from collections.abc import Sequence
from typing import NamedTuple

from cranktrain.core.errors import InputError, nearest

CYCLE_DEG = 720.0
IN_LINE, VEE, BOXER = "in line", "V", "boxer"
EVEN_DEG = 1.0
"""Tolerance of even firing intervals, deg."""
LEAST_BANK_DEG, LARGEST_BANK_DEG = 10.0, 180.0


class Layout(NamedTuple):
    """A layout of cylinders.

    Attributes
    ----------
    form : ``in line``, ``V`` or ``boxer``
    firing_deg : crank angle at which each cylinder fires, in the order of their numbers, at the usual bank angle
    bank_deg : usual angle between the banks, deg; 0 in line
    note : remark on the layout
    split : True if each cylinder of a V has its own pin, rotated so that all cylinders fire at even intervals
    """

    name: str
    title: str
    form: str
    firing_deg: tuple[float, ...]
    bank_deg: float = 0.0
    note: str = ""
    split: bool = False

    @property
    def cylinders(self) -> int:
        """Number of cylinders."""
        return len(self.firing_deg)

    def with_bank(self, bank_deg: float) -> "Layout":
        """Layout with another angle between its banks on the same crank; ``InputError`` for a layout without banks.

        The second bank fires later by the difference.
        """
        if self.form != VEE:
            raise InputError(f"--bank-angle-deg: layout {self.name} is {self.form}, without a V; leave it out")
        if not LEAST_BANK_DEG <= bank_deg <= LARGEST_BANK_DEG:
            raise InputError(
                f"--bank-angle-deg {bank_deg:g} is not within {LEAST_BANK_DEG:g} to {LARGEST_BANK_DEG:g} deg; "
                f"layout {self.name} usually has {self.bank_deg:g}"
            )
        if self.split:  # split pins change with the bank angle, so that firing stays even
            return self._replace(bank_deg=bank_deg)
        half, later = self.cylinders // 2, bank_deg - self.bank_deg
        moved = tuple((angle + later) % CYCLE_DEG for angle in self.firing_deg[half:])
        return self._replace(bank_deg=bank_deg, firing_deg=(*self.firing_deg[:half], *moved))

    @property
    def pins(self) -> tuple[int, ...]:
        """Number of the pin (from 1) of each cylinder."""
        half = self.cylinders // 2
        if self.split:
            return tuple(2 * (k % half) + 1 + k // half for k in range(self.cylinders))
        if self.form == VEE:
            return tuple(k % half + 1 for k in range(self.cylinders))
        return tuple(range(1, self.cylinders + 1))

    @property
    def banks_deg(self) -> tuple[float, ...]:
        """Angle of each cylinder's bank from the vertical in the sense of rotation, deg."""
        half = 0.5 * self.bank_deg
        if self.form == VEE:
            return tuple(-half if k < self.cylinders // 2 else half for k in range(self.cylinders))
        return tuple((-half if k % 2 == 0 else half) for k in range(self.cylinders))

    @property
    def throws_deg(self) -> tuple[float, ...]:
        """Angle of each throw, deg within (−180, 180]."""
        found: dict[int, float] = {}
        for pin, bank, firing in zip(self.pins, self.banks_deg, self.firing_deg, strict=True):
            found.setdefault(pin, 180.0 - (180.0 - (bank - firing)) % 360.0)
        return tuple(found[pin] for pin in sorted(found))

    @property
    def order(self) -> tuple[int, ...]:
        """Firing order, starting with cylinder 1; of cylinders that fire together the lower number comes first."""
        after = [(round(angle - self.firing_deg[0], 6) % CYCLE_DEG, k + 1) for k, angle in enumerate(self.firing_deg)]
        return tuple(cylinder for _, cylinder in sorted(after))

    @property
    def intervals_deg(self) -> tuple[float, ...]:
        """Interval from each cylinder of the firing order to the next, including the last to the first."""
        angles = sorted(round(angle - self.firing_deg[0], 6) % CYCLE_DEG for angle in self.firing_deg)
        return tuple(b - a for a, b in zip(angles, [*angles[1:], CYCLE_DEG], strict=True))

    @property
    def even(self) -> bool:
        """True if the layout fires at even intervals, one cylinder at a time."""
        return max(self.intervals_deg) - min(self.intervals_deg) < EVEN_DEG


def evenly(order: Sequence[int]) -> tuple[float, ...]:
    """Firing angle of each cylinder, deg, for a firing order with even intervals."""
    interval = CYCLE_DEG / len(order)
    return tuple(interval * order.index(cylinder) for cylinder in range(1, len(order) + 1))


def mirrored(half: Sequence[int]) -> tuple[int, ...]:
    """Firing order of an in-line engine with a mirror-symmetric crank, with alternate firing of front and rear half.

    ``half`` is the order in which the throws of the front half reach dead centre. Each stands beside that of its mirror
    image, which fires a revolution earlier or later.
    """
    m = len(half)
    first = [cylinder if k % 2 == 0 else 2 * m + 1 - cylinder for k, cylinder in enumerate(half)]
    return (*first, *(2 * m + 1 - cylinder for cylinder in first))


def in_line(order: Sequence[int], title: str) -> Layout:
    """Layout of an in-line engine that fires at even intervals in the given order."""
    name = "single" if len(order) == 1 else f"i{len(order)}"
    return Layout(name, title, IN_LINE, evenly(order))


def vee(order: Sequence[int], bank_deg: float, title: str) -> Layout:
    """Layout of a V engine with this bank angle that fires at even intervals in the given order."""
    return Layout(f"v{len(order)}", title, VEE, evenly(order), bank_deg)


LAYOUTS = {row.name: row for row in (
    in_line((1,), "single cylinder"),
    in_line((1, 2), "in-line two, both pistons moving together"),
    in_line((1, 3, 2), "in-line three"),
    in_line((1, 3, 4, 2), "in-line four"),
    in_line((1, 2, 4, 5, 3), "in-line five"),
    in_line((1, 5, 3, 6, 2, 4), "in-line six"),
    in_line((1, 3, 5, 7, 6, 4, 2), "in-line seven"),
    in_line(mirrored((1, 3, 2, 4)), "in-line eight"),
    in_line((1, 3, 5, 7, 9, 8, 6, 4, 2), "in-line nine"),
    in_line(mirrored((1, 4, 2, 5, 3)), "in-line ten"),
    in_line((1, 3, 5, 7, 9, 11, 10, 8, 6, 4, 2), "in-line eleven"),
    in_line(mirrored((1, 5, 3, 6, 2, 4)), "in-line twelve"),
    Layout(
        "v2", "V-twin", VEE, (0.0, 450.0), 90.0,
        "two rods on one pin: at 90 deg the counterweights balance all of the first order",
    ),
    Layout(
        "v4", "V-four", VEE, (0.0, 180.0, 450.0, 630.0), 90.0,
        "throws half a turn apart, two rods on a pin: the first order vanishes but for a couple",
    ),
    vee((1, 4, 2, 5, 3, 6), 120.0, "V-six")._replace(
        note="two rods on a pin: fires evenly at 120 deg only; at 60 or 90 deg split pins do, layouts v6_60 and v6_90",
    ),
    *(
        vee((1, 4, 2, 5, 3, 6), bank, f"V-six, {bank:g} deg, split pins")._replace(
            name=f"v6_{bank:g}", split=True, note="a pin for each cylinder, with a flying web between those of a pair"
        )
        for bank in (60.0, 90.0)
    ),
    vee((1, 5, 4, 8, 6, 3, 7, 2), 90.0, "V-eight, cross-plane"),
    vee((1, 6, 2, 7, 4, 9, 5, 10, 3, 8), 72.0, "V-ten"),
    vee((1, 12, 5, 8, 3, 10, 6, 7, 2, 11, 4, 9), 60.0, "V-twelve"),
    vee((1, 16, 6, 11, 2, 15, 5, 12, 8, 9, 3, 14, 7, 10, 4, 13), 45.0, "V-sixteen"),
    Layout("boxer2", "flat twin", BOXER, evenly((1, 2)), 180.0),
    Layout("boxer4", "flat four", BOXER, evenly((1, 3, 2, 4)), 180.0),
    Layout("boxer6", "flat six", BOXER, evenly((1, 6, 3, 2, 5, 4)), 180.0),
)}  # fmt: skip
"""All layouts by name."""


def layout(name: str, bank_deg: float | None = None) -> Layout:
    """Layout with this name, with another bank angle if given; ``InputError`` for an unknown name."""
    if name not in LAYOUTS:
        raise InputError(f"--layout '{name}' is not known; {nearest(name, LAYOUTS)}")
    row = LAYOUTS[name]
    return row if bank_deg is None else row.with_bank(bank_deg)
