"""libsplatd as `meson install` leaves it, in a folder of its own, and programs built against that by pkg-config alone."""
import os
import pathlib
import shlex
import shutil
import subprocess

ROOT = pathlib.Path(os.environ["SPLATD_SOURCE_ROOT"])
PREFIX = os.environ["SPLATD_PREFIX"]
STRICT = ["-Wall", "-Wextra", "-Werror", "-pedantic-errors"]
SKIPPED = 77


def run(*words, **more):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, **more)
    assert done.returncode == 0, f"{shlex.join(str(w) for w in words)}\n{done.stdout}{done.stderr}"
    return done.stdout


class Installed:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.top = self.folder / "root"
        run("meson", "install", "-C", os.environ["SPLATD_BUILD"], "--no-rebuild", "--destdir", self.top)
        self.prefix = self.top / PREFIX.lstrip("/")
        self.headers = self.prefix / "include/splatd"
        found = list(self.prefix.rglob("splatd.pc"))
        assert len(found) == 1, found
        self.library = found[0].parent.parent / "libsplatd.so"
        self.environment = {**os.environ, "PKG_CONFIG_PATH": str(found[0].parent),
                            "PKG_CONFIG_SYSROOT_DIR": str(self.top), "PKG_CONFIG_ALLOW_SYSTEM_CFLAGS": "1",
                            "PKG_CONFIG_ALLOW_SYSTEM_LIBS": "1", "LD_LIBRARY_PATH": str(self.library.parent)}

    def pkg_config(self, *words):
        return run("pkg-config", *words, "splatd", env=self.environment).split()

    def build(self, source, standard="c11", compiler="cc"):
        program = self.folder / pathlib.Path(source).stem
        run(compiler, f"-std={standard}", *STRICT, source, *self.pkg_config("--cflags"), "-o", program,
            *self.pkg_config("--libs"))
        return program

    def run(self, *words):
        return run(*words, env=self.environment)


def compilers():
    """(compiler, language, standard) of those that are here."""
    for name, language, standard in (("gcc", "c", "c11"), ("clang", "c", "c11"), ("g++", "c++", "c++11"),
                                     ("clang++", "c++", "c++11"), ("g++", "c++", "c++20")):
        if shutil.which(name):
            yield name, language, standard
