"""Mutants: the sources with one line made wrong, each of which the tests named beside it must notice.

The cases are rows of ``tests/data/mutants.toml``: file (below ``fmu_src``), the text of a line and what stands in its
place, and the tests (below ``tests``) that should fail. Everything happens in a copy of the tree with a cache of its
own, in ``out/mutants``. First the tests of a case must pass there as they are; then the line is changed, and they run
again. Verdicts are kept in ``tests/data/mutants_judged.json`` with what they rest on, the mutated file and the tests,
so that a run that was stopped goes on and a later one repeats what has changed. Exit code 1 if a mutant survives or a
case cannot be judged.

    python tests/mutants.py [--only TEXT ...] [--again]
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
import tomllib
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[1]
CASES = ROOT / "tests" / "data" / "mutants.toml"
WORKSHOP = ROOT / "out" / "mutants"
LEFT_OUT = ("out", "dist", "build", "__pycache__", "*.egg-info", "*.h5", ".*")
TIMEOUT = 1200.0
"""Seconds after which tests that hang have noticed as well."""
PASSED, FAILED = 0, 1
KILLED, SURVIVED = "killed", "SURVIVED"


@dataclass(frozen=True)
class Case:
    """One wrong line: ``old`` occurs once in ``file``, and becomes ``new``."""

    file: str
    old: str
    new: str
    tests: tuple[str, ...]

    @property
    def title(self) -> str:
        return f"{self.file.removeprefix('cranktrain/')}: {self.old.strip()} -> {self.new.strip()}"

    def mutated(self, folder: Path) -> str:
        """Text of the file below ``folder`` with its wrong line; ``ValueError`` where the line is not there once."""
        text = (folder / "fmu_src" / self.file).read_text("utf-8")
        count = text.count(self.old)
        if count != 1:
            raise ValueError(f"{self.file}: '{self.old}' is there {count} times; mend the case in {CASES.name}")
        return text.replace(self.old, self.new)


def read_cases() -> list[Case]:
    rows = tomllib.loads(CASES.read_text("utf-8"))["case"]
    return [Case(**{**row, "tests": tuple(row["tests"])}) for row in rows]


def copy_tree(target: Path) -> None:
    """Bring a copy of the tree up to date; files that are equal keep their time, and so their compiled kernels."""
    found = set()
    for folder, inner, names in os.walk(ROOT):
        ignored = shutil.ignore_patterns(*LEFT_OUT)(folder, [*inner, *names])
        inner[:] = sorted(set(inner) - ignored)
        for name in set(names) - ignored:
            source = Path(folder) / name
            copy = target / source.relative_to(ROOT)
            found.add(copy)
            if not copy.is_file() or copy.read_bytes() != source.read_bytes():
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, copy)
            elif copy.stat().st_mtime_ns != source.stat().st_mtime_ns:
                os.utime(copy, ns=(source.stat().st_mtime_ns,) * 2)
    for old in set(target.rglob("*.py")) - found:
        old.unlink()


def run_tests(tree: Path, tests: tuple[str, ...]) -> int:
    """Exit code of pytest in the tree; that of a failure where it hangs."""
    environment = os.environ | {
        "PYTHONPATH": str(tree / "fmu_src"),
        "CRANKTRAIN_CACHE": str(WORKSHOP / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
    }
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", "not slow"]
    command += [f"tests/{test}" for test in tests]
    with (WORKSHOP / "last.txt").open("w") as report:
        try:
            return subprocess.run(
                command, cwd=tree, env=environment, stdout=report, stderr=report, timeout=TIMEOUT, check=False
            ).returncode
        except subprocess.TimeoutExpired:
            return FAILED


def judged(case: Case, tree: Path, passing: dict[tuple[str, ...], int]) -> str:
    """What the tests say of a mutant; ``passing`` keeps what they say without."""
    if case.tests not in passing:
        passing[case.tests] = run_tests(tree, case.tests)
    if passing[case.tests] != PASSED:
        return f"ERROR: its tests end with code {passing[case.tests]} without a mutant"
    file = tree / "fmu_src" / case.file
    text, stat = case.mutated(tree), file.stat()
    kernels = WORKSHOP / "cache" / "kernels"
    before = set(kernels.glob("*"))
    original = file.read_bytes()
    try:
        file.write_text(text, "utf-8")
        code = run_tests(tree, case.tests)
    finally:
        file.write_bytes(original)
        os.utime(file, ns=(stat.st_mtime_ns,) * 2)
        for folder in set(kernels.glob("*")) - before:
            shutil.rmtree(folder, ignore_errors=True)
    verdicts = {PASSED: SURVIVED, FAILED: KILLED}
    return verdicts.get(code, f"ERROR: pytest ends with code {code}, see {WORKSHOP / 'last.txt'}")


def written(verdicts: dict[str, str]) -> str:
    """Text of the file of verdicts."""
    return json.dumps(verdicts, indent=0, sort_keys=True) + "\n"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--only", nargs="+", default=[""], metavar="TEXT", help="cases whose title holds one of these")
    parser.add_argument("--again", action="store_true", help="judge also what has been judged as it is")
    options = parser.parse_args(arguments)
    cases = [case for case in read_cases() if any(text in case.title for text in options.only)]
    tree, ledger = WORKSHOP / "tree", CASES.with_name(f"{CASES.stem}_judged.json")
    copy_tree(tree)
    kept: dict[str, str] = json.loads(ledger.read_text("utf-8")) if ledger.is_file() else {}
    passing: dict[tuple[str, ...], int] = {}
    verdicts, current = [], set()
    for number, case in enumerate(cases, 1):
        start = time.monotonic()
        try:
            text = case.mutated(tree)
        except ValueError as error:
            verdict = f"ERROR: {error}"
        else:
            files = sorted({test.partition("::")[0] for test in case.tests})
            rests_on = [json.dumps(asdict(case)), text, *((tree / "tests" / file).read_text("utf-8") for file in files)]
            key = sha256("\0".join(rests_on).encode()).hexdigest()[:16]
            if options.again or kept.get(key) not in (KILLED, SURVIVED):
                kept[key] = judged(case, tree, passing)
                ledger.write_text(written(kept), "utf-8")
            verdict = kept[key]
            current.add(key)
        verdicts.append(verdict)
        print(f"{number:3}/{len(cases)} {verdict:8} {time.monotonic() - start:5.0f} s  {case.title}", flush=True)
    if options.only == [""]:  # verdicts on texts that are no more
        ledger.write_text(written({key: kept[key] for key in current}), "utf-8")
    bad = sum(verdict != KILLED for verdict in verdicts)
    print(f"{len(cases) - bad} of {len(cases)} mutants killed" + (f"; {bad} survived or not judged" if bad else ""))
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
