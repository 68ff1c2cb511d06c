#!/usr/bin/env python3
"""For package_test: what the service's user could prepare for root, and what must not change by it.

    tamper.py prepare              as root: something worth changing, and a configuration to start
    tamper.py tamper file|link     as the service's user: changes whatever it may write
    tamper.py manifest             as root: all that is none of the service's business

`file` leaves texts of its own in each place, `link` links that lead to what is root's.
"""

import hashlib
import os
import pathlib
import stat
import sys
import time

CANARY = pathlib.Path("/srv/canary")
UNITS = "pheromoned@evil.service\nevil.service\n"
ELSEWHERE = ("/proc", "/sys", "/dev")  # /dev/shm is none of what a package looks at
WATCHED = ("/boot", "/etc", "/home", "/opt", "/srv", "/usr/local", "/var/spool")


def prepare():
    (CANARY / "folder").mkdir(parents=True)
    for name in ("file", "folder/file"):
        (CANARY / name).write_text("root's\n")
        (CANARY / name).chmod(0o644)
    pathlib.Path("/etc/pheromone/evil.toml").write_text(
        pathlib.Path("/etc/pheromone/lab2.toml").read_text().replace(":8378", ":8379"))


def replace(path, how):
    """Puts something else in a file's, folder's or socket's place, which stays beside it."""
    is_folder = path.is_dir()
    if path.exists() or path.is_symlink():
        path.rename(path.with_name(f"{path.name}.mine-{time.monotonic_ns()}"))
    if how == "link":
        path.symlink_to(CANARY / ("folder" if is_folder else "file"))
    elif not is_folder:
        path.write_text(UNITS)


def walk(top):
    for folder, folders, files in os.walk(top):
        folders[:] = [it for it in folders if os.path.join(folder, it) not in ELSEWHERE]
        yield folder, folders, files


def tamper(how):
    for folder, folders, files in reversed(list(walk("/"))):  # what is inside first
        if not os.access(folder, os.W_OK | os.X_OK):
            for name in files:
                path = pathlib.Path(folder, name)
                if path.is_file() and not path.is_symlink() and os.access(path, os.W_OK):
                    path.write_text(UNITS)
                    print(path)
            continue
        print(folder)
        for name in {*folders, *files, "enabled-instances"}:
            if ".mine-" in name:
                continue
            try:
                replace(pathlib.Path(folder, name), how)
            except (PermissionError, FileNotFoundError):
                pass  # of others, in a sticky folder; or the server beside it was faster


def manifest():
    for top in WATCHED:
        for folder, folders, files in os.walk(top):
            for name in sorted(folders + files):
                path = pathlib.Path(folder, name)
                # What the package itself installs, enables and removes.
                if str(path).startswith("/etc/pheromone") or name.startswith("pheromoned"):
                    continue
                status = path.lstat()
                what = (os.readlink(path) if path.is_symlink() else
                        hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "")
                print(path, stat.filemode(status.st_mode), status.st_uid, status.st_gid, what)


if __name__ == "__main__":
    {"prepare": prepare, "tamper": tamper, "manifest": manifest}[sys.argv[1]](*sys.argv[2:])
