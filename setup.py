"""Puts config/ into the wheel as epa_rt/workspace, from where epa init writes it out again."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
LEFT_OUT = shutil.ignore_patterns("*.zero.yaml", "*.state.json", "__pycache__", ".*")


class BuildWithConfig(build_py):
    """Modules as ever, then the files that an operator edits; one checkout is their only source."""

    def run(self) -> None:
        super().run()
        if not self.editable_mode:  # an editable install finds them in the checkout
            workspace = Path(self.build_lib, "epa_rt", "workspace")
            shutil.rmtree(workspace, ignore_errors=True)
            shutil.copytree(ROOT / "config", workspace, ignore=LEFT_OUT)


setup(cmdclass={"build_py": BuildWithConfig})
