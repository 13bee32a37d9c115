"""Variables in the form of FMI 3.0: members of a family are elements of one array, choices are enumerations.

``cylinder[1].pressure`` to ``cylinder[6].pressure`` become the array ``cylinder.pressure`` of six elements.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from cranktrain.core.element_names import array_element
from cranktrain.fmu.description import Variable

_RANKS = {"input": 0, "output": 1, "parameter": 2}
_TYPES = ("Real", "String", "Enumeration")
"""Types of variables in the order of their value references, which is that of the FMU of FMI 2.0."""


@dataclass(frozen=True)
class Group:
    """A scalar variable, or an array with the variables that are its elements.

    Attributes
    ----------
    name : name in the model description
    members : variables with consecutive value references; the first one's is that of the array
    is_array : True if it has a dimension; an array may have one member
    """

    name: str
    members: tuple[Variable, ...]
    is_array: bool

    @property
    def variable(self) -> Variable:
        """Variable that describes the group: its first member with the group's name; members share other attributes."""
        return replace(self.members[0], name=self.name)

    @property
    def element_names(self) -> tuple[str, ...]:
        """Names of the members, such as ``cylinder.pressure[1]``."""
        if not self.is_array:
            return (self.name,)
        return tuple(f"{self.name}[{k + 1}]" for k in range(len(self.members)))


def grouped(variables: Sequence[Variable]) -> tuple[Group, ...]:
    """Groups of variables in their order, an array at the position of its first element, with FMI 3.0 value references.

    Variables whose names differ only in a number from 1 to n are an array if they agree in all but start value and
    setting.
    """
    families: dict[str, list[Variable]] = {}
    for variable in variables:
        array = array_element(variable.name)
        families.setdefault(array[0] if array else variable.name, []).append(variable)
    groups: list[Group] = []
    for name, members in families.items():
        if _is_array(members):
            groups.append(Group(name, tuple(members), True))
        else:
            groups += [Group(member.name, (member,), False) for member in members]
    return _numbered(groups)


def _is_array(members: Sequence[Variable]) -> bool:
    """True if variables are the elements 1 to n, in this order, of one array."""
    places = [array_element(member.name) for member in members]
    numbers = [place[1] for place in places if place]
    if numbers != list(range(1, len(members) + 1)):
        return False
    # The description of an element contains its number.
    said = (re.sub(r"\[\d+\]", "", v.description) for v in members)
    common = {
        replace(v, name="", start=None, setting=None, reference=-1, description=text)
        for v, text in zip(members, said, strict=True)
    }
    return len(common) == 1 and all(member.type == "Real" for member in members)


def _numbered(groups: Iterable[Group]) -> tuple[Group, ...]:
    """Groups with value references. Reals come first; within a type the order is inputs, outputs, parameters."""
    listed = list(groups)

    def rank(k: int) -> tuple[int, int]:
        first = listed[k].members[0]
        return _TYPES.index(first.type), _RANKS[first.causality]

    reference = 0
    for k in sorted(range(len(listed)), key=rank):
        group = listed[k]
        members = tuple(
            replace(v, reference=reference + i, type="Enumeration" if v.type == "String" and v.choices else v.type)
            for i, v in enumerate(group.members)
        )
        reference += len(members)
        listed[k] = replace(group, members=members)
    return tuple(listed)


def scalars(groups: Iterable[Group]) -> tuple[Variable, ...]:
    """All scalar variables and elements, in the order of their value references."""
    return tuple(sorted((member for group in groups for member in group.members), key=lambda v: v.reference))


def array_table(groups: Iterable[Group]) -> str:
    """Text with first reference and size of each array, ``FIRST*COUNT FIRST*COUNT``, read by ``fmi3_values.c``."""
    arrays = [group for group in groups if group.is_array]
    return " ".join(f"{group.members[0].reference}*{len(group.members)}" for group in arrays)
