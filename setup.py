"""What pyproject.toml cannot say: a wheel carries, inside the package, what an FMU is built from beside it."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).parent
CARRIED = "modelDescription", "LICENSE", "fmu_src/cranktrain_slave.py"


class BuildWithSources(build_py):
    """Copies them to ``cranktrain/fmu/carried``; a checkout that is installed with -e has them where they are."""

    def run(self) -> None:
        """Build the package, then add them."""
        super().run()
        if self.editable_mode:
            return
        target = Path(self.build_lib) / "cranktrain" / "fmu" / "carried"
        target.mkdir(parents=True, exist_ok=True)
        for name in CARRIED:
            source, copy = HERE / name, target / Path(name).name
            if source.is_dir():
                shutil.copytree(source, copy, dirs_exist_ok=True)
            else:
                shutil.copyfile(source, copy)


setup(cmdclass={"build_py": BuildWithSources})
