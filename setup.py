"""Build of the Python module by CMake, for pip."""
import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

SOURCE = Path(__file__).resolve().parent
(SOURCE / "build").mkdir(exist_ok=True)


class CMakeBuild(build_ext):
    """Builds the one target and puts the module where pip expects it.

    UNIMAPPER_BUILD_FOLDER names a build folder that is configured already.
    """

    def build_extension(self, ext):
        build = os.environ.get("UNIMAPPER_BUILD_FOLDER")
        if build is None:
            build = SOURCE / "build" / "python"
            subprocess.run(["cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", "-Wno-dev",
                            "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_UNITY_BUILD=ON",
                            "-DCMAKE_UNITY_BUILD_BATCH_SIZE=28", "-DUNIMAPPER_BUILD_TESTS=OFF",
                            "-DUNIMAPPER_CALL_GRAPH=OFF", "-DUNIMAPPER_PYTHON=ON",
                            f"-DPython_EXECUTABLE={sys.executable}"], check=True)
        subprocess.run(["cmake", "--build", build, "--target", "unimapper_python"], check=True)
        target = Path(self.get_ext_fullpath(ext.name))
        target.parent.mkdir(parents=True, exist_ok=True)
        self.copy_file(next((Path(build) / "python").glob("unimapper" + sysconfig.get_config_var("EXT_SUFFIX"))), target)


version = re.search(r"project\(unimapper VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
setup(version=version, py_modules=[], ext_modules=[Extension("unimapper", sources=[])],
      cmdclass={"build_ext": CMakeBuild},
      # Nothing is left beside the sources.
      options={"egg_info": {"egg_base": "build"}, "build": {"build_base": "build/pip"}})
