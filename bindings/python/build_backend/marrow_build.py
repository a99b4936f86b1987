"""The PEP 517 backend that builds Marrow's wheel: cmake, build, install, zip. It needs nothing but the standard library.

A wheel is an installation of Marrow in the package's folder: the native module, `lib/` with the shared libraries, which
the module finds from there, and `bin/` with the program that `python -m marrow` runs.

Settings (pip's --config-settings NAME=VALUE):

program    "off" leaves the program out, which needs VTK to build. `python -m marrow` then runs the one in PATH.
gpu        "off" leaves the extraction on GPUs out, which needs Vulkan's tools to build.
build-dir  a folder that CMake has configured with MARROW_PYTHON=ON, to be used instead of build/wheel
"""

import base64
import hashlib
import re
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
VERSION = re.search(r'MARROW_VERSION "(.*)"', (ROOT / "include/marrow/version.h").read_text())[1]
NAME = f"{PROJECT['name']}-{VERSION}"
# What a build needs, and what a reader of the sources would look for first.
SOURCES = """CHANGELOG.md CMakeLists.txt CMakePresets.json LICENSE Makefile README.md pyproject.toml
    apps bindings cmake gpu include packaging scripts src""".split()
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same sources give the same bytes


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    build, with_program, with_gpu = _settings(config_settings)
    if build is None:
        build = ROOT / "build/wheel"
        _configure(build, with_program, with_gpu)
    with tempfile.TemporaryDirectory() as staging:
        package = _install(Path(build), Path(staging), with_program)
        files = {f"marrow/{path.relative_to(package)}": path for path in package.rglob("*") if path.is_file()}
        return _zip(Path(wheel_directory), files, with_program)


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    _, with_program, _ = _settings(config_settings)
    for name, text in _metadata(with_program).items():
        path = Path(metadata_directory) / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return f"{NAME}.dist-info"


def build_sdist(sdist_directory, config_settings=None):
    def clean(info):
        info.uid = info.gid = info.mtime = 0
        info.uname = info.gname = ""
        return None if Path(info.name).name == "__pycache__" else info

    with tarfile.open(Path(sdist_directory) / f"{NAME}.tar.gz", "w:gz", format=tarfile.PAX_FORMAT) as sdist:
        with tempfile.NamedTemporaryFile("w") as package_info:
            package_info.write(_core_metadata())
            package_info.flush()
            sdist.add(package_info.name, f"{NAME}/PKG-INFO", filter=clean)
        for source in SOURCES:
            sdist.add(ROOT / source, f"{NAME}/{source}", filter=clean)
    return f"{NAME}.tar.gz"


def _settings(config_settings):
    settings = dict(config_settings or {})
    program = settings.pop("program", "on")
    gpu = settings.pop("gpu", "on")
    build = settings.pop("build-dir", None)
    if settings or not {program, gpu} <= {"on", "off"}:
        sys.exit("marrow: the settings are program=on or program=off, gpu=on or gpu=off, and build-dir=FOLDER")
    return build, program == "on", gpu == "on"


def _configure(build, with_program, with_gpu):
    _run("cmake", "-S", ROOT, "-B", build, "-G", "Ninja", "-Wno-dev", "-D", "CMAKE_BUILD_TYPE=Release",
         "-D", "CMAKE_INSTALL_LIBDIR=lib", "-D", "MARROW_PYTHON=ON", "-D", f"Python_EXECUTABLE={sys.executable}",
         "-D", f"MARROW_APPS={'ON' if with_program else 'OFF'}", "-D", f"MARROW_GPU={'ON' if with_gpu else 'OFF'}")


def _install(build, staging, with_program):
    """Builds and installs Marrow as the folder of a package, and returns this folder."""
    programs = ["marrow"] if with_program else []
    _run("cmake", "--build", build, "--target", "marrow_python_package", *programs)
    _run("cmake", "--install", build, "--strip", "--component", "python", "--prefix", staging)
    package = next(staging.rglob("marrow/__init__.py")).parent
    if not (package / f"_marrow{sysconfig.get_config_var('EXT_SUFFIX')}").exists():
        sys.exit(f"marrow: {build} was configured for another Python than {sys.executable}")
    for component in ["library"] + ["program"] * with_program:
        _run("cmake", "--install", build, "--strip", "--component", component, "--prefix", staging / component)
    (staging / "library/lib").rename(package / "lib")
    for link in (package / "lib").iterdir():  # a zip file has no symbolic links
        if link.is_symlink():
            link.resolve().replace(link)
    if with_program:
        (staging / "program/bin").rename(package / "bin")
    return package


def _zip(folder, files, with_program):
    abi = "cp{}{}".format(*sys.version_info)
    platform = re.sub("[-.]", "_", sysconfig.get_platform())
    wheel = f"{NAME}-{abi}-{abi}-{platform}.whl"
    metadata = _metadata(with_program, f"{abi}-{abi}-{platform}")
    record = []
    with zipfile.ZipFile(folder / wheel, "w", zipfile.ZIP_DEFLATED) as archive:

        def add(name, content, mode=0o644):
            info = zipfile.ZipInfo(name, EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (0o100000 | mode) << 16
            archive.writestr(info, content)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record.append(f"{name},sha256={digest},{len(content)}\n")

        for name, path in sorted(files.items()):
            add(name, path.read_bytes(), 0o755 if path.parent.name == "bin" else 0o644)
        for name, text in metadata.items():
            add(name, text.encode())
        name = f"{NAME}.dist-info/RECORD"
        archive.writestr(zipfile.ZipInfo(name, EPOCH), "".join(record) + f"{name},,\n")
    return wheel


def _metadata(with_program, tag=None):
    """The files of the folder .dist-info: all but WHEEL without a tag."""
    files = {"METADATA": _core_metadata(), "LICENSE": (ROOT / "LICENSE").read_text()}
    if with_program:
        files["entry_points.txt"] = "[console_scripts]\nmarrow = marrow.__main__:main\n"
    if tag:
        files["WHEEL"] = f"Wheel-Version: 1.0\nGenerator: marrow_build\nRoot-Is-Purelib: false\nTag: {tag}\n"
    return {f"{NAME}.dist-info/{name}": text for name, text in files.items()}


def _core_metadata():
    lines = [
        "Metadata-Version: 2.1",
        f"Name: {PROJECT['name']}",
        f"Version: {VERSION}",
        f"Summary: {PROJECT['description']}",
        f"License: {PROJECT['license']['text']}",
        f"Requires-Python: {PROJECT['requires-python']}",
        *(f"Requires-Dist: {dependency}" for dependency in PROJECT["dependencies"]),
        *(f"Classifier: {classifier}" for classifier in PROJECT["classifiers"]),
        "Description-Content-Type: text/markdown",
    ]
    return "\n".join(lines) + "\n\n" + (ROOT / PROJECT["readme"]).read_text()


def _run(*command):
    try:
        subprocess.run([str(argument) for argument in command], check=True)
    except FileNotFoundError:
        sys.exit(f"marrow: {command[0]} is missing; run scripts/install-dependencies program gpu python")
    except subprocess.CalledProcessError as error:
        sys.exit(f"marrow: {' '.join(error.cmd)} failed; run scripts/install-dependencies program gpu python")
