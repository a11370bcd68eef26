"""gart on two hosts: two network namespaces of this machine, each with a host's name and one address, which a cable joins,
and MPI over TCP between them. Trained by two ranks on each, the model has the bytes of one rank's, rows have gone through
the cable, and where a rank of the other host is killed all end within 30 s.

Needs root, ip (iproute2), unshare (util-linux) and OpenMPI; says "skipped:" and why where one is missing.
usage: check_hosts.py GART WORK_FOLDER LAUNCHER...     the launcher up to the number of ranks
"""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

from small_capture import expect, options_of, run, write_capture

gart, folder, launcher = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3:]
hosts = {f"gart{os.getpid()}{end}": f"10.213.17.{number}" for end, number in (("a", 1), ("b", 2))}
here, there = hosts
ordered = ["--batch", 2, "--backward", "deterministic"]  # ranks share views; sums in a fixed order


def skip(why):
    print(f"skipped: {why}")
    sys.exit(0)


def ip(*words):
    done = run("ip", *words)
    if done.returncode != 0:
        skip(f"ip {' '.join(words)}: {done.stderr.strip()}")


def on_host(name, *command):
    """A command on that host: in its network, by its name, with a temporary folder of its own."""
    words = " ".join(f"'{word}'" for word in map(str, command))
    return ["ip", "netns", "exec", name, "unshare", "--uts", "sh", "-c",
            f"hostname {name}; export TMPDIR={folder}/{name}; exec {words}"]


def sent_by(name):
    path = f"/sys/class/net/{name}/statistics/tx_bytes"
    return int(run("ip", "netns", "exec", name, "cat", path).stdout)


def training(name, *more):
    return on_host(here, *launcher[:1], "--mca", "plm_rsh_agent", agent, "--mca", "btl", "tcp,self", "--mca",
                   "btl_tcp_if_include", "10.213.17.0/24", "--mca", "oob_tcp_if_include", "10.213.17.0/24", "--host",
                   ",".join(f"{address}:2" for address in hosts.values()), *launcher[1:], 4, gart,
                   *options_of(capture, folder / name, *more), *ordered)


def ranks_there():
    """Processes of gart whose network is the other host's."""
    network = os.stat(f"/run/netns/{there}").st_ino
    found = []
    for process in pathlib.Path("/proc").iterdir():
        try:
            words = (process / "cmdline").read_bytes().split(b"\0") if process.name.isdigit() else [b""]
            if os.path.basename(words[0]) == b"gart" and os.stat(process / "ns/net").st_ino == network:
                found.append(int(process.name))
        except OSError:
            continue
    return found


if os.geteuid() != 0:
    skip("network namespaces are root's to make")
for program in ("ip", "unshare"):
    if shutil.which(program) is None:
        skip(f"no {program} here")
if not any(word in run(launcher[0], "--version").stdout for word in ("Open MPI", "OpenRTE")):
    skip("the launcher is not OpenMPI's")
shutil.rmtree(folder, ignore_errors=True)
capture, agent = folder / "capture", folder / "agent.sh"
folder.mkdir(parents=True)
write_capture(capture)
agent.write_text("#!/bin/sh\n# A shell on the other host: agent.sh HOST COMMAND...\nshift\nexec ip netns exec " + there +
                 f" unshare --uts sh -c \"hostname {there}; export TMPDIR={folder}/{there}; $*\"\n")
agent.chmod(0o755)
try:
    for name in hosts:
        ip("netns", "add", name)
        (folder / name).mkdir()
    ip("link", "add", here, "netns", here, "type", "veth", "peer", "name", there, "netns", there)
    for name, address in hosts.items():
        ip("-n", name, "addr", "add", f"{address}/24", "dev", name)
        ip("-n", name, "link", "set", "lo", "up")
        ip("-n", name, "link", "set", name, "up")

    for name in hosts:
        probe = run(*on_host(name, "true"))
        if probe.returncode != 0:
            skip(f"no command runs in a network namespace: {probe.stderr.strip()}")

    alone = run(*launcher, 1, gart, *options_of(capture, folder / "alone", 60), *ordered)
    expect(alone.returncode == 0, f"1 rank: {alone.stderr}")
    both = run(*training("both", 60))
    expect(both.returncode == 0, f"2 ranks on each of 2 hosts: {both.stdout} {both.stderr}")
    for file in ("model.ply", "checkpoint.gart"):
        expect((folder / "alone" / file).read_bytes() == (folder / "both" / file).read_bytes(), f"{file} differs")
    sent = [sent_by(name) for name in hosts]
    print("sent through the cable, bytes:", *sent)
    expect(min(sent) > 100000, "the ranks did not talk through the cable")

    launch = subprocess.Popen([str(c) for c in training("killed", 1000000)], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True)
    began = time.monotonic()
    while not (folder / "killed/checkpoint.gart").exists() or len(ranks_there()) < 2:
        expect(launch.poll() is None and time.monotonic() - began < 100, "the run does not begin")
        time.sleep(0.1)
    time.sleep(1)
    os.kill(ranks_there()[0], signal.SIGKILL)
    killed = time.monotonic()
    output = "".join(launch.communicate(timeout=60))
    print(f"all ended {time.monotonic() - killed:.1f} s after a rank of the other host was killed")
    expect(time.monotonic() - killed < 30 and launch.returncode != 0, f"the others did not end:\n{output}")
    expect(f"on node {hosts[there]} " in output, f"the message does not name the host:\n{output}")
finally:
    for name in hosts:
        run("ip", "netns", "del", name)
print("passed")
