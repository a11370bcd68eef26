"""What the scripts share: other programs run, the machine and the commit told, results written."""
import datetime
import json
import os
import re
import shlex
import shutil
import subprocess
import sys


class Failure(Exception):
    pass


def run(command, **options):
    """The finished process; never raises for an exit code."""
    return subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          errors="replace", **options)


def last_line(text):
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "no output"


def first_match(pattern, text):
    found = re.search(pattern, text, re.MULTILINE)
    return found.group(1).strip() if found else "unknown"


def machine():
    cpuinfo = open("/proc/cpuinfo").read() if os.path.exists("/proc/cpuinfo") else ""
    out = {"cpu": first_match(r"^model name\s*:\s*(.*)$", cpuinfo), "cores": os.cpu_count()}
    if shutil.which("nvidia-smi"):
        query = run(["nvidia-smi", "--query-gpu=name,driver_version,memory.total", "--format=csv,noheader"]).stdout
        fields = [f.strip() for f in query.splitlines()[0].split(",")] if query.strip() else []
        if len(fields) == 3:
            out["gpu"], out["driver"], out["gpu_memory"] = fields
    return out


def commit_of(argument):
    if argument:
        return argument
    folder = os.path.dirname(os.path.abspath(__file__))
    head = run(["git", "-C", folder, "rev-parse", "--short=12", "HEAD"])
    if head.returncode != 0:
        return "unknown"
    changed = run(["git", "-C", folder, "status", "--porcelain", "--untracked-files=no"]).stdout.strip()
    return head.stdout.strip() + (" with changes" if changed else "")


def now():
    return datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC")


def command_line():
    return " ".join(shlex.quote(x) for x in ["python3"] + sys.argv)


def write_json(path, value):
    """Whole or not at all; makes the folder."""
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    with open(path + ".part", "w") as file:
        json.dump(value, file, indent=1)
        file.write("\n")
    os.replace(path + ".part", path)
