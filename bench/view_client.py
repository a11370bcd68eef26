"""A client of gart's viewer, as its page is one: starts the program, opens the address that it prints, sends views and
takes frames (docs/rendering.md has the protocol). Python 3 alone."""
import base64
import json
import os
import re
import select
import socket
import struct
import subprocess
import tempfile
import time
import urllib.parse

from common import Failure


class Served:
    """`gart view` or `gart train --view`, from its start until the end of the `with`."""

    def __init__(self, command, seconds=300):
        self.said = tempfile.TemporaryFile(mode="w+", errors="replace")
        self.process = subprocess.Popen([str(c) for c in command], stdout=self.said, stderr=subprocess.STDOUT)
        self.address = None
        end = time.monotonic() + seconds
        while not self.address:
            found = re.search(r"Look and control: (http://\S+/)\s", self.text())
            if found:
                self.address = found.group(1)
            elif self.process.poll() is not None or time.monotonic() > end:
                self.end()
                raise Failure(f"{' '.join(str(c) for c in command)}: printed no address: {self.text()[-500:]}")
            else:
                time.sleep(0.02)

    def text(self):
        self.said.seek(0)
        return self.said.read()

    def end(self):
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()


class Client:
    """A WebSocket (RFC 6455) to an address. `texts` and `frames` are what came: (seconds, message), (seconds, header,
    bytes of the JPEG)."""

    def __init__(self, address):
        at = urllib.parse.urlparse(address)
        self.socket = socket.create_connection((at.hostname, at.port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET {at.path}socket HTTP/1.1\r\nHost: {at.netloc}\r\nOrigin: http://{at.netloc}\r\n"
                             "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                             f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Protocol: gart-view\r\n\r\n").encode())
        self.bytes, self.message = b"", b""
        while b"\r\n\r\n" not in self.bytes:
            self.bytes += self.socket.recv(4096) or self.fail("the connection ended")
        head, self.bytes = self.bytes.split(b"\r\n\r\n", 1)
        if b" 101 " not in head.split(b"\r\n")[0]:
            self.fail(head.decode(errors="replace").splitlines()[0])
        self.texts, self.frames, self.id = [], [], 0
        self.hello = self.wait("hello")

    def fail(self, why):
        raise Failure("the viewer: " + why)

    def say(self, message):
        payload = json.dumps(message).encode()
        size = struct.pack("!B", 0x80 | len(payload)) if len(payload) < 126 else struct.pack("!BH", 0xfe, len(payload))
        self.socket.sendall(b"\x81" + size + bytes(4) + payload)

    def take(self, seconds):
        """What comes within that time; returns at once when something has."""
        self.parse()
        if not select.select([self.socket], [], [], max(0, seconds))[0]:
            return
        more = self.socket.recv(1 << 20)
        if not more:
            self.fail("the connection ended")
        self.bytes += more
        self.parse()

    def parse(self):
        while len(self.bytes) >= 2:
            code, size, at = self.bytes[0], self.bytes[1] & 127, 2
            if size >= 126:
                at, form = (4, "!H") if size == 126 else (10, "!Q")
                if len(self.bytes) < at:
                    return
                size = struct.unpack(form, self.bytes[2:at])[0]
            if len(self.bytes) < at + size:
                return
            payload, self.bytes = self.bytes[at:at + size], self.bytes[at + size:]
            if code & 15 == 9:
                self.socket.sendall(b"\x8a" + struct.pack("!B", 0x80 | len(payload)) + bytes(4) + payload)
                continue
            if code & 15 == 8:
                self.fail("it closed the connection: " + payload[2:].decode(errors="replace"))
            self.kind = code & 15 or self.kind
            self.message += payload
            if code & 128:
                whole, self.message = self.message, b""
                self.heard(self.kind, whole)

    def heard(self, kind, whole):
        now = time.monotonic()
        if kind == 1:
            self.texts.append((now, json.loads(whole)))
        else:
            length = struct.unpack("<I", whole[:4])[0]
            self.frames.append((now, json.loads(whole[4:4 + length]), len(whole) - 4 - length))

    def wait(self, kind, seconds=60):
        end = time.monotonic() + seconds
        while True:
            for _, message in self.texts:
                if message["type"] == kind:
                    return message
            if time.monotonic() > end:
                self.fail(f"said no {kind} within {seconds} s")
            self.take(0.1)

    def view(self, camera, moving):
        """Asks for a view; (its number, when that was)."""
        self.id += 1
        self.say({"type": "view", "id": self.id, "camera": camera, "mode": "colour", "moving": moving, "crop": None,
                  "photo": None})
        return self.id, time.monotonic()

    def close(self):
        self.socket.close()
