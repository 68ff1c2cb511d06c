"""Builds the compiled part of pheromone_lab with the project's CMake, in the clone that this folder is of,
and puts it into the package. pyproject.toml has the rest.

The build is build/gate, which ./deploy/run has made, or PHEROMONE_BUILD. One that is not there is
configured for the Python that runs this.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import sysconfig

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parents[3]
BUILD = pathlib.Path(os.environ.get("PHEROMONE_BUILD", ROOT / "build" / "gate")).resolve()


class CMakeBuild(build_ext):
    def build_extension(self, ext: Extension) -> None:
        if not (BUILD / "build.ninja").exists():
            self.cmake("--preset", "gate", "-B", BUILD, f"-DPHEROMONE_LAB_PYTHON={sys.executable}")
        elif "lab_python" not in (BUILD / "build.ninja").read_text():
            self.cmake(BUILD)  # configured before its packages were there
        self.cmake("--build", BUILD, "--target", "lab_python")
        suffix = sysconfig.get_config_var("EXT_SUFFIX")
        built = BUILD / "python" / f"_core{suffix}"
        if not built.exists():
            others = [it.name for it in built.parent.glob("_core.*")]
            raise SystemExit(f"{built.parent} is for another Python: found {others}, expected {built.name}. "
                             "Set PHEROMONE_BUILD to a new folder")
        target = pathlib.Path(self.get_ext_fullpath(ext.name))
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(built, target)

    def cmake(self, *arguments: object) -> None:
        subprocess.run(["cmake", *map(str, arguments)], cwd=ROOT, check=True)


# Beside what CMake builds: nothing is left in the source tree.
PACKAGING = BUILD / "python" / "packaging"
PACKAGING.mkdir(parents=True, exist_ok=True)
setup(options={"build": {"build_base": str(PACKAGING)}, "egg_info": {"egg_base": str(PACKAGING)}},
      ext_modules=[Extension("pheromone_lab._core", sources=[])], cmdclass={"build_ext": CMakeBuild})
