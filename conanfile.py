"""Conan recipe: builds these sources on the libraries of Debian, and tries them by examples/03_consumer_cmake.

    conan create . --no-remote --build=missing -c tools.system.package_manager:mode=install
"""

import re
from pathlib import Path

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import load, replace_in_file
from conan.tools.scm import Git
from conan.tools.system.package_manager import Apt


class Sila(ConanFile):
    name = "sila"
    license = "MIT"
    description = "Learns how pedestrians move at intersections, batch by batch, and predicts their next seconds"
    package_type = "static-library"
    settings = "os", "compiler", "build_type", "arch"
    exports = "CMakeLists.txt", "cmake/package.cmake"
    exports_sources = (
        "CMakeLists.txt", "LICENSE", "cli/*", "cmake/*", "examples/CMakeLists.txt", "examples/*.cpp", "include/*", "src/*",
        "viewer/dist/*",
    )
    test_package_folder = "packaging/conan"

    def set_version(self):
        self.version = re.search(r"project\(sila VERSION ([0-9.]+)", self._text("CMakeLists.txt"))[1]

    def export_sources(self):
        git = Git(self, self.recipe_folder)    # in the place of `git archive`, as cmake/revision.cmake expects it
        if (Path(self.recipe_folder) / ".git").exists() and not git.is_dirty():
            revision = Path(self.export_sources_folder, "cmake", "revision.cmake")
            replace_in_file(self, revision, "$Format:%H$", git.get_commit())

    def system_requirements(self):
        listed = re.search(r'DEVELOPMENT_PACKAGE_DEPENDS "([^"]+)"', self._text("cmake/package.cmake"))[1]
        Apt(self).install([*re.findall(r"[\w+-]+-dev", listed), "libdlib-dev", "libboost-dev", "libcli11-dev"])

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["SILA_BUILD_TESTS"] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()

    def package_info(self):
        self.cpp_info.set_property("cmake_find_mode", "none")    # by its own silaConfig.cmake
        self.cpp_info.builddirs = ["lib/cmake/sila"]

    def _text(self, file):
        return load(self, Path(self.recipe_folder, file))
