"""pheromone_lab as it was built, for tests that do not need it installed.

    lab = built.load(build_folder)
"""

import importlib.util
import pathlib
import sys
import sysconfig

SOURCES = pathlib.Path(__file__).resolve().parents[1] / "src"


def load(build):
    path = pathlib.Path(build, "python", "_core" + sysconfig.get_config_var("EXT_SUFFIX"))
    spec = importlib.util.spec_from_file_location("pheromone_lab._core", path)
    core = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(core)
    sys.path.insert(0, str(SOURCES))
    import pheromone_lab
    return pheromone_lab
